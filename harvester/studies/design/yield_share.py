"""The fraction of devices that meet a requirement with one circuit: every device is measured, or a curve through some.

For one key that scatters, `NODES` devices are measured, and power, speed of waking and displacement
between them follow a monotone curve; its change without every other of them is its error.  Among
several keys `SAMPLES` devices are.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.errors import HarvesterError
from harvester.machine.execution import Execution
from harvester.machine.progress import ProgressCallback
from harvester.machine.threads import in_threads
from harvester.scene.scene import Scene
from harvester.storage.bought_parts import CHIPS
from harvester.storage.time_limit import TooLittleTimeError, check_time, working_seconds
from harvester.studies.design.candidate import FEW, MANY, Candidate, Given, evaluate
from harvester.studies.design.design_need import DesignNeed
from harvester.studies.tolerance.design import sobol_points, values_at
from harvester.studies.tolerance.distribution import ShareInterval, wilson
from harvester.studies.tolerance.spreads import PartSpread

NOMINAL = 0.3  # fraction of a design's time with a spread: the circuits on the device itself
NODES = 13
SAMPLES = 64
FINE = 20_001
MOST_SHARES = 3  # circuits of most power whose fraction of devices is computed, beside the simplest
Outcomes = Mapping[str, tuple[Candidate, Given]]  # by the circuit's name


def share_met(
    candidate: Candidate,
    scene: Scene,
    needed: DesignNeed,
    farads: float,
    spreads: Sequence[PartSpread],
    seed: int,
    progress: ProgressCallback,
) -> ShareInterval:
    """Fraction of devices of the ``spreads`` that meet the requirement ``needed``.

    One without an answer does not.

    Raises TooLittleTimeError if a budget ends before all devices have an answer.
    """
    alone = len(spreads) == 1 and spreads[0].kind != "measured"
    u = (
        np.linspace(0.0, 1.0, NODES)[:, None]
        if alone
        else sobol_points(SAMPLES, len(spreads), seed)
    )
    devices = [
        scene.varied({part.key: float(value) for part, value in zip(spreads, values, strict=True)})
        for values in values_at(spreads, u)
    ]
    rows = []
    begin = working_seconds()

    def given_of(device: Scene) -> list[float]:
        return _given(candidate, device, needed, farads, seed)

    with in_threads(given_of, devices) as answers:
        for row in answers:
            rows.append(row)
            progress(len(rows) / len(u))
            check_time(begin, len(rows) / len(u))
    given = np.array(rows)
    if not alone:
        met = int(_met(given, needed).sum())
        return ShareInterval(met / len(u), *wilson(met, len(u)))
    share, rough = (_by_curve(u[::step, 0], given[::step], needed) for step in (1, 2))
    error = abs(share - rough) + 1.0 / FINE
    return ShareInterval(share, max(share - error, 0.0), min(share + error, 1.0))


def shares_met(
    device: Scene,
    meeting: Outcomes,
    needed: DesignNeed,
    farads: float,
    spreads: Sequence[PartSpread],
    seed: int,
    execution: Execution,
) -> tuple[dict[str, ShareInterval], list[str]]:
    """The fraction of devices that meet everything, of the simplest circuit and of those of most power.

    The second answer is the names of those for which a budget leaves no time; TooLittleTimeError if
    these are all.
    """
    by_power = sorted(meeting, key=lambda name: -meeting[name][1].power.value)[:MOST_SHARES]
    compared = [name for name in meeting if name in by_power or name == next(iter(meeting))]
    share_of = {}
    too_late = list[str]()
    for k, name in enumerate(compared):
        candidate = meeting[name][0]

        def report_share(share: float, k: int = k, name: str = name) -> None:
            done = NOMINAL + (1.0 - NOMINAL) * (k + share) / len(compared)
            execution.progress.step(done, name)

        try:
            share_of[name] = share_met(
                candidate,
                device,
                needed=needed.for_circuit(is_chip=name in CHIPS),
                farads=farads,
                spreads=spreads,
                seed=seed,
                progress=report_share,
            )
        except TooLittleTimeError:
            too_late.append(name)
            if len(too_late) == len(compared):
                raise
    return share_of, too_late


def _given(
    candidate: Candidate, device: Scene, needed: DesignNeed, farads: float, seed: int
) -> list[float]:
    """Power (W), one over the time to wake (1/s) and displacement (m, 0 if not known) of one device."""
    try:
        given = evaluate(
            candidate, device, needed, farads, seed, MANY if candidate.supply.top is None else FEW
        )
    except TooLittleTimeError:
        raise
    except HarvesterError:
        return [0.0, 0.0, np.inf]
    return [given.power.value, 1.0 / given.wake, given.displacement or 0.0]


def _met(given: Floats, needed: DesignNeed) -> Floats:
    """Which rows of `_given` meet everything."""
    power, speed, displacement = given.T
    good = power >= needed.power
    if needed.wake is not None:
        good &= speed * needed.wake >= 1.0
    for limit in needed.limits:
        good &= limit.met(power if limit.quantity == "mean_power" else displacement)
    return np.asarray(good)


def _by_curve(u: Floats, given: Floats, needed: DesignNeed) -> float:
    from scipy.interpolate import PchipInterpolator

    finite = np.minimum(given, 1e30)
    return float(_met(PchipInterpolator(u, finite)(np.linspace(0.0, 1.0, FINE)), needed).mean())
