"""Engines side by side and one path from three sources."""

import time

import numpy as np
import pytest

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.machine.progress import CallingBack
from harvester.presentation.plot import image
from harvester.studies.compare import PATHS, compare, one_path
from tests.support.systems import PAPER, scene

pytestmark = pytest.mark.ngspice


@pytest.mark.thorough("test_comparison_has_every_engine_and_its_z")
def test_path_with_and_without_the_stop():
    """The decoupled V follows within 10 % without the stop, and misses by more than half with it."""
    stop = one_path(Problem(scene(PAPER)), "with", dt=0.05)
    bare = one_path(Problem(scene(PAPER).without_stop()), "without", dt=0.05)
    assert stop.spice_rms_error < 1e-5
    assert bare.spice_rms_error < 1e-5
    assert bare.decoupled_rms_error < 0.1
    assert stop.decoupled_rms_error > 0.5
    assert stop.t[-1] == pytest.approx(100.0, abs=1.0)
    assert (stop.x >= 0).all()
    # What is wrong with it: a mean that the true voltage does not have
    assert stop.decoupled.mean() > 3 * abs(stop.spice.mean())


def test_comparison_has_every_engine_and_its_z():
    result = compare(scene(PAPER), trajectories=32, duration=200.0)
    assert [e.engine for e in result.estimates] == [
        "published",
        "averaged",
        "density",
        "ensemble",
        "spice",
    ]
    told = result.as_json()
    rows = {row["engine"]: row for row in told["engines"]}
    reference = rows.pop(told["reference"])
    assert reference["z"] is None
    sampled = next(row for name, row in rows.items() if row["mean_power"]["stderr"] is not None)
    assert abs(sampled["z"]) < 4
    assert rows["published"]["ratio"] == pytest.approx(4.0, rel=0.1)
    assert {p["scene"] for p in told["paths"]} == {"with the stop", "without the stop"}
    assert image(result.plot("title"), "png").startswith(b"\x89PNG")


@pytest.mark.thorough("test_comparison_has_every_engine_and_its_z")
def test_engines_that_cannot_serve_are_named():
    bridge = hv.load("examples/plate.toml").with_load(hv.Load(netlist="bridge"))
    result = compare(bridge, trajectories=2, duration=10.0)
    assert [e.engine for e in result.estimates] == ["ideal", "compiled", "spice"]
    assert result.reference.engine == "spice"
    assert set(result.refused) == {"exact", "published", "averaged", "density", "ensemble", "slow"}
    assert result.paths == ()
    assert result.reference.engine == "spice"
    assert np.isfinite(result.estimates[0].mean_power.value)


@pytest.mark.thorough("test_comparison_has_every_engine_and_its_z")
def test_a_stop_that_is_all_that_bounds_the_response():
    """Without the stop negative damping grows without bound: no such path, and the comparison is valid."""
    result = compare(
        scene(Equations(c1=0.02, restitution=0.9, mu=0.5, beta=0.05, n1=0.01)),
        trajectories=64,
        duration=50.0,
    )
    assert {"ensemble", "spice"} <= {e.engine for e in result.estimates}
    assert [p.title for p in result.paths] == ["with the stop"]


def test_it_writes_when_it_is_told_to(tmp_path, monkeypatch):
    """Nothing without a folder; with one the table of the text, its figure, and where they are from."""
    monkeypatch.chdir(tmp_path)
    told = []
    progress = CallingBack(lambda done, what: told.append((round(done, 6), what)))
    found = compare(
        scene(PAPER), engines=["published", "averaged"], execution=hv.Execution(progress=progress)
    )
    assert list(tmp_path.iterdir()) == []
    assert [what for _, what in told] == ["published", "averaged", "paths"] and told == sorted(told)
    again = compare(
        scene(PAPER), engines=["published", "averaged"], execution=hv.Execution(out="out")
    )
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "compare.csv",
        "compare.png",
        "provenance.json",
    }
    rows = (tmp_path / "out" / "compare.csv").read_text().splitlines()
    assert rows[1].split(",")[1] == f"{again.estimates[0].mean_power.value:.9g}"
    assert str(found).splitlines()[1].strip() == "against published" and "%" in str(found)
    with pytest.raises(
        hv.InputError, match="must have only `out`, `formats`, `progress`, but has `workers`"
    ):
        compare(scene(PAPER), execution=hv.Execution(workers=2))


def test_a_budget_is_for_all_engines_together(monkeypatch):
    """Each gets its share of the remainder, all no more than the whole; what was spent before its turn leaves none."""
    given = []
    for kind in (hv.Ensemble, hv.Density):
        run = kind.run
        monkeypatch.setattr(
            kind, "run", lambda self, *them, run=run: given.append(self.budget) or run(self, *them)
        )
    result = compare(
        scene(PAPER), engines=["averaged", "density", "ensemble"], within=0.01, budget="5s"
    )
    # density may need more than its share
    assert {"averaged", "ensemble"} <= {one.engine for one in result.estimates}
    share = hv.Density.share_of_time
    others = hv.Ensemble.share_of_time + PATHS
    assert (
        given[0] <= 5.0 * share / (share + others)
        and given[1] <= 5.0 * hv.Ensemble.share_of_time / others
    )
    late = compare(scene(PAPER), engines=["ensemble", "density"], budget=1e-3)
    assert [one.engine for one in late.estimates] == ["ensemble"]
    assert late.refused["density"].startswith("the `budget` was spent before its turn")


def test_an_engine_that_refuses_has_spent_of_the_budget(monkeypatch):
    """What is given to the engine after it is its share of the remainder: no more than that, whatever the load."""

    def refuse(*_):
        time.sleep(0.5)
        raise hv.SimulationError("no density in that time")

    run = hv.Ensemble.run
    given = []
    monkeypatch.setattr(hv.Density, "run", refuse)
    monkeypatch.setattr(
        hv.Ensemble, "run", lambda self, *them: given.append(self.budget) or run(self, *them)
    )
    result = compare(scene(PAPER), engines=["density", "ensemble"], budget="5s")
    shares = hv.Ensemble.share_of_time + PATHS
    assert given[0] <= (5.0 - 0.5) * hv.Ensemble.share_of_time / shares and list(
        result.refused
    ) == ["density"]


def test_a_budget_bounds_the_processor_time_of_all_engines():
    """Kernels are there after the first time; the second time engines and their remainder accept what was asked for."""
    engines = ["averaged", "ensemble"]
    compare(scene(PAPER), engines=engines, budget="1s")
    begin = time.process_time()
    result = compare(scene(PAPER), engines=engines, within=1e-4, budget="1s")
    assert time.process_time() - begin < 1.5 and len(result.estimates) == 2
