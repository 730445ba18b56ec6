"""Storage capacitors behind a rectifier, held or free: two advances in a row are one of their length."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_stores import StoreOnPath
from harvester.storage.measured_current import Rectifier
from tests.support.paths import EXAMPLES

PERIOD = 2.0 * math.pi


def store_on_path(volts):
    """A storage capacitor of 1 uF behind the bridge of an example, under a sinusoid; rounded to a tenth of a period."""
    scene = hv.load(EXAMPLES / "plate_harmonic.toml").with_load(netlist="bridge")
    problem = Problem.of(scene)
    period = problem.equations.shaking_period
    h = step_from_rest(problem.equations)
    circuit = Rectifier(problem).compiled(1e-6)
    store = StoreOnPath(problem, circuit, 1e-6, h, part=period / 8.0)
    store.advance(volts, 8.0 * period)
    return store, period


@pytest.mark.parametrize("first", [0.25, 0.5, 1.375])
def test_two_advances_are_one_of_their_length(first):
    """The excitation continues, and so do mass, circuit, charge and the count of steps."""
    whole, period = store_on_path(2.0)
    parts, _ = store_on_path(2.0)
    before = whole.steps
    at_once = whole.advance(None, 3.0 * period)
    one, two = (parts.advance(None, part * period) for part in (first, 3.0 - first))
    assert one.seconds + two.seconds == pytest.approx(at_once.seconds, rel=1e-12)
    assert one.seconds / two.seconds == pytest.approx(first / (3.0 - first), rel=1e-9)
    assert one.charges + two.charges == pytest.approx(at_once.charges, rel=1e-9)
    assert parts.volts == pytest.approx(whole.volts, rel=1e-12)
    mean = (one.squares * one.seconds + two.squares * two.seconds) / at_once.seconds
    assert mean == pytest.approx(at_once.squares, rel=1e-9)
    assert parts.steps == whole.steps > before
    assert parts.peak == pytest.approx(whole.peak, rel=1e-12)


def test_the_largest_displacement_is_that_since_the_beginning():
    """It never falls, and an empty storage capacitor limits the piezo's voltage."""
    store, period = store_on_path(0.0)
    peak = store.peak
    squares = store.advance(0.0, period).squares
    assert store.peak >= peak > 0.0
    # the bridge conducts at the voltage of two diodes, in either direction
    assert 0.0 < math.sqrt(float(squares[0])) < 2.0
    assert np.isfinite(store.volts).all()
