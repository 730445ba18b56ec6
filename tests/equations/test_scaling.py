"""SI <-> nondimensional: round trip, hand-computed numbers, independence of the length l, effects."""

import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harvester.averaging.published.stationary import mean_square_voltage
from harvester.equations.coefficients import Equations
from harvester.equations.effects import EFFECTS, THEORIES
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales, natural_length, scales
from harvester.errors import InputError
from harvester.scene.nondimensional import Nondimensional
from harvester.scene.scene import Scene
from harvester.scene.toml import load, loads
from tests.support.paths import ROOT
from tests.support.systems import linear_v2
from tests.support.to_scene import equations, physical

PLATE = load(ROOT / "examples" / "plate.toml")
FULL = loads("""
[oscillator]
mass = 0.04
stiffness = 16.0
quadratic_stiffness = 2e3
cubic_stiffness = 1e5
damping = -1e-3
damping_x2 = 2.0
damping_x4 = 1e5
damping_v = 3.0
[piezo]
coupling = 1e-3
capacitance = 50e-9
[excitation]
acceleration_psd = 1e-4
stiffness_noise = 0.002
[load]
resistance = 1e6
[stop]
restitution = 0.9
gap = "-0.4 mm"
[opposite_stop]
restitution = 0.8
gap = "1 mm"
""")

SIZE = st.floats(1e-6, 1e6)
STOPS = [
    {},
    {"restitution": 0.0},
    {"restitution": 0.7, "gap": 0.3},
    {"restitution": 1.0, "gap": -2.0, "opposite_restitution": 0.2, "opposite_gap": 3.0},
    {"restitution": 0.9, "gap": 2.0, "opposite_restitution": 0.0, "opposite_gap": 0.0},
    {"stop_stiffness": 1e4, "stop_damping": 3.0, "gap": 0.1},
    {"stop_stiffness": 20.0},
]
SIGNED = st.floats(-1e6, 1e6).filter(lambda v: abs(v) > 1e-6)


@pytest.mark.slow
@settings(deadline=None, max_examples=200, derandomize=True)
@given(
    eqs=st.builds(
        Equations,
        alpha=st.none() | SIGNED,
        beta=SIZE,
        mu=st.none() | SIZE,
        c1=st.none() | SIGNED,
        c2=st.none() | SIGNED,
        c3=st.none() | SIGNED,
        cv=st.none() | SIZE,
        n1=st.none() | SIZE,
        n2=st.none() | SIZE,
        n12=st.none(),
        linear=st.sampled_from([None, -1.0]),
        alpha2=st.none() | SIGNED,
        softening=st.none() | SIZE,
        inertia=st.none() | SIZE,
    ),
    stops=st.sampled_from(STOPS),
    device=st.builds(
        Scales, mass=SIZE, frequency=SIZE, length=SIZE, coupling=SIZE, capacitance=SIZE
    ),
)
def test_round_trip(eqs, stops, device):
    """To a device and back at the same length: the same numbers to 1e-12, absent ones absent."""
    eqs = dataclasses.replace(eqs, **stops)
    if eqs.stop_stiffness or eqs.opposite_restitution is not None:  # scenes refuse both together
        eqs = dataclasses.replace(eqs, inertia=None)
    scene = physical(eqs, device)
    back = equations(scene, device.length)
    assert back.effects == eqs.effects
    for name in (f.name for f in dataclasses.fields(eqs)):
        assert getattr(back, name) == pytest.approx(getattr(eqs, name), rel=1e-12, abs=0)
    s = scales(scene, device.length)
    assert (s.mass, s.length, s.capacitance) == (device.mass, device.length, device.capacitance)
    assert s.frequency == pytest.approx(device.frequency, rel=1e-12)


def test_plate_by_hand():
    """The 40 g plate: w0 = sqrt(16/0.04), beta = 1e-6/(16 x 50.2e-9), mu = 1/(1e6 x 50.2e-9 x 20), 2 zeta = 0.008."""
    eqs, s = equations(PLATE), scales(PLATE)
    assert s.frequency == pytest.approx(20.0, rel=1e-12)
    assert eqs.beta == pytest.approx(1.2450, abs=5e-5)
    assert eqs.mu == pytest.approx(0.99602, abs=5e-6)
    assert eqs.c1 == pytest.approx(-6.4e-3 / (0.04 * 20), rel=1e-12)
    assert s.resistance(eqs.mu) == pytest.approx(1e6, rel=1e-12)


def test_every_coefficient_by_hand():
    """At l = 2 mm: w0 = 20, M w0 = 0.8."""
    eqs, s = equations(FULL, length=2e-3), scales(FULL, length=2e-3)
    by_hand = Equations(
        alpha2=2e-3 * 2e3 / 16,
        alpha=4e-6 * 1e5 / 16,
        beta=1.25,
        mu=1.0,
        c1=1e-3 / 0.8,
        c2=-2 * 4e-6 / 0.8,
        c3=1e5 * 16e-12 / 0.8,
        cv=3.0 * 2e-3 / 0.04,
        restitution=0.9,
        gap=-0.2,
        opposite_restitution=0.8,
        opposite_gap=0.5,
        n1=1e-4 / (4 * 4e-6 * 8000),
        n2=0.002,
    )
    assert dataclasses.asdict(eqs) == pytest.approx(dataclasses.asdict(by_hand), rel=1e-12, abs=0)
    assert s.volts == pytest.approx(1e-3 * 2e-3 / 50e-9, rel=1e-12, abs=0)
    assert s.watts == pytest.approx(0.04 * 8000 * 4e-6, rel=1e-12, abs=0)


def test_damping_ratio():
    """Damping = 2 zeta sqrt(stiffness mass), so c1 = -2 zeta."""
    oscillator = dataclasses.replace(PLATE.oscillator, damping=None, damping_ratio=0.004)
    given_as_ratio = dataclasses.replace(PLATE, oscillator=oscillator)
    assert equations(given_as_ratio).c1 == pytest.approx(-0.008, rel=1e-12)


@pytest.mark.parametrize("factor", [1e-3, 0.5, 7.0])
def test_coefficients_follow_the_length(factor):
    one = equations(FULL, length=1e-3)
    other = equations(FULL, length=1e-3 * factor)
    powers = {
        "alpha2": 1,
        "alpha": 2,
        "c2": 2,
        "c3": 4,
        "cv": 1,
        "n1": -2,
        "gap": -1,
        "opposite_gap": -1,
    }
    for name, value in dataclasses.asdict(one).items():
        expected = None if value is None else value * factor ** powers.get(name, 0)
        assert getattr(other, name) == pytest.approx(expected, rel=1e-12, abs=0)


def results(scene, length, mean_square):
    """E[v^2] in V^2 and E[P] in W, through the nondimensional numbers at a length."""
    eqs, s = equations(scene, length), scales(scene, length)
    v2 = mean_square(eqs)
    return s.volts**2 * v2, s.watts * eqs.beta * eqs.mu * v2


@pytest.mark.parametrize("length", [3e-4, 1e-3, 0.02])
@pytest.mark.parametrize(
    ("scene", "mean_square", "rel"),
    [
        (PLATE, linear_v2, 1e-12),
        (PLATE, mean_square_voltage, 1e-9),
        (FULL, mean_square_voltage, 1e-9),
        (FULL.without_stop(), mean_square_voltage, 1e-9),
    ],
)
def test_physical_results_do_not_depend_on_the_length(scene, length, mean_square, rel):
    """By the exact law of a linear scene, and by the published averaging."""
    v2, power = results(scene, length, mean_square)
    assert (v2, power) == pytest.approx(results(scene, None, mean_square), rel=rel, abs=0)
    assert power == pytest.approx(v2 / scene.load.resistance, rel=1e-12, abs=0)


def test_natural_length():
    """N1 = 1 with noise; without, alpha = 1; without both, 1 mm."""
    assert equations(PLATE).n1 == pytest.approx(1.0, rel=1e-12)
    quiet = dataclasses.replace(FULL, excitation=None)
    assert equations(quiet).alpha == pytest.approx(1.0, rel=1e-12)
    assert natural_length(dataclasses.replace(PLATE, excitation=None)) == 1e-3


def test_zero_is_absent():
    zero = Nondimensional(alpha=0, beta=0, mu=0, c1=0, c2=0, c3=0, eps1=0, D11=1, D22=0, D12=0)
    assert equations(Scene(nondimensional=zero)) == Equations()
    text = FULL.to_toml()
    for number in ("2000.0", "100000.0", "3.0", "-0.001", "2.0", "0.0001", "0.002", "-0.0004"):
        assert f" = {number}\n" in text
        text = text.replace(f" = {number}\n", " = 0\n")
    assert equations(loads(text)).effects == (
        "impact",
        "opposite_stop",
        "back_coupling",
        "resistive_load",
    )


def test_noise_intensities():
    """n1 = eps1^2 D11, n2 = eps2^2 D22, n12 = eps1 eps2 D12; eps is 1 if it is left out."""
    table = Nondimensional(eps1=2, eps2=-3, D11=0.1, D22=0.2, D12=0.05)
    eqs = equations(Scene(nondimensional=table))
    assert (eqs.n1, eqs.n2, eqs.n12) == pytest.approx((0.4, 1.8, -0.3), rel=1e-12)
    plain = equations(Scene(nondimensional=Nondimensional(D11=0.1, D22=0.2, D12=0.05)))
    assert (plain.n1, plain.n2, plain.n12) == (0.1, 0.2, 0.05)


def test_effects():
    assert Equations().effects == ()
    assert equations(PLATE).effects == (
        "linear_damping",
        "external_noise",
        "back_coupling",
        "resistive_load",
    )
    assert Equations(restitution=0.0).effects == ("impact",)  # a plastic stop is a stop
    assert Equations(alpha=1, c2=1, c3=1, n2=1, n12=1).effects == (
        "cubic_stiffness",
        "damping_x2",
        "damping_x4",
        "parametric_noise",
        "correlated_noise",
    )
    assert Equations(
        linear=-1, alpha2=1, alpha=-1, gap=1, opposite_restitution=0.0, stop_stiffness=1
    ).effects == (
        "negative_stiffness",
        "quadratic_stiffness",
        "softening_stiffness",
        "compliant_stop",
        "gap",
        "opposite_stop",
    )


def test_default_device_has_the_scenes_beta():
    scene = Scene(nondimensional=Nondimensional(beta=0.3, mu=0.7))
    s = scales(scene)
    assert s.coupling**2 / (s.mass * s.frequency**2 * s.capacitance) == pytest.approx(
        0.3, rel=1e-12
    )
    assert 1 / (s.resistance(0.7) * s.capacitance * s.frequency) == pytest.approx(0.7, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        (
            {"oscillator.damping_x4": 1e50, "excitation.acceleration_psd": 1e20},
            "oscillator.damping_x4 must give c3 of at most 1e",
        ),
        ({"piezo.coupling": 1e30}, "piezo.coupling must give beta of at most 1e"),
        ({"oscillator.mass": 1e-50, "oscillator.stiffness": 1e49}, "the length scale, .* but is"),
        (
            {
                "oscillator.mass": 1e50,
                "oscillator.stiffness": 1e-40,
                "excitation.acceleration_psd": 0,
            },
            "the power scale mass w0.3 l.2 must be",
        ),
        (
            {"piezo.coupling": 1e-50, "piezo.capacitance": 1e50},
            "the voltage scale coupling l/capacitance must be",
        ),
    ],
)
def test_what_is_too_large_to_compute(changes, line):
    scene = dataclasses.replace(
        FULL, oscillator=dataclasses.replace(FULL.oscillator, cubic_stiffness=None)
    )
    for key, value in changes.items():
        scene = scene.vary(key, value)
    with pytest.raises(InputError, match=f"^{line}"):
        equations(scene)


@pytest.mark.parametrize("length", [0.0, -1.0, math.nan, math.inf])
def test_what_is_no_length(length):
    with pytest.raises(InputError, match=r"^the length scale, .* must be between"):
        equations(PLATE, length=length)


def test_nondimensional_too_large():
    with pytest.raises(
        InputError,
        match=r"^\[nondimensional\] must give n1 of at most 1e\+50 in size, but gives 1e\+9",
    ):
        equations(Scene(nondimensional=Nondimensional(eps1=1e30, D11=1e30)))


def test_correlated_noise_has_no_device():
    with pytest.raises(InputError, match=r"^n12 must be absent from a physical scene"):
        physical(Equations(n1=1.0, n2=1.0, n12=0.5), scales(PLATE))


def test_every_coefficient_belongs_to_an_effect():
    """One that no entry names would be computed with and reported by no answer."""
    parameters = {
        "opposite_gap",
        "stop_damping",
        "drive_frequency",
        "correlation_time",
        "centre",
        "bandwidth",
    }
    named = {effect.coefficient for effect in EFFECTS}
    assert named | parameters == {field.name for field in dataclasses.fields(Equations)}
    assert all(set(effect.known_to) <= set(THEORIES) for effect in EFFECTS)


@pytest.mark.parametrize(
    ("name", "unit"), [("plate", "n1"), ("plate_harmonic", "drive"), ("plate_recorded", "record")]
)
def test_the_shaking_is_the_unit_of_length(name, unit):
    """White noise has N1 = 1, a drive the amplitude 1, a record the RMS 1, so that all numbers are of order one."""
    found = getattr(Problem(load(ROOT / "examples" / f"{name}.toml")).equations, unit)
    assert getattr(found, "rms", found) == pytest.approx(1.0)
