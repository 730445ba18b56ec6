"""ngspice in lock-step with a mass that a drive or filtered noise shakes, against the exact RC update."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation import runs as worker
from harvester.cosimulation.lockstep.rigid_stop import impact
from harvester.cosimulation.lockstep.state import DURING
from harvester.mechanics.kernels.coefficients import Coefficients
from harvester.mechanics.kernels.compiled import interpreted
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.noise import gaussian_grid
from harvester.mechanics.trace import trace
from tests.support.lockstep import PLATE, SEED, check_callbacks, device, rms_difference, scales
from tests.support.systems import BAND, COLOURED, DRIVEN, PAPER, changed, linear_v2, scene

pytestmark = pytest.mark.ngspice

HARMONIC = {"drive": 0.5, "drive_frequency": 1.2}
TONE = changed(PAPER, **HARMONIC)  # with a stop and white noise
HUM = changed(PLATE, n1=None, coloured=0.02, correlation_time=2.0)
STRIP = changed(PAPER, n1=None, n2=None, restitution=None, coloured=0.02, centre=1.2, bandwidth=0.3)


def shaken(eqs, h, duration, stride=4):
    noise = gaussian_grid(SEED, round(duration / h))
    return noise, forcing(eqs, h, len(noise), np.random.default_rng(3))


@pytest.mark.parametrize("h", [0.1, 0.05])
@pytest.mark.parametrize(
    "eqs, duration, most",
    [
        pytest.param(TONE, 40.0, 5e-5, marks=pytest.mark.thorough("test_path")),
        pytest.param(HUM, 200.0, 3e-4, marks=pytest.mark.thorough("test_path")),
        (STRIP, 100.0, 1e-5),
    ],
    ids=["drive", "hum", "band"],
)
def test_path(eqs, duration, most, h):
    """Relative RMS difference of V and x on the same forcing, at the tolerances of white noise; impacts within 1e-4.

    Under a drive V is off by O(h^2) from the first step on, before which ngspice takes its source
    for one at rest.
    """
    noise, a = shaken(eqs, h, duration)
    ours = worker.path_in_worker(device(eqs, h, 4), noise, a)
    exact = trace(eqs, noise, h, 4, shaking=a)
    assert rms_difference(ours, exact) < most
    assert rms_difference(ours, exact, "x") < most
    assert ours.impacts == pytest.approx(exact.impacts, abs=1e-4)
    assert (ours.shaking == exact.shaking).all()
    if eqs.restitution is not None:
        assert len(exact.impacts) > 10


@pytest.mark.thorough("test_path")
@pytest.mark.parametrize("eqs", [TONE, STRIP])
def test_compiled_and_interpreted_callbacks_are_the_same_path(eqs):
    noise, a = shaken(eqs, 0.1, 30.0)
    check_callbacks(device(eqs, 0.1, 4), noise, a)


@pytest.mark.thorough("test_path")
@pytest.mark.parametrize("eqs", [TONE, HUM])
def test_ledger_closes(eqs):
    """The drive's work is input."""
    one = next(
        worker.measure_in_workers(device(eqs, 0.02, 10, scales(eqs.beta)), [SEED], 20_000, 20.0)
    )
    assert abs(one.ledger.residual) < 0.01
    assert one.ledger.input > 0.0


@pytest.mark.thorough("test_path")
def test_engine_under_a_drive():
    """No noise: the closed form within the step's bias, no sampling error, and the balance closes."""
    answer = hv.Spice(trajectories=2).run(scene(DRIVEN))
    exact = linear_v2(DRIVEN)
    value = answer.mean_square_voltage
    assert value.stderr is None
    assert abs(value.value - exact) < 1.5 * value.bias
    assert "nothing is random" in answer.reason
    assert abs(answer.details["power_balance"]) < 2e-3


@pytest.mark.thorough("test_path")
@pytest.mark.parametrize("eqs", [COLOURED, BAND])
def test_engine_under_filtered_noise(eqs):
    """E[V^2] within four standard errors and the step's bias of the closed form."""
    answer = hv.Spice(trajectories=8).run(scene(eqs)).mean_square_voltage
    assert abs(answer.value - linear_v2(eqs)) < 4 * answer.stderr + answer.bias
    assert answer.stderr < 0.1 * answer.value


QUIET = changed(DRIVEN, drive_frequency=0.5, restitution=0.5, gap=0.0)
# scenes that chatter and stick, bounce for ever, lie under preload, and meet two stops
IMPACTING = {
    "lies": (changed(QUIET, restitution=0.0), 5e-5),
    "chatters": (QUIET, 5e-5),
    "bounces": (changed(QUIET, restitution=1.0), 1e-3),
    "gap": (changed(QUIET, gap=0.3, drive_frequency=1.1), 5e-5),
    "preload": (changed(QUIET, restitution=0.0, gap=-0.3, drive_frequency=1.1), 5e-5),
    "two": (
        changed(QUIET, gap=0.3, opposite_restitution=0.6, opposite_gap=0.5, drive_frequency=1.1),
        2e-4,
    ),
    "hum": (changed(HUM, restitution=0.8, gap=0.0), 2e-3),
}


REMAINING = ("hum",)  # the others are the ensemble's, or the same with one stop
OTHERS = pytest.mark.thorough("test_impacts_without_white_noise")


@pytest.mark.parametrize(
    "eqs, most",
    [
        pytest.param(*case, id=name, marks=() if name in REMAINING else OTHERS)
        for name, case in IMPACTING.items()
    ],
)
def test_impacts_without_white_noise(eqs, most):
    """On the path of `trace`, impact by impact, chatter and rests on the stop included, whose times are exact there."""
    noise, a = shaken(eqs, 0.05, 100.0)
    ours = worker.path_in_worker(device(eqs, 0.05, 4), noise, a)
    exact = trace(eqs, noise, 0.05, 4, shaking=a)
    assert rms_difference(ours, exact) < most
    assert rms_difference(ours, exact, "x") < most
    assert len(exact.impacts) > 10
    assert ours.impacts == pytest.approx(exact.impacts, abs=10 * most)
    low = -(eqs.gap or 0.0)
    high = np.inf if eqs.opposite_gap is None else eqs.opposite_gap
    assert low <= ours.x.min() <= ours.x.max() <= high
    assert ((ours.x == low) == (exact.x == low)).all()


@pytest.mark.thorough("test_path")
@pytest.mark.parametrize("name", ["lies", "chatters", "two"])
def test_callbacks_of_impacts_without_white_noise(name):
    """Interpreted, they give the compiled path."""
    eqs, _ = IMPACTING[name]
    noise, a = shaken(eqs, 0.1, 30.0)
    check_callbacks(device(eqs, 0.1, 4), noise, a)


@pytest.mark.thorough("test_path")
@pytest.mark.parametrize("name", ["lies", "chatters", "gap", "two"])
def test_ledger_of_impacts_without_white_noise(name):
    """It closes better the finer the step, impacts and rests included."""
    eqs = IMPACTING[name][0]
    residuals = []
    for h in (0.04, 0.01):
        steps = round(400.0 / h)
        one = next(
            worker.measure_in_workers(device(eqs, h, 10, scales(eqs.beta)), [SEED], steps, 100.0)
        )
        residuals.append(abs(one.ledger.residual))
        assert one.ledger.impacts > 0.1 * one.ledger.input
    assert residuals[1] < 5e-3
    assert residuals[1] < max(0.5 * residuals[0], 1e-3)


@pytest.mark.parametrize("side, place", [(1.0, -0.3), (-1.0, 0.5)])
def test_works_of_an_impact(side, place):
    """The stop dissipates (1 - r^2) v^2/2; the shaking has done its share of what the flight before gained."""
    speed = 1.1
    up = 0.8
    before = 0.6
    share = 0.25
    s = SimpleNamespace(
        side=side, speed=speed, up=up, before=side * before, share=share, measuring=DURING
    )
    s.n_steps = 7
    s.h = 0.1
    s.meet = 0.04
    s.impacts = 0
    s.impact_work = 2.0
    s.noise_work = 3.0
    record = np.zeros((1, 2))
    interpreted(impact)(s, record, Coefficients(gap=0.3, high=0.5))
    assert (s.x, s.impacts, s.flown) == (place, 1, 1)
    assert record[0] == pytest.approx([0.74, side * speed], rel=1e-12)
    assert s.impact_work - 2.0 == pytest.approx((speed**2 - up**2) / 2, rel=1e-12)
    assert s.noise_work - 3.0 == pytest.approx(share * (speed**2 - before**2) / 2, rel=1e-12)


@pytest.mark.thorough("test_impacts_without_white_noise")
def test_engine_with_a_stop_under_a_drive():
    """The ensemble's answer within both steps' bias; with a rectifier the ledger closes, in the unit of the power."""
    eqs = changed(QUIET, drive_frequency=1.1)
    few = hv.Spice(trajectories=2, duration=20.0).run(scene(eqs))
    many = hv.Ensemble(trajectories=64).run(scene(eqs))
    a, b = few.mean_square_voltage, many.mean_square_voltage
    assert abs(a.value - b.value) < a.bias + b.bias + 4 * np.hypot(a.stderr or 0.0, b.stderr or 0.0)
    # or it forgets in minutes
    device = hv.load("examples/plate_harmonic.toml").vary("oscillator.damping", 0.32)
    load = hv.Load(netlist="bridge", parameters={"C": "0.1 uF"})
    stopped = dataclasses.replace(device, stop=hv.Stop(restitution=0.8, gap=0.0), load=load)
    answer = hv.Spice(trajectories=2, duration=4.0).run(stopped)
    assert abs(answer.details["ledger_residual"]) < 0.02
    entries = {
        key: answer.details[f"ledger_{key}"]
        for key in ("damping", "impacts", "circuit", "load", "stored")
    }
    assert entries["load"] == pytest.approx(answer.mean_power.value, rel=1e-9)
    assert entries["impacts"] > 0.0
    assert sum(entries.values()) == pytest.approx(answer.details["ledger_input"], rel=0.02)
