"""ngspice in lock-step with a mass that a drive or filtered noise shakes, against the exact RC update."""

import dataclasses

import numpy as np
import pytest

import harvester as hv
from harvester.circuit import worker
from harvester.errors import CannotServeError
from harvester.mechanics.noise import gaussian_grid
from harvester.mechanics.path import trace
from harvester.mechanics.shaking import forcing
from tests.systems import PAPER, changed, scene
from tests.test_ledger import scales
from tests.test_lockstep import PLATE, SEED, device, rms_difference
from tests.test_shaking import BAND, COLOURED, DRIVEN, continuum

HARMONIC = {"drive": 0.5, "drive_frequency": 1.2}
TONE = changed(PAPER, **HARMONIC)  # with a stop and white noise
HUM = changed(PLATE, n1=None, coloured=0.02, correlation_time=2.0)
STRIP = changed(PAPER, n1=None, n2=None, restitution=None, coloured=0.02, centre=1.2, bandwidth=0.3)


def shaken(eqs, h, duration, stride=4):
    noise = gaussian_grid(SEED, round(duration / h))
    return noise, forcing(eqs, h, len(noise), np.random.default_rng(3))


@pytest.mark.parametrize("h", [0.1, 0.05])
@pytest.mark.parametrize(
    "eqs, duration, most", [(TONE, 40.0, 5e-5), (HUM, 200.0, 3e-4), (STRIP, 100.0, 1e-5)], ids=["drive", "hum", "band"]
)
def test_path(eqs, duration, most, h):
    """Relative RMS difference of V and x on the same forcing, at the tolerances of white noise; impacts within 1e-4.

    Under a drive V is off by O(h^2) from the first step on, before which ngspice takes its source for one at rest.
    """
    noise, a = shaken(eqs, h, duration)
    ours, exact = worker.record_apart(device(eqs, h, 4), noise, a), trace(eqs, noise, h, 4, shaking=a)
    assert rms_difference(ours, exact) < most
    assert rms_difference(ours, exact, "x") < most
    assert ours.impacts == pytest.approx(exact.impacts, abs=1e-4)
    assert (ours.shaking == exact.shaking).all()
    if eqs.restitution is not None:
        assert len(exact.impacts) > 10


@pytest.mark.parametrize("eqs", [TONE, STRIP])
def test_compiled_and_interpreted_callbacks_are_the_same_path(eqs):
    noise, a = shaken(eqs, 0.1, 30.0)
    compiled, plain = (worker.record(device(eqs, 0.1, 4), noise, native, a) for native in (True, False))
    assert (compiled.readings == plain.readings).all()
    assert (compiled.impacts == plain.impacts).all()


@pytest.mark.parametrize("eqs", [TONE, HUM])
def test_ledger_closes(eqs):
    """The drive's work is input."""
    one = next(worker.measure_apart(device(eqs, 0.02, 10, scales(eqs.beta)), [SEED], 20_000, 20.0))
    assert abs(one.ledger.residual) < 0.01
    assert one.ledger.input > 0.0


def test_engine_under_a_drive():
    """No noise: the closed form within the step's bias, no sampling error, and the balance closes."""
    answer = hv.Spice(trajectories=2).run(scene(DRIVEN))
    exact = 0.5 * abs(continuum(DRIVEN)[1]) ** 2
    value = answer.mean_square_voltage
    assert value.stderr is None
    assert abs(value.value - exact) < 1.5 * value.bias
    assert "nothing is random" in answer.reason
    assert abs(answer.details["power_balance"]) < 2e-3


@pytest.mark.parametrize("eqs", [COLOURED, BAND])
def test_engine_under_filtered_noise_agrees_with_the_ensemble(eqs):
    few, many = hv.Spice(trajectories=8).run(scene(eqs)), hv.Ensemble().run(scene(eqs))
    a, b = few.mean_square_voltage, many.mean_square_voltage
    assert abs(a.value - b.value) < 4 * np.hypot(a.stderr, b.stderr) + a.bias + b.bias
    assert a.stderr < 0.1 * a.value


def test_rigid_stop_without_white_noise_is_refused():
    eqs = dataclasses.replace(DRIVEN, restitution=0.9)
    with pytest.raises(CannotServeError, match=r"white noise beside a rigid stop.*use engine 'ensemble'"):
        hv.Spice().run(scene(eqs))
