"""Load circuits: the files of netlists/ and users' own, read, checked, and never trusted.

A load circuit is a subcircuit of two terminals, the piezo's electrodes, with named parameters
and a resistor called Rload, whose power is what the load gets.  Of a file only the subcircuit
is used; the rest is a bench for running it by hand (``ngspice -b``).
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from harvester.errors import InputError, invalid, unknown
from harvester.scene import Load

# First letters of the elements that a load may be made of; no A (XSPICE models read files).
_ELEMENTS = "rcldqjmkswvibefghxt"
_CARDS = (".subckt", ".ends", ".model", ".param")


@dataclass(frozen=True)
class LoadCircuit:
    """The text of a subcircuit, its name, and the values of its parameters."""

    name: str
    text: str
    parameters: dict[str, float] = field(default_factory=dict)

    @property
    def linear(self) -> bool:
        """Whether it is the plain load resistor, which needs no step control of ngspice's own."""
        return self.name == "resistor"


def folder() -> Path:
    """Where the package's netlists are: beside the modules when installed, else in the checkout."""
    installed = Path(__file__).parent.parent / "netlists"
    return installed if installed.is_dir() else Path(__file__).parents[2] / "netlists"


def load_circuit(load: Load) -> LoadCircuit:
    """The subcircuit of a scene's load.

    Raises
    ------
    InputError
        for an unknown netlist, one that could run a command or read a file, one without two
        terminals or without Rload, and parameters that it does not have.
    """
    if load.netlist is None:
        assert load.resistance is not None, "Load checks this"
        return _read(folder() / "resistor.cir", {"R": load.resistance})
    if "/" in load.netlist or load.netlist.endswith(".cir"):
        return _read(Path(load.netlist), load.parameters)
    known = sorted(path.stem for path in folder().glob("*.cir"))
    if load.netlist not in known:
        raise unknown("netlist", load.netlist, known)
    return _read(folder() / f"{load.netlist}.cir", load.parameters)


def _read(path: Path, parameters: dict[str, float]) -> LoadCircuit:
    try:
        text = path.read_text(encoding="ascii", errors="replace")
    except OSError as error:
        raise invalid("load.netlist", f"be a readable file ({error.strerror})", str(path)) from None
    # Continuation lines joined, comments dropped, everything in lower case as ngspice reads it.
    joined = re.sub(r"\n\s*\+\s*", " ", text)
    lines = [re.split(r"\s;|\s\$", line)[0].strip() for line in joined.splitlines()]
    lines = [line for line in lines if line and not line.startswith("*")]
    starts = [i for i, line in enumerate(lines) if line.lower().startswith(".subckt")]
    ends = [i for i, line in enumerate(lines) if line.lower().startswith(".ends")]
    if len(starts) != 1 or len(ends) != 1 or ends[0] < starts[0]:
        raise invalid(f"netlist {path.name}", "hold one subcircuit, .subckt to .ends", f"{len(starts)} of them")
    body = lines[starts[0] : ends[0] + 1]
    for line in body:
        _check_line(path.name, line)
    name, defaults = _header(path.name, body[0])
    if not any(re.match(r"rload\s", line, re.IGNORECASE) for line in body):
        raise InputError(f"netlist {path.name} must have a resistor Rload, the load, but has none")
    for given in parameters:
        if given.lower() not in (name.lower() for name in defaults):
            raise unknown(f"parameter of netlist {name}", given, defaults)
    return LoadCircuit(name, "\n".join(body), dict(parameters))


def _check_line(where: str, line: str) -> None:
    """Refuse what could run a command or read a file."""
    word = line.split(maxsplit=1)[0].lower()
    if word.startswith("."):
        if word not in _CARDS:
            raise invalid(f"netlist {where}", f"have only the cards {', '.join(_CARDS)}", word)
    elif word[0] not in _ELEMENTS:
        raise invalid(f"netlist {where}", "have only elements of ngspice without files or commands", word)
    if re.search(r"file|`|\bshell\b|\bsystem\b", line, re.IGNORECASE):
        raise invalid(f"netlist {where}", "name no file and no command", line[:60])


def _header(where: str, line: str) -> tuple[str, list[str]]:
    """Name and parameter names of a .subckt line."""
    tokens = re.sub(r"\s*=\s*", "=", line).split()[1:]
    tokens = [t for t in tokens if t.lower() != "params:"]
    plain = [t for t in tokens if "=" not in t]
    if len(plain) != 3:
        raise invalid(f"netlist {where}", "have two terminals, the piezo's electrodes", f"{len(plain) - 1} terminals")
    return plain[0], [t.split("=")[0] for t in tokens if "=" in t]
