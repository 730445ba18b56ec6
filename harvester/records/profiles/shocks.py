"""Shocks: a half sine, a sawtooth or a damped sine, single or so many a second.

    half sine      A sin(pi t/D)                  for 0 < t < D
    sawtooth       A t/D                          for 0 < t < D, which ends at its peak
    damped sine    A exp(-t/D) sin(2 pi f t)      from t = 0 on

Repeated every T they are the Fourier series of c_n = 1/T times the integral of a(t) exp(-2 pi i n t/T), in closed form.
c_0 = 0: the base comes back to rest, so that the velocity that a shock gives is taken back evenly until the next.
"""

import math
from functools import lru_cache

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.errors import InputError, invalid
from harvester.records.profiles.profile import Profile
from harvester.records.records import MOST_SAMPLES, Record

FINE = 16.0  # lines go up to so many times 1/D and f, and at least to 2 FINE times the resonance of the device
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
    name: str, amplitude: float, duration: float, frequency: float | None, period: float, resonance: float
) -> Record:
    """One period of a repeated shock in SI units, with lines far beyond the ``resonance`` of the device (Hz).

    A mass follows a line at 2 `FINE` times its resonance and beyond by less than a thousandth of the base's motion:
    what is left out changes its mean square by less than a millionth.

    Raises InputError for a shock without size, one that is longer than the period, and a period of more than
    `MOST_SAMPLES`.
    """
    if amplitude == 0.0:
        raise invalid("excitation.acceleration_amplitude of a shock", "be above 0", amplitude)
    if name != "damped-sine-shock" and duration > period:
        raise invalid("excitation.pulse_duration", f"be at most the time between two shocks, {period:.4g} s", duration)
    needed = math.ceil(2.0 * FINE * resonance * period)
    lines = max(needed, min(math.ceil(FINE * period * max(1.0 / duration, frequency or 0.0)), MOST_SAMPLES // 2 - 1))
    if 2 * lines + 1 > MOST_SAMPLES:
        raise InputError(
            f"excitation.event_rate must be so high that a period of the shocks takes at most {MOST_SAMPLES} samples, "
            f"but that of {period:.4g} s takes {2 * lines + 1}: give a higher event_rate"
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
