"""Harmonic, coloured and band-pass shaking against exact laws."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.equations.scales import Scales
from harvester.errors import CannotServeError, InputError
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.forcing import filtered, forcing
from harvester.mechanics.kernels.shaking import deviation, filter_of
from harvester.mechanics.kernels.step_size import whole_steps
from harvester.mechanics.trace import trace
from tests.support.systems import (
    BAND,
    COLOURED,
    DRIVEN,
    PAPER,
    changed,
    continuum,
    linear,
    linear_v2,
    lyapunov,
    scene,
    z,
)
from tests.support.to_scene import equations, physical

SEED = np.random.SeedSequence(20261121)


def discrete(eqs, h):
    """The same at the kicks, of the linear scheme: kick with exp(-y) ~ 1/q, then drift with the exact voltage.

    At kick k with z = exp(i Omega h) per step: (x, V) before the kick, v after it.
        x z = x + h v,   V z = e V + g v,   v z = (v + (1 + y/2) h (-x z - beta V z + F z))/q
    """
    zed = np.exp(1j * eqs.drive_frequency * h)
    e = math.exp(-eqs.mu * h)
    g = (1.0 - e) / eqs.mu
    y = -eqs.c1 * h
    q = 1.0 + y + 0.5 * y * y
    b = h * (1.0 + 0.5 * y)
    matrix = np.array(
        [[zed - 1.0, -h, 0.0], [b * zed, q * zed - 1.0, b * eqs.beta * zed], [0.0, -g, zed - e]]
    )
    x, _, voltage = np.linalg.solve(matrix, [0.0, b * eqs.drive * zed, 0.0])
    return x, voltage


def response(eqs, h, duration=800.0):
    """Complex amplitudes of x and V at the kicks of a path, over its last ten periods."""
    steps = round(2.0 * math.pi / eqs.drive_frequency / h)
    n = math.ceil(duration / h)
    path = trace(eqs, np.zeros(n), h)
    k = np.arange(n - 10 * steps, n)
    turn = np.exp(-1j * eqs.drive_frequency * h * (k + 1))
    return tuple(2.0 * np.mean(path.samples[k, column] * turn) for column in (0, 1))


@pytest.mark.parametrize("frequency", [0.3, 1.0, 1.1, 2.5])
@pytest.mark.parametrize("steps", [32, 64, 256])
def test_linear_response_is_the_discrete_one(frequency, steps):
    """Amplitude and phase of x and V at the kicks are those of the scheme's transfer function, to 1e-6."""
    eqs = changed(DRIVEN, drive_frequency=frequency)
    h = 2.0 * math.pi / frequency / steps
    if h > 0.5:
        pytest.skip("too long a step")
    assert response(eqs, h) == pytest.approx(discrete(eqs, h), rel=1e-6)


@pytest.mark.parametrize("frequency", [0.3, 1.0, 1.1, 2.5])
def test_discrete_response_converges_to_the_continuum_at_second_order(frequency):
    eqs = changed(DRIVEN, drive_frequency=frequency)
    errors = [np.abs(np.array(discrete(eqs, h)) / continuum(eqs) - 1.0) for h in (0.1, 0.05, 0.025)]
    for coarse, fine in itertools.pairwise(errors):
        assert coarse / fine == pytest.approx([4.0, 4.0], rel=0.02)
    assert errors[-1].max() < 1e-2


@pytest.mark.statistics
@pytest.mark.parametrize("frequency", [0.5, 1.0, 1.1, 1.2, 3.0])
def test_ensemble_of_the_linear_scene(frequency):
    """E[x^2], E[V^2] and the power, extrapolated to h = 0, are |X|^2/2, |V|^2/2 and beta mu |V|^2/2, to 1e-6."""
    eqs = changed(DRIVEN, drive_frequency=frequency)
    pairs = [RichardsonPair(Trajectories(eqs, 64, SEED, h), 60.0) for h in (0.01, 0.02)]
    x, voltage = continuum(eqs)
    for name, exact in (("x2", 0.5 * abs(x) ** 2), ("V2", 0.5 * abs(voltage) ** 2)):
        fine, coarse = (one.extrapolated(name)[0] for one in pairs)
        assert (16.0 * fine - coarse) / 15.0 == pytest.approx(exact, rel=1e-6)
        assert pairs[0].mean(name)[1] < 1e-9 * exact  # every trajectory's windows are whole periods
    assert abs(pairs[0].moments.balance(eqs)).max() < 2e-4


def test_engine_states_that_nothing_is_random():
    answer = hv.Ensemble(trajectories=64).run(scene(DRIVEN))
    exact = linear_v2(DRIVEN)
    assert answer.mean_square_voltage.stderr is None
    assert "nothing is random" in answer.reason
    assert answer.warnings == ()
    assert abs(answer.mean_square_voltage.value - exact) < 1.2 * answer.mean_square_voltage.bias
    assert "harmonic_drive" in answer.effects


@pytest.mark.parametrize("parts", [16, 48])
def test_few_steps_to_a_period(parts):
    """A sixteenth of a period is a step as well; with twice that beside it, the mean is still known
    to a few per cent."""
    pair = RichardsonPair(Trajectories(DRIVEN, 64, SEED, DRIVEN.shaking_period / parts), 100.0)
    assert pair.extrapolated("V2")[0] == pytest.approx(linear_v2(DRIVEN), rel=8.0 / parts**2)


@pytest.mark.statistics
def test_several_responses_are_told():
    """A hardening spring below its jump down: trajectories that begin at rest and far out end on different branches."""
    eqs = Equations(alpha=1.0, beta=0.01, mu=1.0, c1=-0.05, drive=0.2, drive_frequency=1.5)
    answer = hv.Ensemble(trajectories=256).run(scene(eqs))
    assert "several responses" in str(answer.warnings[0])
    assert answer.mean_square_voltage.stderr > 0.0


@pytest.mark.thorough("test_ensemble_of_the_linear_scene")
@pytest.mark.statistics
def test_white_noise_beside_a_drive():
    """Linear: E[V^2] is the sum of both."""
    eqs = changed(DRIVEN, n1=0.05)
    found = RichardsonPair(Trajectories(eqs, 4096, SEED, 0.1, controlled=True), 400.0).extrapolated(
        "V2"
    )
    exact = linear_v2(eqs)
    assert abs(z(found, exact)) < 4
    assert found[1] < 0.005 * exact


NOISES = [
    COLOURED,
    changed(COLOURED, correlation_time=20.0),
    changed(COLOURED, correlation_time=0.01),
    BAND,
    changed(BAND, bandwidth=5.0, centre=1.0),
    changed(BAND, bandwidth=0.1, centre=0.2),
]


@pytest.mark.statistics
@pytest.mark.parametrize(
    "eqs",
    [
        COLOURED,
        BAND,
        *(
            pytest.param(one, marks=pytest.mark.thorough("test_variances_under_filtered_noise"))
            for one in [*NOISES[1:3], *NOISES[4:]]
        ),
    ],
)
def test_variances_under_filtered_noise(eqs):
    """E[x^2], E[x'^2], E[V^2], E[xV] and E[a x'], extrapolated to h = 0, within four standard errors."""
    h = 0.1 if eqs.bandwidth is None else 0.1 / max(1.3, eqs.centre + eqs.bandwidth)
    pair = RichardsonPair(Trajectories(eqs, 2048, SEED, h), 400.0)
    exact = lyapunov(eqs)
    for name, (i, j) in {
        "x2": (0, 0),
        "v2": (1, 1),
        "V2": (2, 2),
        "xV": (0, 2),
        "driven": (1, 3),
    }.items():
        found = pair.extrapolated(name)
        assert abs(z(found, exact[i, j])) < 4
        assert found[1] < 0.02 * exact[i, j]
    assert abs(z(pair.mean("V2"), exact[2, 2], abs(pair.bias("V2")[0]))) < 4


@pytest.mark.thorough("test_ensemble_of_the_linear_scene")
@pytest.mark.statistics
@pytest.mark.parametrize("h", [0.1, 1.0])
def test_short_correlation_time_is_white_noise(h):
    """The kicks of tau = 1e-4 are those of white noise of the same intensity, at every step: the same variance."""
    white = linear(0.6, 0.5, 0.1, 0.02)
    short = changed(white, n1=None, coloured=0.02, correlation_time=1e-4)
    (a, da), (b, db) = (
        RichardsonPair(Trajectories(eqs, 4096, SEED, h), 400.0).mean("V2") for eqs in (white, short)
    )
    assert abs(a - b) < 4.0 * math.hypot(da, db)
    assert db < 0.01 * b


@pytest.mark.parametrize("eqs", NOISES)
@pytest.mark.parametrize("h", [1e-5, 0.1, 3.0])
def test_filter_keeps_its_stationary_law(eqs, h):
    """A S A^T + L L^T = S, and A is the exact exponential of the drift."""
    a11, a12, a21, a22, l11, l21, l22 = (one or 0.0 for one in filter_of(eqs, h)[:7])
    s = deviation(eqs, h) ** 2
    if eqs.bandwidth is None:
        assert a11**2 * s + l11**2 == pytest.approx(s, rel=1e-12)
        assert a11 == pytest.approx(math.exp(-h / eqs.correlation_time))
        return
    a = np.array([[a11, a12], [a21, a22]])
    lower = np.array([[l11, 0.0], [l21, l22]])
    assert s * a @ a.T + lower @ lower.T == pytest.approx(s * np.eye(2), rel=1e-9, abs=1e-12 * s)
    rate = np.array([[-eqs.bandwidth, -eqs.centre], [eqs.centre, 0.0]])
    small = np.eye(2) + h / 1024 * rate + (h / 1024 * rate) @ (h / 1024 * rate) / 2.0
    assert a == pytest.approx(np.linalg.matrix_power(small, 1024), rel=1e-3, abs=1e-3)


@pytest.mark.thorough("test_ensemble_of_the_linear_scene")
@pytest.mark.statistics
@pytest.mark.parametrize("eqs", [COLOURED, BAND])
def test_filter_of_the_ensemble_keeps_its_law_at_long_steps(eqs):
    """Means of p^2, q^2 and p q over trajectories and times, at a step where the noise of p and q is correlated."""
    many = Trajectories(eqs, 2048, SEED, 0.8)
    found = []
    for _ in range(40):
        many.run(16.0)
        p, q = np.moveaxis(many.filter, 1, 0).reshape(2, -1)
        found.append([np.mean(p * p), np.mean(q * q), np.mean(p * q)])
    s = deviation(eqs, 0.8) ** 2
    mean = np.mean(found, axis=0)
    error = np.std(found, axis=0, ddof=1) / math.sqrt(len(found))
    assert abs(mean[0] - s) < 4 * error[0]
    assert error[0] < 0.01 * s
    if eqs.bandwidth is not None:
        assert np.abs((mean - [s, s, 0.0]) / error).max() < 4


@pytest.mark.parametrize("eqs", NOISES[:4])
def test_forcing_of_a_path_has_the_law_of_the_filter(eqs):
    """Variance and correlation over one step of long paths, as of the filter."""
    h = 0.1
    a11 = filter_of(eqs, 0.1).a11
    found = []
    for seed in range(64):
        a = forcing(eqs, h, 4000, np.random.default_rng(seed))
        found.append((np.mean(a * a), np.mean(a[1:] * a[:-1])))
    mean = np.mean(found, axis=0)
    error = np.std(found, axis=0, ddof=1) / 8.0
    s = deviation(eqs, h) ** 2
    assert np.abs((mean - [s, a11 * s]) / error).max() < 4


@pytest.mark.statistics
def test_coarse_and_fine_ensembles_are_shaken_alike():
    """The difference of a pair of steps has a far smaller error than either mean."""
    for eqs in (changed(COLOURED, correlation_time=5.0), BAND):
        pair = RichardsonPair(Trajectories(eqs, 1024, SEED, 0.05), 200.0)
        assert pair.bias("V2")[1] < 0.02 * pair.mean("V2")[1]


@pytest.mark.thorough("test_variances_under_filtered_noise")
@pytest.mark.statistics
def test_filtered_noise_with_a_stop_closes_its_power_balance():
    eqs = changed(PAPER, n1=None, n2=None, coloured=0.05, centre=1.5, bandwidth=0.5)
    moments = Trajectories(eqs, 1024, SEED, 0.02)
    burn_in(moments)
    balance = moments.run(400.0).balance(eqs)
    assert abs(balance.mean()) < 4 * balance.std() / 32 + 2e-3
    assert moments.run(100.0).impacts.mean() > 0.05


@pytest.mark.parametrize("engine", [hv.Published(), hv.Averaged()])
@pytest.mark.parametrize(
    "eqs, what",
    [(DRIVEN, "harmonic drive"), (COLOURED, "coloured noise"), (BAND, "band pass noise")],
)
def test_theories_refuse(engine, eqs, what):
    with pytest.raises(CannotServeError, match=rf"cannot model {what}: use engine 'ensemble'"):
        engine.run(scene(eqs))


PLATE = hv.load("examples/plate.toml")


def excited(**keys):
    return dataclasses.replace(PLATE, excitation=hv.Excitation(**keys))


def test_physical_excitation_in_its_units():
    """0.1 g at 3.2 Hz, 50 ms of memory, a band of 0.5 Hz about 4 Hz, in units of l, 1/w0 = 50 ms."""
    drive = equations(excited(acceleration_amplitude="0.1 g", frequency="3.2 Hz"), length=1e-3)
    assert drive.drive == pytest.approx(0.980665 / (1e-3 * 400.0))
    assert drive.drive_frequency == pytest.approx(2 * math.pi * 3.2 / 20.0)
    assert equations(excited(acceleration_amplitude=0.7, frequency=3.0)).drive == pytest.approx(1.0)
    noise = excited(acceleration_psd="1e-5 g^2/Hz", correlation_time="50 ms")
    assert equations(noise).correlation_time == pytest.approx(1.0)
    assert (equations(noise).n1, equations(noise).coloured) == (None, pytest.approx(1.0))
    band = equations(
        excited(acceleration_psd="1e-5 g^2/Hz", centre_frequency="4 Hz", bandwidth=0.5)
    )
    assert (band.centre, band.bandwidth) == pytest.approx((2 * math.pi * 0.2, 2 * math.pi * 0.025))


@pytest.mark.parametrize("eqs", [DRIVEN, changed(DRIVEN, n1=0.01), COLOURED, BAND])
def test_there_and_back(eqs):
    s = Scales(mass=0.04, frequency=20.0, length=1e-3, coupling=1e-3, capacitance=50.2e-9)
    there = physical(eqs, s)
    assert vars(equations(hv.loads(there.to_toml()), length=1e-3)) == pytest.approx(
        vars(eqs), rel=1e-12
    )
    assert equations(there).effects == eqs.effects


def test_power_does_not_depend_on_the_length():
    given = excited(acceleration_amplitude="0.1 g", frequency="3.5 Hz")
    volts = [abs(continuum(equations(given, length=one))[1]) * one for one in (1e-4, 2e-3)]
    assert volts[0] == pytest.approx(volts[1])


@pytest.mark.parametrize(
    "keys, line",
    [
        (
            {"acceleration_amplitude": 1.0},
            "excitation.frequency must be given with acceleration_amplitude",
        ),
        ({"frequency": 1.0}, "excitation.acceleration_amplitude must be given with frequency"),
        (
            {"correlation_time": 1.0},
            "excitation.acceleration_psd must be given with correlation_time",
        ),
        (
            {"acceleration_psd": 1.0, "bandwidth": 1.0},
            "excitation.centre_frequency must be given with bandwidth",
        ),
        (
            {
                "acceleration_psd": 1.0,
                "bandwidth": 1.0,
                "centre_frequency": 1.0,
                "correlation_time": 1.0,
            },
            "excitation.centre_frequency must be left out if correlation_time is given",
        ),
        (
            {"acceleration_amplitude": "1 g/Hz", "frequency": 1.0},
            "excitation.acceleration_amplitude must be an accel",
        ),
        (
            {"acceleration_amplitude": 1.0, "frequency": 0.0},
            r"excitation.frequency must be a frequency \(Hz\)",
        ),
    ],
)
def test_bad_excitation_is_one_line(keys, line):
    with pytest.raises(InputError, match=line):
        excited(**keys)


@pytest.mark.parametrize("h", [0.3, 0.05, 1e-3])
@pytest.mark.parametrize("frequency", [0.01, 1.0, 7.7])
def test_steps_divide_the_period(h, frequency):
    eqs = changed(DRIVEN, drive_frequency=frequency)
    found = whole_steps(h, eqs.shaking_period)
    parts = eqs.shaking_period / found
    assert found <= h
    assert parts == pytest.approx(64 * round(parts / 64), rel=1e-12)
    # of the coarse ensemble of a pair
    assert whole_steps(2.0 * found, eqs.shaking_period) == 2.0 * found
    many = Trajectories(eqs, 1, SEED, h)
    assert round(parts) % many.stride == 0
    assert many.stride * 16 <= parts * (1 + 1e-9)


def test_random_paths_need_a_forcing():
    assert COLOURED.is_shaken
    with pytest.raises(InputError, match="forcing must be given if coloured noise"):
        trace(COLOURED, np.zeros(10), 0.1)


def test_a_longer_path_begins_as_a_shorter_one():
    eqs = Equations(n1=None, coloured=0.1, centre=1.0, bandwidth=0.2)
    short, long = (forcing(eqs, 0.1, steps, np.random.default_rng(3)) for steps in (50, 80))
    assert short == pytest.approx(long[:51], rel=1e-12)


@pytest.mark.thorough("test_ensemble_of_the_linear_scene")
@pytest.mark.parametrize(
    "noise",
    [
        pytest.param(COLOURED, id="coloured"),
        pytest.param(
            BAND, id="band", marks=pytest.mark.thorough("test_ensemble_of_the_linear_scene")
        ),
    ],
)
def test_a_sinusoid_beside_coloured_noise_adds_its_own_mean_square(noise):
    both = changed(noise, drive=0.15, drive_frequency=1.2)
    found = hv.Ensemble(seed=5, within=0.004).run(scene(both)).mean_square_voltage
    exact = hv.Exact().run(scene(both)).mean_square_voltage.value
    alone = hv.Exact().run(scene(noise)).mean_square_voltage.value
    assert exact > 1.2 * alone
    assert abs(found.value - exact) < 2.0 * found.error95


@pytest.mark.parametrize("noise", [COLOURED, BAND], ids=["coloured", "band"])
def test_a_path_with_both_is_that_of_the_noise_and_a_cosine(noise):
    h = 0.05
    steps = 4000
    both = changed(noise, drive=0.3, drive_frequency=1.3)
    rng = itertools.repeat(3)
    sum_, longer = (
        forcing(both, h, n, np.random.default_rng(next(rng))) for n in (steps, 2 * steps)
    )
    assert np.array_equal(longer[: steps + 1], sum_)
    rest = sum_ - filtered(both, h, steps, np.random.default_rng(next(rng)))[0]
    angle = both.drive_frequency * h * np.arange(steps + 1)
    fitted, *_ = np.linalg.lstsq(np.array([np.cos(angle), np.sin(angle)]).T, rest, rcond=None)
    assert math.isclose(math.hypot(*fitted), both.drive, rel_tol=1e-12)
    assert np.allclose(rest, fitted[0] * np.cos(angle) + fitted[1] * np.sin(angle), atol=1e-12)


@pytest.mark.thorough("test_path")
@pytest.mark.ngspice
def test_both_against_a_stop_agree_with_ngspice():
    both = changed(COLOURED, drive=0.15, drive_frequency=1.2, restitution=0.7, gap=0.1)
    one, other = (
        engine.run(scene(both)).mean_power
        for engine in (hv.Ensemble(within=0.01), hv.Spice(within=0.03))
    )
    assert abs(one.value - other.value) < 2.0 * math.hypot(one.error95, other.error95)
