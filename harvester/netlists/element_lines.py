"""The contents of an element's line, by its letter: nodes, value, model and keys, whose names have no values yet.

Each letter has its nodes, the keys that it may have, and a function that reads the text between;
a word, a key or a form that is not among them is refused.  Keys that do nothing in a transient are
read and left out.

Source: ngspice manual, chapters 3 to 11, and the answers of ngspice 39 (tests/netlists/constructs).

Long because all letters are in one table, with how each is read.
"""

import re
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, field
from typing import NamedTuple

from harvester.errors import InputError, invalid
from harvester.netlists.expression import SOURCES, plain_number, read
from harvester.netlists.expression_tree import Node, constant, operation
from harvester.netlists.read_lines import Line
from harvester.netlists.words import GROUPS, Words, parameter_value, tokens_of

_NODE = re.compile(rf"[\s(,]*([^\s(),]+(?:{GROUPS}[^\s(),]*)*)")
_NAME = re.compile(r"[a-z][\w.+\-/~#\[\]]*", re.ASCII)
_READS = re.compile(r"\b[vi]\s*\(|\b(?:time|temper|hertz)\b")  # in a value: it is a function
_WAVEFORMS = {
    "sin": "sin",
    "sine": "sin",
    "pulse": "pulse",
    "exp": "exp",
    "pwl": "pwl",
    "sffm": "sffm",
    "am": "am",
}
# of a waveform; ngspice leaves out what is beyond, which LTspice reads (cycles)
_MOST_NUMBERS = {"sin": 6, "pulse": 8, "exp": 6, "sffm": 7, "am": 6}


@dataclass(frozen=True)
class Element:
    """An element as it is written: as of `CircuitPart`, but its names are those of its own subcircuit.

    ``name`` is spelt as in the file; for a call ``model`` is the subcircuit and ``options`` are the
    values that it gives.
    """

    line: Line
    name: str
    nodes: tuple[str, ...]
    value: Node | None = None
    form: str = ""
    model: str = ""
    others: tuple[str, ...] = ()
    options: Mapping[str, Node] = field(default_factory=dict)
    waveform: tuple[Node, ...] = ()
    word: str = ""

    @property
    def kind(self) -> str:
        """The letter of its kind."""
        return self.name[0].lower()

    @property
    def current_nodes(self) -> tuple[str, ...]:
        """The nodes that its current flows to; the others of E, G and S only control it."""
        return self.nodes[:2] if self.kind in "egs" else self.nodes

    @property
    def where(self) -> str:
        """Its line, as an error names it."""
        return f"netlist {self.line.where}"


Fields = dict[str, object]


class Letter(NamedTuple):
    """How lines of a letter are read.

    ``nodes`` is their number; ``keys`` are those of its options, ``idle`` those that do nothing;
    ``fields`` reads the text between as fields of `Element`, with the names of models.
    """

    nodes: int
    keys: frozenset[str]
    idle: frozenset[str]
    fields: Callable[[Words, Set[str], tuple[str, ...]], Fields]


def names_of(line: Line) -> str:
    """The line in lower case without its first word."""
    return line.text.lower()[len(line.word) :]


def read_element(line: Line, models: Set[str]) -> Element:
    """The element of a line; ``models`` are the names of all models, by which transistors know their pins.

    Raises InputError for a letter, a form or a key that is not known, too few nodes, and a line
    that cannot be read.
    """
    kind = line.word[0]
    where = f"netlist {line.where}"
    text = names_of(line)
    if kind == "a":
        raise invalid(where, "have B sources and switches in place of an A device", line.text[:60])
    if kind not in LETTERS and kind != "x":
        letters = "".join(sorted([*LETTERS, "x"])).upper()
        raise invalid(where, f"begin with a card or one of the elements {letters}", line.word)
    name = line.text.split(maxsplit=1)[0]
    if not _NAME.fullmatch(line.word):
        raise invalid(where, "give its element a name of letters, digits, _, . and -", name)
    if kind == "x":
        return _call(line, name, text)
    letter = LETTERS[kind]
    nodes, rest = _nodes(line, text, letter.nodes + _pins(kind, text, models))
    if kind == "b":
        return _behavioural(line, name, nodes, rest)
    words = Words(line, rest)
    if kind in "rcl" and (made := _function_in_place(line, name, nodes, words)) is not None:
        return made
    if kind in "cl":
        _refuse_parallel(words)
    fields = letter.fields(words, models, nodes)
    fixed = dict(fields.pop("options", {}))  # type: ignore[call-overload]
    options = fixed | words.finish(letter.keys, letter.idle)
    return Element(line, name, **({"nodes": nodes} | fields), options=options)  # type: ignore[arg-type]


def _nodes(line: Line, text: str, count: int) -> tuple[tuple[str, ...], str]:
    """The first ``count`` words, and the text behind them."""
    nodes: list[str] = []
    position = 0
    for _ in range(count):
        match = _NODE.match(text, position)
        if match is None or "=" in match[1]:
            raise invalid(
                f"netlist {line.where}",
                f"give {count} nodes to {line.text.split(maxsplit=1)[0]}",
                line.text[:60],
            )
        nodes.append(match[1])
        position = match.end()
    return tuple(nodes), re.sub(r"^[\s),]+", "", text[position:])


def _pins(kind: str, text: str, models: Set[str]) -> int:
    """How many pins a transistor has in addition to the usual ones, by a model's place."""
    words = tokens_of(text)
    if kind == "q":
        return 1 if len(words) > 4 and words[3] not in models and words[4] in models else 0
    if kind == "m":
        return -1 if len(words) > 3 and words[3] in models else 0
    return 0


def _call(line: Line, name: str, text: str) -> Element:
    """A call of a subcircuit: its nodes, its name, and its parameters."""
    words = Words(line, text)
    alone = [word for word in words.alone if word != "params:"]
    if len(alone) < 2:
        raise invalid(words.where, "give nodes and a subcircuit", line.text[:60])
    options = {key: parameter_value(value, words.where) for key, value in words.pairs.items()}
    return Element(line, name, tuple(alone[:-1]), model=alone[-1], options=options)


def _behavioural(line: Line, name: str, nodes: tuple[str, ...], text: str) -> Element:
    """A B source."""
    where = f"netlist {line.where}"
    match = re.match(r"\(?\s*([vi])\s*=(.*)$", text, re.DOTALL)
    if match is None:
        raise invalid(where, "begin its function with I= or V=", text[:60])
    parts = re.split(r"\b(m|tc1|tc2|temp|dtemp|reciproctc|reciprocm)\s*=(?!=)", match[2])
    words = Words(
        line,
        " ".join(f"{key}={value}" for key, value in zip(parts[1::2], parts[2::2], strict=True)),
    )
    options = words.finish(
        LETTERS["b"].keys if match[1] == "i" else LETTERS["b"].keys - {"m"}, frozenset()
    )
    return Element(line, name, nodes, read(parts[0], where, SOURCES), match[1], options=options)


def _function_in_place(
    line: Line, name: str, nodes: tuple[str, ...], words: Words
) -> Element | None:
    """A resistor, capacitor or inductor whose value is a function of voltages and currents.

    None of another one.

    A resistor R={f} is the current v/f, as in ngspice.
    """
    kind = name[0].lower()
    keys = {"r": ("r", "resistance"), "c": ("c", "q"), "l": ("l",)}[kind]
    key = next((key for key in keys if key in words.pairs), "")
    text = words.pairs[key] if key else words.alone[0] if words.alone else ""
    if not (text[:1] in ("{", "'", '"') and (_READS.search(text) or key == "q")):
        return None
    if name.lower() == "rload":
        raise invalid(words.where, "give Rload a constant resistance", words.text[:60])
    if key:
        del words.pairs[key]
    else:
        del words.alone[0]
    tree = read(text[1:-1], words.where, SOURCES)
    options = words.finish(frozenset({"m"}) if kind == "r" else frozenset({"m", "ic"}), frozenset())
    if kind == "r":
        return Element(
            line, name, nodes, operation("/", Node("v", names=nodes), tree), "i", options=options
        )
    # without a key ngspice takes a capacitor's function for its charge
    form = key or {"c": "q", "l": "l"}[kind]
    return Element(line, name, nodes, tree, form, options=options)


def _refuse_parallel(words: Words) -> None:
    """Leave out LTspice's parallel parts of a capacitor or an inductor if they are 0.

    Raises InputError for others, whose places in the circuit LTspice's help only draws.
    """
    for key in ("rpar", "cpar", "rlshunt"):
        text = words.pop(key)
        if text is not None and plain_number(text) != 0.0:
            raise invalid(words.where, f"have {key} as an element of its own", words.text[:60])


def _passive(*keys: str) -> Callable[[Words, Set[str], tuple[str, ...]], Fields]:
    """Resistors, capacitors and inductors: a value, a model, or both.

    The value may have one of some keys.
    """

    def fields(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
        given = words.pop(*keys)
        read_so_far: Fields = {}
        if "tc" in words.pairs:
            raise invalid(words.where, "have tc=a,b as tc1=a tc2=b", words.text[:60])
        if words.alone and words.alone[0] not in models and given is None:
            given = words.next("a value")
        if words.alone and words.alone[0] in models:
            read_so_far["model"] = words.next("a model")
        if words.alone and given is None:
            given = words.next("a value")
        if given is not None:
            read_so_far["value"] = words.number(given)
        elif not read_so_far:
            raise invalid(words.where, "have a value", words.text[:60])
        return read_so_far

    return fields


def _coupling(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
    """Inductors, and the factor between them."""
    given = words.pop("k", "coefficient")
    factor = given if given is not None else words.alone.pop() if words.alone else ""
    others = tuple(words.alone)
    if len(others) != 2 or not factor or len(set(others)) != 2:
        raise invalid(words.where, "name two inductors and a factor", words.text[:60])
    words.alone.clear()
    return {"others": others, "value": words.number(factor)}


def _semiconductor(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
    """A model, an area, and the word off, which acts on an operating point only."""
    model = words.next("a model")
    options: dict[str, Node] = {}
    words.take("off")
    if words.alone and plain_number(words.alone[0]) is not None:
        if "area" in words.pairs:
            raise invalid(words.where, "give area once", words.text[:60])
        options["area"] = words.number(words.next("an area"))
    words.take("off")
    return {"model": model, "options": options}


def _switch(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
    """A model, and how it begins."""
    return {
        "model": words.next("a model"),
        "word": "on" if words.take("on") else "off" if words.take("off") else "",
    }


def _switch_by_current(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
    return {"others": (words.next("a source"),), **_switch(words, models, nodes)}


def _source(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
    """A constant value, and a waveform; the part for an analysis of small signals is left out."""
    fields: Fields = {"value": constant(0.0)}
    given = words.pop("dc")
    if words.take("dc") or (words.alone and words.alone[0] not in (*_WAVEFORMS, "ac")):
        given = words.next("a value")
    if given is not None:
        fields["value"] = words.number(given)
    if words.take("ac"):
        while words.alone and plain_number(words.alone[0]) is not None:
            words.next("a magnitude or a phase")
    if words.alone and words.alone[0] in _WAVEFORMS:
        form = _WAVEFORMS[words.next("a waveform")]
        count = len(words.alone)
        if not count:
            raise invalid(words.where, "give the waveform its numbers", words.text[:60])
        if count > (most := _MOST_NUMBERS.get(form, count)):
            must = f"give {form} at most {most} numbers, as ngspice ignores the others"
            raise invalid(words.where, must, count)
        fields["form"] = form
        fields["waveform"] = tuple(map(words.number, words.alone))
        words.alone.clear()
    return fields


def _controlled(form: str, voltage: bool) -> Callable[[Words, Set[str], tuple[str, ...]], Fields]:
    """E, F, G and H: a gain of a ``voltage`` between two nodes or of a current, a polynomial, or a function.

    ``form`` is ``v`` for voltage sources and ``i`` for current sources.
    """

    def fields(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
        if voltage and (text := words.pop("value", "vol" if form == "v" else "cur")) is not None:
            if text[0] not in "{'\"":
                raise invalid(words.where, "have its function in braces", text[:60])
            return {"value": read(text[1:-1], words.where, SOURCES), "form": form}
        if {"table", "laplace", "freq"} & words.pairs.keys():
            raise _no_table(words)
        words.take("vcvs", "vccs", "ccvs", "cccs")
        if words.alone and words.alone[0] in ("poly", "table", "laplace", "freq"):
            return _polynomial(words, form, voltage)
        given = words.pop("gain")
        if voltage:
            controls = (
                words.next("a node that controls it"),
                words.next("two nodes that control it"),
            )
            gain = words.number(given if given is not None else words.next("a gain"))
            return {"nodes": (*nodes, *controls), "value": gain}
        source = words.next("a voltage source whose current controls it")
        return {
            "others": (source,),
            "value": words.number(given if given is not None else words.next("a gain")),
        }

    return fields


def _no_table(words: Words) -> InputError:
    return invalid(
        words.where, "write its table or transfer function as a B source", words.text[:60]
    )


def _polynomial(words: Words, form: str, voltage: bool) -> Fields:
    """POLY(n): a polynomial of n voltages or currents, by the order of its terms in SPICE 2."""
    kind = words.next("a form")
    if (
        kind != "poly"
        or not words.alone
        or not words.alone[0].isdigit()
        or not 1 <= int(words.alone[0]) <= 10
    ):
        raise _no_table(words)
    count = int(words.next("a number of controls"))
    inputs = [
        Node("v", names=(words.next("a node"), words.next("a node")))
        if voltage
        else Node("i", names=(words.next("a source"),))
        for _ in range(count)
    ]
    factors = [words.number(text) for text in words.alone]
    words.alone.clear()
    if not factors:
        raise invalid(words.where, "give the polynomial its coefficients", words.text[:60])
    products: list[tuple[int, ...]] = [()]
    tree = constant(0.0)
    for factor in factors:
        product = products.pop(0)
        term = factor
        for k in product:
            term = Node("*", (term, inputs[k]))
        tree = Node("+", (tree, term))
        products += [(*product, k) for k in range(product[-1] if product else 0, count)]
    return {"value": tree, "form": form}


def _line(words: Words, models: Set[str], nodes: tuple[str, ...]) -> Fields:
    return {}


_TEMPERATURES = frozenset({"temp", "dtemp"})
_COEFFICIENTS = _TEMPERATURES | {"m", "scale", "tc1", "tc2"}
_MOSFET = frozenset({"m", "l", "w", "ad", "as", "pd", "ps", "nrd", "nrs"}) | _TEMPERATURES
_NONE: frozenset[str] = frozenset()
_PART = frozenset({"mfg", "pn", "type"})  # what LTspice and KiCad write down of a bought part
LETTERS = {
    "r": Letter(
        2,
        _COEFFICIENTS | {"l", "w"},
        _PART | {"ac", "noisy", "noise", "tol", "pwr"},
        _passive("r", "resistance"),
    ),
    "c": Letter(
        2,
        _COEFFICIENTS | {"l", "w", "ic", "rser", "lser"},
        _PART | {"v", "irms"},
        _passive("c", "cap", "capacitance"),
    ),
    "l": Letter(
        2, _COEFFICIENTS | {"ic", "rser"}, _PART | {"ipk", "irms"}, _passive("l", "inductance")
    ),
    "k": Letter(0, _NONE, _NONE, _coupling),
    "d": Letter(2, frozenset({"area", "m", "pj"}) | _TEMPERATURES, _NONE, _semiconductor),
    "q": Letter(
        3, frozenset({"area", "areab", "areac", "m"}) | _TEMPERATURES, _NONE, _semiconductor
    ),
    "j": Letter(3, frozenset({"area", "m"}) | _TEMPERATURES, _NONE, _semiconductor),
    "m": Letter(4, _MOSFET, _NONE, _semiconductor),
    "s": Letter(4, _NONE, _NONE, _switch),
    "w": Letter(2, _NONE, _NONE, _switch_by_current),
    "v": Letter(2, frozenset({"rser"}), _NONE, _source),
    "i": Letter(2, frozenset({"m"}), _NONE, _source),
    "b": Letter(2, frozenset({"m"}), _NONE, _line),
    "e": Letter(2, _NONE, _NONE, _controlled("v", voltage=True)),
    "g": Letter(2, frozenset({"m"}), _NONE, _controlled("i", voltage=True)),
    "f": Letter(2, frozenset({"m"}), _NONE, _controlled("i", voltage=False)),
    "h": Letter(2, _NONE, _NONE, _controlled("v", voltage=False)),
    "t": Letter(4, frozenset({"z0", "zo", "td", "f", "nl"}), _NONE, _line),
}
