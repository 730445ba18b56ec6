"""What follows from the density under coloured noise: as under white noise, against closed forms and counting."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import lu_factor

import harvester as hv
from harvester.density import coupled_modes
from harvester.density.box import settled
from harvester.density.first_passages import displacement_rate
from harvester.density.functionals import NAMES
from harvester.density.marginals import Marginals
from harvester.density.mesh import RESOLUTIONS, mesh
from harvester.density.pace import Pace
from harvester.density.refine import refined, solution
from harvester.density.relaxation import voltage_spectrum
from harvester.engines.density import Density
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.linear.transfer import gains
from harvester.studies.counted_path import counted_passage, longer_path
from tests.support.systems import changed, scene

LINEAR = Equations(c1=-0.1, beta=0.3, mu=0.7, coloured=0.02, correlation_time=0.7)
CUBIC = Equations(c1=-0.1, coloured=0.02, correlation_time=0.7, alpha=0.5, restitution=1.0, gap=0.2)
WELLS = Equations(c1=-0.5, coloured=0.06, correlation_time=0.7, linear=-1.0, alpha=1.0)
REMAINING = pytest.mark.thorough("test_elastic_stop_with_a_passive_load_to_eight_digits")


def solved(eqs, modes, noise_modes=5):
    """A density on the coarsest mesh."""
    setting = settled(eqs, 20.0)
    setting = replace(setting, frame=replace(setting.frame, noise_modes=noise_modes))
    return setting, solution(eqs, setting, mesh(eqs, setting.box, RESOLUTIONS[0]), modes)


@REMAINING
@pytest.mark.slow
def test_densities_and_spectrum_of_a_linear_scene():
    """Gaussian densities, and 2 D/(1 + w^2 tau^2) times the gain from the base to the voltage."""
    _, found = solved(LINEAR, 8)
    ours = Marginals(found.form, found.p)
    points = np.linspace(-3.0, 3.0, 13)
    gaussian = np.exp(-0.5 * points**2) / math.sqrt(2.0 * math.pi)
    for name, density in (
        ("displacement", ours.displacement),
        ("velocity", ours.velocity),
        ("voltage", ours.voltage),
    ):
        s = math.sqrt(found.means[NAMES.index(f"{name}_squared")])
        assert density(points * s) * s == pytest.approx(gaussian, abs=1e-3)
    w = np.array([0.3, 1.05, 2.0])
    shaking = 2.0 * LINEAR.coloured / (1.0 + (w * LINEAR.correlation_time) ** 2)
    assert voltage_spectrum(found, w) == pytest.approx(shaking * gains(LINEAR, w)[1], rel=2e-3)


@REMAINING
@pytest.mark.statistics
def test_first_passages_and_impacts_beside_an_elastic_stop_are_those_of_a_path():
    """The rate of first passages, and the impacts a unit of time harder than some speeds."""
    setting, found = solved(CUBIC, 1)
    problem = Problem.of(scene(CUBIC))
    path = longer_path(hv.motion(problem), problem, 1)
    level = 2.2 * math.sqrt(found.means[NAMES.index("displacement_squared")])
    counted = counted_passage(path.time, path.displacement, level, 20.0)
    told = 1.0 / displacement_rate(CUBIC, setting, level, 0, 1)
    assert abs(counted.value - told) < 4.0 * counted.stderr + 0.02 * told
    hits = path.impacts[path.impacts[:, 0] > 0.25 * path.time[-1]]
    groups = 32
    length = 0.75 * path.time[-1] / groups
    for speed in (0.1, 0.4):
        hard = hits[np.abs(hits[:, 1]) > speed]
        rates = np.histogram(hard[:, 0], groups, (0.25 * path.time[-1], path.time[-1]))[0] / length
        error = rates.std(ddof=1) / math.sqrt(groups)
        harder = np.linspace(speed, setting.box.speed, 4001)
        told = np.trapezoid(Marginals(found.form, found.p).impacts(harder), harder)
        assert abs(rates.mean() - told) < 4.0 * error


@REMAINING
@pytest.mark.statistics
def test_hops_between_wells_are_those_of_a_path():
    told = hv.densities(scene(WELLS), within=0.01).hop_rate
    problem = Problem.of(scene(WELLS))
    path = longer_path(hv.motion(problem), problem, 2)
    sides = path.displacement[np.abs(path.displacement) > 0.9] > 0.0
    hops = int(np.sum(sides[1:] != sides[:-1]))
    spent = float(path.time[-1])
    assert hops > 100
    assert abs(hops - told.value * spent) < 4.0 * math.hypot(math.sqrt(hops), told.model * spent)


@pytest.mark.parametrize("noise_modes", [1, 3])
def test_memory_is_that_of_the_factors(monkeypatch, noise_modes):
    """A budget and a limit of memory are judged by it: a factor of each mode and each element of x."""
    held = []

    def counted(block, **options):
        held.append(block.nbytes)
        return lu_factor(block, **options)

    monkeypatch.setattr(coupled_modes, "lu_factor", counted)
    free = changed(LINEAR, beta=None, mu=None)
    _, found = solved(free, 1, noise_modes)
    elements = len(found.form.mesh.x_breaks) - 1
    assert found.form.memory == sum(held[-elements:])


def test_no_answer_within_a_budget_is_said_at_once():
    """After the first coarse solution, whatever the machine: the budget is spent before it begins."""
    spent = Pace(1.0, begin=-1e6)
    with pytest.raises(
        SimulationError, match=r"^no density in a `budget` of 1 s: it needs at least about .* s"
    ):
        settled(changed(LINEAR, mu=None, beta=None), 20.0, spent)
    assert Pace(None, begin=-1e6).is_late(1e12) is False


@REMAINING
@pytest.mark.slow
def test_error_holds_against_more_modes_and_a_finer_mesh():
    """The mesh is chosen with few modes of the noise, the modes on a coarse mesh: one solution with both is inside."""
    cubic = changed(CUBIC, restitution=None, gap=None)
    found = refined(cubic, 1e-3)
    setting = replace(found.setting, frame=replace(found.setting.frame, noise_modes=9))
    better = solution(
        cubic, setting, mesh(cubic, setting.box, RESOLUTIONS[1]), found.solution.form.modes
    )
    assert np.abs(found.means - better.means)[0] <= found.error[0]
    assert Density(within=1e-2).run(scene(cubic)).mean_square_voltage.value == pytest.approx(
        found.means[0], rel=1e-2
    )
