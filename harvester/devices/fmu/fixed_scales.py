"""The numbers of a scene in the scales of another, for parameters that change at fixed scales.

The kernels are nondimensional, and a compiled part keeps the time 1/w0 and the length l of its
scene. If a user of the part changes a parameter, such as the mass, w0 and l of the changed scene
differ, so that each coefficient is converted: one of the unit s^-a m^b is multiplied by
(w0'/w0)^a (l'/l)^b.
"""

import dataclasses
from typing import Any, NamedTuple

from harvester.circuits.idealised import ideal_circuit
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit

# Powers a of 1/s and b of m in each coefficient's unit; voltages count as the lengths Cp v/theta
EQUATIONS = {
    "linear": (2, 0),
    "alpha2": (2, -1),
    "alpha": (2, -2),
    "beta": (2, 0),
    "mu": (1, 0),
    "c1": (1, 0),
    "c2": (1, -2),
    "c3": (1, -4),
    "cv": (0, -1),
    "restitution": (0, 0),
    "opposite_restitution": (0, 0),
    "gap": (0, 1),
    "opposite_gap": (0, 1),
    "stop_stiffness": (2, 0),
    "stop_damping": (1, 0),
    "n1": (3, 2),
    "n2": (3, 0),
    "n12": (3, 1),
    "drive": (2, 1),
    "drive_frequency": (1, 0),
    "coloured": (3, 2),
    "correlation_time": (-1, 0),
    "centre": (1, 0),
    "bandwidth": (1, 0),
}
CIRCUIT = {
    "mu": (1, 0),
    "kappa": (0, 0),
    "n": (0, 1),
    "leak": (1, 1),
    "loss": (1, 1),
    "hysteresis": (0, 1),
    "kept": (0, 0),
    "peak": (1, 0),
    "damping": (0, 0),
    "rest": (0, 1),
    "wire": (-1, 0),
    "core": (1, 0),
}


class Units(NamedTuple):
    """The SI units of a part's inputs and outputs, at fixed 1/w0 and l."""

    length: float
    speed: float
    acceleration: float
    seconds: float
    volts: float
    amperes: float
    watts: float
    newtons: float
    impulse: float
    joules: float


def units(problem: Problem, scales: Scales) -> Units:
    """The units of a problem's device in the time and the length of ``scales``."""
    modal = problem.scene.modal
    w0, length = scales.frequency, scales.length
    return Units(
        length=length,
        speed=length * w0,
        acceleration=length * w0**2,
        seconds=1.0 / w0,
        volts=modal.coupling * length / modal.capacitance,
        amperes=modal.coupling * length * w0,
        watts=modal.mass * w0**3 * length**2,
        newtons=modal.mass * w0**2 * length,
        impulse=modal.mass * w0 * length,
        joules=modal.mass * w0**2 * length**2,
    )


def equations(problem: Problem, scales: Scales) -> Equations:
    """The equations of a problem in other ``scales``; the linear spring is always a number."""
    eqs = dataclasses.replace(problem.equations, linear=problem.equations.spring[0])
    ratios = problem.scales.frequency / scales.frequency, problem.scales.length / scales.length
    changed: dict[str, Any] = {
        name: _brought(getattr(eqs, name), unit, ratios) for name, unit in EQUATIONS.items()
    }
    for name in ("record", "density"):
        if (shaking := getattr(eqs, name)) is not None:
            acceleration = float(ratios[0] ** 2 * ratios[1])
            changed[name] = shaking.scaled(1.0 / ratios[0], acceleration)
    return dataclasses.replace(eqs, **changed)


def circuit(problem: Problem, scales: Scales) -> IdealCircuit | None:
    """The load as an ideal circuit in the same scales; None for a resistance or another netlist."""
    if not problem.netlist or not problem.circuit:
        return None
    ideal = ideal_circuit(problem.circuit, problem.scales)
    ratios = problem.scales.frequency / scales.frequency, problem.scales.length / scales.length
    return _tuple_brought(ideal, ratios) if ideal else None


def _tuple_brought(some: Any, ratios: tuple[float, float]) -> Any:
    """A NamedTuple of a circuit's numbers in other scales, those of its coil included."""
    changed = {}
    for name, value in zip(some._fields, some, strict=True):
        if isinstance(value, tuple):
            changed[name] = _tuple_brought(value, ratios)
        elif isinstance(value, float):
            changed[name] = _brought(value, CIRCUIT[name], ratios)
    return some._replace(**changed)


def _brought(
    value: float | None, unit: tuple[int, int], ratios: tuple[float, float]
) -> float | None:
    """A number in other scales."""
    if value is None:
        return None
    return value * float(ratios[0] ** unit[0]) * float(ratios[1] ** unit[1])
