"""The limited peaks of many devices: some by Rice's formula or counted, all others by a polynomial through them.

A counted level has a sampling error of ten to thirty per cent, from a trajectory with noise of its
own. Least squares of the logarithms of n levels, s being their scatter about the polynomial and
h(x) the leverage of keys' values x, know the level there at 95 % within

    1.96 s sqrt(h(x)),

which is far less: the mean of h is the number of coefficients over n.  A level by Rice's formula
has no noise: the error of leaving a sample out counts in full there, and the formula's own
error.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.scene.scene import Scene
from harvester.studies.extremes.levels import limited_peaks, rice_holds
from harvester.studies.tolerance.surface import Polynomial, fit
from harvester.uncertainty.value import Value, half95

BY_RICE = 256  # devices that are computed where a formula does it
COUNTED = 24  # for each key and one more, where a path is counted
BLOCKS = 512  # of each of these paths


@dataclass(frozen=True)
class PeakSurfaces:
    """The peaks over a lifetime at keys' values: polynomials of their logarithms.

    ``known`` are the relative errors at 95 % of levels by Rice's formula; it is None if levels were
    counted.
    """

    surfaces: dict[str, Polynomial]
    known: dict[str, float] | None

    def __call__(self, x: Floats) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """The level of each quantity and its relative error at 95 %, at keys' values (m, keys): each of shape (m,)."""
        levels = {name: np.exp(surface(x)) for name, surface in self.surfaces.items()}
        if self.known is not None:
            return levels, {name: np.full(len(x), error) for name, error in self.known.items()}
        off = {
            name: np.expm1(half95(s.scatter) * np.sqrt(s.leverage(x)))
            for name, s in self.surfaces.items()
        }
        return levels, off


def devices_needed(problem: Problem, keys: int) -> int:
    """How many devices are to be computed for surfaces over so many keys."""
    return BY_RICE if rice_holds(problem) else COUNTED * (keys + 1)


def peak_surfaces(
    scenes: Sequence[Scene],
    x: Floats,
    inner: int,
    lifetime: float,
    seed: int = 0,
    report: Callable[[int], None] = lambda done: None,
) -> PeakSurfaces:
    """The surfaces through the peaks of ``scenes`` at keys' values ``x``, shape (n, keys).

    The first ``inner`` of them are samples, the others hold the outer ends; ``report`` is called
    with the number done.

    Raises HarvesterError if a scene has no peaks.
    """
    by_rice = rice_holds(Problem(scenes[0]))
    devices: list[dict[str, Value]] = []
    for k, scene in enumerate(scenes):
        path_seed = int(np.random.SeedSequence([seed, k]).generate_state(1)[0])
        devices.append(limited_peaks(Problem(scene), lifetime, path_seed, BLOCKS))
        report(k + 1)
    surfaces, known = {}, {}
    for name in devices[0]:
        levels = np.array([device[name].value if name in device else 0.0 for device in devices])
        if levels.min() <= 0.0:
            raise SimulationError(
                f"{name} is 0 on the trajectory of {int((levels <= 0.0).sum())} of {len(levels)} devices: there is "
                "nothing to extrapolate"
            )
        surface = surfaces[name] = fit(x, np.log(levels), inner)
        known[name] = 2.0 * surface.scatter + float(
            np.median([device[name].known_error95 / device[name].value for device in devices])
        )
    return PeakSurfaces(surfaces, known if by_rice else None)
