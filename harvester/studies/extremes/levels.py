"""The levels that the largest values of a device stay below over a lifetime: by Rice's formula, or counted.

Rice's formula (`harvester.linear.level_crossings`) holds if the response is Gaussian: linear
equations under white noise of the base.  Elsewhere the largest values of blocks of a long
trajectory are counted (`harvester.studies.extremes.counted`) and extrapolated to the largest value
over a long time (`Tail`, `RareTail`).
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.engines.exact import Exact
from harvester.engines.protocol import needs_resistance
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError
from harvester.studies.extremes.counted import BLOCKS, Counted, count
from harvester.uncertainty.value import Value, stderr_of95

RESAMPLED = 400
FEW = 60  # blocks with an impact, at least
SHAPE = 0.2  # of the size, for each e-fold beyond what was counted


@dataclass(frozen=True)
class RareTail:
    """The largest value over a long time of a quantity that many blocks lack, such as the speed of rare impacts.

    Clusters of impacts beyond a threshold are a Poisson process of ``rate`` in a block, and the
    squares of their speeds exceed it by an exponential variate of the mean ``size``, as energies
    beyond a high level of a narrow-band response do.  The largest square in n blocks has the
    distribution

        P(threshold + y) = exp(-n rate exp(-y/size)),   y >= 0,

    so that a block without an impact counts for the rate, not for the speeds.  Shapes as in `Tail`.
    """

    threshold: float
    rate: Floats
    size: Floats
    counted: int

    def largest(self, share: float, blocks: float) -> Value:
        """The level that ``blocks`` blocks stay below with the probability ``share``, with its errors.

        Beyond the energies that were counted the law may have another shape: for each further
        e-fold `SHAPE` of the size is the model error.
        """
        folds = np.maximum(np.log(self.rate * blocks / -math.log(share)), 0.0)
        levels = np.sqrt(self.threshold + self.size * folds)
        low, high = np.quantile(levels[1:], [0.025, 0.975])
        square_error = (
            max(float(folds[0]) - math.log(self.counted), 0.0) * SHAPE * float(self.size[0])
        )
        return Value(
            float(levels[0]),
            stderr=stderr_of95(0.5 * float(high - low)),
            model=0.5 * square_error / float(levels[0]),
        )


def rare(maxima: Floats, seed: int = 0) -> RareTail | None:
    """The tail of blocks of which many have 0, by maximum likelihood.

    None if fewer than `FEW` have another.

    The threshold is the median without zeros.  For a size the likeliest rate is (blocks beyond the
    threshold)/(sum of exp(-y/size) over all), with y = 0 below it.
    """
    from scipy.optimize import minimize_scalar

    squares = maxima**2
    if np.count_nonzero(squares) < FEW:
        return None
    threshold = float(np.median(squares[squares > 0.0]))
    rng = np.random.default_rng(seed)
    count = len(maxima)
    fits = []
    for drawn in (np.arange(count), *rng.integers(0, count, (RESAMPLED // 4, count))):
        y = np.maximum(squares[drawn] - threshold, 0.0)
        hit = int(np.count_nonzero(y))
        total = float(y.sum())
        if not hit:
            continue

        def misfit(log_size: float, y: Floats = y, hit: int = hit, total: float = total) -> float:
            size = math.exp(log_size)
            return float(hit * (log_size + math.log(np.exp(-y / size).sum())) + total / size)

        mean = math.log(total / hit)
        size = math.exp(float(minimize_scalar(misfit, (mean - 0.3, mean)).x))
        fits.append((hit / np.exp(-y / size).sum(), size))
    rates, sizes = np.array(fits).T
    return RareTail(threshold, rates, sizes, int(np.count_nonzero(squares > threshold)))


@dataclass(frozen=True)
class Tail:
    """The largest value over a long time, extrapolated from the largest values of many short blocks.

    The largest of a block of length B has the generalised extreme value distribution

        G(y) = exp(-(1 - k (y - m)/s)^(1/k)),

    fitted by L-moments (Hosking, Wallis and Wood, Technometrics 27, 1985); the largest of a time T
    = n B stays below y with the probability G(y)^n.  Squares are fitted, y = a^2: for a narrow-band
    response they are energies, whose largest values come to such a distribution soonest.  Blocks
    that are drawn anew give the sampling error: the parameters have the shape (draws,), of which
    the first is of all blocks, the others of redraws.
    """

    location: Floats
    scale: Floats
    shape: Floats

    def largest(self, share: float, blocks: float) -> Value:
        """The level that ``blocks`` blocks stay below with the probability ``share``, with its sampling error."""
        x = -math.log(share) / blocks
        k = np.where(np.abs(self.shape) < 1e-9, 1e-9, self.shape)
        squares = self.location - self.scale / k * np.expm1(k * math.log(x))
        levels = np.sqrt(np.maximum(squares, 0.0))
        low, high = np.quantile(levels[1:], [0.025, 0.975])
        return Value(float(levels[0]), stderr=stderr_of95(0.5 * float(high - low)))


def fit(maxima: Floats, seed: int = 0) -> Tail:
    """The tail of blocks whose largest values are ``maxima``, shape (blocks,)."""
    rng = np.random.default_rng(seed)
    count = len(maxima)
    y = np.sort(
        np.vstack([maxima, maxima[rng.integers(0, count, (RESAMPLED, count))]]) ** 2, axis=1
    )
    rank = np.arange(count)
    b0 = y.mean(axis=1)
    b1 = (y * rank / (count - 1)).mean(axis=1)
    b2 = (y * rank * (rank - 1) / ((count - 1) * (count - 2))).mean(axis=1)
    l2 = 2.0 * b1 - b0
    skewness = (6.0 * b2 - 6.0 * b1 + b0) / (2.0 * b1 - b0)
    c = 2.0 / (3.0 + skewness) - math.log(2.0) / math.log(3.0)
    k = 7.8590 * c + 2.9554 * c * c
    k = np.where(np.abs(k) < 1e-6, 1e-6, k)
    gamma = np.array([math.gamma(1.0 + shape) for shape in k])
    scale = l2 * k / ((1.0 - 2.0**-k) * gamma)
    return Tail(b0 - scale * (1.0 - gamma) / k, scale, k)


SHARES = (0.5, 0.95)  # of devices, whose largest value in a lifetime is below the level
STRAIN = "peak_strain"  # of the piezo, where the scene has its piezo.strain_per_displacement
SPEED, RATE = "peak_impact_speed", "impact_rate"  # of a scene with a stop
SELDOM = 0.02  # share of blocks without an impact, from which on impacts are rare
LEAST_TIMES = 1.0  # of a block: a lifetime that is shorter has no tail


def check_served(problem: Problem) -> None:
    """Raise CannotServeError for a problem that has no largest values over a lifetime: a netlist, other excitation."""
    if reason := needs_resistance(problem, "ensemble"):
        raise CannotServeError(f"`lifetime` is for a load resistance or none: {reason}")
    if not problem.equations.is_shaken_by_white_noise:
        raise CannotServeError(
            "`lifetime` must be used with white noise alone, but the scene has other excitation, or no noise"
        )


def rice_holds(problem: Problem) -> bool:
    """Whether a supported problem is linear, so that its response is Gaussian."""
    return not Exact.refusal(problem) and problem.equations.n2 is None


def is_sinusoidal(problem: Problem) -> bool:
    """Whether displacement and voltage are sinusoids of constant amplitude: linear, harmonic excitation alone."""
    return (
        problem.equations.drive is not None and problem.equations.is_steady and rice_holds(problem)
    )


def strain_factor(problem: Problem) -> float | None:
    """The largest strain of the piezo over the displacement, in 1/m.

    None if the scene does not have it.
    """
    return None if problem.scene.piezo is None else problem.scene.piezo.strain_per_displacement


def linear_peaks(problem: Problem, lifetime: float, share: float = SHARES[-1]) -> dict[str, Value]:
    """The levels that |displacement| and |voltage| in a linear scene stay below over a lifetime with a probability.

    And the piezo's strain if the scene has its piezo.strain_per_displacement.  In the scene's
    units; the error is the distance to the levels at which every passage counts alone
    (`harvester.linear.level_crossings`). Under a sinusoid alone they are the amplitudes, whatever
    the lifetime.

    Raises SimulationError if no stationary response exists.
    """
    from harvester.linear.level_crossings import peaks
    from harvester.linear.transfer import amplitudes

    eqs, units = problem.equations, problem.units
    scales = {"peak_displacement": units.length, "peak_voltage": units.volts}
    if is_sinusoidal(problem):
        assert eqs.drive is not None and eqs.drive_frequency is not None, "it is driven"
        sizes = abs(eqs.drive) * np.abs(amplitudes(eqs, eqs.drive_frequency))
        levels = [Value(float(size), model=0.0) for size in sizes]
    else:
        span = lifetime * units.frequency
        ends = [(peak.largest(share, span), peak.bound(share, span)) for peak in peaks(eqs)]
        levels = [Value(low, model=max(high - low, 0.0)) for low, high in ends]
    by_name = {
        name: level.scaled(factor)
        for (name, factor), level in zip(scales.items(), levels, strict=True)
    }
    if (strain := strain_factor(problem)) is not None:
        by_name[STRAIN] = by_name["peak_displacement"].scaled(strain)
    return by_name


@dataclass(frozen=True)
class CountedLevels:
    """Levels of each quantity for each of `SHARES`, and the impacts a second (None without a stop), in scene's units.

    ``path`` is the counted trajectory, and ``blocks`` how many blocks of it a lifetime has.
    """

    levels: dict[str, dict[float, Value]]
    rate: Value | None
    path: Counted
    blocks: float


def counted_levels(
    problem: Problem, lifetime: float, seed: int = 0, blocks: int = BLOCKS
) -> CountedLevels:
    """The levels over a lifetime (seconds, or 1/w0) extrapolated from ``blocks`` blocks of a trajectory.

    A quantity that stays 0 on the trajectory, such as the voltage without coupling, has none, nor
    has the speed of impacts that too few blocks have.

    Raises InputError for a lifetime that is shorter than the memory of the motion, and
    SimulationError if the trajectory has no stationary response.
    """
    units = problem.units
    path = count(problem.equations, seed, blocks)
    n_blocks = lifetime * units.frequency / path.block
    if n_blocks < LEAST_TIMES:
        raise InputError(
            f"`lifetime` must be at least {path.block / units.frequency:.3g}, which the motion needs to forget "
            f"itself, but is {lifetime:.3g}"
        )
    named = {"peak_displacement": (path.x, units.length), "peak_voltage": (path.V, units.volts)}
    if path.speed is not None:
        named[SPEED] = path.speed, units.length * units.frequency
    levels: dict[str, dict[float, Value]] = {}
    for name, (maxima, scale) in named.items():
        tail = rare(maxima, seed) if (maxima == 0.0).mean() > SELDOM else fit(maxima, seed)
        if tail is not None:
            levels[name] = {p: tail.largest(p, n_blocks).scaled(scale) for p in SHARES}
    if (strain := strain_factor(problem)) is not None and "peak_displacement" in levels:
        levels[STRAIN] = {
            p: level.scaled(strain) for p, level in levels["peak_displacement"].items()
        }
    rate = None if path.impacts is None else path.impacts.scaled(units.frequency)
    return CountedLevels(levels, rate, path, n_blocks)


def limited_peaks(
    problem: Problem, lifetime: float, seed: int = 0, blocks: int = BLOCKS
) -> dict[str, Value]:
    """The limited quantities of one device: the level of each quantity that 95 % stay below, and the mean impact rate.

    Raises as `counted_levels`.
    """
    if rice_holds(problem):
        return linear_peaks(problem, lifetime)
    counted = counted_levels(problem, lifetime, seed, blocks)
    peaks = {name: by_share[SHARES[-1]] for name, by_share in counted.levels.items()}
    return peaks if counted.rate is None else {**peaks, RATE: counted.rate}
