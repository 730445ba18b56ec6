"""Small pictures of the load circuits to choose from, drawn as SVG of one stroke."""

from harvester.netlists.load_circuit import netlist_folder
from harvester.storage.bought_parts import CHIPS

_PIEZO = "M10 8V18M4 18H16M4 18V28H16V18M10 28V38"  # a body between two electrodes
_RESISTOR = "M{x} 8V14M{a} 14H{b}V32H{a}ZM{x} 32V38"
_CAPACITOR = "M{x} 8V20M{a} 20H{b}M{a} 25H{b}M{x} 25V38"
_DIAMOND = "M{l} 23L{m} 12L{r} 23L{m} 34ZM{p} 19.5L{q} 23L{p} 26.5ZM{q} 19.5V26.5"


def _resistor(x: int) -> str:
    return _RESISTOR.format(x=x, a=x - 4, b=x + 4)


def _capacitor(x: int) -> str:
    return _CAPACITOR.format(x=x, a=x - 5, b=x + 5)


def _bridge(left: int) -> str:
    """A bridge from its left corner on, 22 wide, with a diode in it."""
    m = left + 11
    return _DIAMOND.format(l=left, m=m, r=left + 22, p=m - 3, q=m + 3)


_RAILS = "M10 8H{x}M10 38H{x}"
# wires to and from a bridge
_AROUND = "M10 8H{m}V12M10 38H{m}V34M{l} 23H{k}V38H{x}M{r} 23H{n}V8H{x}"


def _wired(left: int, end: int) -> str:
    """A bridge with the piezo on its upper and lower corners, and the load up to ``end`` on the others."""
    m = left + 11
    return _bridge(left) + _AROUND.format(m=m, l=left, k=left - 1, r=left + 22, n=left + 25, x=end)


_PICTURES = {
    "resistor": _PIEZO + _RAILS.format(x=52) + _resistor(52),
    "bridge": _PIEZO + _wired(26, 84) + _capacitor(66) + _resistor(84),
    "doubler": _PIEZO
    + "M10 8H84M10 38H84M30 38V27M26 27H34M30 20L26 27H34ZM26 20H34M30 20V8M44 4.5L50 8L44 11.5ZM50 4.5V11.5"
    + _capacitor(66)
    + _resistor(84),
    "parallel_sshi": _PIEZO
    + "M26 8V13M26 13L30 20M26 22V25M26 25q7 2 0 4q7 2 0 4q7 2 0 4"
    + _wired(36, 90)
    + _resistor(90),
    "sshc": _PIEZO
    + "M26 8V13M26 13L30 20M26 22V26M21 26H31M21 29H31M26 29V38"
    + _wired(36, 90)
    + _resistor(90),
    "series_sshi": _PIEZO
    + "M10 8H16L21 3.5M23 8H25q2 -7 4 0q2 -7 4 0q2 -7 4 0H47V12M10 38H47V34"
    + _bridge(36)
    + "M36 23H34V38H90M58 23H61V8H90"
    + _resistor(90),
    "sece": _PIEZO
    + _wired(22, 60)
    + "M60 8V13L64 19M60 21V24q7 2 0 4q7 2 0 4V38"
    + "M60 8H70M72 4.5L78 8L72 11.5ZM78 4.5V11.5M78 8H90M60 38H90"
    + _resistor(90),
}
_LABELS = {
    "resistor": "resistor",
    "bridge": "bridge",
    "doubler": "doubler",
    "parallel_sshi": "parallel SSHI",
}
_LABELS |= {"series_sshi": "series SSHI", "sece": "SECE", "self_powered_sshi": "self-powered SSHI"}
_LABELS |= {"sshc": "SSHC"} | {name: name.upper() for name in CHIPS}


def names() -> list[str]:
    """The circuits to choose from: a resistor, and the netlists of the package."""
    known = sorted(path.stem for path in netlist_folder().glob("*.cir"))
    order = [*_PICTURES, *(name for name in known if name not in _PICTURES)]
    return [name for name in order if name in known]


def label(name: str) -> str:
    """The name of a circuit under its picture."""
    return _LABELS.get(name, name.replace("_", " "))


def picture(name: str) -> str:
    """The picture of a circuit; a box with a load for one that has none."""
    path = _PICTURES.get(
        name, _PIEZO + "M10 8H30M10 38H30M30 4H66V42H30ZM66 8H84M66 38H84" + _resistor(84)
    )
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 96 46" fill="none" stroke="currentColor" '
        f'stroke-width="1.7" stroke-linejoin="round" stroke-linecap="round"><path d="{path}"/></svg>'
    )
