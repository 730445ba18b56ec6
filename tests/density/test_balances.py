"""What holds on every mesh, however coarse, and what does not depend on how the density is cut into parts."""

import numpy as np
import pytest

from harvester.density.box import settled
from harvester.density.functionals import NAMES
from harvester.density.mesh import RESOLUTIONS, mesh
from harvester.density.refine import refined, solution
from harvester.density.weak_form import ModeFrame, WeakForm
from harvester.equations.coefficients import Equations
from tests.support.systems import PAPER, changed

SCENES = {
    "paper": PAPER,
    "strong impacts": changed(PAPER, restitution=0.3),
    "gap and two stops": changed(
        PAPER, c1=-0.05, gap=0.3, opposite_restitution=0.6, opposite_gap=0.4
    ),
    "preload": changed(PAPER, c1=-0.05, gap=-0.2, mu=1.0),
    "compliant": changed(
        PAPER, c1=-0.05, restitution=None, gap=0.2, stop_stiffness=40.0, stop_damping=1.0
    ),
    "correlated noise": changed(PAPER, n12=0.007),
    "two wells": Equations(c1=-0.2, beta=0.1, mu=0.5, n1=0.1, linear=-1.0, alpha=1.0),
}


QUICK = "paper", "compliant"  # the others are the same code


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(eqs, id=name, marks=[] if name in QUICK else [pytest.mark.slow])
        for name, eqs in SCENES.items()
    ],
)
def coarse(request):
    """A scene on the coarsest mesh, with its means."""
    eqs = request.param
    setting = settled(eqs, 24.0)
    return eqs, solution(eqs, setting, mesh(eqs, setting.box, RESOLUTIONS[0]), 6)


def test_exchange_between_mass_and_circuit(coarse):
    """E[x V] = E[V^2], E[x' V] = mu E[V^2] hold to the box's tails on the coarsest mesh."""
    eqs, found = coarse
    means = dict(zip(NAMES, found.means, strict=True))
    assert means["displacement_voltage"] == pytest.approx(means["voltage_squared"], rel=1e-6)
    assert means["velocity_voltage"] == pytest.approx(eqs.mu * means["voltage_squared"], rel=1e-6)


def test_power_balance_with_impacts():
    """N1 + N2 E[x^2] = beta mu E[V^2] + c E[x'^2] + the losses of impacts, on the coarsest mesh of
    a linear friction."""
    eqs = changed(PAPER, c1=-0.03, c2=None, c3=None, restitution=0.6, n2=0.002)
    setting = settled(eqs, 24.0)
    found = solution(eqs, setting, mesh(eqs, setting.box, RESOLUTIONS[0]), 6)
    means = dict(zip(NAMES, found.means, strict=True))
    given = eqs.n1 + eqs.n2 * means["displacement_squared"]
    taken = (
        eqs.beta * eqs.mu * means["voltage_squared"]
        + 0.03 * means["velocity_squared"]
        + means["impact_loss"]
    )
    assert taken == pytest.approx(given, rel=1e-6)


def test_equations_are_solved(coarse):
    assert coarse[1].residual < 1e-10


@pytest.mark.slow
def test_answer_does_not_depend_on_the_frame():
    """Other modes of y, the same means: the frame is a choice of coordinates."""
    setting = settled(PAPER, 26.0)
    on = mesh(PAPER, setting.box, RESOLUTIONS[0])
    ours = solution(PAPER, setting, on, 10).means[0]
    frame = setting.frame
    turned = type(setting)(
        setting.box, ModeFrame(frame.slope + 0.05, frame.offset, 1.2 * frame.scale), setting.peak
    )
    assert solution(PAPER, turned, on, 16).means[0] == pytest.approx(ours, rel=1e-7)


@pytest.mark.slow
def test_paper_scene_has_the_voltage_of_event_driven_monte_carlo():
    assert refined(PAPER, 1e-4).means[0] == pytest.approx(0.08814, abs=4 * 6e-5)


@pytest.mark.thorough("test_equations_are_solved")
@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.96, 0.37, 0.1])
def test_stated_error_holds_against_a_finer_mesh_more_modes_and_a_wider_box(restitution):
    """E[V^2] and E[x'^2] of a cheap answer lie within its error of a better one."""
    eqs = changed(PAPER, restitution=restitution)
    cheap, better = refined(eqs, 1e-4), refined(eqs, 3e-6)
    for name in ("voltage_squared", "velocity_squared", "displacement_squared"):
        place = NAMES.index(name)
        off = abs(cheap.means[place] - better.means[place])
        assert off <= cheap.error[place] + better.error[place]
    assert better.share < 0.5 * cheap.share


@pytest.mark.thorough("test_linear_scene")
@pytest.mark.slow
def test_open_circuit_is_a_spring():
    """With no load V = x: the same as a spring that is stiffer by beta."""
    open_circuit = refined(Equations(c1=-0.1, beta=0.5, n1=0.02, restitution=0.8), 1e-6)
    spring = refined(Equations(c1=-0.1, linear=1.5, mu=1.0, n1=0.02, restitution=0.8), 1e-6)
    place = NAMES.index("displacement_squared")
    assert open_circuit.means[place] == pytest.approx(spring.means[place], rel=3e-6)
    assert np.isclose(open_circuit.means[0], open_circuit.means[place], rtol=1e-12)


@pytest.mark.parametrize("lost", [(True, False), (False, True), (True, True)])
def test_what_is_lost_at_an_end_is_the_rate_of_the_mass(lost):
    """The sum of the equations over all test functions, whose sum is 1, is the outflow at the ends that lose."""
    eqs = SCENES["two wells"]
    setting = settled(eqs, 24.0)
    form = WeakForm(eqs, mesh(eqs, setting.box, RESOLUTIONS[0]), setting.frame, 4, lost)
    p = np.random.default_rng(1).standard_normal(form.shape)
    rate = -form.apply(p)[0].sum()
    expected = float((form.loss() * p[0]).sum())
    assert abs(expected) > 1e-3
    assert rate == pytest.approx(expected, rel=1e-9)
