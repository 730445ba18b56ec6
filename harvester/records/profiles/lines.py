"""Shaking that is a few lines: a machine at its speed of rotation and multiples of it, and walking.

    machine    a(t) = level * sum of A_k sin(2 pi k f t)                  f turns a second, A_k given
    walking    a(t) = level * g * sum of alpha_k cos(2 pi k f t)          f steps a second

A walker pushes the ground with W (1 + sum of alpha_k cos(...)), W the weight; by Newton's second law the
centre of mass is accelerated by g times the sum.  The source states no phases: ours are those of cosines in step.
"""

import math
from collections.abc import Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.errors import invalid
from harvester.records.profiles.profile import Profile
from harvester.records.profiles.standard_curves import G
from harvester.records.records import Record

WALKING = (0.5, 0.2, 0.1, 0.05)  # of the weight, at 1 to 4 times the rate of steps
STEP_RATES = 1.6, 2.2  # steps a second that the source covers
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
            "the vertical acceleration of a walker's centre of mass, 1.6 to 2.2 steps a second (2 where left out)",
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
    angles = _angles(len(harmonics))
    values = np.sin(angles) @ np.array(harmonics)
    return Record(1.0 / (frequency * len(values)), level * values, exact=True)


def walking(frequency: float | None, level: float) -> Record:
    """One step of a walker at ``frequency`` steps a second; InputError outside of `STEP_RATES`."""
    rate = STEP_RATE if frequency is None else frequency
    if not STEP_RATES[0] <= rate <= STEP_RATES[1]:
        must = f"be between {STEP_RATES[0]} and {STEP_RATES[1]} Hz, the steps a second that its source covers"
        raise invalid("excitation.frequency of profile 'walking'", must, rate)
    values = np.cos(_angles(len(WALKING))) @ np.array(WALKING)
    return Record(1.0 / (rate * len(values)), level * G * values, exact=True)


def _angles(lines: int) -> Floats:
    """The angles of the lines at the samples of a period, shape (samples, lines); no line is at half the rate."""
    samples = max(16, 2 * lines + 2)
    return np.asarray(2.0 * math.pi / samples * np.outer(np.arange(samples), np.arange(1, lines + 1)), float)
