"""The text of a whole circuit, as far as it is not PySpice's: integration rule, and what is saved."""

import math
import re
from dataclasses import dataclass

from harvester.circuit.lockstep.drive import VECTORS


@dataclass(frozen=True)
class Deck:
    """A whole circuit as ngspice takes it, and its vectors' names in the order of `VECTORS` ("" for none)."""

    text: str
    vectors: tuple[str, ...]

    @property
    def smoothing(self) -> bool:
        """Whether the load has a capacitor Csmooth."""
        return any(self.vectors[VECTORS.index("smooth") :])


def integration(step: float, time_constant: float | None, volts: float, capacitance: float, reltol: float) -> str:
    """The options card: the exact rule of a load resistor's time constant (s), or steps of ngspice's own (None).

    ``reltol`` is ngspice's relative tolerance, for steps of its own.

    ngspice's absolute tolerances scale with the signal's size ``volts``, so that a microvolt is as precise as
    a kilovolt; at 20 V on 50 nF they are ngspice's own.
    """
    if time_constant is None:
        charge = 1e-8 * volts * capacitance
        sizes = f"vntol={5e-8 * volts!r} chgtol={charge!r} abstol={0.5 * charge / step!r}"
        return f".options method=gear maxord=2 reltol={reltol!r} {sizes}"
    return f".options method=trap xmu={trapezoid_share(step, time_constant)!r} trtol=1e6 chgtol=1"


def smoothing_nodes(text: str) -> tuple[str, str]:
    """Nodes of the load's capacitor Csmooth in the whole circuit; "" for both without one."""
    header = text.split("\n", 1)[0].lower().split()
    found = re.search(r"^csmooth[\s(]+([^\s(),]+)[\s,]+([^\s(),]+)", text, re.IGNORECASE | re.MULTILINE)
    if found is None:
        return "", ""
    outer = {header[2]: "p", header[3]: "0", "0": "0", "gnd": "0"}
    plus, minus = (outer.get(node.lower(), f"xload.{node.lower()}") for node in found.groups())
    return plus, minus


def trapezoid_share(step: float, time_constant: float) -> float:
    """Ngspice's xmu, the weight of a step's beginning: 1/z - 1/(exp(z) - 1), z = step/time constant.

    v1 - v0 + z [(1 - xmu) v1 + xmu v0] = u1 - u0 then has the exact solution of v' + v/(R Cp) = u'
    for a steady slope u'.  It is 1/2, the trapezoidal rule, for a short step and goes to 0,
    backward Euler, for a long one, where the trapezoidal rule would ring.
    """
    z = step / time_constant
    return 0.5 - z / 12.0 if z < 1e-3 else 1.0 / z - (1.0 / math.expm1(z) if z < 700.0 else 0.0)
