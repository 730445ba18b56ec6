"""Growth without bound is found before anything runs if the equations are linear, and no step is too long for it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import harvester as hv
from harvester.equations.bounds import barriers, check_bounded, flow, strongest_feed
from harvester.equations.coefficients import Equations
from harvester.errors import InputError, SimulationError, UnboundedResponseError
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.moments import check_stationary
from tests.support.systems import changed

SEED = np.random.SeedSequence(20261122)
FILTERED = {"coloured": 0.01, "correlation_time": 1e-8}


@pytest.mark.parametrize("c1, grows", [(1e-6, "5e-07"), (0.2, "0.1"), (1e12, r"1e\+12")])
def test_linear_growth_is_found_from_the_eigenvalues(c1, grows):
    with pytest.raises(
        UnboundedResponseError, match=rf"grows without bound: .* grow as exp\({grows} w0 t\)"
    ):
        check_bounded(Equations(c1=c1, beta=1e-9, mu=1.0, **FILTERED))


@pytest.mark.parametrize(
    "eqs",
    [
        Equations(c1=0.05, beta=0.5, mu=1.0, n1=0.01),
        Equations(c1=0.05, c3=0.1, n1=0.01),
        Equations(c1=0.05, restitution=0.9, n1=0.01),
        Equations(c1=-1e-12, beta=1e6, mu=1e12, n1=0.01),
        Equations(beta=1e6, mu=1e12, n1=0.01),
    ],
    ids=["the load takes it", "damping_x4", "stop", "fast load", "no damping"],
)
def test_what_may_be_bounded_is_not_refused(eqs):
    check_bounded(eqs)


def test_what_a_circuit_may_hold_is_not_refused():
    check_bounded(Equations(c1=0.05, n1=0.01), driven=True)


@pytest.mark.parametrize(
    "eqs, feed",
    [
        (Equations(c1=1e3, c3=1e3), 1e3),
        (Equations(c1=-2.0, c2=40.0, c3=20.0), 18.0),
        (Equations(c1=1e12, restitution=0.9), 1e12),
        (Equations(c1=-5.0), 0.0),
    ],
)
def test_no_step_turns_what_friction_feeds_into_a_loss(eqs, feed):
    """From a feed of 1 per step on, 1/(1 + y + y^2/2) falls where exp(-y) grows: E[V^2] was 1e-5."""
    assert strongest_feed(eqs) == pytest.approx(feed)
    assert Trajectories(eqs, 64, SEED).h * feed <= 0.5
    if feed:
        with pytest.raises(
            InputError, match=r"^`dt` must be below .*/w0, for damping is negative somewhere"
        ):
            burn_in(Trajectories(eqs, 64, SEED, 0.1))


def test_violent_growth_against_a_stop_is_no_small_number():
    """Printed as a mean square voltage of 5e-9 +- 1e-9 before."""
    with pytest.raises(SimulationError):
        burn_in(
            Trajectories(
                Equations(c1=1e12, gap=0.5, restitution=0.9, beta=0.05, mu=1.0, **FILTERED),
                64,
                SEED,
            )
        )


def test_a_path_that_grows_is_told_from_one_that_only_begins_quietly():
    t = np.linspace(0.0, 1.0, 300)[:, None] * np.ones(3)
    for quiet in (np.sin(50.0 * t), t**4, np.where(t < 0.5, 1e-3, 1.0), 0.0 * t, 1e30 ** t[:20]):
        check_stationary(quiet)
    for grows in (1e15**t, 1e200**t):
        with pytest.raises(UnboundedResponseError, match=r"its energy grew [0-9.]*e"):
            check_stationary(grows)


@pytest.mark.slow
def test_a_softening_spring_under_a_sinusoid_is_served_while_it_holds_the_mass():
    """The mean of V^2 is that of an accurate solver, over the last of 60 periods; a drive too strong is reported."""
    table = {
        "alpha": -0.3,
        "c1": -0.1,
        "beta": 0.2,
        "mu": 1.0,
        "drive": 0.1,
        "drive_frequency": 0.9,
    }

    def slope(t, z):
        x, v, voltage = z
        force = 0.1 * np.cos(0.9 * t) - 0.1 * v - x + 0.3 * x**3 - 0.2 * voltage
        return [v, force, v - voltage]

    t = np.linspace(59.0, 60.0, 401) * 2.0 * np.pi / 0.9
    true = np.mean(
        solve_ivp(slope, (0.0, t[-1]), np.zeros(3), t_eval=t[:-1], rtol=1e-9, atol=1e-12).y[2] ** 2
    )
    found = (
        hv.Ensemble(trajectories=64)
        .run(hv.Scene(nondimensional=hv.Nondimensional(**table)))
        .mean_square_voltage
    )
    assert abs(found.value - true) < found.error95 + 1e-4 * true < 0.02 * true
    with pytest.raises(UnboundedResponseError):
        hv.Ensemble(trajectories=64).run(
            hv.Scene(nondimensional=hv.Nondimensional(**table | {"drive": 2.0}))
        )


def test_barriers_are_the_tops_between_resting_places():
    """x (1 - x) (1 - 2 x) has its top at 1/2, x^3 - x at 0; beyond a stop there is none."""
    assert barriers(Equations(alpha2=-3.0, alpha=2.0)) == pytest.approx([0.5])
    wells = Equations(linear=-1.0, alpha=1.0)
    assert barriers(wells) == pytest.approx([0.0])
    assert len(barriers(changed(wells, restitution=0.9))) == 0


@pytest.mark.parametrize("mu", [0.7, None])
def test_flow_is_the_jacobian_at_a_well_with_growing_mass_and_coupling(mu):
    """(1 + i x^2) x'' + i x x'^2 + friction x' - x + 3 x^3 + beta (1 + g x^2) V = 0, V' = (1 + g x^2) x' - mu V."""
    eqs = Equations(
        c1=-0.1, c2=0.2, linear=-1.0, alpha=3.0, beta=0.4, mu=mu, inertia=0.6, gamma=0.9, n1=0.01
    )
    well = eqs.resting_places[-1]
    assert well == pytest.approx(3**-0.5)

    def rate(z):
        x, v, volts = z
        grown = 1.0 + 0.9 * x * x
        # the constant beta V of the rest is part of the well: V is 0 there
        friction = np.polynomial.Polynomial(eqs.friction)(x * x) * v
        force = x - 3.0 * x**3 - friction - 0.6 * x * v**2 - 0.4 * grown * volts
        return np.array([v, force / (1.0 + 0.6 * x * x), grown * v - (mu or 0.0) * volts])

    rest = np.array([well, 0.0, 0.0])
    jacobian = np.array([(rate(rest + e) - rate(rest - e)) / 2e-6 for e in 1e-6 * np.eye(3)]).T
    expected = np.linalg.eigvals(jacobian)
    if mu is None:  # V is (1 + g x^2) times the displacement from the well: one eigenvalue is 0
        expected = expected[np.abs(expected) > 1e-6]
    found = np.linalg.eigvals(flow(eqs, well))
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), abs=1e-8)
