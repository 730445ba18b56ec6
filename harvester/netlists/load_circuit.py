"""Load circuits: the files of netlists/ and users' own, read and checked, and never trusted.

A load circuit is a subcircuit of two terminals, the piezo's electrodes, with named parameters and a
resistor called Rload, whose power is that of the load; node 0 is ground.  The rest of a file is a
bench for running it by hand (``ngspice -b``).  In a flat netlist it is the part outside of
subcircuits (`harvester.netlists.flat`).  Nothing of the text reaches ngspice: its lines are written
from the elements that were understood.

Long because a load circuit and the checks of its load are read together.
"""

import os
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from harvester.errors import InputError, invalid, unknown
from harvester.netlists.circuit_keys import CircuitKeys
from harvester.netlists.flat import LOAD, ROLES, STORE, Board, as_board
from harvester.netlists.for_ngspice import lines_for_ngspice
from harvester.netlists.ltspice import inner_nodes
from harvester.netlists.netlist import Body, ParsedNetlist, read_netlist
from harvester.netlists.part import PIEZO, CircuitPart, by_name
from harvester.netlists.read_lines import DeckError, split_path
from harvester.netlists.unintended import unintended_values
from harvester.netlists.written_out import initial_of, settings_of, written_out
from harvester.presentation.diagnostic import Diagnostic
from harvester.scene.load import Load, is_path

_SOME_CAPACITANCE = 1e-8  # F, of a piezo that is not known yet


@dataclass(frozen=True)
class LoadCircuit:
    """A load circuit, read and checked: all that anybody needs of a netlist.

    name, parts, text
        of the circuit, its elements with their values, and their text for ngspice.

    Parameters
    ----------
        values that the scene gives, in the netlist's spelling, and the piezo's capacitance if it
        has a Cp.
    topology
        name of the package's netlist; None for a user's own.
    values
        ``parameters``, and the defaults of the others where these are plain numbers.
    names
        the nodes of the whole circuit by the names that the netlist has for them, in lower case.
    renamed
        of a flat netlist the elements that have another name here.
    ground
        the node of the netlist's own ground: ``0``, an electrode, but of a flat netlist with a
        ground of its own.
    elements
        the values of its elements that are plain numbers, by the names that a scene calls them.
    settings
        the temperatures that it sets (degrees Celsius), by the names of ngspice's options.
    value_warnings
        warnings of probably unintended values.
    """

    name: str
    parts: tuple[CircuitPart, ...] = field(repr=False)
    text: str
    parameters: dict[str, float] = field(default_factory=dict)
    topology: str | None = None
    values: dict[str, float] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    renamed: dict[str, str] = field(default_factory=dict)
    ground: str = "0"
    elements: dict[str, float] = field(default_factory=dict)
    settings: dict[str, float] = field(default_factory=dict)
    value_warnings: tuple[Diagnostic, ...] = ()

    def _part(self, name: str) -> CircuitPart | None:
        return next((part for part in self.parts if part.name == name), None)

    @cached_property
    def resistance(self) -> float | None:
        """The load resistor (ohm) of a circuit of that alone, which needs no step control.

        Else None.
        """
        lone = len(self.parts) == 1 and set(self.parts[0].nodes) == {PIEZO, "0"}
        return self.parts[0].effective_value if lone else None

    @property
    def linear(self) -> bool:
        """Whether it is no more than the load resistor."""
        return self.resistance is not None

    @cached_property
    def smoothing(self) -> float | None:
        """The smoothing capacitor Csmooth (F).

        None if there is none or it is not a plain number.
        """
        store = self._part(STORE)
        return None if store is None else store.effective_value

    @cached_property
    def storage(self) -> float | None:
        """The product of Csmooth and Rload (s), if both are plain numbers."""
        load = self._part(LOAD)
        resistance = None if load is None else load.effective_value
        return None if self.smoothing is None or resistance is None else self.smoothing * resistance

    @property
    def smoothing_nodes(self) -> tuple[str, ...]:
        """The nodes of the capacitor Csmooth; none without one."""
        store = self._part(STORE)
        return () if store is None else store.nodes

    def value_of(self, name: str) -> float | None:
        """The value of a parameter or an element by its name in the scene's load.parameters.

        None if it has none.
        """
        return {key.lower(): value for key, value in (self.elements | self.values).items()}.get(
            self.own_name(name)
        )

    def own_name(self, name: str) -> str:
        """The entry for a name in the scene's load.parameters, in small letters: R for the load of a flat netlist."""
        return ROLES.get(self.renamed.get(name.lower(), ""), name).lower()


def netlist_folder() -> Path:
    """The folder of the package's netlists: next to the modules when installed, else in the checkout."""
    installed = Path(__file__).parent
    return installed if any(installed.glob("*.cir")) else Path(__file__).parents[2] / "netlists"


def load_circuit(
    load: Load, capacitance: float | None = None, text: str | None = None
) -> LoadCircuit:
    """Read and check the circuit of a scene's load; a load resistance is the netlist `resistor`.

    ``capacitance`` (F) is the piezo's: a netlist's parameter Cp receives it, unless the scene gives
    one.  ``text`` is that of the netlist's file, which then need not be there yet.

    Raises InputError for an unknown netlist, one that could run a command or reach a file outside
    its folder, one without two terminals or without Rload, a construct that is not supported, and
    parameters that it lacks or that lack a value.
    """
    name = load.netlist
    parameters = dict(load.parameters)
    if name is None:
        assert load.resistance is not None, "Load checks this"
        name = "resistor"
        parameters = {"R": load.resistance}
    path, root = split_path(name) if is_path(name) else (_of_package(name), None)
    try:
        netlist, body, board = _read(load, path, root, text)
    except DeckError as error:
        raise InputError(f"{error}; {_adopt(load, path)}") from None
    for model, line in body.cards.items():
        if not line.included:
            body.model(model)  # also one that nobody names; those of libraries may be others'
    keys = CircuitKeys(body, board)
    given = keys.given(path, parameters, capacitance)
    parts = written_out(netlist, body, board.nodes, board.ground, *keys.split(given))
    if initial := initial_of(netlist):
        parts = _with_initial(parts, {board.nodes[net]: volts for net, volts in initial.items()})
    _check_terminals(path, parts, body)
    _check_roles(path, parts, body, keys.values(given))
    there = by_name(parts)
    return LoadCircuit(
        name=body.name or path.stem,
        parts=parts,
        text="\n".join(lines_for_ngspice(parts)),
        parameters=given,
        topology=None if is_path(name) else name,
        values=keys.values(given),
        names=board.nodes,
        renamed=board.renamed,
        ground=board.ground,
        elements={keys.called(name): there[name.lower()].number or 0.0 for name in keys.elements},
        settings=settings_of(netlist),
        value_warnings=unintended_values(netlist, body, parts, capacitance)
        if is_path(name)
        else (),
    )


def _read(
    load: Load, path: Path, root: Path | None, text: str | None
) -> tuple[ParsedNetlist, Body, Board]:
    """The netlist of a load, its part that is the load circuit, and the nodes by their names."""
    netlist = read_netlist(path, netlist_folder() / "parts", load.terminals is not None, root, text)
    if load.terminals is not None:
        return netlist, netlist.outside, as_board(netlist, load)
    body = _with_rload(path, netlist)
    return netlist, body, Board(dict(zip(body.terminals, (PIEZO, "0"), strict=True)))


def Netlist(name: str, /, **parameters: float | str) -> Load:  # noqa: N802, as it reads as one of the tables
    """The load of a netlist with its parameters, checked at once: that it can be used, and has such parameters.

    Parameters
    ----------
    name : str
        one of the package's netlists, such as "bridge", or the path of a file that has a
        subcircuit.  In a flat netlist `Load` names the terminals.
    parameters : float or str
        of the subcircuit, and its elements by their names: numbers in SI units, or texts with their
        unit.

    Returns
    -------
    Load
        for `Scene` and `Scene.with_load`.

    Raises
    ------
    InputError
        for a netlist that is not there, with the nearest match, or cannot be used; a parameter that
        it does not have; and one that is neither a number nor a quantity.

    Examples
    --------
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


def with_parts(load: LoadCircuit, parts: tuple[CircuitPart, ...]) -> LoadCircuit:
    """The circuit with other elements in place of its own."""
    return replace(load, parts=parts, text="\n".join(lines_for_ngspice(parts)))


def _adopt(load: Load, path: Path) -> str:
    """The command that makes a board of a deck, as it is typed."""
    names = ("board.cir", "adopted.cir", *(f"adopted{k}.cir" for k in range(2, 100)))
    beside = [path.with_name(name) for name in names]
    out = os.path.relpath(next((new for new in beside if not new.exists()), beside[0]))
    words = ["harvester", "adopt", os.path.relpath(path)]
    words += [] if load.terminals is None else ["--terminals", ",".join(load.terminals)]
    words += [] if load.resistor is None else ["--load", load.resistor]
    words += [] if load.store is None else ["--store", load.store]
    # the long paths of a folder elsewhere are named once
    words += [] if out.startswith(os.pardir) else ["--out", out]
    return f"{shlex.join(words)} leaves out the lines that a scene replaces"


def _of_package(name: str) -> Path:
    """The file of a netlist of the package, by its name."""
    known = sorted(path.stem for path in netlist_folder().glob("*.cir"))
    if name not in known:
        raise unknown("netlist", name, known)
    return netlist_folder() / f"{name}.cir"


def _with_rload(path: Path, netlist: ParsedNetlist) -> Body:
    """The one subcircuit with a resistor Rload."""
    loads = [
        body
        for body in netlist.subcircuits.values()
        if any(line.word == LOAD for line in body.lines)
    ]
    if len(loads) != 1:
        many = len(loads) or "none"
        kind = DeckError if netlist.drives_bench and not loads else InputError
        raise kind(
            f"netlist {path.name} must have one subcircuit with a resistor Rload, the load, but has {many} (of a flat "
            "netlist, load.terminals names the piezo's nets)"
        )
    if len(loads[0].terminals) != 2:
        many = f"{len(loads[0].terminals)} terminals"
        raise invalid(
            f"netlist {loads[0].line.where}", "have two terminals, the piezo's electrodes", many
        )
    return loads[0]


def _with_initial(
    parts: Sequence[CircuitPart], volts: Mapping[str, float]
) -> tuple[CircuitPart, ...]:
    """The elements with those of .ic cards: capacitors at such nodes begin with the difference, but for their own."""
    at = {inner: volts[node] for inner, node in inner_nodes(parts).items() if node in volts}
    volts = {**at, **volts}

    def start(part: CircuitPart) -> CircuitPart:
        if part.kind != "c" or "ic" in part.options or not volts.keys() & set(part.nodes):
            return part
        first, second = (volts.get(node, 0.0) for node in part.nodes)
        return replace(part, options={**part.options, "ic": first - second})

    return tuple(map(start, parts))


def _check_terminals(path: Path, parts: Iterable[CircuitPart], body: Body) -> None:
    """Refuse terminals that nothing is connected to."""
    nodes = {node for part in parts for node in (*part.nodes, *part.nodes_read)}
    for terminal, node in zip(body.terminals, (PIEZO, "0"), strict=False):
        if node not in nodes:
            raise InputError(
                f"netlist {path.name} must use its terminal {terminal!r}, but no element is connected to it"
            )


def _check_roles(
    path: Path, parts: Sequence[CircuitPart], body: Body, values: Mapping[str, float]
) -> None:
    """Refuse a load or a storage capacitor that would give power, and a load that is not a resistor."""
    elements = {element.name.lower(): element for element in body.elements}
    spelled = {key.lower(): f"load.parameters.{key}" for key in values}
    there = by_name(parts)
    for name, least in ((LOAD, "above 0"), (STORE, "at least 0")):
        number = None if name not in there else there[name].number
        if number is not None and (number < 0.0 or (number == 0.0 and name == LOAD)):
            element = elements[name]
            names = () if element.value is None else element.value.names
            argument = spelled.get(names[0] if names else "", f"netlist {there[name].line}")
            written = element.line.text.split(maxsplit=1)[0]
            raise invalid(argument, f"be {least}, for {written}", number)
    if there[LOAD].kind != "r":
        raise InputError(f"netlist {path.name} must have a resistor Rload of a constant resistance")
