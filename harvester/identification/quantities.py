"""The device from a fit's parameters: the keys of a scene, and their formulas.

K = M w0^2    zeta = 1/(2 Q)    theta = psi C    M = theta^2/(beta w0^2 C)    f_oc = f_sc sqrt(1 + beta)
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

# of a scene
NEEDED = ("oscillator.mass", "oscillator.stiffness", "piezo.coupling", "piezo.capacitance")


@dataclass(frozen=True)
class Quantity:
    """One number: its key, unit and meaning, and its formula of the parameters by name, of which it ``needs`` some.

    ``above_0`` states that its interval is one of its logarithm.
    """

    key: str
    unit: str
    what: str
    needs: tuple[str, ...]
    of: Callable[[dict[str, float]], float]
    above_0: bool = True


def _w0(v: dict[str, float]) -> float:
    return 2.0 * math.pi * v["frequency"]


def _open_circuit(v: dict[str, float]) -> float:
    """The first resonance in open circuit: the least eigenvalue of the springs of all modes and of the piezo."""
    first = v["frequency"] ** 2
    whole = first * (1.0 + v["beta"])
    if "beta2" not in v:
        return math.sqrt(whole)
    second = v["frequency2"] ** 2
    other = second * (1.0 + v["beta2"])
    mixed = first * second * v["beta"] * v["beta2"]
    return math.sqrt(0.5 * (whole + other) - math.sqrt(0.25 * (whole - other) ** 2 + mixed))


def mass(v: dict[str, float]) -> float:
    """The modal mass in kg: known, or from the voltage a metre."""
    if "mass" in v:
        return v["mass"]
    return v["psi"] ** 2 * v["capacitance"] / (v["beta"] * _w0(v) ** 2)


def coupling(v: dict[str, float]) -> float:
    """The coupling theta in N/V."""
    return math.sqrt(mass(v) * v["beta"] * _w0(v) ** 2 * v["capacitance"])


_F = ("frequency",)
_F2 = ("frequency2",)
_C = ("frequency", "beta", "capacitance")
_M = (*_C, "mass")
QUANTITIES = (
    Quantity("short_circuit_frequency", "Hz", "resonance in short circuit", _F, lambda v: v["frequency"]),
    Quantity("quality_factor", "", "in short circuit, 1/(2 damping ratio)", ("quality",), lambda v: v["quality"]),
    Quantity(
        "open_circuit_frequency", "Hz", "resonance in open circuit", ("frequency", "beta"), _open_circuit
    ),
    Quantity("coupling_coefficient", "", "theta^2/(K Cp) = (f_oc/f_sc)^2 - 1", ("beta",), lambda v: v["beta"]),
    Quantity(
        "coupling_squared_per_mass", "N^2/(V^2 kg)", "theta^2/M", _C,
        lambda v: v["beta"] * _w0(v) ** 2 * v["capacitance"],
    ),
    Quantity("mode.2.frequency", "Hz", "second resonance in short circuit", _F2, lambda v: v["frequency2"]),
    Quantity("mode.2.damping_ratio", "", "mechanical, 1/(2 Q)", ("quality2",), lambda v: 0.5 / v["quality2"]),
    Quantity("mode.2.coupling_coefficient", "", "theta^2/(K Cp)", ("beta2",), lambda v: v["beta2"]),
    Quantity(
        "mode.2.coupling_squared_per_mass", "N^2/(V^2 kg)", "theta^2/M", (*_F2, "beta2", "capacitance"),
        lambda v: v["beta2"] * (2.0 * math.pi * v["frequency2"]) ** 2 * v["capacitance"],
    ),
    Quantity("dielectric_loss", "", "tan delta of the clamped piezo", ("loss",), lambda v: v["loss"], False),
    Quantity("oscillator.mass", "kg", "effective (modal) mass", _M, mass),
    Quantity("oscillator.stiffness", "N/m", "in short circuit", ("frequency", "mass"), lambda v: mass(v) * _w0(v) ** 2),
    Quantity(
        "oscillator.damping_ratio", "", "mechanical, 1/(2 Q)", ("quality",), lambda v: 0.5 / v["quality"]
    ),
    Quantity("piezo.coupling", "N/V", "force per volt, charge per displacement", _M, coupling),
    Quantity("piezo.capacitance", "F", "clamped: with the mass held", ("capacitance",), lambda v: v["capacitance"]),
    Quantity(
        "stop.restitution", "", "speed after over speed before an impact", ("restitution",), lambda v: v["restitution"],
        False,
    ),
    Quantity("stop.gap", "m", "from the mass at rest; negative: pressed on it", ("gap",), lambda v: v["gap"], False),
)  # fmt: skip


def answered(names: set[str]) -> list[Quantity]:
    """The quantities that parameters with these names make."""
    if "psi" in names and {"beta", "frequency", "capacitance"} <= names:
        names = names | {"mass"}
    return [quantity for quantity in QUANTITIES if set(quantity.needs) <= names]
