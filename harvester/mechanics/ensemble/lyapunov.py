"""Top Lyapunov exponent by Monte Carlo: trajectories of the linearised equations, scaled back to size one.

Near rest and without external noise Eq. 2 is homogeneous of degree one in (x, x', V), impacts
included, so that a trajectory may be scaled at any time without changing what it does next:

    lambda = lim ln |(x, x', V)| / t = (sum of the logs of the scales) / time

The steps are those of `harvester.mechanics.kernels.equation_of_motion` (`drift`, `kick`).  V counts where it acts on
the mass through a load; without a load V = x is a spring; without coupling the size is that of (x, x').
"""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from harvester.machine.cores import cores
from harvester.mechanics.kernels.compiled import kernel
from harvester.mechanics.kernels.equation_of_motion import drift, kick, relaxation
from harvester.mechanics.kernels.lanes import LANES
from harvester.mechanics.kernels.noise import child, draw_noise, random_words
from harvester.uncertainty.controls import controlled_mean
from harvester.uncertainty.richardson import step_bias

STEP = 0.05  # default step, in units of 1/(frequency of the linear response + rate of its noise)
MEMORIES = 6.0  # burn-in, in units of the longest memory
LONGEST = 2e4  # time units: the burn-in is never longer
MOST_STEPS = 3e10  # trajectory-steps: a minute or so
_RESCALED = 0.4  # time units, about, between two rescalings


@kernel
def grow(x, v, V, s0, s1, logs, rounds, draws, coarse, h, mu, r, beta, c1, n2, pushes=None):  # type: ignore[no-untyped-def]
    """Advance a block and rescale it after each of ``rounds``; add the logs of the scales to ``logs``.

    ``pushes``, shape (3, LANES), gets sums of mean zero: of g |x| sqrt(2 N2 h) xi over the square of the size, for
    g = x', which kicks add to the logs to first order, and g = x and V.  None: nothing of it is compiled.

    x, v, V, s0, s1: shape (LANES,), state and generator, changed in place.  A coefficient that is
    None is an absent effect.  A round has ``draws`` of two random variates, for two steps of length h each or, where
    these are ``coarse``, for one.
    """
    e, g = relaxation(h, mu)
    noise, steps = np.zeros((2, LANES)), 1 if coarse else 2
    force = 0.0 if n2 is None else math.sqrt(2.0 * n2 * h)
    for _ in range(rounds):
        for _ in range(draws):
            if n2 is not None:
                draw_noise(noise, s0, s1, coarse)
            for k in range(steps):
                for i in range(LANES):
                    x[i], vi, V[i], _hit = drift(x[i], v[i], V[i], h, e, g, mu, r)
                    if pushes is not None and n2 is not None:
                        size2 = x[i] * x[i] + vi * vi
                        if mu is not None:
                            size2 += V[i] * V[i]
                        if size2 > 0.0:
                            push = abs(x[i]) / size2 * force * noise[k, i]
                            pushes[0, i] += vi * push
                            pushes[1, i] += x[i] * push
                            if mu is not None:
                                pushes[2, i] += V[i] * push
                    v[i] = kick(x[i], vi, V[i], noise[k, i], h, None, beta, c1, None, None, None, n2, None)
        for i in range(LANES):
            size2 = x[i] * x[i] + v[i] * v[i]
            if mu is not None:
                size2 += V[i] * V[i]
            size = math.sqrt(size2)
            logs[i] += math.log(size)
            x[i] /= size
            v[i] /= size
            # Without a load V - x = 0 for good; in a shrinking motion its rounding errors would not shrink along.
            V[i] = x[i] if mu is None else V[i] / size


def memory(eqs: Equations) -> float:
    """Time after which the start is forgotten: that of the phase, and of the voltage where it acts."""
    return MEMORIES / min(0.1, eqs.mu if eqs.beta and eqs.mu else 0.1)


@dataclass(frozen=True)
class Growth:
    """A measured exponent (nondimensional), with its errors and what it took.

    ``bias`` is the size of the error of the finite step; ``samples`` holds one exponent a trajectory, ``pushed``,
    shape (n, 3), sums of mean zero beside it: the controls (`harvester.uncertainty.controls`) of ``value``.
    """

    value: float
    stderr: float
    bias: float
    h: float
    duration: float
    burn_in: float
    steps: int
    samples: Floats
    pushed: Floats


def exponent(
    eqs: Equations,
    seed: np.random.SeedSequence,
    trajectories: int = 4096,
    duration: float = 1000.0,
    h: float | None = None,
    tick: Callable[[float], None] | None = None,
) -> Growth:
    """Measure lambda over ``duration`` after a burn-in, with its bias from a run of twice the step on the same noise.

    ``trajectories`` is rounded up to whole blocks of `LANES`; each gives one sample.  The same seed,
    the same answer, whatever the number of threads.  External noise and nonlinear terms of ``eqs``
    play no part.  The burn-in is `memory`, at most `LONGEST`.  ``tick`` is called with the fraction done.

    Raises SimulationError where a trajectory stops dead (restitution 0 and no voltage that pushes the mass off), or
    would take too long.
    """
    if h is None:
        h = STEP / (math.sqrt(1.0 + (eqs.beta or 0.0)) + math.cbrt(eqs.n2 or 0.0))
    burn_in = min(memory(eqs), LONGEST)
    wanted = 1.5 * (burn_in + duration) / h * trajectories
    if wanted > MOST_STEPS:
        raise SimulationError(
            f"the exponent would take {wanted:.1e} trajectory-steps of {h:.2g}/w0, the coupling or the noise is so "
            "strong: give fewer `trajectories`"
        )
    done = (lambda fraction: None) if tick is None else tick
    run = (eqs, child(seed, 0), trajectories, burn_in, duration, h)
    fine, pushed, steps = _run(*run, False, lambda part: done(part * 2 / 3))
    coarse, coarse_pushed, coarse_steps = _run(*run, True, lambda part: done((2 + part) / 3))
    value, stderr = controlled_mean(fine, pushed)
    bias = abs(step_bias(fine, coarse, np.hstack([pushed, coarse_pushed]))[0])
    return Growth(value, stderr, bias, h, duration, burn_in, steps + coarse_steps, fine, pushed)


def _run(
    eqs: Equations,
    seed: np.random.SeedSequence,
    trajectories: int,
    burn_in: float,
    duration: float,
    h: float,
    coarse: bool,
    tick: Callable[[float], None],
) -> tuple[Floats, Floats, int]:
    """One sample of lambda a trajectory, sums of mean zero beside it, shape (n, 3), and trajectory-steps.

    ``coarse`` makes one step of 2 h of two of h.
    """
    blocks = -(-trajectories // LANES)
    draws = max(1, round(0.5 * _RESCALED / h))
    time = 2 * draws * h  # of a round
    before, after = math.ceil(burn_in / time), math.ceil(duration / time)
    words = np.stack([random_words(child(seed, 0, k), LANES) for k in range(blocks)])
    phase = np.random.default_rng(child(seed, 1)).uniform(-0.5 * math.pi, 0.5 * math.pi, (blocks, LANES))
    state = np.stack([np.cos(phase), np.sin(phase), np.zeros_like(phase)], axis=1)
    mu = eqs.mu if eqs.beta else None
    if mu is None:
        state[:, 2] = state[:, 0]
    logs, pushes = np.zeros((blocks, LANES)), np.zeros((blocks, 3, LANES))

    def block(k: int) -> None:
        step = 2.0 * h if coarse else h
        arguments = (draws, coarse, step, mu, eqs.restitution, eqs.beta, eqs.c1, eqs.n2)
        grow(*state[k], *words[k], logs[k], before, *arguments, pushes[k])  # type: ignore[call-arg]
        logs[k], pushes[k] = 0.0, 0.0
        grow(*state[k], *words[k], logs[k], after, *arguments, pushes[k])  # type: ignore[call-arg]

    with ThreadPoolExecutor(cores()) as pool:
        for done, _ in enumerate(pool.map(block, range(blocks)), 1):
            tick(done / blocks)
    if not np.isfinite(logs).all():
        raise SimulationError(
            "a trajectory of the linearised motion stops dead: lambda is minus infinity; give a restitution above 0"
        )
    steps_a_round = draws if coarse else 2 * draws
    made = steps_a_round * (before + after) * blocks * LANES
    return logs.ravel() / (after * time), np.moveaxis(pushes, 1, 2).reshape(-1, 3) / (after * time), made
