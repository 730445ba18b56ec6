"""Load circuits: the files of netlists/ and users' own, read and checked, and never trusted.

A load circuit is a subcircuit of two terminals, the piezo's electrodes, with named parameters
and a resistor called Rload, whose power is what the load gets; node 0 is ground.  Of a file only
that subcircuit and what it uses reach ngspice; the rest is a bench for running it by hand
(``ngspice -b``).  Every line is checked all the same (`harvester.netlists.allowed`).

Long because a load circuit and the checks that make it safe are read in one go.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from harvester.errors import InputError, invalid, shown, unknown
from harvester.netlists.allowed import allowed_lines, check_names, check_size, part_names, with_parts
from harvester.netlists.flat import Board, as_subcircuit
from harvester.netlists.read_lines import Line, ngspice_number, read_lines
from harvester.netlists.subcircuits import (
    Header,
    element_keys,
    header_of,
    split_subcircuits,
    used_lines,
    with_elements_as_parameters,
)
from harvester.scene.load import Load, is_path

_SOME_CAPACITANCE = 1e-8  # F, of a piezo that is not known yet
_ROLES = {"rload": "R", "csmooth": "C"}  # of a flat netlist: the parameters of what has another name there
_RESERVED = ("name", "netlist", "subcircuit_name", "self")  # PySpice's arguments of a subcircuit call by name


@dataclass(frozen=True)
class LoadCircuit:
    """A load circuit, read and checked: all that anybody needs of a netlist.

    name, text
        of the subcircuit; the text includes what it uses.

    Parameters
    ----------
        values that the scene gives, in the netlist's spelling, and the piezo's capacitance where it has a Cp.
    resistance
        of a circuit that is no more than the load resistor (ohm), which needs no step control of ngspice's own; else
        None.
    smoothing, storage
        the smoothing capacitor Csmooth (F), and its product with Rload (s); None where there is none or it is no plain
        number.
    topology
        name of the package's netlist; None for a user's own.
    values
        ``parameters``, and the defaults of the others where these are plain numbers.
    terminals, smoothing_nodes
        nodes of the piezo's electrodes and of Csmooth (empty without one), in lower case.
    nets, renamed, ground
        of a flat netlist (`harvester.netlists.flat`): the nodes by the names of its nets, the elements that have
        another name here, and the node of its own ground ("": ground is an electrode).
    elements
        the values of its elements that are plain numbers, by the names that a scene calls them.
    """

    name: str
    text: str
    parameters: dict[str, float] = field(default_factory=dict)
    resistance: float | None = None
    smoothing: float | None = None
    storage: float | None = None
    topology: str | None = None
    values: dict[str, float] = field(default_factory=dict)
    terminals: tuple[str, ...] = ("p", "n")
    smoothing_nodes: tuple[str, ...] = ()
    nets: dict[str, str] = field(default_factory=dict)
    renamed: dict[str, str] = field(default_factory=dict)
    ground: str = ""
    elements: dict[str, float] = field(default_factory=dict)

    @property
    def linear(self) -> bool:
        """Whether it is no more than the load resistor."""
        return self.resistance is not None

    def value_of(self, name: str) -> float | None:
        """The value of a parameter or an element by its name in the scene's load.parameters; None where it has none."""
        return {key.lower(): value for key, value in (self.elements | self.values).items()}.get(self.own_name(name))

    def own_name(self, name: str) -> str:
        """What stands for a name in the scene's load.parameters, in small letters: R for the load of a flat netlist."""
        return _ROLES.get(self.renamed.get(name.lower(), ""), name).lower()


def netlist_folder() -> Path:
    """Where the package's netlists are: beside the modules when installed, else in the checkout."""
    installed = Path(__file__).parent
    return installed if any(installed.glob("*.cir")) else Path(__file__).parents[2] / "netlists"


def load_circuit(load: Load, capacitance: float | None = None) -> LoadCircuit:
    """Read and check the circuit of a scene's load; a load resistance is the netlist `resistor`.

    ``capacitance`` (F) is the piezo's: a netlist's parameter Cp takes it, unless the scene gives one.

    Raises InputError for an unknown netlist, one that could run a command or reach a file outside its folder, one
    without two terminals or without Rload, and parameters that it lacks or that lack a value.
    """
    name, parameters = load.netlist, dict(load.parameters)
    if name is None:
        assert load.resistance is not None, "Load checks this"
        name, parameters = "resistor", {"R": load.resistance}
    path = Path(name) if is_path(name) else _of_package(name)
    folder = netlist_folder() / "parts"
    board = _board(load, path, folder)
    subcircuits, outside = split_subcircuits(path.name, with_parts(list(allowed_lines(board.lines)), folder))
    body = _with_rload(path, subcircuits)
    parameters = {_ROLES.get(board.elements.get(key.lower(), ""), key): value for key, value in parameters.items()}
    keys, name_of_load = element_keys(body), header_of(body[0]).name.lower()
    subcircuits[name_of_load] = body = with_elements_as_parameters(body, parameters)
    header = header_of(body[0])
    _check_header(path, header, body)
    scene_values = _scene_values(header, parameters, capacitance, keys)
    check_names(subcircuits, outside)
    check_size(subcircuits, header.name.lower())
    text = "\n".join(
        [
            _first_line(body[0].text, header, scene_values),
            *(line.text for line in [*body[1:], *used_lines(body, subcircuits, outside)]),
        ]
    )
    defaults = {key: ngspice_number(value or "") for key, value in header.defaults.items()}
    values = {key: value for key, value in (defaults | scene_values).items() if value is not None}
    smoothing, storage = _storage(body, values)
    called = {new: old for old, new in board.elements.items()}
    return LoadCircuit(
        header.name,
        text,
        scene_values,
        resistance=_lone_resistance(body, header, values),
        smoothing=smoothing,
        storage=storage,
        topology=None if is_path(name) else name,
        values=values,
        terminals=tuple(terminal.lower() for terminal in header.terminals),
        smoothing_nodes=_smoothing_nodes(body),
        nets=board.nets,
        renamed=board.elements,
        ground=board.ground,
        elements={called.get(name.lower(), name): ngspice_number(value) or 0.0 for name, value in keys.items()},
    )


def Netlist(name: str, /, **parameters: float | str) -> Load:  # noqa: N802, as it reads as one of the tables
    """The load of a netlist with its parameters, checked at once: that it can be used, and has such parameters.

    Parameters
    ----------
    name
        one of the package's netlists, such as "bridge", or the path of a file that has a subcircuit.  Of a flat netlist
        `Load` names the terminals.
    parameters
        of the subcircuit, and its elements by their names: numbers in SI units, or texts with their unit.

    Returns
    -------
    Load
        for `Scene` and `Scene.with_load`.

    Raises
    ------
    InputError
        for a netlist that is not there, with the nearest match, or cannot be used; a parameter that it does not have;
        and one that is no number and no quantity.

    >>> import harvester as hv
    >>> hv.Netlist("bridge", R="1 Mohm", C=1e-5).parameters
    {'R': 1000000.0, 'C': 1e-05}
    >>> hv.Netlist("bridg")
    Traceback (most recent call last):
    harvester.errors.InputError: unknown netlist 'bridg': did you mean 'bridge'?
    """
    load = Load(netlist=name, parameters=parameters)
    load_circuit(load, _SOME_CAPACITANCE)
    return load


def _board(load: Load, path: Path, parts: Path) -> Board:
    """The lines of the load's netlist; of a flat one those of a subcircuit made of it."""
    lines = list(read_lines(path))
    if load.terminals is not None:
        return as_subcircuit(path.name, lines, load, part_names(parts))
    if not any(line.word in (".subckt", ".ends") for line in lines):
        must = "hold a subcircuit, .subckt to .ends, or be a flat one whose two piezo nets load.terminals names"
        raise invalid(f"netlist {path.name}", must, "neither")
    return Board(lines)


def _first_line(text: str, header: Header, values: Mapping[str, float]) -> str:
    """The subcircuit's first line, with the scene's values of the parameters that have no default."""
    for wanting in (key for key, value in header.defaults.items() if value is None):
        text = re.sub(rf"\b{wanting}\b(?!\s*=)(?=[^:]*$)", f"{wanting}={values[wanting]!r}", text)
    return text


def _of_package(name: str) -> Path:
    """The file of a netlist of the package, by its name."""
    known = sorted(path.stem for path in netlist_folder().glob("*.cir"))
    if name not in known:
        raise unknown("netlist", name, known)
    return netlist_folder() / f"{name}.cir"


def _with_rload(path: Path, subcircuits: dict[str, list[Line]]) -> list[Line]:
    """The lines of the one subcircuit with a resistor Rload."""
    loads = [body for body in subcircuits.values() if any(line.word == "rload" for line in body)]
    if len(loads) != 1:
        many = len(loads) or "none"
        raise InputError(
            f"netlist {path.name} must have one subcircuit with a resistor Rload, the load, but has {many} (of a flat "
            "netlist, load.terminals names the piezo's nets)"
        )
    return loads[0]


def _check_header(path: Path, header: Header, load: list[Line]) -> None:
    """Refuse a subcircuit without two connected terminals, or with a parameter of a reserved name."""
    where, terminals = f"netlist {load[0].where}", header.terminals
    if len(terminals) != 2:
        raise invalid(where, "have two terminals, the piezo's electrodes", f"{len(terminals)} terminals")
    if reserved := [name for name in header.defaults if name in _RESERVED]:
        raise invalid(where, f"have no parameter of the name {' or '.join(_RESERVED)}", reserved[0])
    connected = {token for line in load[1:] for token in re.split(r"[\s(),]+", line.text.lower())}
    for terminal, other in ((terminals[0], None), (terminals[1], "0")):
        if terminal.lower() not in connected and other not in connected:
            raise InputError(
                f"netlist {path.name} must use its terminal {terminal!r}, but no element is connected to it"
            )


def _storage(load: list[Line], values: dict[str, float]) -> tuple[float | None, float | None]:
    """Csmooth, and the product Rload Csmooth, of values that are numbers or parameters.

    Raises InputError where it is known that Rload is none or would give power, or Csmooth energy.
    """
    spelled = {key.lower(): f"load.parameters.{key}" for key in values}
    by_role: dict[str, float | None] = {}
    for line in load:
        tokens = line.text.lower().split()
        if tokens[0] in ("rload", "csmooth") and len(tokens) > 3:
            name = tokens[3].strip("{}'")
            value = by_role[tokens[0]] = _number(tokens[3], values)
            least = "above 0" if tokens[0] == "rload" else "at least 0"
            if value is not None and (value < 0.0 or (value == 0.0 and tokens[0] == "rload")):
                raise invalid(spelled.get(name, f"netlist {line.where}"), f"be {least}, for {tokens[0]}", value)
    resistance, capacitance = by_role.get("rload"), by_role.get("csmooth")
    return capacitance, None if resistance is None or capacitance is None else resistance * capacitance


def _number(token: str, values: dict[str, float]) -> float | None:
    """The value of an element: a number, or a parameter of that name; None for an expression."""
    known = {key.lower(): value for key, value in values.items()}
    name = token.strip("{}'")
    return known[name] if name in known else ngspice_number(token)


def _lone_resistance(load: list[Line], header: Header, values: dict[str, float]) -> float | None:
    """The resistance (ohm) of a subcircuit whose only element is Rload, from terminal to terminal; else None."""
    elements = [line.text.lower().split() for line in load if line.word not in (".subckt", ".ends", ".model")]
    if len(elements) != 1 or len(elements[0]) != 4:
        return None
    _, *nodes, value = elements[0]
    ground = {"0": header.terminals[1].lower(), "gnd": header.terminals[1].lower()}
    if {ground.get(node, node) for node in nodes} != {terminal.lower() for terminal in header.terminals}:
        return None
    resistance = _number(value, values)
    return resistance if resistance is not None and resistance > 0.0 else None


def _smoothing_nodes(load: list[Line]) -> tuple[str, ...]:
    """The nodes of the capacitor Csmooth, in lower case."""
    for line in load:
        if (match := re.match(r"csmooth[\s(]+([^\s(),]+)[\s,]+([^\s(),]+)", line.text.lower())) is not None:
            return match.groups()
    return ()


def _scene_values(
    header: Header, parameters: dict[str, float], capacitance: float | None, keys: Iterable[str]
) -> dict[str, float]:
    """The scene's parameters in the netlist's spelling, Cp included; every one without default must be among them.

    ``keys`` are the elements that are parameters by their names.
    """
    spelling = {default.lower(): default for default in header.defaults}
    for key in parameters:
        if key.lower() not in spelling:
            if not header.defaults:
                raise InputError(
                    f"unknown parameter of netlist {header.name} {shown(key)}: it has none but its elements "
                    f"({', '.join(list(keys)[:20]) or 'none has a plain value'}); another one stands on its first "
                    f"line, such as '.subckt {header.name} p n {key}=1Meg'"
                )
            raise unknown(f"parameter of netlist {header.name}", key, [*header.defaults, *keys])
    values = {spelling[key.lower()]: value for key, value in parameters.items()}
    if capacitance is not None and "cp" in spelling:
        values.setdefault(spelling["cp"], capacitance)
    for name, default in header.defaults.items():
        if default is None and name not in values:
            raise InputError(
                f"load.parameters must give {name} of netlist {header.name}, which has no default, but does not"
            )
    return values
