"""A compiled circuit that several threads use at once, and its source in the cache."""

import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest

import harvester as hv
from harvester.circuits import newton
from harvester.equations.problem import Problem
from harvester.errors import UnboundedResponseError
from harvester.mechanics.ensemble.trajectories import Trajectories
from tests.support.netlists import compiled, on_plate

THREADS = 8


@pytest.fixture
def hasty_threads():
    """Threads take turns all the time, so that a race shows at once."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_threads_that_ask_at_once_get_the_same_arrays(hasty_threads):
    """A record of a thread's own would point to arrays that are freed: the first answer of a process was wrong."""
    circuit = compiled(hv.load("examples/plate_harmonic.toml").with_load(netlist="bridge"))
    together = Barrier(THREADS)

    def record(h):
        together.wait()
        return circuit.for_kernels(h).record

    with ThreadPoolExecutor(THREADS) as pool:
        for k in range(10):
            h = 0.01 + 1e-4 * k
            found = list(pool.map(record, [h] * THREADS))
            assert all(one is circuit.for_kernels(h).record for one in found)


def test_a_damaged_source_in_the_cache_is_written_anew(tmp_path, monkeypatch):
    monkeypatch.setattr("harvester.mechanics.kernels.compiled._cache_folder", lambda: str(tmp_path))
    text = "solve = 12\n"
    assert newton.compiled_source.__wrapped__(text) == 12
    (path,) = tmp_path.glob("circuit_*.py")
    path.write_text("solve = 13\n")
    assert newton.compiled_source.__wrapped__(text) == 12
    assert path.read_text() == text


def test_a_circuit_that_gives_power_ends_a_long_run_early(tmp_path):
    """Trajectories are looked at between pieces, where ^C is heard as well: to its end this run would take an hour."""
    scene = on_plate(tmp_path, "Rload p n 100k\nC1 p n 1n\nR9 p n -5k")
    problem = Problem.of(scene)
    many = Trajectories(
        problem.equations, 128, np.random.SeedSequence(1), 0.01, circuit=compiled(scene)
    )
    with pytest.raises(UnboundedResponseError, match="it left the finite numbers"):
        many.run(1e6)
