"""The elements of a load circuit with the values of their subcircuit's parameters: all subcircuits written out."""

import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field

from harvester.circuits.expression import number
from harvester.errors import CannotServeError, InputError
from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.read_lines import GROUND, NODES, Line
from harvester.netlists.subcircuits import header_of, joined, split_subcircuits

ROOM = 27.0  # degrees Celsius, of the circuit
# parameters of models that do nothing at 27 degrees, but for noise and the ratings of the part
_NO_EFFECT = {"level", "tnom", "eg", "xti", "xtb", "kf", "af", "iave", "vpk", "vceo", "icrating", "mfg", "type"}
_POSITIVE = {*("n", "nf", "nr", "ne", "nc", "bf", "br", "phi", "vj", "pb", "vje", "pe", "vjc", "pc", "nbv")}
_PAIR = re.compile(r"(\w+)=(\{[^}]*\}|'[^']*'|[^\s()]+)")


@dataclass(frozen=True)
class ModelCard:
    """A model card: its name, the type such as ``d``, and the values of its parameters by their names."""

    name: str
    kind: str
    values: dict[str, float]

    def value(self, *names: str, default: float = 0.0) -> float:
        """A parameter that has several names."""
        return next((self.values[name] for name in names if name in self.values), default)


@dataclass(frozen=True)
class CircuitPart:
    """An element: name and nodes as ``x1.d2`` (the second terminal is ``0``), and the text behind its nodes.

    ``values`` are the parameters that hold where it stands, ``models`` the models; ``path`` is that of its subcircuit,
    whose terminals are connected to the nodes ``outer``.
    """

    name: str
    nodes: tuple[str, ...]
    rest: str
    values: Mapping[str, float]
    models: Mapping[str, ModelCard] = field(repr=False)
    path: str
    outer: Mapping[str, str] = field(repr=False)

    @property
    def kind(self) -> str:
        """The letter of its kind: d is a diode."""
        return self.name.removeprefix(self.path)[0]

    @property
    def where(self) -> str:
        """The element, as an error names it."""
        return f"netlist element {self.name}"

    @property
    def words(self) -> list[str]:
        """What stands behind its nodes, without pairs of a name and a value."""
        return _PAIR.sub(" ", joined(self.rest)).split()

    @property
    def options(self) -> dict[str, float]:
        """Pairs of a name and a value behind its nodes, such as ic=1."""
        return {name: self.number(text) for name, text in _PAIR.findall(joined(self.rest))}

    def number(self, text: str) -> float:
        """The value of a number or an expression where the element stands."""
        return number(text, self.where, self.values)

    def node(self, name: str) -> str:
        """The node of the whole circuit that a name in an expression of the element means."""
        return "0" if name in GROUND else self.outer.get(name, self.path + name)

    @property
    def area(self) -> float:
        """Of a diode or a transistor, times how many are side by side.

        Raises InputError where it is not above 0.
        """
        given = [self.number(word) for word in self.words[1:] if word != "off"]
        area = (given[0] if given else self.options.get("area", 1.0)) * self.options.get("m", 1.0)
        if not area > 0.0:
            raise InputError(f"{self.where} must have an area above 0, but has {area:g}")
        return area

    def model(self, kinds: tuple[str, ...], known: Set[str]) -> ModelCard:
        """Its model: of one of the ``kinds``, with parameters that are ``known``.

        Raises UnservedError for another, InputError where the netlist has none.
        """
        words = self.words
        name = next((word for word in words if word in self.models), words[0] if words else "")
        if name not in self.models:
            raise InputError(f"{self.where} must name a model of the netlist, but {name!r} is none")
        card = self.models[name]
        if card.kind not in kinds:
            raise unserved(self, f"has a model of the type {card.kind}")
        for key in card.values:
            if key not in known | _NO_EFFECT:
                raise unserved(self, f"has a model with the parameter {key}")
            if key in _POSITIVE and not card.values[key] > 0.0:
                raise InputError(f"{self.where} must have a model whose {key} is above 0, but has {card.values[key]:g}")
        if card.value("tnom", default=ROOM) != ROOM or card.value("level", default=1.0) != 1.0:
            raise unserved(self, f"has a model of another level than 1, or of another tnom than {ROOM:g}")
        return card


class UnservedError(CannotServeError):
    """A compiled circuit does not have this element, or this form of it."""


def unserved(part: CircuitPart, why: str) -> UnservedError:
    """The error of an element that is not served."""
    return UnservedError(f"{part.where} {why}")


def parts_of(load: LoadCircuit) -> list[CircuitPart]:
    """The elements of a load circuit in their order.

    Raises InputError for values that cannot be computed, and subcircuits called with too few nodes.
    """
    bodies, outside = split_subcircuits("load", [Line("load", text) for text in load.text.splitlines() if text])
    first, second = load.terminals
    values = _parameters(outside, {})
    models = _models(outside, values, {})
    given = {name.lower(): value for name, value in load.parameters.items()}
    body = bodies[load.name.lower()]
    return list(_inside(body, bodies, "", {first: "p", second: "0"}, given, values, models))


def _inside(
    body: list[Line],
    bodies: dict[str, list[Line]],
    path: str,
    outer: Mapping[str, str],
    given: Mapping[str, float],
    common: Mapping[str, float],
    models: Mapping[str, ModelCard],
) -> Iterator[CircuitPart]:
    """The elements of one call of a subcircuit, whose terminals are ``outer`` and parameters ``given``."""
    values = dict(common)
    for name, text in header_of(body[0]).defaults.items():
        key = name.lower()
        where = f"parameter {name} of {path or 'the netlist'}"
        values[key] = given[key] if key in given else number(text or "", where, values)
    values |= {name: value for name, value in given.items() if name not in values}
    values = _parameters(body, values)
    scope = _models(body, values, models)

    def node(name: str) -> str:
        return "0" if name in GROUND else outer.get(name, path + name)

    for line in body:
        text = joined(line.text.lower())
        name, *words = text.replace("(", " ( ").split() if line.word[0] != "b" else text.split()
        if name.startswith("."):
            continue
        if name[0] == "x":
            yield from _called(name, text, bodies, path, node, values, common, scope)
            continue
        count = _node_count(name, words, scope)
        if (match := re.match(r"\S+" + r"[\s(,]+([^\s(),]+)" * count, text)) is None:
            raise InputError(f"netlist element {path}{name} must have {count} nodes, but is {text[:60]!r}")
        rest = text[match.end() :].lstrip(") ,") if name[0] != "b" else text[match.end() :]
        yield CircuitPart(path + name, tuple(map(node, match.groups())), rest.strip(), values, scope, path, outer)


def _node_count(name: str, words: list[str], models: Mapping[str, ModelCard]) -> int:
    """How many of an element's words are nodes, those that control it included."""
    count = NODES.get(name[0], 0)
    if name[0] == "q" and len(words) > 4 and words[3] not in models and words[4] in models:
        return 4
    return 3 if name[0] == "m" and len(words) > 3 and words[3] in models else count


def _called(name, text, bodies, path, node, values, common, models):
    """The elements of the subcircuit that an X line calls."""
    pairs = dict(_PAIR.findall(text))
    plain = [word for word in _PAIR.sub(" ", text).split()[1:] if word != "params:"]
    inner = bodies[plain[-1]]
    terminals = [name.lower() for name in header_of(inner[0]).terminals]
    if len(plain) != len(terminals) + 1:
        raise InputError(
            f"netlist element {path}{name} must give {len(terminals)} nodes to {plain[-1]}, but gives {len(plain) - 1}"
        )
    where = f"netlist element {path}{name}"
    there = dict(zip(terminals, map(node, plain[:-1]), strict=True))
    given = {key: number(value, where, values) for key, value in pairs.items()}
    yield from _inside(inner, bodies, f"{path}{name}.", there, given, common, models)


def _parameters(lines: list[Line], values: Mapping[str, float]) -> dict[str, float]:
    """Values with those that .param cards set, in their order."""
    parameters = dict(values)
    for line in lines:
        if line.word == ".param":
            for name, text in _PAIR.findall(joined(line.text.lower())):
                parameters[name] = number(text, f"parameter {name}", parameters)
    return parameters


def _models(lines: list[Line], values: Mapping[str, float], outer: Mapping[str, ModelCard]) -> dict[str, ModelCard]:
    """Models with those of .model cards among lines."""
    cards = dict(outer)
    for line in lines:
        if line.word == ".model":
            text = joined(line.text.lower().replace("(", " ", 1))
            _, name, kind, *_ = text.split()
            pairs = {key: number(value, f"model {name}", values) for key, value in _PAIR.findall(text)}
            cards[name] = ModelCard(name, kind, pairs)
    return cards
