"""Linear scenes in closed form: against the Lyapunov equation in rational numbers, white noise, and the ensemble."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.equations.modes import Modes
from harvester.errors import UnboundedResponseError
from harvester.linear.shaking import lines, response_to_shaking
from harvester.linear.solve import solve
from harvester.linear.transfer import amplitudes, white
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.records.records import Record, TabulatedDensity
from tests.support.systems import BAND, COLOURED, DRIVEN, changed, linear, lyapunov, z

SEED = np.random.SeedSequence(20261122)
# flat: white noise of N1 = 1
FAR = TabulatedDensity(np.array([1e-16, 1e-3, 0.2, 1e9]), np.full(4, 4.0))
TONES = Record(0.2, np.random.default_rng(1).standard_normal(400).cumsum() * 0.05)


def off(eqs, exact):
    """How far the answer is off, in units of the error that it states."""
    found = solve(eqs)
    return abs(found.value - exact) / found.error


@pytest.mark.parametrize(
    "beta, mu, c", [(0.05, 0.05, 0.01), (1.25, 1.0, 0.05), (10.0, 100.0, 3.0), (0.5, 1.0, -0.05)]
)
def test_white_noise(beta, mu, c):
    """All three moments; with negative damping, which the load makes up for as well."""
    eqs = linear(beta, mu, c)
    x2, speed2, v2, *_ = white(eqs)
    assert eqs.n1 * np.array([x2, speed2, v2]) == pytest.approx(np.diag(lyapunov(eqs)), rel=1e-13)
    assert off(eqs, lyapunov(eqs)[2, 2]) < 1.0


@pytest.mark.parametrize("n2", [None, 0.03])
@pytest.mark.parametrize(
    "eqs",
    [
        COLOURED,
        changed(COLOURED, correlation_time=20.0),
        changed(COLOURED, correlation_time=1e-3),
        BAND,
        changed(BAND, bandwidth=5.0, centre=1.0),
        changed(BAND, bandwidth=0.01, centre=1.25, mu=10.0),
    ],
    ids=str,
)
def test_filtered_noise_with_and_without_noise_on_the_stiffness(eqs, n2):
    eqs = changed(eqs, n2=n2)
    exact = lyapunov(eqs)
    assert off(eqs, exact[2, 2]) < 1.0
    assert solve(eqs).error < 1e-11 * exact[2, 2]
    x2, v2 = response_to_shaking(eqs)[0]
    assert n2 or (x2, v2) == pytest.approx((exact[0, 0], exact[2, 2]), rel=1e-13)


def test_stated_error_of_random_scenes():
    """From weak to strong damping, coupling and load, sharp resonances and narrow bands: no error beyond the stated."""
    rng = np.random.default_rng(20261122)
    worst = 0.0
    for k in range(60):
        c, beta, mu, width, centre, tau = 10.0 ** rng.uniform(
            [-7, -4, -4, -4, -1, -3], [1, 2, 3, 1, 1, 2]
        )
        filters = ({"n1": 1.0}, {"correlation_time": tau}, {"bandwidth": width, "centre": centre})[
            k % 3
        ]
        # or half of what the load takes is fed
        damped = -0.5 * beta * mu / (1.0 + beta + mu * mu) if k % 2 else c
        eqs = Equations(c1=-damped, beta=beta, mu=mu, coloured=1.0 if k % 3 else None, **filters)
        if k % 4 == 3:
            eqs = changed(eqs, n2=0.5 / white(eqs).x2)
        worst = max(worst, off(eqs, lyapunov(eqs)[2, 2]))
    assert 0.01 < worst < 1.0


def test_noise_of_short_memory_is_white():
    """Off by the square of its correlation time, to which its density at low frequencies has no first order."""
    exact = white(COLOURED).v2 * COLOURED.coloured
    errors = [
        solve(changed(COLOURED, correlation_time=tau)).value / exact - 1.0 for tau in (1e-3, 1e-4)
    ]
    assert errors[0] == pytest.approx(100.0 * errors[1], rel=1e-2)
    assert abs(errors[1]) < 1e-6


@pytest.mark.parametrize("c", [1e-8, 1e-4, 0.05, 3.0])
@pytest.mark.parametrize("mu", [None, 1e-4, 0.8, 50.0])
def test_a_flat_table_is_white_noise(c, mu):
    """However sharp the resonance is, and wherever in the table."""
    eqs = Equations(c1=-c, beta=1e-9 if c < 1e-3 else 0.5, mu=mu, density=FAR)
    assert solve(eqs).value == pytest.approx(white(eqs).v2, rel=max(1e-12, 1e-15 / c))
    assert off(eqs, white(eqs).v2) < 2.0  # the table ends


def test_a_table_of_slopes_and_zeros():
    """Next to the sum over a million intervals."""
    f, g = np.array([0.02, 0.1, 0.15, 0.2, 0.3, 0.5]), np.array([0.0, 0.5, 4.0, 4.0, 1e-6, 0.0])
    eqs = Equations(c1=-0.1, beta=0.5, mu=0.7, density=TabulatedDensity(f, g))
    assert eqs.density.at(f) == pytest.approx(g, abs=1e-300)
    assert eqs.density.at(np.sqrt(f[3:5] * f[2:4])) == pytest.approx(np.sqrt(g[3:5] * g[2:4]))
    edges = np.linspace(f[0], f[-1], 1_000_001)
    gains = np.abs(amplitudes(eqs, math.pi * (edges[1:] + edges[:-1]))) ** 2
    assert response_to_shaking(eqs)[0] == pytest.approx(
        gains @ np.diff(eqs.density.below(edges)), rel=1e-9
    )


def test_shaking_adds_up():
    """A drive, a record or a density next to white noise: the sum of both."""
    for eqs in (DRIVEN, changed(COLOURED, coloured=None, correlation_time=None, density=FAR)):
        both = solve(changed(eqs, n1=0.05)).value
        assert both == pytest.approx(solve(eqs).value + 0.05 * white(eqs).v2, rel=1e-13)
    s = 1j * DRIVEN.drive_frequency
    x = DRIVEN.drive / (1.0 + s * s - s * DRIVEN.c1 + DRIVEN.beta * s / (s + DRIVEN.mu))
    assert solve(DRIVEN).value == pytest.approx(0.5 * abs(x * s / (s + DRIVEN.mu)) ** 2, rel=1e-14)


@pytest.mark.parametrize("count", [399, 400])
def test_lines_have_the_power_of_the_record(count):
    """Parseval, of the series between the samples as well; the lines of a cosine are its own."""
    record = Record(0.2, TONES.values[:count])
    w, p = lines(record)
    assert p.sum() == pytest.approx(np.mean(record.at_even_times(8 * count) ** 2), rel=1e-13)
    assert record.at_even_times(8 * count)[::8] == pytest.approx(record.values, abs=1e-12)
    cosine = Record(0.1, 3.0 + 2.0 * np.cos(2.0 * math.pi * 7.0 * np.arange(100) / 100.0))
    w, p = lines(cosine)
    assert (w[p > 1e-12], p[p > 1e-12]) == (
        pytest.approx([0.0, 1.4 * math.pi]),
        pytest.approx([9.0, 2.0]),
    )


def test_what_rounding_does_to_weak_lines_is_stated():
    """An excitation of 1e-9 next to gravity: the lines are off by what the transform rounds, and
    the error states so."""
    n = 1000
    small = 1e-9 * np.cos(2.0 * math.pi * 32.0 * np.arange(n) / n)
    eqs = Equations(c1=-0.1, beta=0.5, mu=1.0, record=Record(0.2, 9.80665 + small))
    exact = solve(
        changed(eqs, record=None, drive=1e-9, drive_frequency=2.0 * math.pi * 32.0 / (0.2 * n))
    ).value
    assert 1e-8 * exact < abs(solve(eqs).value - exact) < solve(eqs).error < 1e-2 * exact


def test_a_narrow_table_is_white_noise_of_its_area():
    """At the resonance of a blunt response."""
    f = 0.17 * (1.0 + np.array([0.0, 1e-9]))
    eqs = Equations(c1=-0.5, beta=0.5, mu=1.0, density=TabulatedDensity(f, np.ones(2)))
    exact = 0.17e-9 * np.abs(amplitudes(eqs, 2.0 * math.pi * 0.17)[1]) ** 2
    assert 1e-9 * exact < solve(eqs).error < 1e-4 * exact
    assert abs(solve(eqs).value - (f[1] - f[0]) / 0.17e-9 * exact) < solve(eqs).error


def test_a_record_of_a_cosine_is_a_drive():
    n = 64
    record = Record(
        2.0 * math.pi / DRIVEN.drive_frequency / n,
        DRIVEN.drive * np.cos(2.0 * math.pi * np.arange(n) / n),
    )
    assert solve(
        changed(DRIVEN, drive=None, drive_frequency=None, record=record)
    ).value == pytest.approx(solve(DRIVEN).value, rel=1e-13)


def test_open_circuit_and_a_constant_push():
    """V = x, its mean as well; with a load a constant acceleration leaves no voltage."""
    eqs = Equations(c1=-0.1, beta=0.5, record=Record(1.0, np.full(20, 3.0)))
    assert solve(eqs).value == pytest.approx((3.0 / 1.5) ** 2)
    assert solve(changed(eqs, mu=1e-3)).value == pytest.approx(0.0, abs=1e-25)
    noise = changed(eqs, record=None, n1=0.01)
    assert solve(noise).value == pytest.approx(solve(changed(noise, mu=1e-9)).value, rel=1e-6)


@pytest.mark.parametrize(
    "changes, line",
    [
        ({"c1": 0.3}, r"are linear, .* grow as exp\(0\.[0-9]+ w0 t\)"),
        ({"c1": None, "beta": None}, "or never settles: nothing dissipates energy; give a damping"),
        ({"n2": 0.4}, "noise on the stiffness feeds .* N2 must be below 0.306098, but is 0.4"),
        ({"linear": -1.0}, "the spring pushes the mass away"),
    ],
)
def test_growth_without_bound_is_named(changes, line):
    for eqs in (linear(0.5, 1.0), DRIVEN):
        with pytest.raises(UnboundedResponseError, match=r"^the response grows without bound"):
            solve(changed(eqs, **changes))
    with pytest.raises(UnboundedResponseError, match=line):
        solve(changed(linear(0.5, 1.0), **changes))


@pytest.mark.thorough("test_linear_statistics")
@pytest.mark.statistics
@pytest.mark.parametrize(
    "eqs",
    [
        changed(linear(0.5, 1.0, 0.2, 0.02), n2=0.02, n12=0.01),
        changed(BAND, n2=0.02),
        changed(DRIVEN, n1=0.02, n2=0.02),
        Equations(c1=-0.2, beta=0.5, mu=1.0, record=TONES),
        Equations(c1=-0.2, beta=0.5, mu=1.0, n1=0.01, n2=0.01, record=TONES),
    ],
    ids=[
        "correlated noise",
        "band and noise on the stiffness",
        "drive and both",
        "record",
        "record and both",
    ],
)
def test_the_ensemble_agrees(eqs):
    """|z| < 4 of E[V^2] at a step of zero; without noise what is left of the step is of fourth order."""
    pair = RichardsonPair(Trajectories(eqs, 2048, SEED, 0.05), 400.0)
    value, error = pair.extrapolated("V2")
    assert abs(z((value, error), solve(eqs).value, 2e-4 * value)) < 4.0
    assert error < 0.01 * value


def test_engine_states_its_error_and_serves_open_circuits():
    scene = hv.load("examples/plate.toml")
    answer = hv.Exact().run(scene)
    power = answer.mean_power
    assert (power.stderr, power.model) == (None, 0.0)
    assert 0.0 < power.known_error95 < 1e-12 * power.value
    assert "uW (closed form)" in str(answer)
    assert (
        hv.Exact().run(hv.load("examples/plate_recorded.toml")).warnings
        == hv.Ensemble(trajectories=64).run(hv.load("examples/plate_recorded.toml")).warnings
    )
    opened = hv.Exact().run(
        hv.Scene(oscillator=scene.oscillator, piezo=scene.piezo, excitation=scene.excitation)
    )
    assert (opened.mean_power.value, opened.mean_square_voltage.value > 0.0) == (0.0, True)
    assert str(opened.warnings[0]).startswith("open circuit")
    quiet = hv.Exact().run(
        hv.Scene(oscillator=scene.oscillator, piezo=scene.piezo, load=scene.load)
    )
    assert (quiet.mean_power.value, str(quiet.warnings[0])[:21]) == (0.0, "the response dies out")


def test_small_motions_in_one_of_two_wells():
    """The stiffness there is 2, and not the 1 about x = 0 that a spring of one well has."""
    eqs = changed(DRIVEN, linear=-1.0, alpha=1.0, drive=1e-4, drive_frequency=1.3)
    trajectories = Trajectories(eqs, 8, SEED, h=0.01, start=np.array([1.0, 0.0, 0.0]))
    trajectories.run(400.0)
    moments = trajectories.run(10.0 * eqs.shaking_period)
    x, voltage = np.abs(amplitudes(eqs, 1.3)) * eqs.drive / math.sqrt(2.0)
    assert np.sqrt(moments.V2) == pytest.approx(voltage, rel=1e-3)
    assert np.sqrt(moments.x2 - moments.x**2) == pytest.approx(x, rel=1e-3)


def test_amplitudes_of_modes_that_the_circuit_does_not_couple():
    """x = 1/(1 - w^2 + i c w) of the oscillator alone, and V = s/(s + mu) (s_2 y_2) of the second mode alone."""
    modes = Modes(
        stiffness=(0.0, 6.25),
        damping=(0.0, 0.1),
        coupling=(0.0, 0.7),
        base=(1.0, 0.4),
        contact=(1.0, 0.0),
    )
    eqs = Equations(c1=-0.05, mu=0.8, n1=0.01, modes=modes)
    w = np.linspace(0.2, 3.0, 7)
    x, volts = amplitudes(eqs, w)
    second = 0.4 / (6.25 - w * w + 0.1j * w)
    assert x == pytest.approx(1.0 / (1.0 - w * w + 0.05j * w), rel=1e-12)
    assert volts == pytest.approx(1j * w / (1j * w + 0.8) * 0.7 * second, rel=1e-12)


def test_sharpness_of_modes_is_the_largest_quality_factor():
    """Q_k = w_k/c_k of modes that the circuit does not couple: 10 and 25."""
    modes = Modes(
        stiffness=(1.0, 6.25),
        damping=(0.1, 0.1),
        coupling=(0.3, 0.0),
        base=(1.0, 0.4),
        contact=(1.0, 0.0),
    )
    assert white(Equations(c1=0.0, n1=0.01, modes=modes)).sharpness == pytest.approx(25.0, rel=1e-2)
