"""The most that a device can draw from its excitation: no scene exceeds it, some reach it, and an
answer above states so."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

import harvester as hv
from harvester.engines.protocol import estimate, impossible_power
from harvester.equations.power_bound import power_bound
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import has
from harvester.uncertainty.value import Value
from tests.support.paths import EXAMPLES

PLATE = Problem.of(hv.load(EXAMPLES / "plate.toml"))


def nondimensional(**table):
    return hv.Scene(nondimensional=hv.Nondimensional(**table))


def bound_of(scene):
    return power_bound(Problem.of(scene))


def test_the_bound_is_mass_times_density_over_four():
    """Whatever stiffness, stop and circuit: what white noise of the base gives is fixed, and the load gets less."""
    scene = PLATE.scene
    bound = scene.oscillator.mass * scene.excitation.acceleration_psd / 4.0
    for share, said in ((0.999, False), (1.001, True)):
        found = impossible_power(
            PLATE, Value(share * bound / PLATE.units.watts), power_bound(PLATE)
        )
        assert (found is not None) == said
    assert found.numbers["bound"] == pytest.approx(bound, rel=1e-9)
    assert "exceeds the upper bound of this excitation for any device" in str(found)
    answer = hv.run(scene)
    assert answer.bound.value == pytest.approx(bound, rel=1e-9)
    assert answer.share_of_possible == pytest.approx(answer.mean_power.value / bound)
    assert answer.share_of_possible < 1.0
    assert answer.as_json()["bound"] == {"value": answer.bound.value, "why": str(answer.bound.why)}


def test_a_power_above_it_within_its_error_is_no_contradiction():
    assert impossible_power(PLATE, Value(1.01, stderr=0.1), power_bound(PLATE)) is None


def test_a_power_below_zero_says_so():
    answer = estimate("spice", PLATE, Value(1.0), Value(-1e-6, stderr=1e-5), [], 0.0)
    assert has(answer.diagnostics, "negative_power")
    assert not has(hv.run(PLATE).diagnostics, "negative_power", "power_above_bound")


def test_a_sinusoid_gives_at_most_mass_times_amplitude_squared_over_eight_times_the_damping():
    scene = hv.load(EXAMPLES / "plate_harmonic.toml")
    mass, damping = scene.oscillator.mass, scene.oscillator.damping
    most = (mass * scene.excitation.acceleration_amplitude) ** 2 / (8.0 * damping)
    assert bound_of(scene).value == pytest.approx(most, rel=1e-9)


def test_a_stroke_bounds_what_hardly_damped_mass_takes():
    """m D <|da/dt|> with D half of the room between the stops: the mean of |sin| is 2/pi."""
    scene = nondimensional(
        c1=-1e-3,
        beta=0.1,
        mu=1.0,
        drive=0.2,
        drive_frequency=0.9,
        restitution=0.5,
        gap=0.1,
        opposite_restitution=0.5,
        opposite_gap=0.3,
    )
    found = bound_of(scene)
    assert found.why.code == "bound_by_stroke"
    assert found.value == pytest.approx(0.2 * 0.2 * 0.9 * 2.0 / math.pi, rel=1e-12)


@pytest.mark.parametrize(
    "table",
    [
        {"D22": 0.01},  # its force grows with the response
        {"c1": 0.05, "c3": 0.1},  # friction that feeds at small amplitudes
        # neither friction nor stops limit a drive
        {"D11": None, "drive": 1.0, "drive_frequency": 1.0},
    ],
)
def test_where_nothing_limits_the_power_there_is_no_bound(table):
    assert bound_of(nondimensional(**{"beta": 0.05, "mu": 1.0, "D11": 0.01} | table)) is None
    assert hv.run(PLATE).bound is not None


def test_white_noise_gives_all_of_it_to_the_load_where_nothing_else_takes():
    answer = hv.run(nondimensional(c1=-1e-6, beta=0.5, mu=1.0, D11=0.3), "exact")
    assert answer.share_of_possible == pytest.approx(1.0, abs=1e-3)
    assert answer.share_of_possible < 1.0


def test_a_drive_gives_all_of_it_to_the_best_load():
    """A load that damps as much as the friction, at the resonance with it: half of the power, which is the bound."""

    def share(logs):
        frequency, mu = np.exp(logs)
        scene = nondimensional(c1=-0.01, beta=0.5, mu=mu, drive=0.1, drive_frequency=frequency)
        return hv.run(scene, "exact").share_of_possible

    best = minimize(
        lambda logs: -share(logs),
        np.log([1.2, 0.02]),
        method="Nelder-Mead",
        options={"xatol": 1e-6},
    )
    assert -best.fun == pytest.approx(1.0, abs=1e-3)
    assert -best.fun <= 1.0 + 1e-9


def random_scenes(count=300, seed=8):
    """Linear scenes under every excitation, and stops, cubic springs and friction under noise or a drive."""
    rng = np.random.default_rng(seed)

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    for k in range(count):
        table = {"c1": -between(1e-3, 0.5), "beta": between(1e-3, 5.0), "mu": between(0.01, 30.0)}
        shaking = [
            {"D11": between(1e-3, 1.0)},
            {"drive": between(0.1, 2.0), "drive_frequency": between(0.3, 3.0)},
            {"D11": between(1e-3, 1.0), "correlation_time": between(0.1, 10.0)},
            {
                "D11": between(1e-3, 1.0),
                "centre_frequency": between(0.5, 2.0),
                "bandwidth": between(0.05, 1.0),
            },
            {
                "D11": between(1e-3, 1.0),
                "drive": between(0.1, 2.0),
                "drive_frequency": between(0.3, 3.0),
            },
        ][k % 5 if k % 3 == 0 else k % 2]
        if k % 3 == 1:
            table |= {"restitution": rng.uniform(0.3, 1.0), "alpha": between(0.01, 1.0)}
        if k % 3 == 2:
            table |= {"restitution": 0.7, "gap": between(0.1, 1.0), "opposite_restitution": 0.7}
            table |= {"opposite_gap": between(0.1, 1.0)}
        yield k, nondimensional(**table, **shaking)


@pytest.mark.thorough("test_bounds.py")
@pytest.mark.statistics
def test_no_scene_exceeds_its_bound():
    shares = []
    for k, scene in random_scenes():
        engine = "exact" if k % 3 == 0 else hv.Ensemble(trajectories=128, duration=60.0)
        answer = hv.run(scene, engine)
        error = answer.mean_power.known_error95 / answer.bound.value
        assert answer.share_of_possible <= 1.0 + 1e-9 + error, (k, scene)
        assert not has(answer.diagnostics, "power_above_bound")
        shares.append(answer.share_of_possible)
    assert len(shares) == 300 and max(shares) > 0.9
