"""The command `harvester doctor`."""

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_json
from harvester.commands.options import json_option
from harvester.errors import CircuitError, InputError, MissingProgramError, shown

if TYPE_CHECKING:
    from harvester.netlists.part import CircuitPart

OPTIONAL = {  # package: the extra that brings it, and what uses it
    "panel": ("explore", "'harvester explore'"),
    "ziglang": ("fmu", "'harvester export --fmu'"),
    "fmpy": ("fmu", "running an FMU in Python"),
    "distributed": ("dask", "sweeps on several machines"),
    "playwright": ("test", "tests in a browser"),
    "sphinx": ("docs", "building the pages"),
}
CAPACITANCE = 50e-9  # F, of a netlist that asks for that of a piezo


@command("harvester doctor", "harvester doctor --json")
@cloup.argument("file", required=False, type=cloup.Path(), help="A netlist, or a scene with one.")
@cloup.option_group("Output", json_option)
def doctor(file: str | None, as_json: bool) -> None:
    """Report installed and missing programs and libraries, and how to get them.

    Given a netlist or scene FILE, list the elements that engine 'compiled' supports.
    """
    if file is not None:
        lines = list(examine_netlist(file))
        if as_json:
            echo_json({"netlist": lines})
        else:
            echo("\n".join(lines))
        return
    parts = list(examine())
    if as_json:
        echo_json(
            {
                p.name: {"name": p.name, "found": p.version, "how": p.how, "optional": p.optional}
                for p in parts
            }
        )
    else:
        echo("\n".join(map(str, parts)))


@dataclass(frozen=True)
class Requirement:
    """A requirement: its ``version`` ('' for nothing), ``how`` to get it, and whether it must be."""

    name: str
    version: str
    how: str = ""
    optional: bool = False

    def __str__(self) -> str:
        word = "ok     " if self.version else "absent " if self.optional else "MISSING"
        return f"{word}  {self.name:<16} {self.version or self.how}"


def examine() -> Iterator[Requirement]:
    """Everything that the package uses, then the parts that only some commands use."""
    from harvester.machine import provenance
    from harvester.netlists.load_circuit import netlist_folder

    for name, version in provenance.versions().items():
        yield Requirement(name, version, "run 'make setup'")
    yield from _ngspice()
    names = sorted(path.stem for path in netlist_folder().glob("*.cir"))
    yield Requirement("netlists", ", ".join(names), "run 'make setup'")
    this = provenance.machine()
    yield Requirement("machine", f"{this['processor']}, {this['cores']} cores, {this['system']}")
    for package, (extra, what) in OPTIONAL.items():
        how = f"only for {what}: python -m pip install 'piezo-harvester[{extra}]'"
        yield Requirement(package, provenance.version(package), how, optional=True)


def examine_netlist(file: str) -> Iterator[str]:
    """One line for each element of a netlist: whether compiled circuits have it, and why not."""
    from harvester.circuits.solvability import check_parts, check_size, unserved_parts
    from harvester.netlists.load_circuit import load_circuit
    from harvester.netlists.part import by_name
    from harvester.scene.load import is_path
    from harvester.scene.toml import load as load_scene

    if is_path(file) and not file.endswith(".toml"):
        parts = by_name(_elements_of(file))
    else:
        load = load_scene(file).load
        if load is None or load.netlist is None:
            raise InputError(
                f"`file` must be a netlist, FILE.cir, or a scene with one, but {shown(file)} has none"
            )
        parts = by_name(load_circuit(load, CAPACITANCE).parts)
    served = 0
    for name, why in unserved_parts(parts):
        served += not why
        yield f"{'works  ' if not why else 'NOT    '}  {name}{f'  {why}' if why else ''}"
    check_parts(parts.values())
    check_size(parts.values())
    elements = f"{len(parts)} element{'s' * (len(parts) > 1)}"
    yield f"engine 'compiled' supports {served} of {elements}; engine 'spice' supports all"


def _elements_of(file: str) -> "Sequence[CircuitPart]":
    """Elements of the load subcircuit, or of a flat netlist, whose terminals need not be known."""
    from harvester.netlists.circuit_keys import CircuitKeys
    from harvester.netlists.flat import LOAD, Board, net_of
    from harvester.netlists.load_circuit import load_circuit, netlist_folder
    from harvester.netlists.netlist import read_netlist
    from harvester.netlists.read_lines import split_path
    from harvester.netlists.written_out import written_out
    from harvester.scene.load import Load

    here = file if "/" in file else f"./{file}"
    path, root = split_path(here)
    netlist = read_netlist(path, netlist_folder() / "parts", board=True, root=root)
    outside = netlist.outside
    is_load = (
        element.name.lower() == LOAD
        for body in netlist.subcircuits.values()
        for element in body.elements
    )
    if any(is_load) or not outside.elements:
        return load_circuit(Load(netlist=here), CAPACITANCE).parts
    nets = {net_of(node) for element in outside.elements for node in element.nodes}
    board = Board({net: net for net in (*nets, *netlist.settings.everywhere)})
    keys = CircuitKeys(outside, board)
    return written_out(netlist, outside, board.nodes, board.ground, *keys.split({}))


def _ngspice() -> Iterator[Requirement]:
    """The parts of ngspice: the shared library, which is loaded, and the program."""
    from harvester.cosimulation.ngspice.locate_libngspice import REMEDY, find_library

    try:
        library = find_library()
    except MissingProgramError as error:
        yield Requirement("libngspice", "", str(error).rpartition(": ")[2])
    else:
        from harvester.cosimulation.runs import ngspice_version

        try:
            version, why = ngspice_version()
            yield Requirement("libngspice", f"{version} ({library})", REMEDY)
            yield _trial(version, why)
        except (CircuitError, OSError) as error:
            yield Requirement("libngspice", "", f"{library} does not load: {error}")
    program = shutil.which("ngspice") or ""
    yield Requirement(
        "ngspice program", program, "run 'apt-get install ngspice' (only for netlists by hand)"
    )


def _trial(version: str, why: str) -> Requirement:
    """Whether an ngspice has the functions that the lock-step needs, and whether its version is a known one."""
    from harvester.cosimulation.ngspice.trial import COMPARED, TESTED

    good, others = (", ".join(map(str, some)) for some in (TESTED, COMPARED))
    known = f"version {version} is known good: all tests have run with it"
    if int(version) in COMPARED:
        known = f"version {version} passes its trial, and gave the answers of {good} in most scenes that were compared"
    elif int(version) not in TESTED:
        known = f"version {version} passes its trial, but is not among those that were compared with {good}: {others}"
    return Requirement("ngspice trial", "" if why else known, f"{why}: install version {good}")
