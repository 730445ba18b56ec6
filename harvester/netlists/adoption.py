"""Decks: netlists of a whole simulation, with a source in the piezo's place, made into boards.

A deck is read line by line.  The source, the piezo's capacitor, analyses, outputs and commands are
left out; all other lines are kept as they are written.  The treatment of each line is data
(`Adoption.diagnostics`), and an unknown card is refused.
"""

import re
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, field, replace
from pathlib import Path

from harvester.errors import InputError, invalid, unknown
from harvester.netlists.cards import DEFINITIONS, LEFT_OUT, PARAMETERS, REFUSED, TEMPERATURES
from harvester.netlists.deck_capacitance import capacitance_of, parameters_of
from harvester.netlists.deck_cards import (
    ParameterStep,
    beside,
    check_form,
    names_of,
    on_libraries,
    read_step,
    step_values,
)
from harvester.netlists.deck_device import DeckDevice, Nets, find_piezo, is_supply
from harvester.netlists.deck_doubts import refuse_doubtful
from harvester.netlists.deck_model import (
    ModelReaders,
    Removed,
    bodies_of,
    global_nets,
    measurements,
    nets_inside,
    piezos,
    shortened_starts,
    without_body,
)
from harvester.netlists.deck_roles import load_of, store_of
from harvester.netlists.element_lines import Element, read_element
from harvester.netlists.flat import net_of
from harvester.netlists.read_lines import Line, included_lines, library_of, own_lines
from harvester.netlists.unintended import unintended_number, unintended_texts
from harvester.netlists.words import tokens_of
from harvester.presentation.diagnostic import Diagnostic, note, warning

KEPT = (*DEFINITIONS, *PARAMETERS, ".inc", ".lib", ".global", ".ic", ".temp")
OPTIONS = (".options", ".option", ".opt")
PHYSICAL = (
    "gmin",
    "rshunt",
    "cshunt",
    "scale",
)  # options that change a circuit, and that no board has
_CHANGES = re.compile(
    r"^(alter|altermod|alterparam|set\s+temp|option|let\s+@|setcirc|source)\b", re.I
)
_FILE = re.compile(r"\bpwl\b[^=]*\bfile\s*=.*|\bwavefile\s*=.*", re.I)  # the rest of a source


@dataclass
class SimulationDeck:
    """The lines of a deck: elements outside of subcircuits, lines that a board keeps, and steps."""

    path: Path
    elements: list[Element] = field(default_factory=list)
    kept: list[Line] = field(default_factory=list)
    local: set[Line] = field(default_factory=set)  # lines of subcircuits, which have their own nets
    steps: list[ParameterStep] = field(default_factory=list)
    parameters: dict[str, str] = field(default_factory=dict)  # texts of .param cards
    shared: set[str] = field(default_factory=set)  # nets of .global cards, also of libraries
    models: set[str] = field(default_factory=set)  # of all models and subcircuits that are there
    missing: list[tuple[Line, str]] = field(default_factory=list)  # libraries that are not
    remarks: list[Diagnostic] = field(default_factory=list)


@dataclass(frozen=True)
class Adoption:
    """A board made of a deck.

    text
        of the board.
    terminals, resistor, store
        of the scene's table [load]; store is None without one.
    capacitance
        the piezo's in farad, as a scene's number with a prefix; "" if it has none, or its value is
        not known.
    diagnostics
        the treatment of the deck's lines.
    """

    text: str
    terminals: Nets
    resistor: str
    store: str | None
    capacitance: str
    diagnostics: tuple[Diagnostic, ...]


def adopt(
    path: Path, terminals: Nets | None = None, load: str | None = None, store: str | None = None
) -> Adoption:
    """The board of a deck.

    ``terminals`` are the piezo's nets, ``load`` and ``store`` the names of elements; those that are
    left out are searched for.

    Raises InputError for a file without a netlist, an unknown card, and an undecidable element,
    with the option to give.
    """
    check_form(path)
    deck = _read(path)
    piezo, gone = _piezo(deck, terminals)
    capacitance = capacitance_of(piezo, deck.parameters)
    deck.remarks += _on_piezo(piezo, capacitance)
    texts = {line: line.text for line in deck.kept if line not in gone}
    left, measured = _without_readers(deck, texts, gone, piezo)
    resistor = load_of(left, measured, load, path.name)
    kept_store = store_of(left, measured, store, path.name, resistor)
    deck.remarks += _on_roles(resistor, load, kept_store, store)
    supplies = (each for each in left if each.kind in "vi" and is_supply(each))
    deck.remarks += [note("deck_source_kept", element=each.name) for each in supplies]
    for step in deck.steps:
        deck.remarks.append(step.offered(texts, deck.parameters, left, resistor, kept_store))
    deck.remarks += on_libraries(deck.missing, texts, deck.models)
    lines = [f"* from {path.name}, by harvester adopt", *texts.values(), ".end", ""]
    name = None if kept_store is None else kept_store.name
    remarks = tuple(deck.remarks)
    return Adoption("\n".join(lines), piezo.nets, resistor.name, name, capacitance, remarks)


def _piezo(deck: SimulationDeck, terminals: Nets | None) -> tuple[DeckDevice, set[Line]]:
    """The piezo of a deck, a subcircuit or elements, and the lines that it has alone."""
    bodies = bodies_of(deck.kept)
    nets = None if terminals is None else set(map(net_of, terminals))
    every = piezos(deck.elements, bodies, deck.models)
    called = [each for each in every if nets in (None, set(map(net_of, each.nets)))]
    if len(called) != 1:
        device = find_piezo(deck.elements, terminals, deck.path.name)
        if terminals is None:
            refuse_doubtful(device, deck.elements, deck.path.name)
        return device, {element.line for element in device.elements}
    body = bodies.get(without_body(called[0], deck.elements), ())
    return called[0], {*(element.line for element in called[0].elements), *body}


def _without_readers(
    deck: SimulationDeck, texts: dict[Line, str], gone: Set[Line], piezo: DeckDevice
) -> tuple[list[Element], list[ModelReaders]]:
    """The elements that are left without the piezo's own model, and the measurements of it.

    The lines ``texts`` lose these and the starting values of that model.
    """
    left = [element for element in deck.elements if element.line not in gone]
    removed = Removed((each for each in deck.elements if each not in left), left, piezo.nets)
    inner = nets_inside(piezo.drives, bodies_of(deck.kept), deck.models)
    removed.nets |= deck.shared & (inner - {"0"})
    groups = measurements(left, removed, piezo.nets, deck.shared)
    measured = [element for group in groups for element in group.elements]
    for element in measured:
        del texts[element.line]
        text = element.line.text[:60]
        deck.remarks.append(note("deck_measurement", text=text, line=element.line.where))
    _shorten_starts(deck, texts, removed)
    return [element for element in left if element not in measured], groups


def _shorten_starts(deck: SimulationDeck, texts: dict[Line, str], removed: Removed) -> None:
    """Leave out the starting values of the piezo's own model from the lines ``texts``."""
    outside = [line for line in texts if line not in deck.local]
    for card, text, lost in list(shortened_starts(outside, removed)):
        deck.remarks.append(note("deck_start", text=", ".join(lost), line=card.where))
        texts[card] = text
        if not text:
            del texts[card]
    cards = [text for line, text in texts.items() if line.word in (".ic", ".temp")]
    deck.remarks += [note("deck_kept", card=text[:60]) for text in cards]


def _read(path: Path) -> SimulationDeck:
    """The deck of a file."""
    deck = SimulationDeck(path)
    outside: list[Line] = []
    dropped: dict[str, None] = {}
    depth = 0
    for line in _without_commands(deck, own_lines(path)):
        depth += {".subckt": 1, ".ends": -1}.get(line.word, 0)
        if depth < 0:
            raise invalid(f"deck {line.where}", "end a subcircuit that began", line.text[:60])
        if depth:
            deck.local.add(line)
        if depth or line.word in (*KEPT, ".ends"):
            _keep(deck, line, inside=depth > 0)
        elif not line.word.startswith("."):
            outside.append(line)
            deck.kept.append(line)
        elif line.word in LEFT_OUT:
            dropped[line.word] = None
        else:
            _read_card(deck, line)
    named = [word for word in dropped if word not in (".title", ".end")]
    deck.remarks += [note("deck_cards", cards=", ".join(named))] if named else []
    deck.elements = [_element(line, deck.models) for line in outside]
    return deck


def _element(line: Line, models: Set[str]) -> Element:
    """The element of a line; a source may have its waveform in a file, as a drive's is left out."""
    if line.word[0] not in "vi":
        return read_element(line, models)
    numbers = Line(line.where, _FILE.sub("pwl(0 0 1 1)", line.text))
    return replace(read_element(numbers, models), line=line)


def _without_commands(deck: SimulationDeck, lines: Iterable[Line]) -> Iterator[Line]:
    """The lines outside of .control blocks."""
    commands = list[Line]()
    for line in lines:
        if not commands and line.word != ".control":
            yield line
            continue
        commands.append(line)
        if line.word == ".endc":
            deck.remarks += _on_commands(commands)
            commands = []
    if commands:
        raise invalid(f"deck {commands[0].where}", "end its commands by .endc", ".control")


def _read_card(deck: SimulationDeck, line: Line) -> None:
    """Read an .options or a .step card; raise InputError for another one."""
    if line.word in OPTIONS:
        _read_options(deck, line)
    elif line.word == ".step":
        deck.steps.append(read_step(line))
        named = {"element": line.word, "line": line.where, "unit": ""}
        odd = (unintended_number(word, named) for word in step_values(line))
        deck.remarks += [remark for remark in odd if remark is not None]
    elif line.word in REFUSED:
        raise InputError(f"deck {line.where} must not have {line.word}: {REFUSED[line.word]}")
    else:
        raise unknown(f"card in deck {line.where}", line.word, (*KEPT, *LEFT_OUT, ".step"))


def _keep(deck: SimulationDeck, line: Line, inside: bool) -> None:
    """Keep a line, and note its models and parameters; a library is kept if it is there.

    The parameters of a line ``inside`` a subcircuit are those of the subcircuit alone.
    """
    named = library_of(line)
    if named is not None:
        library = beside(deck.path, named.file)
        if library is None:
            deck.missing.append((line, named.file))
            return
        card = (
            f".lib {library.name} {named.section}" if named.section else f".include {library.name}"
        )
        folder = deck.path.parent.resolve()
        name = library.relative_to(folder).as_posix()
        whole = f'.lib "{name}" {named.section}' if named.section else f'.include "{name}"'
        lines = list(included_lines(Line(line.where, whole), deck.path))
        deck.models |= set(names_of(lines))
        deck.shared |= global_nets(lines)
        deck.kept.append(Line(line.where, card if library.parent == folder else line.text))
        return
    deck.kept.append(line)
    deck.models |= set(names_of([line]))
    deck.shared |= global_nets([line])
    if line.word in PARAMETERS and not inside:
        deck.parameters |= parameters_of(line.text)


def _read_options(deck: SimulationDeck, line: Line) -> None:
    """Keep the temperatures of an .options card; warn of other options that change the circuit."""
    texts = tokens_of(line.text.lower())[1:]
    pairs = {texts[k - 1]: texts[k + 1] for k in range(1, len(texts) - 1) if texts[k] == "="}
    if kept := {key: text for key, text in pairs.items() if key in TEMPERATURES}:
        text = ".options " + " ".join(f"{key}={value}" for key, value in kept.items())
        deck.kept.append(Line(line.where, text))
        deck.remarks.append(note("deck_kept", card=text))
    for key in PHYSICAL:
        if key in pairs:
            deck.remarks.append(warning("deck_option", option=f"{key}={pairs[key]}"))
    if others := [text for text in pairs if text not in (*TEMPERATURES, *PHYSICAL)]:
        deck.remarks.append(note("deck_cards", cards=" ".join([line.word, *others])))


def _on_commands(commands: Sequence[Line]) -> Iterator[Diagnostic]:
    """Remarks on a block of commands: those that change the circuit are named."""
    yield note("deck_commands", count=len(commands) - 2)
    for line in commands:
        if _CHANGES.match(line.text):
            yield warning("deck_command_changes", command=line.text[:60], line=line.where)


def _on_piezo(piezo: DeckDevice, capacitance: str) -> Iterator[Diagnostic]:
    """Remarks on the elements that the scene's device replaces."""
    nets = ",".join(piezo.nets)
    for drive in piezo.drives:
        yield note("deck_drive", text=drive.line.text[:60], line=drive.line.where, nets=nets)
    for code, is_meter in (("deck_motion", False), ("deck_meter", True)):
        parts = [each.line.text[:60] for each in piezo.motion if (each.kind == "v") == is_meter]
        if parts:
            is_branch = is_meter or any(each.kind == "l" for each in piezo.motion)
            yield note(code if is_branch else "deck_series", text=", ".join(parts))
    yield from _on_capacitors(piezo.capacitors, capacitance)
    if not piezo.drives:
        yield note("deck_no_drive", nets=nets)


def _on_capacitors(capacitors: Sequence[Element], capacitance: str) -> Iterator[Diagnostic]:
    """Remarks on the piezo's capacitors, whose sum is "" if it is not known."""
    texts = ", ".join(each.line.text[:60] for each in capacitors)
    lines = ", ".join(each.line.where for each in capacitors)
    if capacitance:
        yield note("deck_capacitance", text=texts, line=lines, value=capacitance)
    elif capacitors:
        yield note("deck_capacitance_open", text=texts, line=lines)
    for each in capacitors:
        yield from unintended_texts(each)


def _on_roles(
    resistor: Element, load: str | None, kept: Element | None, store: str | None
) -> Iterator[Diagnostic]:
    """Remarks on a load and a storage capacitor that nobody named."""
    if load is None:
        yield note("deck_load", element=resistor.name)
    if store is None and kept is not None:
        yield note("deck_store", element=kept.name)
