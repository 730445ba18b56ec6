"""Runs of ngspice in lock-step with a model of the user's own, in this process, which is a worker."""

import math
import pickle
import sys
import time
from dataclasses import dataclass
from typing import Any

import cloudpickle
import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.lockstep import any_mechanics
from harvester.cosimulation.lockstep.any_mechanics import Functions, begin_model
from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger
from harvester.cosimulation.lockstep.model_drive import ModelDrive
from harvester.cosimulation.model_errors import not_compiled, of_model, quoted, unraisable
from harvester.cosimulation.model_protocol import check_event
from harvester.cosimulation.ports import Coil, Port
from harvester.cosimulation.probe_series import values_of, vectors_of
from harvester.errors import InputError
from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.probes import Probe

PATIENCE = 30.0  # seconds in which a run must get on
NAMES = {
    any_mechanics.DRIFT: "drift",
    any_mechanics.KICKED: "kick",
    any_mechanics.JUMP: "jump",
    any_mechanics.SOURCE: "source",
}


@dataclass(frozen=True)
class ModelJob:
    """A model, its circuit, and how they run: arguments as of `harvester.cosimulation.coupled_models.cosimulate`.

    ``tolerances`` are ngspice's relative tolerance, and the voltage to which its absolute ones are
    relative (V).  The noise is that of a step of 2^``halvings`` h, refined; each ``path`` of a seed
    has its own.
    """

    model: Any
    start: Any
    load: LoadCircuit
    port: Port
    h: float
    steps: int
    stride: int
    seed: int
    tolerances: tuple[float, float]
    probes: tuple[Probe, ...]
    compiled: bool
    halvings: int = 0
    path: int = 0

    @property
    def capacitance(self) -> float:
        """That of the piezo (F), 0 of a coil."""
        return 0.0 if isinstance(self.port, Coil) else float(self.port.capacitance)


@dataclass(frozen=True)
class ModelRun:
    """Results of a run: readings as of `ModelRecord`, times of events, the probes at the readings, and the balance."""

    samples: Floats
    events: Floats
    probed: Floats
    ledger: EnergyLedger
    steps: int
    seconds: float
    compilation: float


def packed(job: ModelJob) -> bytes:
    """A job for a worker: with the model's code, whose module may be found from here alone."""
    names = {type(instance).__module__ for instance in (job.model, job.start)} - {
        "__main__",
        "builtins",
    }
    modules = [sys.modules[name] for name in names if name in sys.modules]
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        return bytes(cloudpickle.dumps(job))
    except Exception as error:
        raise InputError(
            "`model` and `start` must be such that a process can hand them to another one, but "
            f"{type(job.model).__name__} is not: {quoted(str(error))}"
        ) from None
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)


def _unpacked(data: bytes) -> ModelJob:
    """The job; raises InputError if a part of its model is not found here."""
    try:
        job: ModelJob = pickle.loads(data)
    except Exception as error:
        raise InputError(
            "`model` and `start` must be such that a process can hand them to another one, but are "
            f"not: {type(error).__name__}: {quoted(str(error))}"
        ) from None
    return job


def run_model(data: bytes) -> ModelRun:
    """Run a job that is `packed`; the same seed, the same noise.

    Raises InputError if a function of the model fails during the run; and as
    `harvester.cosimulation.runs.run_in_this_process`.
    """
    from harvester.cosimulation.ngspice.model_callbacks import PlainCallbacks, coefficients_of
    from harvester.cosimulation.ngspice.trial import checked_ngspice

    job = _unpacked(data)
    coil = isinstance(job.port, Coil)
    piezo = job.capacitance
    noise = noise_of(job)
    start = np.array(job.start, dtype=np.float64)
    coefficients = coefficients_of(job.model) if job.compiled else np.empty(0)
    exact = job.load.linear and not coil  # the rule of a load resistor is exact for each drift
    coupling = float(job.port.coupling or 0.0)
    volts = coupling if coil else coupling / piezo
    drive = ModelDrive(
        start=start,
        coefficients=coefficients,
        noise=noise,
        h=job.h,
        stride=job.stride,
        volts=volts,
        coupling=coupling,
        coil=coil,
        free=not exact,
    )
    begin_model(drive.state[0], job.start, drive.record.samples, _bound(job.model), None)
    begin = time.perf_counter()
    callbacks = None
    if job.compiled:
        functions = _compiled(job)
    else:
        callbacks = PlainCallbacks(job.model, job.start, drive, checked_ngspice().state)
        functions = callbacks.addresses
    drive.state["source_at"], drive.state["accepted_at"] = functions
    middle = time.perf_counter()
    raised: list[BaseException] = []

    def keep(error: BaseException) -> None:
        """Keep the error of a compiled function; the rest of the run is ngspice's alone."""
        raised.append(error)
        checked_ngspice().state["fault"] = any_mechanics.RAISED

    try:
        with unraisable(keep):
            checked_ngspice().run_driven(_deck(job, drive), drive, PATIENCE)
    finally:
        if callbacks is not None:
            callbacks.finish()
        if raised:
            raise of_model(raised[0]) from None
    s: Any = drive.state[0]
    _check(job, s, drive.at if callbacks is None else callbacks.at)
    times = job.h * job.stride * np.arange(len(drive.record.samples))
    seen = [np.interp(times, drive.series["time"], values_of(probe, drive)) for probe in job.probes]
    return ModelRun(
        samples=drive.record.samples,
        events=drive.record.events[: s.impacts].copy(),
        probed=np.array(seen, dtype=np.float64).reshape(len(seen), len(times)),
        ledger=drive.ledger(piezo, exact),
        steps=int(s.accepted),
        seconds=time.perf_counter() - middle,
        compilation=middle - begin,
    )


def noise_of(job: ModelJob) -> Floats:
    """Normal variates of the halves of each step, shape (steps, 2).

    A step of the finer job is half a step of the coarser one, and its two halves have that half's
    variate n as their sum: (n + z)/sqrt 2 and (n - z)/sqrt 2, with z independent of n.  Each
    trajectory and each of its halvings has a seed of its own.
    """
    first = np.random.SeedSequence(job.seed, spawn_key=(job.path,) if job.path else ())
    others = [
        np.random.SeedSequence(job.seed, spawn_key=(job.path, k)) for k in range(job.halvings)
    ]
    variates = np.random.default_rng(first).standard_normal((job.steps >> job.halvings, 2)).ravel()
    for finer in others:
        z = np.random.default_rng(finer).standard_normal(len(variates))
        halves = np.stack([variates + z, variates - z], axis=1)
        variates = (math.sqrt(0.5) * halves).ravel()
    return variates.reshape(job.steps, 2)


def _bound(model: Any) -> Functions:
    """The one function of a model that the beginning of a run asks."""
    return Functions(None, None, lambda _, at: model.source(at), None, None, None)


def _deck(job: ModelJob, drive: ModelDrive) -> Any:
    """The circuit of a job."""
    from harvester.cosimulation.ngspice.deck import build_deck, coil_deck

    (tolerance, volts) = job.tolerances
    vectors = vectors_of(job.probes)
    if isinstance(job.port, Coil):
        return coil_deck(
            job.load,
            job.port.resistance,
            inductance=job.port.inductance,
            times=(job.h, drive.duration),
            volts=volts,
            reltol=tolerance,
            probes=vectors,
        )
    s: Any = drive.state[0]
    return build_deck(
        job.load,
        job.capacitance,
        step=job.h,
        duration=drive.duration,
        start=(float(s.volts * s.driven), 0.0, 0.0),
        volts=volts,
        reltol=tolerance,
        probes=vectors,
    )


def _compiled(job: ModelJob) -> tuple[int, int]:
    """The addresses of the model's C functions."""
    from harvester.cosimulation.ngspice.model_callbacks import compiled

    try:
        absent = tuple(component is None for component in job.model)
        model: Any = type(job.model)
        state: Any = type(job.start)
        made = compiled(model, state, absent)
    except Exception as error:  # of numba's, or of what numba asks of a class of the user's own
        raise not_compiled(error, type(job.model).__name__) from None
    return made[0].address, made[1].address


def _check(job: ModelJob, s: Any, at: Any) -> None:
    """Refuse a run that a function of the model has ended."""
    state = type(job.start)(*map(float, at))
    where = f" at {float(s.end):.6g} s, in {state}"
    if s.fault in NAMES:
        raise InputError(
            f"`model.{NAMES[s.fault]}` must give finite numbers, but does not{where}: check it, or `step`"
        )
    if s.fault == any_mechanics.OFTEN:
        raise InputError(
            f"`model.event` must come to an end within a step, but has more than {any_mechanics.MOST}{where}: let "
            "`model.jump` bring to rest a mass that would meet the next event within a step"
        )
    if s.fault == any_mechanics.EVENT:
        check_event(job.model.event(state, float(s.h - s.phase)), float(s.h - s.phase), where)
        raise InputError(f"`model.event` must give a time within the drift, but does not{where}")
