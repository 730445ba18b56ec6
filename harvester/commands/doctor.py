"""The command `harvester doctor`."""

import shutil
from collections.abc import Iterator

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo
from harvester.errors import InputError, shown

CAPACITANCE = 50e-9  # F, of a netlist that asks for that of a piezo


@command("harvester doctor")
@cloup.argument("file", required=False, type=cloup.Path(), help="A netlist, or a scene with one.")
def doctor(file: str | None) -> None:
    """What is installed, what is missing, and how to get it.

    Of a netlist FILE, or a scene file, which of its elements a compiled circuit has (engine 'compiled').
    """
    for line in examine() if file is None else examine_netlist(file):
        echo(line)


def examine() -> Iterator[str]:
    """One line for each thing that the package uses: what was found, or how to get it."""
    from harvester.machine.provenance import machine, versions
    from harvester.netlists.load_circuit import netlist_folder

    for name, version in versions().items():
        yield _line(name, version, "run 'make setup'")
    yield from _ngspice()
    names = sorted(path.stem for path in netlist_folder().glob("*.cir"))
    yield _line("netlists", ", ".join(names), "run 'make setup'")
    this = machine()
    yield _line("machine", f"{this['processor']}, {this['cores']} cores, {this['system']}", "")


def examine_netlist(file: str) -> Iterator[str]:
    """One line for each element of a netlist: whether compiled circuits have it, and why not."""
    from harvester.circuits.parts import parts_of
    from harvester.circuits.solvability import check_parts, unserved_parts
    from harvester.netlists.load_circuit import load_circuit
    from harvester.scene.load import Load
    from harvester.scene.toml import load as load_scene

    asked = Load(netlist=file if "/" in file else f"./{file}") if file.endswith(".cir") else load_scene(file).load
    if asked is None or asked.netlist is None:
        raise InputError(f"`file` must be a netlist, FILE.cir, or a scene with one, but {shown(file)} has none")
    parts = {part.name: part for part in parts_of(load_circuit(asked, CAPACITANCE))}
    served = 0
    for name, why in unserved_parts(parts):
        served += not why
        yield f"{'served ' if not why else 'NOT    '}  {name}{f'  {why}' if why else ''}"
    check_parts(parts)
    yield f"{served} of {len(parts)} elements are served by engine 'compiled'; engine 'spice' takes all"


def _ngspice() -> Iterator[str]:
    """The lines on ngspice: the shared library, which is loaded, and the program."""
    from harvester.cosimulation.ngspice.locate_libngspice import find_library
    from harvester.errors import CircuitError, MissingProgramError

    how = "run 'make setup' or 'apt-get install libngspice0 ngspice'"
    try:
        library = find_library()
    except MissingProgramError:
        yield _line("libngspice", "", how)
    else:
        from harvester.cosimulation.runs import ngspice_version

        try:
            yield _line("libngspice", f"{ngspice_version()} ({library})", how)
        except (CircuitError, OSError) as error:
            yield _line("libngspice", "", f"{library} does not load: {error}")
    yield _line("ngspice program", shutil.which("ngspice") or "", how + " (only for netlists by hand)")


def _line(what: str, found: str, how: str) -> str:
    """A line on one thing: ok and what was ``found``, or MISSING and ``how`` to get it."""
    return f"{'ok     ' if found else 'MISSING'}  {what:<16} {found or how}"
