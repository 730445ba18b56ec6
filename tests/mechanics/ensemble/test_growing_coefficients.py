"""Softening of the ceramic, mass and coupling that grow with X^2, dielectric loss: from the scene to the answer.

Judges: Gibbs' density by quadrature, an integrator of high order, a resistor in parallel; engines that do not know an
effect refuse it.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipe

import harvester as hv
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.equation_of_motion import drift, kick
from harvester.mechanics.kernels.intervals import interval
from tests.support.to_scene import equations

PERIOD = 2.0 * np.pi
DRIVEN = {"c1": -0.1, "beta": 0.2, "mu": 1.0, "drive": 0.15, "drive_frequency": 1.0}
EFFECTS = {
    "softening": {"softening": 0.1, "alpha": 0.05},
    "inertia": {"inertia": 0.3},
    "gamma": {"gamma": 0.4},
    "loss_tangent": {"loss_tangent": 0.2},
}


def scene_of(**numbers):
    """A nondimensional scene."""
    return hv.Scene(nondimensional=hv.Nondimensional(**numbers))


def rate(t, y, softening=0.0, alpha=0.0, inertia=0.0, gamma=0.0, loss_tangent=0.0):
    """The equations of `DRIVEN` with one effect more, and the integral of V^2."""
    x, v, V, _ = y
    force = -x - alpha * x**3 + softening * x * abs(x) - 0.1 * v + 0.15 * math.cos(t)
    force -= 0.2 * (1.0 + gamma * x * x) * V + inertia * x * v * v
    return [
        v,
        force / (1.0 + inertia * x * x),
        (1.0 + gamma * x * x) * v - (1.0 + loss_tangent) * V,
        V * V,
    ]


@pytest.mark.thorough("test_mean_square_displacement_by_gibbs")
@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_periodic_response_by_dormand_and_prince(name):
    """E[V^2] under a sinusoid, within what the engine states."""
    effect = EFFECTS[name]
    ends = solve_ivp(
        lambda t, y: rate(t, y, **effect),
        (0.0, 80.0 * PERIOD),
        np.zeros(4),
        "DOP853",
        [60.0 * PERIOD, 80.0 * PERIOD],
        rtol=1e-9,
    ).y[3]
    answer = hv.Ensemble(within=1e-3).run(scene_of(**DRIVEN, **effect))
    found = answer.mean_square_voltage
    exact = (ends[1] - ends[0]) / (20.0 * PERIOD)
    without = hv.Ensemble(within=1e-3).run(scene_of(**DRIVEN)).mean_square_voltage
    assert abs(found.value - exact) < 2.0 * found.known_error95
    assert abs(without.value - exact) > 0.02 * exact
    assert answer.mean_power.value == pytest.approx(0.2 * found.value, rel=1e-9)


def gibbs(energy, mass=lambda x: 1.0):
    """E[x^2] for the density sqrt(mass) exp(-2 energy), that of friction 0.1 and noise 0.05."""

    def weight(x):
        return math.sqrt(mass(x)) * math.exp(-2.0 * energy(x))

    return quad(lambda x: x * x * weight(x), -9, 9)[0] / quad(weight, -9, 9)[0]


@pytest.mark.statistics
@pytest.mark.parametrize(
    ("numbers", "exact"),
    [
        (
            {"softening": 0.4, "alpha": 0.3},
            gibbs(lambda x: 0.5 * x * x - 0.4 / 3.0 * abs(x) ** 3 + 0.075 * x**4),
        ),
        ({"inertia": 0.5}, gibbs(lambda x: 0.5 * x * x, lambda x: 1.0 + 0.5 * x * x)),
        (
            {"gamma": 0.5, "beta": 0.4},  # in open circuit V is a spring: V = x + gamma x^3/3
            gibbs(lambda x: 0.5 * x * x + 0.2 * (x + 0.5 / 3.0 * x**3) ** 2),
        ),
    ],
)
def test_mean_square_displacement_by_gibbs(numbers, exact):
    """E[x^2] in equilibrium, where friction and noise have no part in the density but their ratio."""
    eqs = equations(scene_of(c1=-0.1, D11=0.05, **numbers))
    trajectories = Trajectories(eqs, 1024, np.random.SeedSequence(4))
    trajectories.run(60.0)
    moments = trajectories.run(1500.0)
    mean, error = moments.mean("x2")
    assert abs(mean - exact) < 4.0 * error + 2e-3 * exact
    assert error < 0.01 * exact
    balance = moments.balance(eqs)
    assert abs(balance.mean()) < 4.0 * balance.std() / math.sqrt(len(balance)) + 2e-3


@pytest.mark.parametrize("mu", [0.3, 1.0])
def test_dielectric_loss_is_a_resistor_in_parallel(mu):
    """The voltage is that of both loads as one, and the power that of the given one alone."""
    lossy = hv.run(scene_of(c1=-0.1, beta=0.2, D11=0.1, mu=mu, loss_tangent=0.2), "exact")
    both = hv.run(scene_of(c1=-0.1, beta=0.2, D11=0.1, mu=mu + 0.2), "exact")
    assert lossy.mean_square_voltage.value == pytest.approx(both.mean_square_voltage.value)
    assert lossy.mean_power.value == pytest.approx(both.mean_power.value * mu / (mu + 0.2))


def test_dielectric_loss_in_open_circuit():
    """The piezo discharges itself, no load has power, and the answer reports an open circuit."""
    answer = hv.run(scene_of(c1=-0.1, beta=0.2, D11=0.1, loss_tangent=0.2), "exact")
    assert answer.mean_power.value == 0.0
    assert any(diagnostic.code == "open_circuit" for diagnostic in answer.diagnostics)


def test_density_with_a_softening_ceramic_by_gibbs():
    """Engine density has the term in its weak form: E[x^2] by quadrature to 1e-4."""
    answer = hv.run(scene_of(c1=-0.1, D11=0.05, softening=0.4, alpha=0.3, mu=1.0), "density")
    exact = gibbs(lambda x: 0.5 * x * x - 0.4 / 3.0 * abs(x) ** 3 + 0.075 * x**4)
    assert answer.details["displacement_squared"] == pytest.approx(exact, rel=1e-4)


def free_period(c):
    """The period of an undamped motion from x = 1, and its least x, by the kernels' steps."""
    h = 2e-3
    half, whole = (interval(part * h, h, None) for part in (0.5, 1.0))
    s = drift(State(1.0, 0.0, 0.0), half, None, None)[0]
    time, least = 0.5 * h, 1.0
    while True:
        v = kick(s, 0.0, h, c)
        if s.v > 0.0 >= v:  # the turning point, between two kicks by the parabola of the speed
            return time - h * v / (v - s.v) - 0.5 * h, least
        least = min(least, s.x)
        s = drift(State(s.x, v, s.V), whole, None, None)[0]
        time += h


def test_backbone_of_a_growing_mass():
    """Without forces but the spring m x'^2 + x^2 = 1 is conserved: the period is 4 E(-0.3), an elliptic integral."""
    period, least = free_period(Coefficients(inertia=0.3))
    assert period == pytest.approx(4.0 * ellipe(-0.3), rel=1e-3)
    assert least == pytest.approx(-1.0, abs=1e-4)


def test_backbone_of_a_softening_ceramic():
    """The period from the energy, by quadrature; it is longer than that of the linear spring."""

    def slowness(u):
        x = math.sin(u)
        return math.cos(u) / math.sqrt(1.0 - x * x - 0.2 / 1.5 * (1.0 - x**3))

    period, least = free_period(Coefficients(softening=0.2))
    assert period == pytest.approx(4.0 * quad(slowness, 0.0, 0.5 * math.pi)[0], rel=1e-3)
    assert period > 1.05 * PERIOD
    assert least == pytest.approx(-1.0, abs=1e-4)


def test_a_growing_mass_loses_its_own_energy_at_a_stop():
    """The mass of an impact is that at the gap, 1.5: the power balance closes."""
    eqs = equations(
        scene_of(c1=-0.05, beta=0.05, mu=1.0, D11=0.3, inertia=0.5, restitution=0.6, gap=1.0)
    )
    trajectories = Trajectories(eqs, 1024, np.random.SeedSequence(4), 0.02)
    trajectories.run(60.0)
    balance = trajectories.run(200.0).balance(eqs)
    assert abs(balance.mean()) < 4.0 * balance.std() / math.sqrt(len(balance)) + 5e-3


SERVED = {
    "softening": ("density", "spice"),
    "loss_tangent": ("density", "averaged", "published", "exact"),
}
REFUSED = [
    (name, engine)
    for name in EFFECTS
    for engine in ("density", "averaged", "published", "exact", "spice")
    if engine not in SERVED.get(name, ())
]


@pytest.mark.parametrize(("name", "engine"), REFUSED)
def test_engines_without_it_refuse(name, engine):
    """No engine leaves an effect out."""
    scene = scene_of(c1=-0.1, beta=0.2, D11=0.1, mu=1.0, **EFFECTS[name])
    with pytest.raises(hv.CannotServeError, match="cannot model"):
        hv.run(scene, engine)


DEVICE = """
[oscillator]
mass = "10 g"
frequency = "20 Hz"
q = 50
{oscillator}
[piezo]
coupling = 1e-3
capacitance = "50 nF"
{piezo}
[excitation]
acceleration_psd = 0.01
{rest}
"""


@pytest.mark.parametrize(
    ("oscillator", "piezo", "rest", "named"),
    [
        ("inertia_x2 = 1.0", "", '[load]\nnetlist = "bridge"', "oscillator.inertia_x2 must be"),
        ("", "coupling_x2 = 2.0", '[load]\nnetlist = "bridge"', "piezo.coupling_x2 must be"),
        ("", "loss_tangent = 0.02", '[load]\nnetlist = "bridge"', "piezo.loss_tangent must be"),
        ("", "coupling_x2 = 2.0", "[stop]\nrestitution = 0.5", "if stop is given"),
        (
            "inertia_x2 = 1.0",
            "",
            "[ball]\nmass = 1e-3\nroom = 1e-2\nrestitution = 0.5",
            "if ball is given",
        ),
    ],
)
def test_a_scene_that_no_equations_have_is_refused(oscillator, piezo, rest, named):
    """One line, with the key and the table that exclude each other."""
    text = DEVICE.format(oscillator=oscillator, piezo=piezo, rest=rest)
    with pytest.raises(hv.InputError, match=named):
        hv.loads(text)


@pytest.mark.parametrize(
    "stops",
    [
        {"stop_stiffness": 50.0, "gap": 1.0},
        {"restitution": 0.9, "gap": 1.0, "opposite_restitution": 0.8, "opposite_gap": 1.0},
    ],
)
def test_a_mass_that_grows_has_no_other_stop_than_a_rigid_one(stops):
    """The contact was computed for the mass at rest: the power balance was 12.8 % off."""
    with pytest.raises(hv.InputError, match=r"inertia must be left out if \w+ is given"):
        hv.Nondimensional(beta=0.05, mu=1.0, D11=0.01, inertia=0.5, **stops)


@pytest.mark.parametrize(
    "stop",
    [
        "[stop]\nstiffness = 1e4\n",
        "[stop]\nrestitution = 0.9\n\n[opposite_stop]\nrestitution = 0.9\ngap = 1e-3\n",
    ],
)
def test_a_device_whose_mass_grows_refuses_the_same_stops(tmp_path, stop):
    path = tmp_path / "a.toml"
    device = "[oscillator]\nmass = 0.04\nstiffness = 16.0\ninertia_x2 = 5.0\n\n"
    path.write_text(f"{device}[piezo]\ncoupling = 1e-3\ncapacitance = 5e-8\n\n{stop}")
    with pytest.raises(hv.InputError, match=r"oscillator.inertia_x2 must be left out if \S+ is"):
        hv.load(path)
