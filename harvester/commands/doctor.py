"""The command `harvester doctor`."""

import shutil
from collections.abc import Iterator

from harvester.commands.help import command
from harvester.commands.messages import echo


@command("harvester doctor")
def doctor() -> None:
    """What is installed, what is missing, and how to get it."""
    for line in examine():
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
