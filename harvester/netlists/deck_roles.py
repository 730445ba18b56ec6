"""The load and the storage of a deck: elements of the board, not of a measurement of the piezo's own model."""

from collections.abc import Callable, Sequence
from typing import TypeVar

from harvester.errors import InputError, unknown
from harvester.netlists.deck_model import ModelReaders
from harvester.netlists.element_lines import Element
from harvester.netlists.flat import net_of

NAMES = {  # of loads and stores
    "load": ("rload", "rl", "r_load", "r_l"),
    "store": ("csmooth", "cstore", "cstorage", "cs", "cload"),
}

Part = TypeVar("Part", Element, Element | None)


def load_of(
    board: Sequence[Element], measured: Sequence[ModelReaders], given: str | None, file: str
) -> Element:
    """The load: the element ``given``, one by its name, or the resistor across the largest capacitor.

    Raises InputError if there is none on the board, and if a measurement acts on it, or on an
    element that has a load's name.
    """
    if given is None:
        _refuse_named("load", measured)
    return _on_board(lambda elements: _find_load(elements, given, file), board, measured)


def store_of(
    board: Sequence[Element],
    measured: Sequence[ModelReaders],
    given: str | None,
    file: str,
    load: Element,
) -> Element | None:
    """The storage capacitor: the element ``given``, one by its name, or the largest capacitor across the load.

    Raises as `load_of`, but it is None without one.
    """
    store = _on_board(lambda elements: _find_store(elements, given, file, load), board, measured)
    if store is None:
        _refuse_named("store", measured)
    return store


def _refuse_named(what: str, measured: Sequence[ModelReaders]) -> None:
    """Raise InputError if a measurement acts on an element with a name of a load or a storage capacitor.

    A storage capacitor is across a resistor; another capacitor, as that of a filter, only measures.
    """
    for group in measured:
        resistors = [_nets_of(each) for each in group.elements if each.kind == "r"]
        for each in group.elements:
            if each.name.lower() not in NAMES[what]:
                continue
            if what == "load":
                group.refuse(f", or name the load by `load` if {each.name} only measures")
            if _nets_of(each) in resistors:
                group.refuse(f", or rename {each.name} if it only measures")


def _on_board(
    find: Callable[[Sequence[Element]], Part],
    board: Sequence[Element],
    measured: Sequence[ModelReaders],
) -> Part:
    """An element of the board; raise InputError if it is only found among measurements."""
    try:
        return find(board)
    except InputError:
        element = find([*board, *(each for group in measured for each in group.elements)])
        for group in measured:
            if element in group.elements:
                group.refuse()
        raise


def _named(
    elements: Sequence[Element], letter: str, given: str | None, what: str, file: str
) -> Element | None:
    """The load or the storage capacitor: as given, by its name, or the only one of its kind.

    None otherwise.
    """
    there = {element.name.lower(): element for element in elements if element.kind == letter}
    if given is not None:
        if given.lower() not in there:
            names = [element.name for element in there.values()]
            raise unknown(f"`{what}` of deck {file}", given, names or ["none"])
        return there[given.lower()]
    by_name = [there[name] for name in NAMES[what] if name in there]
    return (by_name or list(there.values()))[0] if by_name or len(there) == 1 else None


def _find_load(elements: Sequence[Element], given: str | None, file: str) -> Element:
    """The load: one by its name, or the resistor across the largest capacitor."""
    if (named := _named(elements, "r", given, "load", file)) is not None:
        return named
    store = max((e for e in elements if e.kind == "c"), key=_size, default=None)
    resistors = [element for element in elements if element.kind == "r"]
    across = [each for each in resistors if store and _nets_of(each) == _nets_of(store)]
    if len(across) == 1:
        return across[0]
    names = ", ".join(element.name for element in resistors) or "none"
    raise InputError(
        f"`load` must name the resistor of deck {file} whose power is asked for, but is left out: "
        f"its resistors are {names}"
    )


def _find_store(
    elements: Sequence[Element], given: str | None, file: str, load: Element
) -> Element | None:
    """The storage capacitor: one by its name, or the largest capacitor across the load.

    None without one.
    """
    if (named := _named(elements, "c", given, "store", file)) is not None:
        return named
    capacitors = (element for element in elements if element.kind == "c")
    across = (each for each in capacitors if _nets_of(each) == _nets_of(load))
    return max(across, key=_size, default=None)


def _nets_of(element: Element) -> set[str]:
    return set(map(net_of, element.nodes[:2]))


def _size(element: Element) -> float:
    """The value of an element; 0 if it depends on a name."""
    value = element.value
    return value.value if value is not None and value.is_constant else 0.0
