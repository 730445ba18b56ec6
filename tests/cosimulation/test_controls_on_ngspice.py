"""Controls made of ngspice's own paths, and runs that begin in given states."""

import dataclasses

import numpy as np
import pytest

from harvester.cosimulation import runs as worker
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.mechanics.kernels.circuit_control_variates import (
    add_circuit_features,
    circuit_boundary,
    path_controls,
)
from harvester.mechanics.kernels.coefficients import BATCH, State, coefficients
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.value import mean_and_error
from tests.support.lockstep import scales
from tests.support.systems import PAPER, linear, linear_v2, z

LINEAR = linear(0.5, 0.8)


def device(load, eqs=LINEAR, h=0.1):
    return worker.CoupledDevice(eqs, scales(0.5, 1e-3), load_circuit(load), h, 4)


def begun(one, start):
    """V and the voltage of Csmooth just before the first kick of a run from ``start``."""
    drive = worker.run_in_this_process(one, worker.new_drive(one, np.zeros(8), start=start))
    return drive.kicked[0, 2:4]


@pytest.mark.ngspice
@pytest.mark.parametrize("netlist", ["bridge", "doubler", "parallel_sshi", "series_sshi", "sece"])
def test_a_run_begins_charged(netlist):
    """The piezo's and the smoothing capacitor's voltage are those of the start, less the charge of
    the diodes at once."""
    one = dataclasses.replace(
        device(Load(netlist=netlist), dataclasses.replace(LINEAR, mu=None)), h=0.01
    )
    start = (0.5, 0.0, 0.2, 0.6)
    ((V, U),) = map_in_workers(begun, [(one, start)])
    assert pytest.approx(0.6, rel=0.02) == U
    assert pytest.approx(0.2, abs=0.05) == V


@pytest.mark.thorough("test_a_run_begins_charged")
@pytest.mark.ngspice
@pytest.mark.statistics
def test_controls_of_ngspice_runs():
    """A linear scene with a load resistor: the mean is the closed form's, from a twentieth of the runs or less."""
    one = device(Load(resistance=scales(0.5, 1e-3).resistance(0.8)), h=0.05)
    seeds = np.random.SeedSequence(6).spawn(12)
    runs = list(worker.measure_in_workers(one, seeds, 9600, 80.0, blocks=12))
    values = np.concatenate([run.moments.V2 for run in runs])
    controls = np.vstack([run.moments.controls for run in runs])
    plain = values.reshape(12, -1).mean(axis=1)
    entries = controlled_entries(values, controls, 12)
    assert entries.var() < plain.var() / 20.0
    # the step's bias
    assert abs(z(mean_and_error(entries), linear_v2(LINEAR), 1e-3 * linear_v2(LINEAR))) < 4.0
    power = np.concatenate([run.load_power for run in runs]).reshape(12, -1).mean(axis=1)
    ledgers = np.array([run.ledger.load for run in runs])
    # a last block ends up to a reading before the run
    assert power == pytest.approx(ledgers, rel=0.01)


def test_columns_of_a_path_are_those_of_the_lanes():
    """Kick by kick, the compiled features of many trajectories make the martingales of a recorded path."""
    rng = np.random.default_rng(8)
    states = rng.standard_normal((4, 2, 6))
    noise = rng.standard_normal((2, 5))
    eqs = dataclasses.replace(PAPER, n12=0.002)
    found = path_controls(eqs, states, noise, 0.5)
    for block in (0, 1):
        sums = np.zeros(9 * BATCH)
        for k in range(5):
            x, v, V, U = states[:, block, k]
            add_circuit_features.py_func(
                0, State(x, v, V), U, noise[block, k], sums, coefficients(eqs)
            )
        assert found[block, ::2] == pytest.approx(sums[::BATCH] / 0.5, rel=1e-12)
        change = circuit_boundary(states[:, block, 5], eqs) - circuit_boundary(
            states[:, block, 0], eqs
        )
        assert found[block, 1::2] == pytest.approx(change / 0.5, rel=1e-12)
