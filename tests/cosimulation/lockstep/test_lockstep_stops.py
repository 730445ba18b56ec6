"""ngspice in lock-step with a mass between stops, or on another spring, against the exact RC update."""

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation import runs as worker
from harvester.errors import SimulationError
from harvester.mechanics.kernels.noise import gaussian_grid, refined
from harvester.mechanics.trace import trace
from tests.support.lockstep import (
    PLATE,
    SEED,
    both,
    check_callbacks,
    device,
    rms_difference,
    scales,
)
from tests.support.systems import PAPER, changed, padded, scene

pytestmark = pytest.mark.ngspice

TWO = {"gap": 0.2, "opposite_gap": 0.3, "opposite_restitution": 0.9}
SPRING = {"linear": 1.0, "alpha2": 0.0}
FULL = padded(PAPER, **SPRING)  # each kind of stop is compiled once
# the other stop is never met
PRESSED = changed(FULL, gap=-0.2, opposite_gap=9.0, opposite_restitution=0.9)
BISTABLE = changed(FULL, restitution=None, linear=-1.0, alpha=2.0)


@pytest.mark.parametrize("h", [0.1, 0.05])
@pytest.mark.parametrize(
    "eqs, duration",
    [
        pytest.param(PRESSED, 15.0, marks=pytest.mark.thorough("test_path")),
        (changed(FULL, **TWO), 100.0),
        (BISTABLE, 20.0),
        pytest.param(
            changed(PRESSED, alpha2=0.4, gap=0.0), 100.0, marks=pytest.mark.thorough("test_path")
        ),
    ],
    ids=["preload", "both sides", "bistable", "quadratic"],
)
def test_path(eqs, duration, h):
    """Relative RMS difference of V below 2e-5, of x below 1e-5, impacts within 1e-4, while paths are not chaotic."""
    ours, exact = both(eqs, h, duration)
    assert rms_difference(ours, exact) < 2e-5
    assert rms_difference(ours, exact, "x") < 1e-5
    assert ours.impacts == pytest.approx(exact.impacts, abs=1e-4)
    if eqs.restitution is not None:
        assert len(exact.impacts) > 15
    if eqs.opposite_gap == 0.3:
        assert (exact.impacts[:, 1] > 0).any()
        assert (exact.impacts[:, 1] < 0).any()


@pytest.mark.thorough("test_path")
@pytest.mark.parametrize(
    "eqs",
    [
        padded(changed(PLATE, restitution=0.96, **TWO), **SPRING),
        padded(changed(PLATE, linear=-1.0, alpha=50.0), alpha2=0.0),
    ],
)
def test_strong_coupling_converges_at_second_order(eqs):
    """beta = 1.25: the difference of V falls with the square of the step, in the geometric mean over paths."""
    steps = (0.1, 0.05, 0.025, 0.0125)
    differences = np.empty((4, len(steps)))
    for seed, row in enumerate(differences):
        noise = gaussian_grid(np.random.SeedSequence(seed), 60)
        rng = np.random.default_rng(1)
        for i, h in enumerate(steps):
            row[i] = rms_difference(*both(eqs, h, stride=1, noise=noise))
            noise = refined(noise, rng)
    assert np.polyfit(np.log(steps), np.log(differences).mean(axis=0), 1)[0] > 1.8
    assert differences[:, -1].max() < 1e-3


def compliant(k, **others):
    return changed(
        FULL,
        restitution=None,
        stop_stiffness=k,
        stop_damping=0.1 * k**0.5,
        **{"gap": 0.0, **others},
    )


@pytest.mark.parametrize(
    "eqs, h, duration, most",
    [
        (compliant(4.0), 0.05, 60.0, 2e-4),
        (compliant(400.0), 0.1, 60.0, 2e-5),
        (compliant(4e4), 0.05, 60.0, 5e-5),
        (compliant(400.0, gap=0.3), 0.05, 60.0, 1e-5),
        (compliant(400.0, gap=-0.1), 0.025, 20.0, 2e-5),
        pytest.param(
            compliant(400.0, n1=None, n2=None, drive=0.7, drive_frequency=1.1),
            0.05,
            60.0,
            2e-4,
            marks=pytest.mark.thorough("test_path_at_a_compliant_stop"),
        ),
    ],
    ids=["soft", "stiff", "hard", "distance", "preload", "drive"],
)
def test_path_at_a_compliant_stop(eqs, h, duration, most):
    """Contacts longer and shorter than a step; relative RMS difference of V and x, and impacts."""
    ours, exact = both(eqs, h, duration)
    assert rms_difference(ours, exact) < most
    assert rms_difference(ours, exact, "x") < most
    assert len(exact.impacts) > 5
    assert ours.impacts == pytest.approx(exact.impacts, abs=5 * most)
    assert ours.x.min() < -(eqs.gap or 0.0) - 1e-3


@pytest.mark.thorough("test_path_at_a_compliant_stop")
def test_engine_at_a_compliant_stop_agrees_with_the_ensemble():
    """E[V^2] within four standard errors and the bias of both steps; the ledger closes, the stop's loss in it."""
    given = scene(changed(PAPER, restitution=None, stop_stiffness=400.0, stop_damping=2.0, c1=-0.2))
    a, b = hv.Spice(duration=300.0).run(given), hv.Ensemble(within=0.01).run(given)
    few, many = a.mean_square_voltage, b.mean_square_voltage
    assert (
        abs(few.value - many.value) < 4 * np.hypot(few.stderr, many.stderr) + few.bias + many.bias
    )
    assert few.stderr < 0.05 * few.value
    assert abs(a.details["ledger_residual"]) < 0.01
    assert a.details["ledger_impacts"] > 0.2 * a.details["ledger_input"]


@pytest.mark.thorough("test_path")
@pytest.mark.parametrize(
    "eqs", [changed(FULL, **TWO), PRESSED, changed(BISTABLE, alpha2=0.1), compliant(50.0, gap=0.1)]
)
def test_compiled_and_interpreted_callbacks_are_the_same_path(eqs):
    noise = gaussian_grid(SEED, 300)
    check_callbacks(device(eqs, 0.1, 4), noise)


@pytest.mark.parametrize(
    "eqs", [changed(FULL, **TWO), changed(BISTABLE, alpha2=0.1), PRESSED, compliant(50.0)]
)
def test_ledger_closes(eqs):
    """Springs store what they absorb, and each stop dissipates (1 - r^2) v^2/2 by its own r."""
    s = scales(eqs.beta)
    one = next(worker.measure_in_workers(device(eqs, 0.02, 10, s), [SEED], 20_000, 20.0, 1))
    assert abs(one.ledger.residual) < 0.01
    if eqs.restitution is not None:
        assert one.ledger.impacts == pytest.approx(s.watts * one.moments.impact_loss[0], rel=0.02)


def test_trajectories_begin_in_each_well():
    """One of two seeds begins in either well, and stays there while it is shaken too weakly to hop."""
    eqs = changed(BISTABLE, n1=1e-8, n2=0.0)
    seeds = [np.random.SeedSequence(k) for k in range(4)]
    means = [
        m.moments.x[0] for m in worker.measure_in_workers(device(eqs, 0.1, 4), seeds, 400, 0.0, 1)
    ]
    low, high = eqs.resting_places
    assert means == pytest.approx([low, high, low, high], abs=0.01)
    assert trace(eqs, np.zeros(4), 0.1).x[0] == pytest.approx(low)


def test_stops_too_near_for_the_lock_step_are_a_named_error():
    eqs = changed(
        FULL, c1=-0.1, restitution=1.0, gap=0.0, opposite_gap=0.002, opposite_restitution=1.0
    )
    with pytest.raises(SimulationError, match=r"at most twice a step .*: use engine 'ensemble'"):
        worker.path_in_worker(device(eqs, 0.1), gaussian_grid(SEED, 400))
