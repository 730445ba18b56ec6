"""Top Lyapunov exponent by Monte Carlo: trajectories of the linearised equations, scaled back to size one.

Near rest and without external noise Eq. 2 is homogeneous of degree one in (x, x', V), impacts
included, so that a trajectory may be scaled at any time without changing its course:

    lambda = lim ln |(x, x', V)| / t = (sum of the logs of the scales) / time

The steps are those of `harvester.mechanics.kernels.equation_of_motion` (`drift`, `kick`).  V counts
if it acts on the mass through a load; without a load V = x is a spring; without coupling the
size is that of (x, x').
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from harvester.machine.threads import in_threads
from harvester.mechanics.kernels.coefficients import BATCH, Coefficients, State
from harvester.mechanics.kernels.compiled import forced, kernel
from harvester.mechanics.kernels.equation_of_motion import drift, kick
from harvester.mechanics.kernels.intervals import interval
from harvester.mechanics.kernels.noise import child, draw_noise, random_words
from harvester.mechanics.kernels.trajectory_batch import Batch
from harvester.uncertainty.controls import controlled_mean
from harvester.uncertainty.richardson import step_bias

STEP = 0.05  # default step, in units of 1/(frequency of the linear response + rate of its noise)
MEMORIES = 6.0  # burn-in, in units of the longest memory
LONGEST = 2e4  # time units: the burn-in is never longer
MOST_STEPS = 3e10  # trajectory-steps: a minute or so
_RESCALED = 0.4  # time units, about, between two rescalings


@kernel
def grow(b, logs, pushes, rounds, draws, coarse, h, c):  # type: ignore[no-untyped-def]
    """Advance a batch and rescale it after each of ``rounds``.

    Add the logs of the scales to ``logs``.

    b, h and c are as of `harvester.mechanics.kernels.trajectory_batch.advance`.  ``pushes``, shape
    (3, BATCH), gets sums of mean zero, of g |x| sqrt(2 N2 h) xi over the square of the size, for g
    = x', which kicks add to the logs to first order, and g = x and V.  A round has ``draws`` of two
    random variates, for two steps each or, if these are ``coarse``, for one.
    """
    x = b.state[0]
    v = b.state[1]
    V = b.state[2]
    d = interval(h, h, c.mu)
    noise = np.zeros((2, BATCH))
    steps = 1 if coarse else 2
    force = 0.0 if c.n2 is None else math.sqrt(2.0 * c.n2 * h)
    for _ in range(rounds):
        for _ in range(draws):
            if c.n2 is not None:
                draw_noise(noise, b.s0, b.s1, coarse)
            for k in range(steps):
                for i in range(BATCH):
                    s, _hit = drift(State(x[i], v[i], V[i]), d, c.mu, c.r)
                    x[i], V[i] = s.x, s.V
                    size2 = _square(s, c)
                    if c.n2 is not None and size2 > 0.0:
                        push = abs(s.x) / size2 * force * noise[k, i]
                        pushes[0, i] += s.v * push
                        pushes[1, i] += s.x * push
                        if c.mu is not None:
                            pushes[2, i] += s.V * push
                    v[i] = kick(s, noise[k, i], h, c)
        for i in range(BATCH):
            size = math.sqrt(_square(State(x[i], v[i], V[i]), c))
            logs[i] += math.log(size)
            x[i] /= size
            v[i] /= size
            # Without a load V - x = 0 for good; in a shrinking motion its rounding errors would not
            # shrink along.
            V[i] = x[i] if c.mu is None else V[i] / size


@forced
def _square(s, c):  # type: ignore[no-untyped-def]
    """The square of the size, of (x, x', V), or of (x, x') if the voltage does not act through a load."""
    square = s.x * s.x + s.v * s.v
    if c.mu is not None:
        square += s.V * s.V
    return square


def memory(eqs: Equations) -> float:
    """Time after which the start is forgotten: that of the phase, and of the voltage if it acts."""
    return MEMORIES / min(0.1, eqs.mu if eqs.beta and eqs.mu else 0.1)


@dataclass(frozen=True)
class Growth:
    """A measured exponent (nondimensional), with its errors and its cost.

    ``bias`` is the size of the time-step error; ``samples`` holds one exponent a
    trajectory, ``pushed``, shape (n, 3), sums of mean zero next to it: the controls
    (`harvester.uncertainty.control_variate`) of ``value``.
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
    progress: Callable[[float], None] | None = None,
) -> Growth:
    """Measure lambda over ``duration`` after a burn-in, with its bias from a run of twice the step on the same noise.

    ``trajectories`` is rounded up to whole blocks of `BATCH`; each gives one sample.  The same seed,
    the same answer, whatever the number of threads.  External noise and nonlinear terms of ``eqs``
    play no part.  The burn-in is `memory`, at most `LONGEST`.  ``progress`` is called with the fraction done.

    Raises SimulationError if a trajectory stops dead (restitution 0 and no voltage that pushes the
    mass off), or would last too long.
    """
    if h is None:
        h = STEP / (math.sqrt(1.0 + (eqs.beta or 0.0)) + math.cbrt(eqs.n2 or 0.0))
    burn_in = min(memory(eqs), LONGEST)
    needed = 1.5 * (burn_in + duration) / h * trajectories
    if needed > MOST_STEPS:
        raise SimulationError(
            f"the exponent would need {needed:.1e} trajectory-steps of {h:.2g}/w0, the coupling or the noise is so "
            "strong: give fewer `trajectories`"
        )
    done = (lambda fraction: None) if progress is None else progress
    run = partial(
        _run,
        eqs,
        child(seed, 0),
        trajectories=trajectories,
        burn_in=burn_in,
        duration=duration,
        h=h,
    )
    fine, pushed, steps = run(coarse=False, progress=lambda part: done(part * 2 / 3))
    coarse, coarse_pushed, coarse_steps = run(
        coarse=True, progress=lambda part: done((2 + part) / 3)
    )
    value, stderr = controlled_mean(fine, pushed)
    bias = abs(step_bias([fine, coarse], controls=np.hstack([pushed, coarse_pushed]))[0])
    return Growth(
        value=value,
        stderr=stderr,
        bias=bias,
        h=h,
        duration=duration,
        burn_in=burn_in,
        steps=steps + coarse_steps,
        samples=fine,
        pushed=pushed,
    )


def _run(
    eqs: Equations,
    seed: np.random.SeedSequence,
    trajectories: int,
    burn_in: float,
    duration: float,
    h: float,
    coarse: bool,
    progress: Callable[[float], None],
) -> tuple[Floats, Floats, int]:
    """One sample of lambda per trajectory, sums of mean zero next to it, shape (n, 3), and trajectory-steps.

    ``coarse`` makes one step of 2 h of two of h.
    """
    blocks = -(-trajectories // BATCH)
    draws = max(1, round(0.5 * _RESCALED / h))
    time = 2 * draws * h  # of a round
    before, after = math.ceil(burn_in / time), math.ceil(duration / time)
    words = np.stack([random_words(child(seed, 0, k), BATCH) for k in range(blocks)])
    phase = np.random.default_rng(child(seed, 1)).uniform(
        -0.5 * math.pi, 0.5 * math.pi, (blocks, BATCH)
    )
    state = np.stack([np.cos(phase), np.sin(phase), np.zeros_like(phase)], axis=1)
    mu = eqs.mu if eqs.beta else None
    if mu is None:
        state[:, 2] = state[:, 0]
    logs = np.zeros((blocks, BATCH))
    pushes = np.zeros((blocks, 3, BATCH))

    step = 2.0 * h if coarse else h
    c = Coefficients(mu=mu, beta=eqs.beta, c1=eqs.c1, n2=eqs.n2, r=eqs.restitution)

    def block(k: int) -> None:
        batch = Batch(state[k], *words[k])
        grow(batch, logs[k], pushes[k], before, draws=draws, coarse=coarse, h=step, c=c)
        logs[k], pushes[k] = 0.0, 0.0
        grow(batch, logs[k], pushes[k], after, draws=draws, coarse=coarse, h=step, c=c)

    with in_threads(block, range(blocks)) as ended:
        for done, _ in enumerate(ended, 1):
            progress(done / blocks)
    if not np.isfinite(logs).all():
        raise SimulationError(
            "a trajectory of the linearised motion stops dead: lambda is minus infinity; give a restitution above 0"
        )
    made = (draws if coarse else 2 * draws) * (before + after) * blocks * BATCH
    return (
        logs.ravel() / (after * time),
        np.moveaxis(pushes, 1, 2).reshape(-1, 3) / (after * time),
        made,
    )
