"""Excitation that repeats itself: shocks, and the few lines of a machine or of walking.

A shock is single, or there are so many a second:

    half sine      A sin(pi t/D)                  for 0 < t < D
    sawtooth       A t/D                          for 0 < t < D, which ends at its peak
    damped sine    A exp(-t/D) sin(2 pi f t)      from t = 0 on

Repeated every T they are the Fourier series of c_n = 1/T times the integral of a(t) exp(-2 pi i n
t/T), in closed form. c_0 = 0: the base comes back to rest, so that the velocity that a shock gives
is removed evenly until the next.

A machine has lines at its speed of rotation and multiples of it, a walker at those of the steps:

    machine    a(t) = level * sum of A_k sin(2 pi k f t)                  f turns a second, A_k given
    walking    a(t) = level * g * sum of alpha_k cos(2 pi k f t)          f steps per second

A walker pushes the ground with W (1 + sum of alpha_k cos(...)), W the weight; by Newton's second
law the centre of mass is accelerated by g times the sum.  The source states no phases: ours are
those of cosines in step.
"""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError, invalid
from harvester.records.profiles.standard_curves import G, Profile
from harvester.records.records import MOST_SAMPLES, Record

# lines go up to so many times 1/D and f, and at least to 2 FINE times the resonance of the device
FINE = 16.0
SMALL = 0.02  # angle below which a closed form is a series
_OTHERS = ("event_rate", "level")
SHOCKS = {
    profile.name: profile
    for profile in (
        Profile(
            "half-sine-shock",
            "a shock of half a sine: peak, duration, and how many a second",
            "pulse shape of IEC 60068-2-27 and MIL-STD-810 method 516; the numbers are yours",
            needs=("acceleration_amplitude", "pulse_duration"),
            takes=_OTHERS,
        ),
        Profile(
            "sawtooth-shock",
            "a shock that rises to its peak and ends there: peak, duration, and how many a second",
            "pulse shape (terminal peak) of IEC 60068-2-27 and MIL-STD-810 method 516; the numbers are yours",
            needs=("acceleration_amplitude", "pulse_duration"),
            takes=_OTHERS,
        ),
        Profile(
            "damped-sine-shock",
            "a sine that fades: amplitude, frequency, the time to 1/e as its duration, and how many a second",
            "no source: the numbers are yours",
            needs=("acceleration_amplitude", "pulse_duration", "frequency"),
            takes=_OTHERS,
        ),
    )
}


@lru_cache(8)
def shock(
    name: str,
    amplitude: float,
    duration: float,
    frequency: float | None,
    period: float,
    resonance: float,
) -> Record:
    """One period of a repeated shock in SI units, with lines far beyond the ``resonance`` of the device (Hz).

    A mass follows a line at 2 `FINE` times its resonance and beyond by less than a thousandth of
    the base's motion: the omitted part changes its mean square by less than a millionth.

    Raises InputError for a shock without size, one that is longer than the period, and a period of
    more than `MOST_SAMPLES`.
    """
    if amplitude == 0.0:
        raise invalid("excitation.acceleration_amplitude of a shock", "be above 0", amplitude)
    if name != "damped-sine-shock" and duration > period:
        raise invalid(
            "excitation.pulse_duration",
            f"be at most the time between two shocks, {period:.4g} s",
            duration,
        )
    needed = math.ceil(2.0 * FINE * resonance * period)
    lines = max(
        needed,
        min(
            math.ceil(FINE * period * max(1.0 / duration, frequency or 0.0)), MOST_SAMPLES // 2 - 1
        ),
    )
    if 2 * lines + 1 > MOST_SAMPLES:
        raise InputError(
            f"excitation.event_rate must be so high that a period of the shocks has at most {MOST_SAMPLES} samples, "
            f"but that of {period:.4g} s has {2 * lines + 1}: give a higher event_rate"
        )
    w = 2.0 * math.pi / period * np.arange(lines + 1.0)
    series = (2 * lines + 1) * amplitude / period * _transform(name, w, duration, frequency)
    series[0] = 0.0
    return Record(period / (2 * lines + 1), np.fft.irfft(series, 2 * lines + 1), exact=True)


def _transform(name: str, w: Floats, duration: float, frequency: float | None) -> Complexes:
    """The integral of a shock of amplitude 1 times exp(-i w t), in the shape of w."""
    if name == "half-sine-shock":
        up, down = (_pulse(sign * math.pi - w * duration) for sign in (1.0, -1.0))
        return np.asarray(duration / 2j * (up - down))
    if name == "sawtooth-shock":
        return np.asarray(duration * _ramp(w * duration))
    assert frequency is not None, "the scene checks this"
    turn = 2.0 * math.pi * frequency
    return np.asarray(turn / ((1.0 / duration + 1j * w) ** 2 + turn * turn))


def _pulse(angle: Floats) -> Complexes:
    """The integral of exp(i angle s) over s from 0 to 1."""
    return np.asarray(np.exp(0.5j * angle) * np.sinc(angle / (2.0 * math.pi)))


def _ramp(angle: Floats) -> Complexes:
    """The integral of s exp(-i angle s) over s from 0 to 1."""
    small = angle < SMALL
    y = np.where(small, 1.0, angle)
    closed = (np.exp(-1j * y) * (1.0 + 1j * y) - 1.0) / (y * y)
    z = -1j * angle
    series = 1.0 / 2.0 + z / 3.0 + z**2 / 8.0 + z**3 / 30.0 + z**4 / 144.0
    return np.asarray(np.where(small, series, closed))


WALKING = (0.5, 0.2, 0.1, 0.05)  # of the weight, at 1 to 4 times the rate of steps
STEP_RATES = 1.6, 2.2  # steps per second that the source covers
STEP_RATE = 2.0
MOST_LINES = 64
LINES = {
    profile.name: profile
    for profile in (
        Profile(
            "machine",
            "a machine: its speed of rotation and multiples of it, with the peak of each",
            "no source: both are of your machine",
            needs=("frequency", "harmonics"),
            takes=("level",),
        ),
        Profile(
            "walking",
            "the vertical acceleration of a walker's centre of mass, 1.6 to 2.2 steps per second (default: 2)",
            "coefficients 0.5, 0.2, 0.1, 0.05 of AISC Design Guide 11, table 1.1 (Allen and Murray 1993)",
            takes=("frequency", "level"),
        ),
    )
}


def machine(frequency: float, harmonics: Sequence[float], level: float) -> Record:
    """One turn of a machine of ``frequency`` turns a second, with peaks ``harmonics`` (m/s^2) at 1, 2, ... times it.

    Raises InputError for no line, or more than `MOST_LINES`.
    """
    if not any(harmonics) or len(harmonics) > MOST_LINES:
        must = f"have 1 to {MOST_LINES} accelerations, some of them above 0"
        raise invalid("excitation.harmonics", must, list(harmonics))
    values = np.sin(_angles(len(harmonics))) @ np.array(harmonics)
    return Record(1.0 / (frequency * len(values)), level * values, exact=True)


def walking(frequency: float | None, level: float) -> Record:
    """One step of a walker at ``frequency`` steps per second.

    InputError outside of `STEP_RATES`.
    """
    rate = STEP_RATE if frequency is None else frequency
    if not STEP_RATES[0] <= rate <= STEP_RATES[1]:
        must = f"be between {STEP_RATES[0]} and {STEP_RATES[1]} Hz, the steps per second that its source covers"
        raise invalid("excitation.frequency of profile 'walking'", must, rate)
    values = np.cos(_angles(len(WALKING))) @ np.array(WALKING)
    return Record(1.0 / (rate * len(values)), level * G * values, exact=True)


def _angles(lines: int) -> Floats:
    """The angles of the lines at the samples of a period, shape (samples, lines).

    No line is at half the rate.
    """
    samples = max(16, 2 * lines + 2)
    return np.asarray(
        2.0 * math.pi / samples * np.outer(np.arange(samples), np.arange(1, lines + 1)), float
    )
