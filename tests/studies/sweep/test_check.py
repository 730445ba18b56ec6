"""A sweep whose engines nobody named: the default one, formulas next to it, and a check at few points."""

import dataclasses

import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import has
from harvester.studies.sweep.compute import compute_table
from harvester.studies.sweep.points import Axis, grid
from harvester.studies.sweep.sweep import chosen
from tests.support.systems import PAPER, changed, scene

STOPPED = scene(changed(PAPER, restitution=0.7))
LOADS = "nondimensional.mu"
ALONE = hv.Execution(workers=1)  # further processes would import all for a second of work


@pytest.mark.slow
def test_density_checks_the_ensemble_at_one_point_of_three(harvester, tmp_path):
    table = hv.sweep(STOPPED, vary={LOADS: [0.5, 1.0, 2.0]}, execution=ALONE)
    count = {name: len(table.of(name)) for name in table.engines}
    assert count == {"published": 3, "averaged": 3, "ensemble": 3, "density": 1}
    (checked,) = table.of("density")
    assert checked.varied == {LOADS: 1.0}
    assert has(table.diagnostics, "check_agrees") and not has(table.diagnostics, "check_differs")
    assert "agrees with ensemble at the compared point" in str(table)


def test_a_device_without_power_agrees_with_its_check():
    """Without coupling both powers are 0, which is not a difference."""
    table = hv.sweep(STOPPED, vary={"nondimensional.beta": [0.0]}, execution=ALONE)
    assert table.of("density")[0].mean_power.value == 0.0
    assert "agrees with ensemble at the compared point: 0.0 % apart" in str(table)


def test_points_of_a_check():
    axis = Axis(LOADS, tuple(float(k) for k in range(1, 26)))
    assert grid([axis]).spread(3) == {6, 12, 18}
    assert grid([dataclasses.replace(axis, values=(1.0,))]).spread(1) == {0}


@pytest.mark.slow
def test_an_engine_that_differs_from_its_check_is_a_warning():
    """Far steps of the ensemble are off by more than errors that are derived from it."""
    points = grid([Axis(LOADS, (0.5, 1.0, 2.0))])
    table = compute_table(STOPPED, points, [hv.Published(), hv.Density()], check="density")
    blind = dataclasses.replace(
        table,
        rows=tuple(
            dataclasses.replace(
                row, mean_power=dataclasses.replace(row.mean_power, bias=None, model=0.0)
            )
            for row in table.rows
        ),
    )
    assert len(table.rows) == 4 and has(blind.diagnostics, "check_differs")


@pytest.mark.slow
def test_an_interrupted_check_is_resumed(tmp_path):
    points = grid([Axis(LOADS, (0.5, 1.0, 2.0))])
    engines = [hv.Averaged(), hv.Density()]
    out = hv.Execution(out=tmp_path / "sweep")
    first = compute_table(STOPPED, points, engines, out, check="density")
    again = compute_table(
        STOPPED, points, engines, dataclasses.replace(out, resume=True), check="density"
    )
    assert again.rows == first.rows and len(again.rows) == 4


@pytest.mark.parametrize(
    "which, engines, check",
    [
        (None, ["published", "averaged", "ensemble", "density"], "density"),
        ("all", ["published", "averaged", "density", "ensemble", "spice"], None),
        (["all"], ["published", "averaged", "density", "ensemble", "spice"], None),
        (["averaged"], ["averaged"], None),
    ],
)
def test_engines_of_a_sweep(which, engines, check):
    of_sweep = chosen(Problem.of(STOPPED), which)
    assert [getattr(named, "NAME", named) for named in of_sweep.engines] == engines
    assert of_sweep.check == check
