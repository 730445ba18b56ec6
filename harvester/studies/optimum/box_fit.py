"""A box of points with a polynomial through their powers: the fit, its peak, and the next box."""

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import note
from harvester.studies.optimum.evaluations import Evaluation, served
from harvester.studies.optimum.response_surface import CUBIC, SEEN, Fit
from harvester.studies.optimum.search_result import Peak
from harvester.studies.tolerance.surface import exponents
from harvester.uncertainty.value import Value

DROP = 0.1  # of the power, between the middle of a box and its faces
ROUNDING = 1e-9  # relative noise of a power that has no other


def fit_box(
    rounds: list[list[Evaluation]], u: Floats, width: Floats, degree: int = CUBIC
) -> tuple[Fit, Floats]:
    """Fit a polynomial to the means of several rounds of one design in a box.

    Also the time-step bias at each point.

    The box has its middle at ``u`` and half-widths ``width``.  Points that are not sound are left
    out if there are enough others.  Raises SimulationError if too many points fail.
    """
    good = _usable(rounds, len(exponents(len(u), CUBIC)))
    kept = [[points[k] for k in good] for points in rounds]
    power = np.mean([served(points)[1] for points in kept], axis=0)
    bias = np.mean([[value.bias or 0.0 for value in served(points)[2]] for points in kept], axis=0)
    covariance = np.sum([_covariance(points) for points in kept], axis=0) / len(rounds) ** 2
    covariance = covariance + (ROUNDING * power.mean()) ** 2 * np.eye(len(good))
    low = np.maximum(u - width, 0.0)
    high = np.minimum(u + width, 1.0)
    x = (np.array([p.u for p in kept[0]]) - u) / width
    walls = np.array([low <= 0.0, high >= 1.0])
    return Fit(
        x=x,
        power=power,
        covariance=covariance,
        low=(low - u) / width,
        high=(high - u) / width,
        walls=walls,
        degree=degree,
    ), bias


def peak_of_box(fit: Fit, bias: Floats, u: Floats, width: Floats) -> Peak:
    """The highest place of a fit as a peak, with the interval that sampling and the time-step bias leave."""
    best = np.clip(u + width * fit.best, 0.0, 1.0)
    power = Value(*fit.value(fit.best))
    faces = np.where(best <= 0.0, -1.0, np.where(best >= 1.0, 1.0, 0.0))
    if fit.exits.any() or fit.resolution < SEEN:
        return Peak(best, power, faces, width=width, why=note("curvature_in_noise"))
    half = width * (fit.half_widths + fit.bias_shift(bias))
    return Peak(
        best, power, faces, np.clip(best - half, 0.0, 1.0), np.clip(best + half, 0.0, 1.0), width
    )


def next_box(fit: Fit, u: Floats, width: Floats) -> tuple[Floats, Floats, bool]:
    """The middle and half-widths of the box to fit after this one, and whether it is good enough to stop there.

    A box moves towards a peak outside it, shrinks if its polynomial does not fit, grows if
    the curvature drowns in the noise, and ends at the size at which the power falls by `DROP` from
    its middle to its faces.
    """
    middle = np.clip(u + width * fit.best, 0.0, 1.0)
    doubtful = fit.on_face & ~fit.surely_on_face
    if fit.exits.any():
        return middle, np.minimum((1.0 if fit.resolution > SEEN else 1.5) * width, 0.5), False
    if fit.resolution < SEEN and fit.misfit_dominates:
        best = np.clip(u + width * fit.x[int(np.argmax(fit.power))], 0.0, 1.0)
        return best, np.where(fit.surely_on_face, 1.0, 0.5) * width, False
    if fit.resolution < SEEN or (doubtful.any() and not fit.walls.all()):
        if fit.walls.all():
            return u, width, True
        grown = np.minimum(2.0 * width, 0.5)
        width = grown if fit.resolution < SEEN else np.where(doubtful, grown, width)
        return np.where(width >= 0.5, 0.5, middle), width, False
    size = np.minimum(np.clip(_fitting_widths(fit, width), 0.25 * width, 4.0 * width), 0.5)
    return middle, size, bool(np.all((size < 1.5 * width) & (width < 1.5 * size)))


def _fitting_widths(fit: Fit, width: Floats) -> Floats:
    """The half-widths at which the power falls by `DROP`.

    For keys at the end of their range the present ones.
    """
    curvature = -np.diag(fit.hessian)
    fitting = np.sqrt(2.0 * DROP * abs(fit.value(fit.best)[0]) / np.maximum(curvature, 1e-300))
    return np.where((fit.faces != 0.0) | (curvature <= 0.0), width, width * fitting)


def _usable(rounds: list[list[Evaluation]], least: int) -> list[int]:
    """Which points of the design have an answer in every round: more than ``least``, the sound ones if they are."""
    columns = [*enumerate(zip(*rounds, strict=True))]
    sound = [k for k, some in columns if all(point.is_sound for point in some)]
    good = (
        sound
        if len(sound) > least
        else [k for k, some in columns if all(point.power is not None for point in some)]
    )
    if len(good) <= least:
        failed = next(point.answer for some in rounds for point in some if point.power is None)
        raise SimulationError(
            f"too few points near the optimum have an answer; the last that failed: {failed}"
        )
    return good


def _covariance(points: list[Evaluation]) -> Floats:
    """The covariance of the powers of a design, shape (m, m): from the trajectories if they share their noise."""
    answers = [p.answer for p in points if isinstance(p.answer, Estimate)]
    known = [s for s in [a.power_samples for a in answers] if s is not None]
    if (
        len(known) == len(points)
        and len({p.seed for p in points}) == len({len(s) for s in known}) == 1
    ):
        return np.asarray(np.cov(np.array(known)) / len(known[0]))
    return np.diag([(a.mean_power.stderr or 0.0) ** 2 for a in answers])
