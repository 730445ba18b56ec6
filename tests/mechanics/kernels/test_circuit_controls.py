"""Controls of the circuits of ideal elements: no bias, and means that are worth many times as many trajectories."""

import numpy as np
import pytest

from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit, SwitchedCoil
from harvester.uncertainty.value import mean_and_error
from tests.support.systems import changed, z

PLATE = Equations(beta=1.245, c1=-0.008, n1=1.0)
BRIDGE = IdealCircuit(mu=0.5, kappa=20.0, n=0.0066, leak=7e-4, loss=0.0, bridge=True)
SSHI = IdealCircuit(
    mu=0.5,
    kappa=20.0,
    n=0.0066,
    leak=7e-4,
    loss=0.0,
    bridge=True,
    hysteresis=0.005,
    parallel=SwitchedCoil(0.7, 150.0),
)
STOP = changed(PLATE, restitution=0.96)


def stationary(eqs, circuit, count, seed=1):
    many = Trajectories(eqs, count, np.random.SeedSequence(seed), circuit=circuit, controlled=True)
    burn_in(many)
    return many


def test_absent_when_not_asked_for():
    seed = np.random.SeedSequence(3)
    plain, wished = (
        Trajectories(STOP, 64, seed, 0.1, circuit=SSHI, controlled=w).run(40.0)
        for w in (False, True)
    )
    assert plain.controls is None
    assert wished.controls.shape == (64, 18)
    np.testing.assert_allclose(plain.load, wished.load, rtol=1e-9)


OTHERS = pytest.mark.thorough("test_power_is_worth_many_times_as_many_trajectories")


@pytest.mark.parametrize(
    "eqs, circuit, floor",
    [
        pytest.param(PLATE, BRIDGE, 25.0, id="bridge", marks=OTHERS),
        pytest.param(STOP, BRIDGE, 20.0, id="bridge-stop", marks=OTHERS),
        pytest.param(STOP, SSHI, 8.0, id="sshi-stop"),
    ],
)
def test_power_is_worth_many_times_as_many_trajectories(eqs, circuit, floor):
    """And plain and controlled means agree: boundaries take a stationary path for granted."""
    moments = stationary(eqs, circuit, 512).run(400.0)
    plain = moments.mean("load")
    controlled = mean_and_error(moments.controlled("load"))
    assert (plain[1] / controlled[1]) ** 2 > floor
    assert abs(z(plain, *controlled)) < 4.0


@pytest.mark.thorough("test_power_is_worth_many_times_as_many_trajectories")
@pytest.mark.statistics
def test_no_bias_at_a_large_step():
    """The controlled mean is that of a long plain run at the same step, with impacts and switchings."""
    circuit = SSHI
    short, long = (Trajectories(STOP, n, np.random.SeedSequence(n), 0.15, circuit=circuit, controlled=n == 512)
                   for n in (512, 1024))  # fmt: skip
    for one in (short, long):
        one.run(300.0)
    found, known = short.run(200.0), long.run(4000.0)
    for name in ("load", "V2", "x2"):
        assert abs(z(mean_and_error(found.controlled(name)), *known.mean(name))) < 4.0, name
