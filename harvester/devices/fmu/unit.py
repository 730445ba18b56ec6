"""A scene's device as a functional mock-up unit: a part for simulators that import FMI 2.0 or 3.0.

The library inside is made of this package's own kernels, which numba compiles and LLVM emits for each system; no Python
is in it.  It advances by inner steps, whatever the communication step: without noise and with a resistor from impact to
impact at sixth order (`harvester.mechanics.part.located`), else on the grid of the package's ensembles
(`harvester.mechanics.part.gridded`).
"""

import datetime
import hashlib
import html
import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from harvester.devices.fmu import parts
from harvester.devices.fmu.objects import PLATFORMS
from harvester.devices.fmu.variables import Variable, variables
from harvester.engines.protocol import AnyScene
from harvester.equations.problem import Problem
from harvester.errors import invalid, unknown
from harvester.machine import files

VERSIONS, CIRCUITS = (2, 3), ("inside", "outside")
FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # of the files inside: the same scene gives the same bytes


@dataclass(frozen=True)
class Exported:
    """What was written: the model's name, its variables, the platforms, the inner step (s) and the size (bytes)."""

    name: str
    variables: list[Variable]
    platforms: list[str]
    step: float
    size: int


def export_fmu(
    scene: AnyScene,
    out: str | Path,
    *,
    circuit: str = "inside",
    fmi: int = 2,
    platforms: Sequence[str] | None = None,
    seed: int = 0,
    argument: str = "out",
) -> Exported:
    """Write a scene's device as the FMU ``out``, a part for simulators of machines.

    Parameters
    ----------
    scene
        a Scene of a device, or the path of its file.
    out
        the file to write, such as device.fmu.
    circuit
        "inside": the load is in the FMU, a resistor or an ideal circuit of the package; "outside": the FMU has an
        electrical port, whose current (A) and load resistance (ohm) are inputs and whose voltage (V) is an output.
    fmi
        2: FMI 2.0 for co-simulation; 3: FMI 3.0 with event mode, where an impact ends a communication step early.
    platforms
        of "linux-x86_64", "linux-aarch64", "windows-x86_64", "macos-aarch64"; None: all.
    seed
        draws the record of noise of a tabulated density.
    argument
        how errors name ``out``.

    Raises
    ------
    InputError
        for a nondimensional scene, an unknown option, and a file that cannot be written.
    CannotServeError
        for further modes, and a circuit inside that is a netlist of another kind.
    MissingProgramError
        without the package ziglang.
    """
    from harvester.devices.fmu import build
    from harvester.devices.fmu.description import description, terminals
    from harvester.devices.fmu.header import header

    problem = Problem.of(scene).plain
    path, name = _checked(out, argument)
    chosen = _options(circuit, fmi, platforms)
    parts.check(problem)
    build.check_compiler()
    part = parts.part_of(problem, problem.scales, circuit == "outside", seed)
    some = variables(problem, part, circuit == "outside")
    code = _compiled(part)
    frequency = problem.scales.frequency
    step = part.plan.h / frequency
    content = header(some, part, "", frequency)
    token = "{" + hashlib.sha256(f"{fmi}{content}{code}".encode()).hexdigest()[:32] + "}"
    content = header(some, part, token, frequency)
    title = problem.scene.title or problem.scene.name
    when = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    inside: dict[str, bytes] = {
        "modelDescription.xml": description(some, name, token, fmi, title, step, when).encode()
    }
    for platform in chosen:
        made = build.library(code, content, PLATFORMS[platform], fmi)
        folder, ending = PLATFORMS[platform].folders[fmi - 2], PLATFORMS[platform].ending
        inside[f"binaries/{folder}/{name}.{ending}"] = made
    if fmi == 3:
        inside["terminalsAndIcons/terminalsAndIcons.xml"] = terminals(some).encode()
    inside |= _documents(title, some, step)
    data = _zipped(inside)
    files.write(path, data, argument)
    return Exported(name, some, chosen, step, len(data))


def _checked(out: str | Path, argument: str) -> tuple[Path, str]:
    """The file to write, and the name of the model; InputError for a file that is none."""
    path = Path(out)
    if path.suffix != ".fmu" or path.is_dir():
        raise invalid(f"`{argument}`", "be a file that ends in .fmu, such as device.fmu", str(out))
    name = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    return path, name if re.match(r"[A-Za-z]", name) else f"device_{name}"


def _options(circuit: str, fmi: int, platforms: Sequence[str] | None) -> list[str]:
    """The platforms; InputError for an option that is unknown."""
    if circuit not in CIRCUITS:
        raise invalid("`circuit`", f"be {' or '.join(CIRCUITS)}", circuit)
    if fmi not in VERSIONS:
        raise invalid("`fmi`", "be 2 or 3", fmi)
    chosen = list(dict.fromkeys(PLATFORMS if platforms is None else platforms))
    for platform in chosen:
        if platform not in PLATFORMS:
            raise unknown("platform", platform, list(PLATFORMS))
    if not chosen:
        raise invalid("`platforms`", f"be one at least of {', '.join(PLATFORMS)}", "none")
    return chosen


def _compiled(part: parts.Part) -> str:
    """The LLVM code of a part."""
    from harvester.mechanics.part.entry import entry

    return str(entry(part.plan).inspect_llvm())


def _documents(title: str, some: list[Variable], step: float) -> dict[str, bytes]:
    """The page and the note of the licence that are inside."""
    rows = "\n".join(
        f"<tr><td>{html.escape(v.name)}</td><td>{html.escape(v.unit)}</td><td>{html.escape(v.meaning)}</td></tr>"
        for v in some
    )
    page = (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title></head><body>'
        f"<h1>{html.escape(title)}</h1><p>A vibro-impact piezoelectric energy harvester, made by harvester. "
        f"The inner step is {step:.6g} s; the communication step may be any. The inputs are held over a step.</p>"
        f"<table><tr><th>variable</th><th>unit</th><th>meaning</th></tr>{rows}</table></body></html>\n"
    )
    licence = (
        "This FMU contains machine code of the package harvester, which is under the GNU General Public License, "
        "version 3 or later (SPDX: GPL-3.0-or-later): whoever passes it on must offer the source of that package and "
        "of this device under the same licence. The C library and the compiler's runtime, of which parts may be "
        "linked, have licences of their own that permit it.\n"
    )
    return {
        "documentation/index.html": page.encode(),
        "documentation/licenses/license.txt": licence.encode(),
    }


def _zipped(inside: dict[str, bytes]) -> bytes:
    """The files as an archive."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in inside.items():
            info = zipfile.ZipInfo(name, FIRST_DATE)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            archive.writestr(info, data)
    return memory.getvalue()
