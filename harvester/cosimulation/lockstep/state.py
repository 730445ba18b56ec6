"""The record that the mass and ngspice share in lock-step: the fields of one run's state.

Times ``t``, ``leg_t``, ``target_time``, ``since``, ``begin`` and ``end`` are in second; ``volts`` =
theta l/Cp; ``voltage``, ``current``, ``power``, ``load``, ``delivered``, ``square`` and
``smooth_*`` in SI; the rest is nondimensional.  ``bend`` is the acceleration of a ``smooth`` drift
(`source_voltage`), 0 of one in straight lines. ``n_steps`` counts kicks of the mass, ``accepted``
ngspice's steps.  ``*_at`` are addresses of the data of the compiled callbacks, ``*_index`` the
places of ngspice's vectors, -1 for one that is not there.
"""

from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.mechanics.kernels.compiled import inlined

# values of `goal`: what a leg of the lock-step leads to
KICK = 0
IMPACT = 1
SAMPLE = 2
# values of `measuring`: where the run stands to the time that the energy balance covers
BEFORE = 0
DURING = 1
AFTER = 2
BEYOND = 0.75  # steps that a run goes on after its last kick
# of the time of a run's end, before which ngspice is led no further: some 30 roundings
EARLY = 4e-15
TINY = 1e-9  # parts of a step: targets nearer than this are one


class Point(NamedTuple):
    """A point that ngspice accepted: time (s), terminal voltage, the load's power, current, voltage of Csmooth (SI)."""

    t: float
    v: float
    power: float
    current: float
    smooth: float


class Recording(NamedTuple):
    """Arrays of a run, those of `harvester.cosimulation.lockstep.drive.Drive` by the same names.

    ``modes``, shape (3, rows x BATCH), are states of several modes (`modal_drift`), and
    ``coordinates`` those of their samples; None of one mode.
    """

    noise: Floats
    shaking: Floats | None
    samples: Floats
    impacts: Floats
    charge: Floats
    kicked: Floats
    modes: Floats | None = None
    coordinates: Floats | None = None


# Of a drift without white noise: phase of its impact, speeds before and after it, the acceleration
# that presses on the stop and the excitation's share of it, the time after which bounces of r = 1
# repeat, which stop it is (1, -1 for the opposite one), and the velocity from which it began.
_PLAN = ("meet", "speed", "up", "pressing", "share", "again", "side", "before")
_REALS = (
    "x",
    "v",
    "bend",
    "phase",
    "next_phase",
    "h",
    "w0",
    "volts",
    *_PLAN,
    "t",
    "leg_t",
    "target_time",
)
_LEDGER = ("since", "voltage", "current", "power", "load", "delivered", "square", "begin", "end")
_WORKS = ("noise_work", "spring_work", "voltage_work", "damping_work", "impact_work")
_STORED = tuple(
    f"{what}_{when}" for what in ("energy", "voltage", "smooth") for when in ("begin", "end")
)
_COUNTS = (
    "goal",
    "n_steps",
    "stride",
    "accepted",
    "impacts",
    "free",
    "smooth",
    "measuring",
    "has_beta",
    "flown",
)
# 1: the motion of another run, from its record; a leg that begins with a turn of the motion, or an
# impact
_WAYS = ("follows", "turned")
# Of a model of one's own (`any_mechanics`): what drives its port and the reaction as a leg begins,
# the port's coupling; a coil's charge of this part and mean current of the last one, their lengths,
# the middle of this one, and the source ahead of its kick; whether it is a coil, what ended the
# motion, the model's own state, whether the part ends at its event, and how many parts this step
# had.
_MODEL = (
    "driven",
    "reaction",
    "coupling",
    "charge",
    "mean_before",
    "part",
    "part_before",
    "middle",
    "grown",
)
_OF_MODEL = ("coil", "fault", "model_at", "split", "parts")
_CALLBACKS = ("source_at", "step_at", "accepted_at")
_ARRAYS = (
    *(f"{name}_at" for name in Recording._fields),
    "coefficients_at",
    "noise_size",
    "impacts_size",
)
# of ngspice, in the order of `Deck`
VECTORS = ("time", "voltage", "power", "current", "smooth", "smooth_minus")
_INDICES = tuple(f"{vector}_index" for vector in VECTORS)
STATE = np.dtype(
    [(name, np.float64) for name in (*_REALS, *_LEDGER, *_WORKS, *_STORED, *_MODEL)]
    + [
        (name, np.int64)
        for name in (*_COUNTS, *_WAYS, *_OF_MODEL, *_CALLBACKS, *_ARRAYS, *_INDICES)
    ],
    align=True,
)


@inlined
def note_impact(s, impacts, time, velocity):
    """Count an impact, and record its time and its velocity into the stop while there is room for it."""
    if s.impacts < len(impacts):
        impacts[s.impacts, 0] = time
        impacts[s.impacts, 1] = velocity
    s.impacts += 1
