"""Load circuits: the files of netlists/ and users' own, read, checked, and never trusted.

A load circuit is a subcircuit of two terminals, the piezo's electrodes, with named parameters
and a resistor called Rload, whose power is what the load gets; node 0 is ground.  Of a file only
that subcircuit and what it uses reach ngspice; the rest is a bench for running it by hand
(``ngspice -b``).  Every line is checked all the same (`harvester.netlists.allowed`).
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from harvester.errors import InputError, invalid, unknown
from harvester.netlists.allowed import (
    MOST_BYTES,
    Line,
    check_names,
    check_size,
    defined,
    header_of,
    parts,
    read_lines,
)
from harvester.scene.load import Load
from harvester.scene.units import PREFIXES

_SUFFIXES = {"meg" if prefix == "M" else prefix.lower(): power for prefix, power in PREFIXES.items()}  # of ngspice
_TAKEN = ("name", "netlist", "subcircuit_name", "self")  # PySpice's own arguments of a subcircuit call


@dataclass(frozen=True)
class LoadCircuit:
    """The text of a subcircuit (and of what it uses), its name, and the values of its parameters.

    ``linear`` says that it is the plain load resistor, which needs no step control of ngspice's own;
    ``storage`` (s) is the product of Rload and the smoothing capacitor Csmooth, None where there is none or it is
    no plain number.
    """

    name: str
    text: str
    parameters: dict[str, float] = field(default_factory=dict)
    linear: bool = False
    storage: float | None = None


def folder() -> Path:
    """Where the package's netlists are: beside the modules when installed, else in the checkout."""
    installed = Path(__file__).parent
    return installed if any(installed.glob("*.cir")) else Path(__file__).parents[2] / "netlists"


def load_circuit(load: Load, capacitance: float | None = None) -> LoadCircuit:
    """The subcircuit of a scene's load.

    ``capacitance`` (F) is the piezo's: a netlist's parameter Cp takes it, unless the scene gives one.

    Raises
    ------
    InputError
        for an unknown netlist, one that could run a command or reach a file outside its folder,
        one without two terminals or without Rload, and parameters that it lacks or that lack a value.
    """
    if load.netlist is None:
        assert load.resistance is not None, "Load checks this"
        return _read(folder() / "resistor.cir", {"R": load.resistance}, None)
    if "/" in load.netlist or load.netlist.endswith(".cir"):
        return _read(Path(load.netlist), load.parameters, capacitance)
    known = sorted(path.stem for path in folder().glob("*.cir"))
    if load.netlist not in known:
        raise unknown("netlist", load.netlist, known)
    return _read(folder() / f"{load.netlist}.cir", load.parameters, capacitance)


def _read(path: Path, parameters: dict[str, float], capacitance: float | None) -> LoadCircuit:
    lines = read_lines(path, path.parent.resolve(), (), [MOST_BYTES])
    subcircuits, outside = parts(path.name, lines)
    loads = [one for one in subcircuits.values() if any(line.word == "rload" for line in one)]
    if len(loads) != 1:
        many = len(loads) or "none"
        raise InputError(
            f"netlist {path.name} must have one subcircuit with a resistor Rload, the load, but has {many}"
        )
    load = loads[0]
    name, terminals, defaults = header_of(load[0])
    if len(terminals) != 2:
        raise invalid(
            f"netlist {load[0].where}", "have two terminals, the piezo's electrodes", f"{len(terminals)} terminals"
        )
    if taken := [one for one in defaults if one in _TAKEN]:
        raise invalid(f"netlist {load[0].where}", f"have no parameter of the name {' or '.join(_TAKEN)}", taken[0])
    connected = {token for line in load[1:] for token in re.split(r"[\s(),]+", line.text.lower())}
    for terminal, other in ((terminals[0], None), (terminals[1], "0")):
        if terminal.lower() not in connected and other not in connected:
            raise InputError(
                f"netlist {path.name} must use its terminal {terminal!r}, but no element is connected to it"
            )
    given = _given(name, defaults, parameters, capacitance)
    check_names(subcircuits, outside)
    check_size(subcircuits, name.lower())
    used = _used(load, subcircuits, outside)
    header = load[0].text
    for wanting in (key for key, value in defaults.items() if value is None):
        header = re.sub(rf"\b{wanting}\b(?!\s*=)(?=[^:]*$)", f"{wanting}={given[wanting]!r}", header)
    text = "\n".join([header, *(line.text for line in [*load[1:], *used])])
    linear = path == folder() / "resistor.cir" and "R" in given
    return LoadCircuit(name, text, given, linear, _storage(load, defaults, given))


def _storage(load: list[Line], defaults: dict[str, str | None], given: dict[str, float]) -> float | None:
    """Rload Csmooth, of values that are numbers or parameters."""
    known = {key.lower(): number(value or "") for key, value in defaults.items()}
    known |= {key.lower(): value for key, value in given.items()}
    found: dict[str, float | None] = {}
    for line in load:
        tokens = line.text.lower().split()
        if tokens[0] in ("rload", "csmooth") and len(tokens) > 3:
            name = tokens[3].strip("{}'")
            found[tokens[0]] = known[name] if name in known else number(tokens[3])
    resistance, capacitance = found.get("rload"), found.get("csmooth")
    return None if resistance is None or capacitance is None else resistance * capacitance


def number(text: str) -> float | None:
    """A number as ngspice writes it (2.2k, 5Meg, 1u); None for anything else."""
    match = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(meg|[tgkmunpf])?[a-z]*", text.strip().lower())
    return None if match is None else float(match[1]) * 10.0 ** _SUFFIXES[match[2] or ""]


def _given(
    name: str, defaults: dict[str, str | None], parameters: dict[str, float], capacitance: float | None
) -> dict[str, float]:
    """The scene's parameters in the netlist's spelling, Cp included; every one without default must be among them."""
    spelling = {default.lower(): default for default in defaults}
    for one in parameters:
        if one.lower() not in spelling:
            raise unknown(f"parameter of netlist {name}", one, defaults)
    given = {spelling[one.lower()]: value for one, value in parameters.items()}
    if capacitance is not None and "cp" in spelling:
        given.setdefault(spelling["cp"], capacitance)
    for one, default in defaults.items():
        if default is None and one not in given:
            raise InputError(f"load.parameters must give {one} of netlist {name}, which has no default, but does not")
    return given


def _used(load: list[Line], subcircuits: dict[str, list[Line]], outside: list[Line]) -> list[Line]:
    """The other subcircuits, models and parameters that the load names, and those that these name."""
    others: list[tuple[set[str], list[Line]]] = [
        ({name}, body) for name, body in subcircuits.items() if body is not load
    ]
    others += [({line.text.lower().split()[1]}, [line]) for line in outside if line.word == ".model"]
    others += [(set(defined([line])), [line]) for line in outside if line.word == ".param"]
    used: list[Line] = []
    new = [load]
    while new:
        named = set().union(*(_named(body) for body in new))
        new = [body for names, body in others if names & named]
        others = [one for one in others if not one[0] & named]
        used += [line for body in new for line in body]
    return used


def _named(body: list[Line]) -> set[str]:
    """Names that a subcircuit, or a line outside, takes from without: all but its own parameters."""
    own = set(defined(body))
    if body[0].word == ".subckt":
        own |= {name.lower() for name in header_of(body[0])[2]}
    return {name.lower() for line in body for name in re.findall(r"[\w.]+", line.text)} - own
