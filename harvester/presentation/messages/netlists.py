"""Warnings about netlists: probably unintended numbers, and circuits that cannot rectify."""

from collections.abc import Callable

from harvester.uncertainty.value import Value


def _quantity(value: float, unit: str) -> str:
    return Value(value).format(unit)


def _digits(
    element: str, line: str, text: str, value: float, unit: str, other: float, write: str
) -> str:
    return (
        f"{element} ({line}) is {text}, which ngspice reads as {_quantity(value, unit)} and "
        f"LTspice as {_quantity(other, unit)}: is {write} meant?"
    )


def _mega(element: str, line: str, text: str, value: float, unit: str, write: str) -> str:
    return (
        f"{element} ({line}) is {text}, which is {_quantity(value, unit)}: M is milli in SPICE; is "
        f"{write} meant?"
    )


def _farad(element: str, line: str, text: str, value: float, unit: str, write: str) -> str:
    return (
        f"{element} ({line}) is {text}, which is {_quantity(value, unit)}: F is femto in SPICE; is "
        f"{write} meant?"
    )


def _unusual(element: str, line: str, value: float, unit: str, low: float, high: float) -> str:
    return (
        f"{element} ({line}) is {_quantity(value, unit)}, far outside of the usual {low:g} to "
        f"{high:g} {unit}: is its scale factor right (Meg, not M)?"
    )


def _twice(element: str, line: str, value: float, capacitance: float) -> str:
    return (
        f"{element} ({line}), {_quantity(value, 'F')}, is across the piezo, whose capacitance of "
        f"{_quantity(capacitance, 'F')} the scene adds: remove it if it is the piezo's own, which "
        "counts twice"
    )


def _no_return(names: str, count: int) -> str:
    lack = "has" if count == 1 else "have"
    block = "it blocks" if count == 1 else "they block"
    return (
        f"{names} {lack} no return path for a direct current, which the piezo and capacitors block: "
        f"once the capacitors are charged, {block} but for leakage and breakdown; a bridge or a "
        "second diode closes the path"
    )


MESSAGES: dict[str, str | Callable[..., str]] = {
    "digits_behind_suffix": _digits,
    "mega_or_milli": _mega,
    "farad_or_femto": _farad,
    "unusual_element": _unusual,
    "piezo_capacitance_twice": _twice,
    "antiparallel_diodes": "{first} and {second} connect an electrode and the storage capacitor in both "
    "directions: nothing is rectified; is one of them at the other electrode?",
    "no_return_path": _no_return,
}
