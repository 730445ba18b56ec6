"""A path of a scene, its circuit's power and its node's day, for the page, in a worker process of their own.

Their compilation delays nobody.
"""

import math
import time
from collections.abc import Callable
from concurrent.futures import wait
from functools import partial
from typing import Any

from harvester.engines.selection import ENGINES, default_sampler, engine
from harvester.engines.slow import Slow
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError
from harvester.explore.job import told_of
from harvester.machine import processes
from harvester.machine.system import this_system
from harvester.scene.scene import Scene

PERIODS = 12.0  # that are drawn
MOST = 1500  # points that are drawn
# What the power of a circuit is computed to, and the seconds for that: at once, in the end, and
# along a curve.
QUICK = (0.05, 0.05)
FINE = (0.01, 10.0)
COARSE = (0.05, 1.0)
FEW = 64  # trajectories at once: their start is most of what they take
IDLE = 300.0  # seconds after which a worker without work ends

Job = Callable[..., dict[str, Any]]
Overtaken = Callable[[], bool]  # whether a newer request waits; or the page is closed
# the priority of what is computed in the background: the first power of a circuit passes it
GIVES_WAY = 5

# for what must be there at once, the latter
_idle, _quick = processes.idle_processes(), processes.idle_processes()


def path(tables: dict[str, Any]) -> dict[str, Any]:
    """The last periods of one trajectory of a scene: t, x, v and V in its units, as lists, and the places of its stops.

    Raises HarvesterError as `harvester.motion`, in the scene's own process: call `elsewhere`.
    """
    from harvester.studies.motion import motion

    problem = Problem(Scene(**tables))
    trace = motion(
        problem,
        default_sampler(problem),
        duration=2.0 * math.pi * PERIODS / problem.units.frequency,
    )
    last = trace.time > trace.time[-1] - trace.shown
    every = max(1, -(-int(last.sum()) // MOST))
    drawn = (trace.time - trace.time[last][0], trace.displacement, trace.velocity, trace.voltage)
    return {
        **{
            name: series[last][::every].tolist() for name, series in zip("txvV", drawn, strict=True)
        },
        "stops": list(trace.stops),
        "physical": trace.physical,
        "impacts": trace.number_of_impacts,
        "not_drawn": [
            str(note)
            for note in trace.diagnostics
            if note.code in ("stop_not_drawn", "ball_not_drawn")
        ],
        "engine": trace.engine,
    }


def power(tables: dict[str, Any], within: float, seconds: float) -> dict[str, Any]:
    """The power of a scene with its own circuit, by the cheapest engine that supports it: as `told_of`, and whose.

    ``within`` is the relative error to reach, ``seconds`` the time for that.

    Raises CannotServeError if none does, and HarvesterError as that one.
    """
    problem = Problem(Scene(**tables))
    kinds = sorted(
        (kind for kind in ENGINES.values() if kind.needs_netlist), key=lambda kind: kind.LOOK.trust
    )
    kind = next((kind for kind in kinds if kind.refusal(problem) is None), None)
    if kind is None:
        raise CannotServeError(Slow.refusal(problem))
    if kind.by_mean_current:  # it has no such options, but a quick way and a whole one
        estimate = Slow().quick(problem) if within > FINE[0] else Slow().run(problem)
    else:
        # else: "not reached"
        options = {"trajectories": FEW} if (within, seconds) == QUICK else {"within": within}
        chosen = engine(kind.NAME, budget=seconds, **options)
        # that of few words first
        estimate = (chosen.at_many_points if within > FINE[0] else chosen).run(problem)
    return {"engine": kind.NAME} | told_of(estimate)


def life(tables: dict[str, Any]) -> dict[str, Any]:
    """How a scene's [node] lives of it for a day: the rows of `harvester node`, its remarks, and three in short.

    Raises HarvesterError as `harvester.node`.
    """
    from harvester.explore.beside import PACKETS
    from harvester.presentation.sheet import sheet
    from harvester.studies.node import node

    answer = node(Scene(**tables))
    first = answer.first_packet
    short = {
        PACKETS: f"{answer.packets_per_hour.value:.4g}",
        "runs": f"{100.0 * answer.share_running.value:.4g} % of the day",
        "awake after": "no packet in a day" if first is None else f"{first.value:.4g} s",
    }
    page = sheet(answer)
    return {"rows": page.rows, "remarks": [*page.warnings, *page.notes], "short": short}


def prediction(tables: dict[str, Any], prior: str) -> dict[str, Any]:
    """The prediction of a real device, by `harvester.predict` in this process alone.

    Raises HarvesterError as `harvester.predict`.
    """
    from harvester.machine.execution import Execution
    from harvester.studies.prediction.predict import predict

    alone = Execution(workers=1, progress=False)
    return {"prediction": predict(Scene(**tables), prior=prior, execution=alone)}


def elsewhere(
    job: Job,
    arguments: tuple[Any, ...],
    overtaken: Overtaken,
    ended: Overtaken,
    patience: float,
    first: bool = False,
) -> dict[str, Any] | None:
    """A function of this module in a worker process; None if it has ended or is out of patience.

    The ``patience`` once it is overtaken is in seconds; ``first``: in a process that others give way to.

    Raises HarvesterError as the ``job``, and RuntimeError of loky's if the worker dies.
    """
    idle, job = (_quick, job) if first else (_idle, partial(_behind, job))
    future, process = processes.submit_to_one(idle, _new, job, arguments)
    begin = time.monotonic()
    while not wait([future], 0.01).done:
        if ended() or (overtaken() and time.monotonic() - begin > patience):
            processes.kill(process)
            return None
    try:
        return future.result()
    finally:
        idle.append(process)


def _behind(job: Job, *arguments: Any) -> dict[str, Any]:
    """The same in a process that gives way to others."""
    this_system.give_way(GIVES_WAY)
    return job(*arguments)


def _new() -> Any:
    return processes.create(idle=IDLE)


def close() -> None:
    """End all workers that are idle."""
    for idle in (_idle, _quick):
        while idle:
            processes.kill(idle.pop())
