"""The rectifier's current at a held voltage against closed forms, and its table."""

import dataclasses
import math

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.storage.measured_current import measured
from harvester.storage.rectified_current import RectifiedCurrent
from tests.support.paths import EXAMPLES

MASS = 0.02
STIFFNESS = 1800.0
RATIO = 0.02
THETA = 1e-4
CP = 50e-9
A = 40.0


@pytest.fixture(scope="module")
def weak():
    """A weakly coupled device at resonance: the mass does not feel the bridge."""
    w = math.sqrt(STIFFNESS / MASS)
    scene = hv.Scene(
        oscillator=hv.Oscillator(mass=MASS, stiffness=STIFFNESS, damping_ratio=RATIO),
        piezo=hv.Piezo(coupling=THETA, capacitance=CP),
        excitation=hv.Excitation(acceleration_amplitude=A, frequency=w / (2 * math.pi)),
        load=hv.Netlist("bridge", C=1e-3, R=1e9),
    )
    problem = Problem.of(scene)
    return measured(problem).best, w


def test_it_is_that_of_a_bridge_on_a_fixed_amplitude(weak):
    """I = 2 w Cp (Voc - V - 2 Vd)/pi with the drop Vd of a 1N4148 at the peak current (Ottman and others, 2002)."""
    table, w = weak
    voc = THETA / CP * A / (2.0 * RATIO * w**2)
    drop = 1.752 * 0.02585 * math.log(CP * w * voc / 2.52e-9)
    volts = np.linspace(0.0, 0.7, 5) * voc
    expected = 2.0 * w * CP * (voc - volts - 2.0 * drop) / math.pi
    # drops fall with the current
    assert table.at(volts) == pytest.approx(expected, abs=0.02 * expected[0])
    # nothing but leakage
    assert abs(float(table.at(np.array([2.0 * voc]))[0])) < 1e-3 * expected[0]


def test_the_ring_up_takes_a_time_constant_of_the_mass(weak):
    """1 - exp(-t/tau) leaves out tau, and somewhat more as the first volts do not pass the diodes."""
    table, w = weak
    tau = 1.0 / (RATIO * w)
    assert tau * 0.98 < table.ring_up / table.current[0] < 1.3 * tau


def test_leaving_out_voltages_changes_a_smooth_table_little(weak):
    table, _ = weak
    volts = np.linspace(0.0, 0.5 * table.voltages[-1], 50)
    assert np.abs(table.halved().at(volts) - table.at(volts)).max() < 0.01 * table.current[0]
    assert table.halved().voltages[[0, -1]] == pytest.approx(table.voltages[[0, -1]])


@pytest.mark.thorough("test_it_is_that_of_a_bridge_on_a_fixed_amplitude")
def test_noise_gives_a_current_with_its_errors():
    """Two seeds agree within their standard errors, and fluctuate about as the spectral density states."""
    scene = hv.load("examples/plate_bridge.toml")
    tables = [measured(Problem.of(scene), 3.0, seed=seed).best for seed in (1, 2)]
    first, second = tables
    z = (first.current - second.current) / np.hypot(first.stderr, second.stderr)
    assert np.abs(z).max() < 4.0 and z.std() > 0.3
    assert np.all(first.density > 0.0)


def test_the_delay_is_what_the_lag_does_not_make_up():
    one = np.ones(3)
    table = RectifiedCurrent(np.arange(3.0), one * 2e-6, None, one, one, 0.1 * one, 5e-7)
    assert table.delay == pytest.approx(0.25 - 0.1)


@pytest.mark.statistics
def test_runs_on_one_record_are_no_whole_sample():
    """Under tabulated noise 64 runs share a record: there are some records, whose scatter is the stated error."""
    noise = hv.Excitation(acceleration_psd_file=str(EXAMPLES / "shake_psd.csv"))
    scene = dataclasses.replace(hv.load(EXAMPLES / "plate_bridge.toml"), excitation=noise)
    tables = [
        measured(Problem.of(scene), 1.0, seed=seed, count=3, runs=64).best for seed in range(12)
    ]
    scatter = np.std([table.current for table in tables], axis=0, ddof=1)
    stated = np.sqrt(np.mean([table.stderr**2 for table in tables], axis=0))
    # Four records have Student's quantile 3.18 in place of 1.96.
    assert (0.5 * 1.62 * scatter < stated).all() and (stated < 2.0 * 1.62 * scatter).all()
