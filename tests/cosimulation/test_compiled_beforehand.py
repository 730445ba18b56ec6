"""A worker that compiles what runs next to a compiled circuit need, while the program compiles the rest."""

import dataclasses
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest

import harvester as hv
from harvester.circuits import substeps
from harvester.circuits.compiled_circuit import TYPICAL, CompiledCircuit
from harvester.cosimulation import worker_pool
from harvester.cosimulation.runs import CoupledDevice, compiled_beforehand
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels import compiled

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def problem():
    scene = hv.load(EXAMPLES / "plate_bridge.toml")
    return Problem.of(dataclasses.replace(scene, stop=hv.Stop(restitution=0.96)))


def test_a_circuit_waits_for_the_compilation_in_another_process_and_is_the_same(
    problem, monkeypatch
):
    def moments():
        circuit = CompiledCircuit(problem.circuit, problem.scales)
        own = Trajectories(problem.equations, 16, np.random.SeedSequence(0), 0.2, circuit=circuit)
        own.run(4.0)
        return own.state

    before = moments()

    class Slow(Future):
        """A job that ends when somebody waits for it."""

        asked = 0

        def done(self):
            self.asked += 1
            return self.asked > 1

    job = Slow()
    job.set_result(None)
    later = compiled.LaterFunction(substeps.follow.compiled, substeps.follow.function)
    later.elsewhere = job
    monkeypatch.setattr(compiled.LaterFunction, "is_cached", False)
    monkeypatch.setattr("harvester.circuits.compiled_circuit.follow", later)
    assert np.array_equal(moments(), before)  # the call without a step has changed nothing
    assert job.asked and not later.waits and later.address


@pytest.mark.ngspice
def test_a_worker_goes_ahead_where_there_are_several_cores_and_is_used_or_ended(
    problem, monkeypatch
):
    monkeypatch.setattr(worker_pool, "worker_count", lambda: 2)
    monkeypatch.setattr(worker_pool, "idle_workers", type(worker_pool.idle_workers)())
    circuit = CompiledCircuit(problem.circuit, problem.scales)
    device = CoupledDevice(
        problem.equations, problem.scales, problem.circuit, TYPICAL, 2, ideal=circuit
    )
    with compiled_beforehand(device):
        ((process, futures),) = worker_pool.workers_ahead
    assert list(worker_pool.map_in_workers(abs, [(-1,)])) == [1]
    assert (
        not worker_pool.workers_ahead
        and futures[-1].result().steps > 0
        and process in worker_pool.idle_workers
    )
    with compiled_beforehand(device):
        assert not worker_pool.workers_ahead  # beside workers that run already
    worker_pool.idle_workers.clear()
    with pytest.raises(ZeroDivisionError), compiled_beforehand(device):
        ((other, _),) = worker_pool.workers_ahead
        raise ZeroDivisionError
    assert not worker_pool.workers_ahead
    with pytest.raises(RuntimeError):
        other.submit(abs, 1)
    monkeypatch.setattr(worker_pool, "worker_count", lambda: 1)
    with compiled_beforehand(device):
        assert not worker_pool.workers_ahead


@pytest.mark.ngspice
def test_a_worker_that_finds_no_ngspice_takes_no_further_job(problem, monkeypatch):
    """The reference of a compiled circuit has no answer, and ngspice answers where its library is named again."""
    monkeypatch.setattr(worker_pool, "idle_workers", type(worker_pool.idle_workers)())
    engine = hv.Compiled(trajectories=64, duration="0.05s", dt="0.1ms")
    with monkeypatch.context() as nowhere:
        nowhere.setenv("NGSPICE_LIBRARY_PATH", "/nowhere/libngspice.so")
        assert engine.run(problem).mean_power.error95 is None
    assert not worker_pool.idle_workers
    assert engine.run(problem).mean_power.error95 > 0.0
