"""Marginal densities, inter-well transitions, first passages and spectra: against closed forms, and
against counting."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.density.box import settled
from harvester.density.first_passages import displacement_rate
from harvester.density.marginals import Marginals
from harvester.density.mesh import RESOLUTIONS, mesh
from harvester.density.refine import solution
from harvester.density.relaxation import slowest_decay, voltage_spectrum
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, SimulationError
from harvester.linear.level_crossings import peaks
from harvester.linear.transfer import gains
from harvester.mechanics.kernels.noise import gaussian_grid
from harvester.mechanics.trace import trace
from harvester.studies.counted_path import counted_passage, longer_path, voltage_plane
from tests.support.systems import PAPER, changed, linear, linear_v2, scene

WELLS = Equations(c1=-0.5, n1=0.025, linear=-1.0, alpha=1.0)


def solved(eqs, place=0, modes=6, tail=20.0):
    """A density on a coarse mesh."""
    setting = settled(eqs, tail)
    return setting, solution(eqs, setting, mesh(eqs, setting.box, RESOLUTIONS[place]), modes)


@pytest.mark.slow
def test_marginal_densities_of_a_linear_scene_are_gaussian():
    eqs = linear(0.3, 0.7, c=0.1)
    _, found = solved(eqs, 1, 8)
    ours = Marginals(found.form, found.p)
    points = np.linspace(-3.0, 3.0, 13)
    s = math.sqrt(linear_v2(eqs))
    (px, _) = peaks(eqs)
    gaussian = np.exp(-0.5 * points**2) / math.sqrt(2.0 * math.pi)
    assert ours.voltage(points * s) * s == pytest.approx(gaussian, abs=1e-5)
    assert ours.displacement(points * px.deviation) * px.deviation == pytest.approx(
        gaussian, abs=1e-5
    )
    assert ours.passages(2.0 * px.deviation) == pytest.approx(
        0.5 * px.rice(2.0 * px.deviation), rel=1e-4
    )


@pytest.mark.thorough("test_spectrum_of_a_linear_scene_is_the_closed_form")
@pytest.mark.statistics
def test_voltage_beside_a_stop_is_distributed_as_on_a_path():
    """The fraction of the time in each tenth of the range, within the error that half of the terms report."""
    found = hv.densities(
        scene(changed(PAPER, c1=-0.05, c2=None, c3=None, n2=None, mu=1.0)), within=1e-3
    )
    path = hv.motion(
        scene(changed(PAPER, c1=-0.05, c2=None, c3=None, n2=None, mu=1.0)), duration=30_000.0
    )
    edges = np.linspace(-3.0, 3.0, 11) * found.voltage_rms.value
    counted = np.histogram(path.voltage[len(path.voltage) // 5 :], edges, density=False)[0] / (
        0.8 * len(path.voltage)
    )
    told = np.diff(
        np.interp(
            edges, found.voltage, np.cumsum(found.voltage_density) * np.diff(found.voltage)[0]
        )
    )
    assert np.abs(told - counted).max() < found.largest_error * told.max() + 4.0 * 0.002
    assert found.largest_error < 0.06


def test_impact_speeds_of_an_elastic_stop_are_those_of_maxwell():
    """The flux w exp(-w^2/2T), T = N1/c, at 1/pi impacts a unit of time."""
    c, n1 = 0.1, 0.02
    _, found = solved(Equations(c1=-c, n1=n1, restitution=1.0), 1, 1)
    ours = Marginals(found.form, found.p)
    warmth = n1 / c
    speeds = np.linspace(0.1, 1.5, 8)
    law = speeds / warmth * np.exp(-0.5 * speeds**2 / warmth) / math.pi
    assert ours.impacts(speeds) == pytest.approx(law, abs=1e-5)
    harder = np.linspace(0.8, 8.0 * math.sqrt(warmth), 4001)
    assert np.trapezoid(ours.impacts(harder), harder) == pytest.approx(
        math.exp(-0.32 / warmth) / math.pi, rel=1e-4
    )


def test_rate_between_wells_is_that_of_kramers_and_below_it():
    """The slowest decay of a deep double well; Kramers' formula counts every climb of the barrier, and is above it."""
    _, found = solved(WELLS, 1, 1)
    rate, density = slowest_decay(found)
    c = 0.5
    climbs = math.sqrt(1.0 + c * c / 4.0) - c / 2.0
    kramers = 2.0 * climbs * math.sqrt(2.0) / (2.0 * math.pi) * math.exp(-0.25 / 0.05)
    assert kramers == pytest.approx(0.00237, abs=1e-5)
    assert rate == pytest.approx(0.0022168, abs=2e-7)
    assert 0.9 * kramers < rate < kramers
    left = Marginals(found.form, density / np.abs(density).max())
    assert left.displacement(np.array([-1.0]))[0] == pytest.approx(
        -left.displacement(np.array([1.0]))[0], rel=1e-5
    )


@pytest.mark.thorough("test_spectrum_of_a_linear_scene_is_the_closed_form")
@pytest.mark.statistics
def test_hops_are_those_that_a_path_makes():
    """From the middle of one well to that of the other, in 600000 time units."""
    told = hv.densities(scene(WELLS)).hop_rate
    path = []
    spent = 0.0
    start = None
    for k in range(6):
        one = trace(WELLS, gaussian_grid(np.random.SeedSequence([k, 3]), 2_000_000), 0.05, 4, start)
        start = float(one.x[-1]), float(one.v[-1]), float(one.V[-1])
        path.append(one.x[np.abs(one.x) > 0.9] > 0.0)
        spent += 100_000.0
    hops = int(np.sum(np.diff(np.concatenate(path).astype(int)) != 0))
    assert abs(hops - told.value * spent) < 4.0 * math.hypot(math.sqrt(hops), told.model * spent)


@pytest.mark.thorough("test_rate_between_wells_is_that_of_kramers_and_below_it")
@pytest.mark.statistics
def test_two_deep_wells_with_a_slow_load_are_forgotten_as_on_a_path():
    """The side on which the mass is, correlated over 100 and 800 time units; the load pulls it back
    after a transition."""
    eqs = Equations(c1=-0.2, beta=0.1, mu=0.05, linear=-1.0, alpha=1.0, n1=0.01)
    # both wells have half of the time
    told = 2.0 * hv.densities(scene(eqs), within=1e-2).hop_rate.value
    rows = []
    start = None
    for k in range(40):
        one = trace(eqs, gaussian_grid(np.random.SeedSequence([k, 5]), 2_000_000), 0.05, 20, start)
        start = float(one.x[-1]), float(one.v[-1]), float(one.V[-1])
        side = np.sign(one.x)
        rows.append([np.mean(side[:-lag] * side[lag:]) for lag in (100, 800)])
    near, far = np.array(rows).T
    error = (near / near.mean() - far / far.mean()).std() / math.sqrt(len(rows)) / 700.0
    assert abs(math.log(near.mean() / far.mean()) / 700.0 - told) < 4.0 * error
    assert error < 0.06 * told


@pytest.mark.slow
def test_spectrum_of_a_linear_scene_is_the_closed_form():
    eqs = linear(0.3, 0.7, c=0.1)
    _, found = solved(eqs, 0, 6)
    w = np.array([0.3, 1.05, 2.0])
    assert voltage_spectrum(found, w) == pytest.approx(2.0 * eqs.n1 * gains(eqs, w)[1], rel=1e-5)


@pytest.mark.thorough("test_spectrum_of_a_linear_scene_is_the_closed_form")
@pytest.mark.statistics
def test_spectrum_beside_a_stop_is_that_of_a_path():
    """The density at three frequencies, by Fourier sums over pieces of a path."""
    eqs = changed(PAPER, c1=-0.1, c2=None, c3=None, n2=None, mu=1.0, restitution=0.7)
    _, found = solved(eqs, 0, 6)
    h = 0.05
    pieces = 1500
    length = 4000
    path = trace(eqs, gaussian_grid(np.random.SeedSequence(5), (pieces + 10) * length), h)
    volts = path.V[-pieces * length :].reshape(pieces, length)
    steps = np.array([20, 60, 120])  # whole periods of a piece
    w = 2.0 * math.pi * steps / (length * h)
    window = np.hanning(length)
    turned = np.exp(-1j * np.outer(w, h * np.arange(length))) * window
    powers = np.abs(volts @ turned.T) ** 2 * h / (window**2).sum()
    z = (powers.mean(axis=0) - voltage_spectrum(found, w)) / (
        powers.std(axis=0) / math.sqrt(pieces)
    )
    assert np.abs(z).max() < 4.0


@pytest.mark.slow
def test_first_passages_are_fewer_than_passages():
    """Rice counts all passages of a clump, the rate of first passages only the clumps; at high levels both are one."""
    eqs = linear(0.3, 0.7, c=0.1)
    setting = settled(eqs, 20.0)
    px = peaks(eqs)[0]
    ratios = [
        displacement_rate(eqs, setting, k * px.deviation, 0, 4) / px.rice(k * px.deviation)
        for k in (2, 3, 4)
    ]
    assert ratios == sorted(ratios) and ratios[0] > 0.5 and ratios[-1] < 1.0
    assert displacement_rate(eqs, setting, 3.0 * px.deviation, 1, 4) == pytest.approx(
        displacement_rate(eqs, setting, 3.0 * px.deviation, 0, 4), rel=0.01
    )


@pytest.mark.thorough("test_first_passages_are_fewer_than_passages")
@pytest.mark.statistics
@pytest.mark.parametrize("restitution", [None, 0.7])
def test_rate_of_first_passages_is_that_counted_on_a_path(restitution):
    """Two lengths of blocks that keep below the level: their logarithms differ by the rate times the time between."""
    eqs = changed(linear(0.3, 0.7, c=0.1), restitution=restitution)
    setting, found = solved(eqs)
    level = 2.7 * math.sqrt(found.means[2])
    rate = displacement_rate(eqs, setting, level, 1, 6)
    h = 0.05
    length = 4000
    count = 6000
    peaks_of = []
    for k in range(3):
        path = trace(eqs, gaussian_grid(np.random.SeedSequence([k, 9]), count // 3 * length), h)
        peaks_of.append(np.abs(path.x[: count // 3 * length]).reshape(-1, length // 2).max(axis=1))
    short = np.concatenate(peaks_of) < level
    both = short.reshape(-1, 2).all(axis=1)
    # P(200)/P(100) = exp(-100 rate), each from the same blocks.
    ratio = both.mean() / short.mean()
    parts = both / both.mean() - short.reshape(-1, 2).mean(axis=1) / short.mean()
    error = parts.std() / math.sqrt(len(parts))
    assert abs(math.log(ratio) + 100.0 * rate) < 4.0 * error


@pytest.mark.thorough("test_a_study_has_all_of_it_in_units")
@pytest.mark.statistics
def test_passages_and_joint_density_of_a_path_are_those_of_a_linear_scene():
    """Displacements, whose passages the density knows, and the Gaussian density of displacement and voltage."""
    eqs = linear(0.3, 0.7, c=0.1)
    problem = Problem.of(scene(eqs))
    (px, pv) = peaks(eqs)
    path = longer_path(hv.motion(problem), problem, 3)
    setting = settled(eqs, 20.0)
    for level in (2.0, 2.5):
        told = 1.0 / displacement_rate(eqs, setting, level * px.deviation, 1, 6)
        counted = counted_passage(path.time, path.displacement, level * px.deviation, 20.0)
        assert abs(counted.value - told) < 4.0 * counted.stderr + 0.02 * told
    ours = counted_passage(path.time, path.voltage, 2.5 * pv.deviation, 20.0)
    # Rice counts each passage of a clump
    assert 0.4 < 1.0 / pv.rice(2.5 * pv.deviation) / ours.value < 0.8
    with pytest.raises(SimulationError, match="passed too rarely: give less"):
        counted_passage(path.time, path.voltage, 6.0 * pv.deviation, 20.0)
    with pytest.raises(SimulationError, match="passed too often: give more"):
        counted_passage(path.time, path.voltage, 0.01 * pv.deviation, 20.0)
    s, t = px.deviation, pv.deviation
    x, v, density, error = voltage_plane(path, (-4.0 * s, 4.0 * s), (-4.0 * t, 4.0 * t))
    # E[x V] = E[V^2]
    rho = t / s
    (a, b) = np.meshgrid(x / s, v / t, indexing="ij")
    exact = np.exp(-0.5 * (a * a - 2.0 * rho * a * b + b * b) / (1.0 - rho**2))
    exact /= 2.0 * math.pi * s * t * math.sqrt(1.0 - rho**2)
    often = density > 0.1 * density.max()
    z = (density - exact)[often] / error[often]
    assert np.abs(z).max() < 5.0 and np.sqrt((z**2).mean()) < 1.7


@pytest.mark.slow
def test_a_study_has_all_of_it_in_units():
    found = hv.densities("examples/plate_with_stop.toml", within=1e-3, level="6 V")
    step = found.voltage[1] - found.voltage[0]
    assert found.voltage_density.sum() * step == pytest.approx(1.0, abs=1e-3)
    assert math.sqrt((found.voltage**2 * found.voltage_density).sum() * step) == pytest.approx(
        found.voltage_rms.value, rel=1e-3
    )
    speeds = found.impact_speed
    assert np.trapezoid(found.impact_density, speeds) == pytest.approx(
        found.impact_rate.value, rel=1e-3
    )
    assert found.hop_rate is None and found.level == 6.0
    passage = found.first_passage_time
    problem = Problem.of(hv.load("examples/plate_with_stop.toml"))
    other = longer_path(hv.motion(problem), problem, 9)
    at = np.flatnonzero(np.abs(other.voltage) > 6.0)
    # from every place on
    until = other.time[at[np.searchsorted(at, np.arange(at[-1]))]] - other.time[: at[-1]]
    assert abs(passage.value - until.mean()) < 1.5 * passage.known_error95
    assert passage.stderr < 0.1 * passage.value
    bins = np.diff(found.plane_displacement)[0] * np.diff(found.plane_voltage)[0]
    assert found.voltage_plane.sum() * bins == pytest.approx(1.0, abs=1e-3)
    over_x = found.voltage_plane.sum(axis=1) * np.diff(found.plane_voltage)[0]
    told = np.interp(found.plane_displacement, found.displacement, found.displacement_density)
    assert np.abs(over_x - told).max() < 0.05 * told.max()


@pytest.mark.slow
def test_a_level_beyond_two_wells_is_passed_less_often_than_they_are_changed():
    found = hv.densities(scene(WELLS), level=1.5)
    assert found.first_passage_time.value > 1.0 / found.hop_rate.value and found.level == 1.5
    assert found.first_passage_time.bias < 0.02 * found.first_passage_time.value


@pytest.mark.slow
def test_bad_input_is_told():
    with pytest.raises(InputError, match="`level` must be"):
        hv.densities(scene(PAPER), level=-1.0)
    with pytest.raises(InputError, match="for a nondimensional scene"):
        hv.densities(scene(PAPER), level="1 mm")
    with pytest.raises(InputError, match="`level` must be a distance from rest"):
        hv.densities("examples/plate.toml", level="3 ohm")
    with pytest.raises(InputError, match="between its stops"):
        hv.densities(scene(changed(PAPER, c1=-0.05, gap=-0.2)), level=0.1)
    with pytest.raises(InputError, match="`spectrum` must be"):
        hv.densities(scene(PAPER), spectrum=-1)
    with pytest.raises(SimulationError, match="too rarely"):
        hv.densities(scene(WELLS), level=100.0)
    with pytest.raises(CannotServeError, match="needs a load resistance"):
        hv.densities("examples/plate_bridge.toml")
