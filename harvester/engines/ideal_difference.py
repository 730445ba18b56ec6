"""The difference between a circuit of ideal elements and the compiled netlist, on the same noise.

Under a steady excitation the periodic response of the compiled circuit is the reference.
"""

import time
from typing import TYPE_CHECKING

import numpy as np

from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.mechanics.kernels.moments import Moments
from harvester.uncertainty.paired_difference import difference95, enough_entries, share95

if TYPE_CHECKING:
    from harvester.circuits.compiled_circuit import CompiledCircuit
    from harvester.mechanics.ensemble.richardson import RichardsonPair

# trajectories, of circuits that forget in this nondimensional time; fewer where it is longer
COUNT = 128
TIME = 32.0
# trajectories; nondimensional time, above which nobody would wait
FEWEST = 16
LONGEST = 500.0
FEWEST_SECONDS = 0.5  # that the reference takes at least: with less left of a budget none begins
SETTLING, AVERAGED = 3.0, 4.0  # settling times of the slowest of mass, storage and load
# steps of the reference under a steady excitation: at that of ideal elements it was 2 % off beside
# a stop
FINE = 0.25, 0.125
# tolerance of a circuit's step under a steady excitation, and what settling may change
STEADY, SETTLED = 2e-3, 1e-4
JUDGE = 5e-3  # twice what compiled circuits differ by from ngspice at most (docs/compiled.md)


def difference_from_compiled(
    problem: Problem, pair: "RichardsonPair", deadline: float
) -> dict[str, float]:
    """Relative differences of E[V^2] ("V2") and of the load's power ("load"), at most at 95 %, and the reference's.

    The trajectories of both begin in settled states of the ideal circuit and have the same noise.
    Near a stop they part all the same; controls make the difference of their means sharper.  Empty
    if no compiled circuit is possible or converges, if it forgets too slowly, and if it has not
    ended at the ``deadline`` of `time.perf_counter`.
    """
    from harvester.circuits.beside_ideal import compiled_beside
    from harvester.circuits.compiled_circuit import compiled_circuit
    from harvester.mechanics.ensemble.burn_in import memory
    from harvester.mechanics.ensemble.trajectories import Trajectories

    settled = pair.trajectories
    if time.perf_counter() > deadline - FEWEST_SECONDS:
        return {}
    try:
        circuit = compiled_circuit(problem.load_circuit, problem.scales)
        if problem.equations.is_steady:
            return _of_periods(
                compiled_circuit(problem.load_circuit, problem.scales, STEADY), problem, pair
            )
        slowest = max(memory(settled, pair.moments, pair.duration), circuit.memory)
        if slowest > LONGEST:
            return {}
        count = round(max(COUNT * min(TIME / slowest, 1.0), FEWEST))
        count = enough_entries(count, settled.together)
        compiled, compilation_seconds = compiled_beside(
            settled, circuit, min(count, settled.count), settled.seed
        )
        n = compiled.blocks
        twin = Trajectories(
            settled.eqs,
            compiled.count,
            settled.seed,
            settled.h,
            circuit=settled.circuit,
            controlled=settled.controlled,
            origin=(settled.state[:n].copy(), settled.filter[:n].copy(), settled.words[:n].copy()),
        )
        if compiled.time:
            twin.run(compiled.time)
        compiled.filter[:], compiled.words[:] = twin.filter, twin.words
        begin = time.perf_counter()
        for trajectories in (compiled, twin):
            trajectories.run(slowest)
        if (
            begin + (SETTLING + AVERAGED) * (time.perf_counter() - begin)
            > deadline + compilation_seconds
        ):
            return {}
        for trajectories in (compiled, twin):
            trajectories.run((SETTLING - 1.0) * slowest)
        high, low = (trajectories.run(AVERAGED * slowest) for trajectories in (compiled, twin))
    except HarvesterError:
        return {}
    failed = compiled.own_sums[1]  # steps that did not converge
    if failed:
        return {}
    return {name: _largest(name, high, low, compiled.together) for name in ("V2", "load")}


def _largest(name: str, high: Moments, low: Moments, together: int) -> float:
    """The relative difference of a moment at 95 %, and that of the reference."""
    mine, its = (getattr(moments, name) for moments in (high, low))
    size = float(its.mean())
    if not size > 0.0:
        return 0.0
    difference = difference95(mine, its, (high.controls, low.controls), together)
    return share95(difference, size) + JUDGE


def _of_periods(
    circuit: "CompiledCircuit", problem: Problem, pair: "RichardsonPair"
) -> dict[str, float]:
    """The same of a steady excitation, from the compiled circuit's periodic response.

    Empty if it has none.
    """
    from harvester.circuits.circuit_period import periodic_response

    eqs = problem.equations
    scales = problem.scales
    h = pair.trajectories.h
    responses = [periodic_response(circuit, eqs, part * h, SETTLED) for part in FINE]
    moments = [
        (response.power, response.square, *response.left) for response in responses if response
    ]
    if len(moments) < len(FINE):
        return {}
    (rough, _), (fine, left) = np.reshape(moments, (2, 2, 2))
    its = np.array(
        [
            (eqs.beta or 0.0) * pair.mean("load")[0] * scales.watts,
            pair.mean("V2")[0] * scales.volts**2,
        ]
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.abs(fine / its - 1.0) + np.abs(fine - rough) / its + left + JUDGE
    return {
        name: float(share)
        for name, share, size in zip(("load", "V2"), off, its, strict=True)
        if size > 0.0
    }
