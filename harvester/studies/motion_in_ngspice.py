"""The trajectory of `harvester.studies.motion` by ngspice in lock-step, and the time for a long one."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.netlists.probes import Probe

if TYPE_CHECKING:
    from harvester.mechanics.kernels.path import Path

# of a trajectory whose time a pilot measures, and the pilot's share of it
MANY_STEPS = 50_000
PILOT = 0.02
Expected = Callable[[float], None]  # called with the seconds that a path is expected to take


def path_in_ngspice(
    problem: Problem,
    noise: Floats,
    h: float,
    stride: int,
    shaking: Floats | None,
    probes: tuple[Probe, ...],
    expected: Expected | None,
    shunt: float = 0.0,
) -> "tuple[Path, Floats]":
    """The trajectory of ``problem`` by ngspice, and its probes at the trajectory's times, shape (probes, n).

    ``noise``, shape (steps,), are its kicks, a step ``h`` (1/w0) apart; ``shaking``, shape (steps +
    1,), are the base's accelerations there; a reading is every ``stride`` steps.  ``expected`` is
    called with the seconds that a long trajectory will need, from two short ones.  ``shunt`` is a
    capacitance from each node to ground, of the piezo's.

    Raises MissingProgramError without ngspice, and CircuitError if the circuit does not converge.
    """
    from harvester.cosimulation.charging import probed_path_in_worker
    from harvester.cosimulation.ngspice.locate_libngspice import find_library
    from harvester.cosimulation.runs import CoupledDevice

    find_library()
    device = CoupledDevice(
        problem.equations,
        problem.scales,
        problem.load_circuit,
        h,
        stride,
        probes=probes,
        shunt=shunt,
    )
    if expected is not None and len(noise) > MANY_STEPS:
        few = round(PILOT * len(noise))
        for _ in range(2):  # the first starts the process
            begin = time.perf_counter()
            probed_path_in_worker(
                device, noise[:few], None if shaking is None else shaking[: few + 1]
            )
        expected((time.perf_counter() - begin) / PILOT)
    return probed_path_in_worker(device, noise, shaking)
