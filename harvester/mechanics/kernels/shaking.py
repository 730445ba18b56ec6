"""Excitation that is not a white noise: the acceleration a that every kick adds to the other forces.

    harmonic     a = F cos(Omega t)
    coloured     tau a' = -a + sqrt(2 D) white noise                      (Ornstein and Uhlenbeck)
    band-pass    a' = -B a - W b + B sqrt(2 D) white noise,   b' = W a    (a resonator of frequency W)
    record       a from a file, repeated for ever (`harvester.records.records`), or drawn from a density at random
    phases

The first three are a linear filter of two states, a = p, whose step is exact in law:

    (p, q)  <-  A (p, q) + L (xi1, xi2)     with variates of mean 0 and variance 1

A kick takes a at its own time, so that the scheme stays of second order.  Coloured noise is less
smooth: for correlation times below the step its samples would carry too much power to low
frequencies.  Their variance is therefore (2 D/h) tanh(h/(2 tau)) in place of D/tau, which makes the
spectrum at frequency 0 exact for every tau and h; as tau -> 0 the kicks become those of white noise
of intensity D, as h -> 0 the samples those of the process.
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats, Words
from harvester.equations.bounds import linear_growth
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import forced
from harvester.mechanics.kernels.noise import shuffle, two_variates
from harvester.records.records import Record


def _noise_filter(eqs: Equations, h: float) -> tuple[Floats, Floats]:
    """Matrix A of a step h of the band-pass, and L with L L^T = S - A S A^T, S = B D times the unit matrix."""
    from scipy.linalg import expm

    assert eqs.coloured is not None and eqs.bandwidth is not None and eqs.centre is not None
    step = expm(h * np.array([[-eqs.bandwidth, -eqs.centre], [eqs.centre, 0.0]]))
    (q11, q12), (_, q22) = eqs.bandwidth * eqs.coloured * (np.eye(2) - step @ step.T)
    l11 = math.sqrt(max(q11, 0.0))
    l21 = q12 / l11 if l11 > 0.0 else 0.0
    return step, np.array([[l11, 0.0], [l21, math.sqrt(max(q22 - l21 * l21, 0.0))]])


def deviation(eqs: Equations, h: float) -> float:
    """Standard deviation of the samples of coloured or band-pass noise at a step h."""
    assert eqs.coloured is not None
    if eqs.correlation_time is None:
        assert eqs.bandwidth is not None
        return math.sqrt(eqs.bandwidth * eqs.coloured)
    return math.sqrt(2.0 * eqs.coloured / h * math.tanh(0.5 * h / eqs.correlation_time))


def samples_of(eqs: Equations, h: float, rng: np.random.Generator) -> Floats | None:
    """Accelerations of a record, or of one drawn from a density, at all steps h of a period.

    None without.
    """
    if eqs.density is not None:
        return drawn_record(eqs, h, rng).values
    return None if eqs.record is None else eqs.record.at_even_times(round(eqs.record.period / h))


def drawn_record(eqs: Equations, h: float, rng: np.random.Generator) -> Record:
    """A record of that density, long enough for the resonance, whose bandwidth is minus its eigenvalue's real part."""
    assert eqs.density is not None
    growth = linear_growth(eqs)
    return eqs.density.record(h, rng, math.inf if growth is None or growth >= 0.0 else -growth)


class Tone(NamedTuple):
    """A sinusoid with coloured noise: cosine and sine of its angle in a step, and its states (p, q)."""

    c: float
    s: float
    p: Floats | None = None
    q: Floats | None = None


class Filter(NamedTuple):
    """An excitation other than white noise, of trajectories side by side: two linear filters of a state (p, q) each.

    p and q are arrays of one state a trajectory, s0 and s1 the words of their random generators;
    None in a filter of one trajectory.  With a record nothing is filtered: p is the present one of
    its ``samples``, and q its index.  ``gain`` is the acceleration over p, if it is not 1, and
    ``tone`` a sinusoid that is added to coloured noise.
    """

    a11: float
    a12: float | None = None
    a21: float | None = None
    a22: float | None = None
    l11: float | None = None
    l21: float | None = None
    l22: float | None = None
    gain: float | None = None
    samples: Floats | None = None
    p: Floats | None = None
    q: Floats | None = None
    s0: Words | None = None
    s1: Words | None = None
    tone: Tone | None = None


def filter_of(eqs: Equations, h: float, coarse: bool = False) -> Filter:
    """The filter of an excitation other than white noise, each coefficient None if absent.

    ``coarse``: it makes two steps of h/2 in each step, on the noise of both, so that the
    trajectories of a Richardson pair are shaken alike.
    """
    whole = h
    h = 0.5 * h if coarse else h
    tone = None
    if eqs.drive is not None:
        assert eqs.drive_frequency is not None
        tone = Tone(math.cos(eqs.drive_frequency * h), math.sin(eqs.drive_frequency * h))
    if eqs.coloured is None:
        return Filter(0.0) if tone is None else Filter(tone.c, -tone.s, tone.s, tone.c)
    if eqs.correlation_time is not None:
        fading = h / eqs.correlation_time
        spread = deviation(eqs, h)
        gain = deviation(eqs, whole) / spread  # 1, unless coarse
        return Filter(
            math.exp(-fading),
            l11=spread * math.sqrt(-math.expm1(-2.0 * fading)),
            gain=gain,
            tone=tone,
        )
    a, lower = _noise_filter(eqs, h)
    (a11, a12, a21, a22), (l11, _, l21, l22) = a.ravel().tolist(), lower.ravel().tolist()
    return Filter(a11, a12, a21, a22, l11=l11, l21=l21, l22=l22, tone=tone)


def filter_start(
    eqs: Equations,
    h: float,
    trajectories: int,
    rng: np.random.Generator,
    samples: Floats | None = None,
) -> Floats:
    """The filter's first states (p, q), shape (2, trajectories): random in phase or place, or by the noise's law.

    Those of a sinusoid with coloured noise come after the noise's, in two further rows. In a
    record of a density the places are evenly apart from a random one on, so that together they soon
    see all of it.
    """
    if samples is not None:
        indices = rng.integers(0, len(samples), trajectories)
        if eqs.density is not None:
            indices = (indices[0] + len(samples) * np.arange(trajectories) // trajectories) % len(
                samples
            )
        return np.array([samples[indices], indices])
    states = np.empty((0, trajectories))
    if eqs.coloured is not None:
        states = deviation(eqs, h) * rng.standard_normal((2, trajectories))
    if eqs.drive is not None:
        phase = rng.uniform(0.0, 2.0 * math.pi, trajectories)
        states = np.concatenate([states, eqs.drive * np.array([np.cos(phase), np.sin(phase)])])
    return states


def rows_of(eqs: Equations) -> int:
    """How many rows the states of `filter_start` have."""
    return 4 if eqs.drive is not None and eqs.coloured is not None else 2


def of_batch(known: Filter, states: Floats, words: Words, samples: Floats | None) -> Filter:
    """A filter with the states of `filter_start` and the random words of a batch, both shared with the caller."""
    tone = None if known.tone is None else known.tone._replace(p=states[2], q=states[3])
    return known._replace(
        p=states[0], q=states[1], s0=words[0], s1=words[1], samples=samples, tone=tone
    )


@forced
def last_acceleration(i, shaker):
    """The acceleration of trajectory i at its last kick; None without a shaker."""
    if shaker is None:
        return None
    a = shaker.p[i]
    if shaker.gain is not None:
        a = shaker.gain * a
    if shaker.tone is not None:
        a += shaker.tone.p[i]
    return a


@forced
def shake(accelerations, coarse, shaker):
    """Advance the filters of all trajectories by a step: the accelerations' means over its drift, and at its kick.

    ``accelerations`` has shape (2, trajectories).
    """
    count = len(shaker.p)
    for i in range(count):
        accelerations[0, i] = last_acceleration(i, shaker)
    if coarse:
        for i in range(count):
            _step_of_filter(i, shaker)
    for i in range(count):
        _step_of_filter(i, shaker)
        before = accelerations[0, i]
        after = last_acceleration(i, shaker)
        accelerations[0, i] = 0.5 * (before + after)
        accelerations[1, i] = after


@forced
def shaken(i, accelerations, shaker):
    """The two accelerations of trajectory i, made by `shake`; None without a shaker."""
    if shaker is None:
        return None, None
    return accelerations[0, i], accelerations[1, i]


@forced
def _step_of_filter(i, f):
    """Make one step of the filter of trajectory i, or advance by one sample."""
    p, q = f.p, f.q
    if f.samples is not None:
        index = int(q[i]) + 1
        index = index if index < len(f.samples) else 0
        p[i] = f.samples[index]
        q[i] = index
        return
    p1 = f.a11 * p[i]
    q1 = 0.0
    if f.a12 is not None:
        p1 += f.a12 * q[i]
        q1 = f.a21 * p[i] + f.a22 * q[i]
    if f.l11 is not None:
        bits, f.s0[i], f.s1[i] = shuffle(f.s0[i], f.s1[i])
        xi1, xi2 = two_variates(bits)
        p1 += f.l11 * xi1
        if f.l22 is not None:
            q1 += f.l21 * xi1 + f.l22 * xi2
    p[i] = p1
    if f.a12 is not None:
        q[i] = q1
    if f.tone is not None:
        p, q = f.tone.p, f.tone.q
        turned = f.tone.c * p[i] - f.tone.s * q[i]
        q[i] = f.tone.s * p[i] + f.tone.c * q[i]
        p[i] = turned
