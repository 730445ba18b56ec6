"""Several modes: against the Lyapunov equation, the Gibbs law, and the energy that impacts dissipate."""

import math

import numpy as np
import pytest
from scipy.stats import norm

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.equations.modes import Modes
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.trace import trace
from tests.support.systems import BEAM, SECOND, THIRD

TURN = 2.0 * math.pi


THOROUGH = pytest.mark.thorough("test_linear_means")


@pytest.mark.slow
@pytest.mark.parametrize(
    "noise, modes",
    [
        ("white", (SECOND, THIRD)),
        pytest.param("tabulated", (SECOND,), marks=THOROUGH),
        pytest.param("white", (SECOND,), marks=THOROUGH),
        pytest.param("coloured", (SECOND, THIRD), marks=THOROUGH),
        pytest.param("tabulated", (SECOND, THIRD), marks=THOROUGH),
    ],
)
def test_linear_means(noise, modes):
    """Trajectories agree with the closed form, which is a Lyapunov equation or an integral of transfer functions."""
    shaking = {
        "white": BEAM.excitation,
        "coloured": BEAM.excitation.replace(correlation_time="1 ms"),
        "tabulated": hv.Excitation(profile="mil-std-810-truck-vertical"),
    }[noise]
    scene = BEAM.replace(mode=modes, excitation=shaking)
    exact = hv.run(scene, "exact").mean_power.value
    found = hv.run(
        scene,
        "ensemble",
        seed=2,
        trajectories=512,
        **({"duration": 1.0} if noise != "white" else {}),
    )
    power = found.mean_power
    assert abs(power.value - exact) < 4.0 * power.stderr + 1.5 * power.bias + 1e-3 * exact
    assert power.stderr < (3e-3 if noise == "white" else 0.03) * exact


def test_lyapunov_and_transfer_function():
    """White noise as a tabulated density far beyond all modes gives what the Lyapunov equation gives."""
    scene = BEAM.replace(mode=(SECOND, THIRD))
    white = hv.run(scene, "exact").mean_square_voltage.value
    slow = BEAM.excitation.replace(correlation_time=1e-9)
    assert hv.run(
        scene.replace(excitation=slow), "exact"
    ).mean_square_voltage.value == pytest.approx(white, rel=1e-6)


@pytest.mark.thorough("test_linear_means")
@pytest.mark.slow
def test_gibbs_law_at_a_stop():
    """Noise and damping along one direction and an elastic stop along another: energy has the Gibbs law.

    x = sum e_j y_j has the speed's variance N1 e.e/c, w = phi.y is a Gaussian cut off at the stop,
    which is hit at the rate of w' < 0 there, and what of x is independent of w keeps its own
    variance.
    """
    e = np.array([1.0, -0.6])
    phi = np.array([1.0, 0.8])
    n1 = 0.02
    c = 0.1
    beta = 0.3
    gap = 0.2
    modes = Modes((0.0, 6.0), (0.0, 0.0), tuple(e), tuple(e), tuple(phi), tuple(e))
    eqs = Equations(c1=-c, beta=beta, n1=n1, restitution=1.0, gap=gap, modes=modes)
    stiffness = np.diag([0.0, 6.0]) + (1.0 + beta) * np.outer(e, e)
    covariance = n1 / c * np.linalg.inv(stiffness)
    heat = n1 / c
    many = Trajectories(eqs, 512, np.random.SeedSequence(3), 0.05)
    many.run(100.0)
    moments = many.run(400.0)
    size = math.sqrt(phi @ covariance @ phi)
    cut = -gap / size
    density = norm.pdf(cut) / norm.sf(cut)
    second = size**2 * (1.0 + cut * density)  # E[w^2 | w > -gap]
    slope = e @ covariance @ phi / size**2
    expected = {
        "v2": heat * e @ e,
        "x2": slope**2 * second + e @ covariance @ e - slope**2 * size**2,
        "impacts": density / size * math.sqrt(heat * phi @ phi / TURN),
    }
    for name, value in expected.items():
        mean, error = moments.mean(name)
        assert abs(mean - value) < 4.0 * error + 2e-3 * value, name
        assert error < 0.02 * value


@pytest.mark.thorough("test_linear_means")
@pytest.mark.slow
@pytest.mark.parametrize("opposite", [pytest.param(None, marks=THOROUGH), 0.8])
def test_impacts_take_what_the_ledger_says(opposite):
    """Without springs the kinetic energy lost is that dissipated by impacts, to rounding, however many there are."""
    modes = Modes(
        (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, -0.5, 0.3), (1.0, 1.0, 1.0), (1.0, 0.7, -0.4)
    )
    ends = {} if opposite is None else {"opposite_restitution": opposite, "opposite_gap": 0.5}
    eqs = Equations(linear=1e-30, restitution=0.7, gap=0.3, modes=modes, **ends)
    start = np.array([0.0, 0.0, 0.0, -1.0, 0.4, 0.2, 0.0])
    path = trace(eqs, np.zeros(400), 0.02, 100, start)
    kinetic = 0.5 * (path.coordinates[-1, 1] ** 2).sum()
    assert len(path.impacts) > (0 if opposite is None else 3)
    assert kinetic + path.lost == pytest.approx(0.5 * (start[3:6] ** 2).sum(), rel=1e-9)
    assert path.V[-1] == pytest.approx(
        float(np.dot(modes.coupling, path.coordinates[-1, 0])), abs=1e-12
    )


@pytest.mark.thorough("test_linear_means")
@pytest.mark.slow
def test_energy_closes_with_the_step():
    """With springs and an open circuit the whole energy, and the losses of impacts, closes to
    second order in the step."""
    stop = hv.Stop(stiffness="2e4 N/m", damping="5 N s/m", gap="0.05 mm")
    undamped = BEAM.oscillator.replace(damping_ratio=None)
    lossless = BEAM.replace(oscillator=undamped, load=None, excitation=None, stop=stop)
    eqs = Problem(lossless.replace(mode=(SECOND.replace(damping_ratio=None),))).equations
    s = np.array(eqs.modes.coupling)
    start = np.array([0.0, 0.0, 0.5, -0.3, 0.0]) * 4.0 * eqs.gap
    k = eqs.modes.matrices(1.0, 0.0)[0] + eqs.beta * np.outer(s, s)
    errors = []
    for h in (4e-3, 1e-3, 2.5e-4):
        steps = round(20.0 / h)
        path = trace(eqs, np.zeros(steps), h, steps, start)
        (y, v) = path.coordinates[-1]
        before = 0.5 * (start[2:4] ** 2).sum()
        assert path.lost > 0.1 * before and len(path.impacts) > 2
        errors.append(abs((0.5 * (v @ v + y @ k @ y) + path.lost) / before - 1.0))
    assert errors[0] < 1e-3 and errors[2] < 2e-5


def test_magnifier_is_what_it_is_in_the_limit():
    """On a spring that is far too stiff a magnifier changes nothing."""
    alone = BEAM.replace(mode=())
    stiff = alone.replace(
        magnifier=hv.Magnifier(mass="20 g", stiffness="1e9 N/m", damping="1e3 N s/m")
    )
    powers = [hv.run(scene, "exact").mean_power.value for scene in (alone, stiff)]
    assert powers[1] == pytest.approx(powers[0], rel=1e-3)


@pytest.mark.thorough("test_linear_means")
@pytest.mark.parametrize(
    ("stop", "least"), [(None, 60.0), (hv.Stop(restitution=0.9, gap="0.05 mm"), 5.0)]
)
def test_controls_of_modes(stop, least):
    """They divide the variance of E[V^2]: by 160 and 13 where those of `docs/which.md` were measured."""
    many = Trajectories(
        Problem(BEAM.replace(stop=stop)).equations, 1024, np.random.SeedSequence(1), controlled=True
    )
    many.run(200.0)
    found = many.run(100.0)
    assert found.V2.var() > least * found.controlled("V2").var()
