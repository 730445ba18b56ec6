"""Engine `density`: its answers with their errors, when it is chosen, and its refusals."""

import math

import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InfiniteMeanError, InputError
from tests.support.systems import PAPER, changed, linear, linear_v2, scene


@pytest.mark.thorough("test_linear_scene")
def test_linear_scene_within_its_error():
    eqs = linear(0.05, 1.0)
    answer = hv.Density(within=1e-6).run(scene(eqs))
    voltage = answer.mean_square_voltage
    assert voltage.stderr is None
    assert abs(voltage.value - linear_v2(eqs)) <= voltage.error95 <= 1e-6 * voltage.value
    assert answer.mean_power.value == pytest.approx(0.05 * voltage.value, rel=1e-12)


@pytest.mark.slow
def test_the_same_answer_in_other_units():
    """A physical scene: power and E[V^2] do not depend on the scales, and its details are in SI."""
    plate = hv.load("examples/plate_with_stop.toml")
    answer = hv.Density(within=1e-3).run(plate)
    averaged = hv.Averaged().run(plate)
    assert (
        abs(answer.mean_power.value - averaged.mean_power.value)
        <= averaged.mean_power.known_error95
    )
    w0 = Problem(plate).scales.frequency
    assert answer.details["impact_rate"] == pytest.approx(w0 / math.pi, rel=0.3)


@pytest.mark.thorough("test_at_many_points_it_computes_what_is_asked")
def test_it_is_chosen_where_sampling_does_not_reach():
    """`within` of 0.001 % without an engine; a coarser one stays with what is cheaper."""
    fine = hv.run(scene(PAPER), within="0.001%")
    assert fine.engine == "density"
    assert fine.mean_power.error95 <= 1e-5 * fine.mean_power.value
    assert hv.run(scene(PAPER), within="5%").engine == "averaged"
    assert hv.run(scene(linear(0.05, 1.0)), within="0.001%").engine == "exact"


@pytest.mark.thorough("test_linear_scene")
@pytest.mark.slow
@pytest.mark.parametrize("n2", [0.02, 0.07])
def test_error_of_a_box_in_a_power_tail(n2):
    """Noise of the stiffness in a linear scene, whose E[V^2] is known: the error holds what the box leaves out."""
    eqs = changed(linear(0.1, 0.7, c=0.1), n2=n2)
    found = hv.Density(within=1e-3).run(scene(eqs)).mean_square_voltage
    assert abs(found.value - linear_v2(eqs)) <= found.error95


def test_progress_ends_at_one():
    seen = []
    hv.Density(within=1e-5).run(scene(PAPER), seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


@pytest.mark.slow
def test_at_many_points_it_computes_what_is_asked():
    """A sweep states the error of the coarsest meshes, unless one is asked for."""
    assert hv.Density().at_many_points.within == 0.01
    for asked in (hv.Density(within=1e-6), hv.Density(budget=3.0), hv.Ensemble()):
        assert asked.at_many_points is asked
    (row,) = hv.sweep(scene(PAPER), vary={"nondimensional.mu": [0.5]}, engines=["density"]).rows
    fine = hv.Density().run(scene(PAPER).vary("nondimensional.mu", 0.5)).mean_power
    assert abs(row.mean_power.value - fine.value) <= row.mean_power.error95 <= 1e-3 * fine.value


@pytest.mark.slow
def test_a_budget_that_ends_too_early_is_said(monkeypatch):
    """The least answer is given in this scene, which takes a second of CPU time."""
    monkeypatch.setattr("harvester.density.pace.SHORTEST", math.inf)
    answer = hv.Density(within=1e-7, budget=0.01).run(scene(PAPER))
    (warning,) = answer.warnings
    assert str(warning).startswith("`within` 1e-05 % was not reached: the error is ")
    assert answer.mean_power.error95 > 1e-7 * answer.mean_power.value


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"n1": None, "n2": 0.01}, "needs base noise"),
        ({"n1": None, "n2": None}, "needs base noise"),
        (
            {"n1": None, "n2": None, "coloured": 0.01, "correlation_time": 1.0},
            "does not support coloured noise with a dissipative rigid",
        ),
        (
            {"n1": None, "n2": None, "restitution": 0.0, "coloured": 0.01, "correlation_time": 1.0},
            "does not support coloured noise with a dissipative rigid",
        ),
        (
            {"n1": None, "n2": None, "coloured": 0.01, "centre": 1.0, "bandwidth": 0.1},
            "cannot model band pass noise",
        ),
        ({"drive": 0.1, "drive_frequency": 1.0}, "cannot model harmonic drive"),
        ({"cv": 0.1}, "cannot model damping_v"),
    ],
)
def test_what_has_no_stationary_density_is_refused(changes, words):
    with pytest.raises(
        CannotServeError, match=f"^engine 'density' {words}.*: use engine 'ensemble'"
    ):
        hv.Density().run(scene(changed(PAPER, **changes)))


def test_a_circuit_and_a_heavy_tail_are_refused():
    with pytest.raises(
        CannotServeError, match=r"engine 'density' needs a load resistance.*use engine 'spice'"
    ):
        hv.Density().run(hv.load("examples/plate_bridge.toml"))
    with pytest.raises(InfiniteMeanError, match="do not exist"):
        hv.Density().run(scene(changed(linear(0.05, 0.5), n2=0.1)))


def test_within_has_a_least_value():
    with pytest.raises(InputError, match="`within` must be between 1e-07 % and 100 %"):
        hv.Density(within=1e-12)
    with pytest.raises(
        InputError, match=r"`within` must be between 0.001 % and 100 %, but is '1e-5%'"
    ):
        hv.Ensemble(within="1e-5%")
