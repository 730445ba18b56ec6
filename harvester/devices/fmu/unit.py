"""A scene's device as a functional mock-up unit: a part for simulators that import FMI 2.0 or 3.0.

The library inside is made of this package's own kernels, which numba compiles and LLVM emits for
each system; it contains no Python.  It advances by inner steps, whatever the communication step:
without noise and with a resistor from impact to impact at sixth order
(`harvester.mechanics.part.located`), else on the grid of the package's ensembles
(`harvester.mechanics.part.gridded`).
"""

import hashlib
import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.devices.fmu import parts
from harvester.devices.fmu.objects import ENTRY, PLATFORMS, host
from harvester.devices.fmu.variables import Variable, variables
from harvester.engines.protocol import AnyScene
from harvester.equations.problem import Problem
from harvester.errors import invalid, unknown
from harvester.machine import files

VERSIONS = (2, 3)
FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # of the files inside: the same scene gives the same bytes


@dataclass(frozen=True)
class Exported:
    """An FMU as written: name, variables, platforms, inner step (s) and size (bytes)."""

    name: str
    variables: list[Variable]
    platforms: list[str]
    step: float
    size: int


def export_fmu(
    scene: AnyScene,
    out: str | Path,
    *,
    circuit: str = parts.INSIDE,
    fmi: int = 2,
    platforms: str | Sequence[str] | None = None,
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
        "inside": the load is in the FMU, a resistor, an ideal circuit of the package, or another
        netlist, compiled; "netlist": as "inside", but the netlist itself in place of its ideal
        circuit; "outside": the FMU has an electrical port, with current (A) and load resistance
        (ohm) as inputs and the voltage (V) as an output.
    fmi
        2: FMI 2.0 for co-simulation; 3: FMI 3.0 with event mode, in which an impact ends a
        communication step early.
    platforms
        some of "linux-x86_64", "linux-aarch64", "windows-x86_64" and "macos-aarch64", or "all";
        None: this machine's.
    seed
        draws the noise record for a tabulated PSD.
    argument
        how errors name ``out``.

    Raises
    ------
    InputError
        for a nondimensional scene, an unknown option, and a file that cannot be written.
    CannotServeError
        for further modes, and a netlist with elements that engine "compiled" lacks.
    MissingProgramError
        without the package ziglang.
    """
    from harvester.devices.fmu.contents import build

    problem = Problem.of(scene).plain
    if circuit not in parts.CIRCUITS:
        raise invalid(
            "`circuit`", f"be {', '.join(parts.CIRCUITS[:-1])} or {parts.CIRCUITS[-1]}", circuit
        )
    target = unit_file(out, fmi, platforms, argument)
    parts.check(problem)
    build.check_compiler()
    part = parts.part_of(problem, problem.scales, circuit, seed)
    return written(
        Unit(
            part=part,
            variables=variables(problem, part),
            code=compiled(part),
            frequency=problem.scales.frequency,
            title=problem.scene.title or problem.scene.name,
        ),
        target,
    )


class Unit(NamedTuple):
    """A part, its variables, LLVM code by C function, 1 over its unit of time, and a title."""

    part: parts.AnyPart
    variables: list[Variable]
    code: dict[str, str]
    frequency: float
    title: str


class UnitFile(NamedTuple):
    """A file to write: its name as a model, version of FMI, platforms, and how errors name it."""

    path: Path
    name: str
    fmi: int
    platforms: list[str]
    argument: str


def unit_file(
    out: str | Path, fmi: int, platforms: str | Sequence[str] | None, argument: str = "out"
) -> UnitFile:
    """The checked `UnitFile`; InputError for another kind of file, or an unknown option."""
    path, name = _checked(out, argument)
    return UnitFile(path, name, fmi, _options(fmi, platforms), argument)


def written(unit: Unit, target: UnitFile) -> Exported:
    """Link the libraries, and write the FMU."""
    from harvester.devices.fmu.contents import build
    from harvester.devices.fmu.contents.description import ModelFacts, description, terminals
    from harvester.devices.fmu.contents.documents import documents, icons
    from harvester.devices.fmu.contents.header import header

    part, some, code, frequency, title = unit
    fmi, name = target.fmi, target.name
    step = part.step / frequency
    content = header(some, part, "", frequency)
    made_of = f"{fmi}{content}{''.join(code.values())}"
    token = "{" + hashlib.sha256(made_of.encode()).hexdigest()[:32] + "}"
    content = header(some, part, token, frequency)
    stops = not part.model["MODEL"]
    model = ModelFacts(name=name, token=token, title=title, step=step, stops=stops)
    inside: dict[str, bytes] = {"modelDescription.xml": description(some, model, fmi).encode()}
    for key in target.platforms:
        platform = PLATFORMS[key]
        file = f"binaries/{platform.folders[fmi - 2]}/{name}.{platform.ending}"
        inside[file] = build.library(code, content, platform, fmi)
    if fmi == 3:
        inside["terminalsAndIcons/terminalsAndIcons.xml"] = terminals(some).encode()
    inside |= documents(title, some, step) | icons(fmi)
    data = _zipped(inside)
    files.write(target.path, data, target.argument)
    return Exported(name, some, target.platforms, step, len(data))


def _checked(out: str | Path, argument: str) -> tuple[Path, str]:
    """The file to write, and the name of the model; InputError for another kind of file."""
    path = Path(out)
    if path.suffix != ".fmu" or path.is_dir():
        raise invalid(f"`{argument}`", "be a file that ends in .fmu, such as device.fmu", str(out))
    name = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    return path, name if re.match(r"[A-Za-z]", name) else f"device_{name}"


def _options(fmi: int, platforms: str | Sequence[str] | None) -> list[str]:
    """The platforms; InputError for an option that is unknown."""
    if fmi not in VERSIONS:
        raise invalid("`fmi`", "be 2 or 3", fmi)
    if platforms is None:
        platforms = [host() or "this machine's"]
    elif isinstance(platforms, str):
        platforms = platforms.split(",")
    chosen = dict.fromkeys(platform.strip() for platform in platforms)
    if "all" in chosen:
        chosen = dict.fromkeys(PLATFORMS)
    for platform in chosen:
        if platform not in PLATFORMS:
            raise unknown("platform", platform, [*PLATFORMS, "all"])
    if not chosen:
        raise invalid("`platforms`", f"be one at least of {', '.join(PLATFORMS)}", "none")
    return list(chosen)


def compiled(part: parts.CompiledPart) -> dict[str, str]:
    """The LLVM code of a part's C functions, by their names."""
    from harvester.mechanics.part.entry import entry

    return all_code(str(entry(part.plan).inspect_llvm()), part.board)


def all_code(entry: str, board: CompiledCircuit | None) -> dict[str, str]:
    """The LLVM code of an entry and of a netlist's functions."""
    from harvester.circuits.circuit_part import circuit_functions
    from harvester.devices.fmu.contents.build import kept
    from harvester.mechanics.kernels.compiled import compiled_sources

    code = {ENTRY: entry}
    if board is not None:
        sources = [path.read_text() for path in compiled_sources()]
        for name, function in circuit_functions(board).items():
            code[name] = kept([function.text, *sources], "ll", function.code).decode()
    return {name: _renamed(llvm) for name, llvm in code.items()}


def _renamed(llvm: str) -> str:
    """The same with names of functions of our own: numba counts in its names."""
    names: dict[str, str] = {}

    def renamed(symbol: re.Match[str]) -> str:
        """A text as it is, since its type has its length; a symbol by its number."""
        return symbol[1] or names.setdefault(symbol[0], f"part{len(names)}")

    return re.sub(r'(\] c"[^"]*")|_ZN\w+', renamed, llvm)


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
