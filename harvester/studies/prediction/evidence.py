"""Single points of a datasheet as evidence on a device: the likelihood of devices that the priors allow.

A point is a number of the linear device at its own best frequency
(`harvester.linear.single_points`), or its resonance in open circuit.  Its logarithm is normal
about that of a device, with the errors of the meter and of the model of a linear device, the latter
independent of that of the prediction.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, reading, unknown
from harvester.linear.single_points import LOADED, OPEN, DataSheetPoint, LinearDevice, read_point
from harvester.quantities.kinds import FREQUENCY
from harvester.studies.prediction.priors import data
from harvester.studies.tolerance.surface import Polynomial, fit

RESONANCE = "open_circuit_frequency"
NAMES = (OPEN, LOADED, RESONANCE)
METER = {OPEN: 0.025, LOADED: 0.05, RESONANCE: 0.003}  # relative errors of a measurement
MODEL_SHARE = {OPEN: 0.5, LOADED: 1.0, RESONANCE: 0.0}  # exponent of the model error of a power
LEAST_SHARE = (
    50.0 / 8192.0
)  # effective fraction of devices, below which the points are hardly possible


def read_points(points: Mapping[str, str]) -> dict[str, DataSheetPoint | float]:
    """The points by their names, the resonance in open circuit in Hz.

    InputError for another name or form.
    """
    for name in points:
        if name not in NAMES:
            raise unknown("point of `points`", name, NAMES)
    return {
        name: reading(f"`{name}`", FREQUENCY.read, text)
        if name == RESONANCE
        else read_point(name, text)
        for name, text in points.items()
    }


def of_device(point: DataSheetPoint | float, device: LinearDevice) -> float:
    """The value that a device has in place of a point."""
    if isinstance(point, DataSheetPoint):
        return point.of(device)
    return device.frequency * math.sqrt(1.0 + device.beta) / (2.0 * math.pi)


def effective_number(weights: Floats) -> float:
    """How many devices of equal weight determine a quantile as well as these."""
    return float(weights.sum() ** 2 / (weights**2).sum())


@dataclass(frozen=True)
class Evidence:
    """For each point a polynomial of its logarithm over the standardised keys, that of its value, and its error."""

    laws: tuple[Polynomial, ...]
    measured: tuple[float, ...]
    sigmas: tuple[float, ...]

    def weights(self, x: Floats) -> Floats:
        """The likelihood of devices, shape (n, keys), over the largest; shape (n,).

        Raises InputError if hardly any of them has such points.
        """
        log = np.zeros(len(x))
        for law, measured, sigma in zip(self.laws, self.measured, self.sigmas, strict=True):
            log -= 0.5 * ((law(x) - measured) / sigma) ** 2
        weights = np.exp(log - log.max())
        rare = effective_number(weights) < LEAST_SHARE * len(x)
        if rare or log.max() < -8.0 * len(self.laws):
            raise InputError(
                "`points` must be possible for devices of the priors, but hardly any device has "
                "them: check peak or RMS and the acceleration, or state a wider origin in `known`"
            )
        return np.asarray(weights)


def evidence(
    points: Mapping[str, DataSheetPoint | float], keys: Mapping[str, Floats], x: Floats
) -> Evidence:
    """The evidence of points, by devices at ``x``, shape (n, keys), whose values of scene keys are ``keys``, (n,)."""
    model = float(data()["model"]["linear"])
    mass = keys["oscillator.mass"]
    frequency = np.sqrt(keys["oscillator.stiffness"] / mass)
    devices = [
        LinearDevice(*map(float, row))
        for row in zip(
            mass,
            frequency,
            mass * frequency / keys["oscillator.damping"],
            keys["piezo.capacitance"],
            keys["piezo.coupling"],
            strict=True,
        )
    ]
    laws = []
    measured = []
    sigmas = []
    for name, point in points.items():
        law = fit(x, np.log([of_device(point, device) for device in devices]))
        laws.append(law)
        measured.append(math.log(point.value if isinstance(point, DataSheetPoint) else point))
        sigmas.append(
            math.sqrt(METER[name] ** 2 + (MODEL_SHARE[name] * model) ** 2 + law.scatter**2)
        )
    return Evidence(tuple(laws), tuple(measured), tuple(sigmas))
