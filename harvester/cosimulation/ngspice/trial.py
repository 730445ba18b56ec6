"""Whether an ngspice does what the lock-step needs: a short run with a known end, as versions differ.

A mass goes at a steady speed and meets a stop; its charge flows through a load resistor.  Within a
step of constant slope the resistor's rule is exact, so that from step to step, but for the first
ones, the voltage is to rounding

    V1 = exp(-z) V0 + (1 - exp(-z)) theta v R,    z = h/(R Cp),    before the stop

if ngspice asks for its source in time, takes the steps that it is given, obeys the weight of the
rule, and tells each accepted point.  A bridge rectifier behind the same piezo then takes steps of
ngspice's own.  A version that is not among those `TESTED` is tried before it runs anything else.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from harvester.cosimulation.lockstep.any_mechanics import Functions, begin_model
from harvester.cosimulation.lockstep.model_drive import ModelDrive
from harvester.cosimulation.ngspice import locate_libngspice
from harvester.cosimulation.ngspice.deck import build_deck
from harvester.cosimulation.ngspice.instance import Ngspice, ngspice
from harvester.cosimulation.ngspice.model_callbacks import PlainCallbacks
from harvester.errors import CircuitError, MissingProgramError
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load

TESTED = (39,)  # versions that all tests have run with
# versions with which scenes gave its answers: docs/install.md has which, and their differences
COMPARED = (46, 47)
# s, their number, and when the stop comes (s)
STEP = 1e-3
STEPS = 40
EVENT = 0.0255
# N/V, F, ohm
COUPLING = 1e-3
CAPACITANCE = 5e-8
RESISTANCE = 1e6
ROUNDING = 1e-9  # of the voltage


class TrialState(NamedTuple):
    """Displacement, velocity and time."""

    x: float
    v: float
    t: float


class SteadyMotion:
    """A mass at a steady speed, which turns round once."""

    def drift(self, s: TrialState, h: float) -> TrialState:
        """It continues."""
        return TrialState(s.x + h * s.v, s.v, s.t + h)

    def kick(self, s: TrialState, h: float, reaction: float, noise: float) -> TrialState:
        """No force acts."""
        return s

    def source(self, s: TrialState) -> float:
        """The displacement."""
        return s.x

    def event(self, s: TrialState, h: float) -> float | None:
        """The time to the stop."""
        return EVENT - s.t if s.v > 0.0 and s.t + h >= EVENT else None

    def jump(self, s: TrialState) -> TrialState:
        """It turns round."""
        return TrialState(s.x, -s.v, s.t)


def faults(library: Ngspice) -> str:
    """What of the lock-step an ngspice does not do, in words; "" where all is well."""
    for netlist in ("resistor", "bridge"):
        load = load_circuit(
            Load(resistance=RESISTANCE) if netlist == "resistor" else Load(netlist=netlist)
        )
        model = SteadyMotion()
        start = TrialState(0.0, 1.0, 0.0)
        at = np.array(start, dtype=np.float64)
        volts = COUPLING / CAPACITANCE
        free = not load.linear
        drive = ModelDrive(
            start=at,
            coefficients=np.empty(0),
            noise=np.zeros((STEPS, 2)),
            h=STEP,
            stride=1,
            volts=volts,
            coupling=COUPLING,
            coil=False,
            free=free,
        )
        plain = Functions(None, None, lambda _, at: at.x, None, None, None)
        begin_model(drive.state[0], start, drive.record.samples, plain, model)
        callbacks = PlainCallbacks(model, start, drive, library.state)
        drive.state["source_at"], drive.state["accepted_at"] = callbacks.addresses
        deck = build_deck(load, CAPACITANCE, STEP, drive.duration)
        try:
            library.run_driven(deck, drive, patience=10.0)
        except CircuitError as error:
            return f"it does not run the {netlist}: {error}"
        callbacks.finish()
        events = drive.record.events[: drive.state[0].impacts]
        if len(events) != 1 or abs(events[0] - EVENT) > 1e-9 * STEP:
            return "it does not end a step where it is told to"
        seen = drive.record.samples[4 : int(EVENT / STEP) + 1, -3]
        decay = math.exp(-STEP / (RESISTANCE * CAPACITANCE))
        steady = COUPLING * RESISTANCE
        off = np.abs(seen[1:] - decay * seen[:-1] - (1.0 - decay) * steady).max() / steady
        if load.linear and not off < ROUNDING:
            return f"a step of a resistor's voltage is off by {off:.1e}"
        if not (
            np.isfinite(drive.record.samples).all() and math.isfinite(float(drive.state[0].load))
        ):
            return f"it gives no numbers of the {netlist}"
    return ""


@cache
def checked_ngspice() -> Ngspice:
    """The one ngspice of this process, after its trial if its version is not among those `TESTED`.

    Raises MissingProgramError as `harvester.cosimulation.ngspice.instance.ngspice`, and for one
    that fails its trial.
    """
    library = ngspice()
    why = "" if library.ngspice_version in TESTED else faults(library)
    if why:
        raise MissingProgramError(
            f"engine 'spice' must have an ngspice that does what it is told, but version {library.ngspice_version} "
            f"does not ({why}): take version {' or '.join(map(str, TESTED))}, {locate_libngspice.REMEDY}"
        )
    return library


def versions() -> tuple[str, str]:
    """The version of ngspice in this process, and what its trial found: "" if it does all that it must."""
    library = ngspice()
    return str(library.ngspice_version), faults(library)
