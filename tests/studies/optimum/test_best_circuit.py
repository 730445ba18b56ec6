"""The best of several circuits: each is searched by itself; the impossible is refused before anything runs."""

import dataclasses
import json
import math
import re
import time

import numpy as np
import pytest

import harvester as hv
from harvester.machine.progress import CallingBack
from harvester.presentation.diagnostic import has, warning
from harvester.studies.optimum import circuit_choice
from harvester.studies.optimum.circuit_choice import CircuitChoice
from harvester.studies.optimum.race import Race
from harvester.studies.optimum.search import Search, SearchRequest
from harvester.studies.optimum.search_result import SearchResult
from tests.support import systems
from tests.support.paths import EXAMPLES

BRIDGE = EXAMPLES / "plate_bridge.toml"
OVER = ("--vary", "load.parameters.R=300k:3M")


@pytest.mark.thorough("test_all_are_scanned_alike")
@pytest.mark.slow
def test_each_circuit_has_its_own_best(harvester, tmp_path):
    """The best of a short search of each, in the order of power, with a folder each; the parameters are kept."""
    words = (
        "--vary",
        "load.netlist=bridge,doubler",
        *OVER,
        "--engine",
        "ideal",
        "--trajectories",
        "64",
        "--json",
    )
    status, out, err = harvester("optimise", BRIDGE, *words, "--budget", "1.5s", "--out", tmp_path)
    assert (status, err) == (0, "")
    found = json.loads(out)
    powers = {name: one["mean_power"]["value"] for name, one in found["circuits"].items()}
    assert set(powers) == {"bridge", "doubler"}
    top = max(powers, key=powers.__getitem__)
    assert found["best"] == (top if {*found["unscanned"]} <= {top} else None)
    assert (
        (tmp_path / "circuits.csv")
        .read_text()
        .startswith("load.netlist,load.parameters.R (ohm),mean_power (W),")
    )
    assert (tmp_path / "bridge" / "optimise.csv").exists() and (
        tmp_path / "doubler" / "optimise.png"
    ).exists()
    about = json.loads((tmp_path / "doubler" / "provenance.json").read_text())
    assert about["scene"]["load"]["netlist"] == "doubler" and set(
        about["scene"]["load"]["parameters"]
    ) <= {"R", "C"}


@pytest.mark.slow
def test_seconds_of_a_choice_are_those_that_passed():
    """All circuits together; the clock's own reading in its place would be hours."""
    begin = time.perf_counter()
    found = hv.optimise(
        BRIDGE,
        vary={"load.netlist": ["bridge", "doubler"], "load.parameters.R": (3e5, 3e6)},
        engine=hv.Ideal(trajectories=64),
        budget=0.5,
    )
    assert len(found.optima) == 2
    assert 0.0 < found.seconds <= time.perf_counter() - begin


def test_coils_of_different_quality_are_told():
    """1/Q = Rcoil sqrt(Cp/L) + sqrt(L/Cp)/Rcore; nothing is stated of one inductor, nor if the
    inductor itself is varied."""
    given = hv.load(BRIDGE)
    scenes = {name: given.with_load(netlist=name) for name in ("bridge", "parallel_sshi", "sece")}
    over = {"load.parameters.R": ("300k", "3M")}
    (said,) = circuit_choice.compare_coils(scenes, over)
    wave = math.sqrt(2.0 / given.piezo.capacitance)
    assert f"sece {1.0 / (200.0 / wave + wave / 500e3):.2g}" in str(said) and "bridge" not in str(
        said
    )
    assert circuit_choice.compare_coils(scenes, over | {"load.parameters.L": ("10m", "1")}) == ()
    same = {"L": 0.0105, "Rcoil": 11.9, "Rcore": 510e3}
    alike = {
        name: given.with_load(netlist=name, parameters=same) for name in ("parallel_sshi", "sece")
    }
    assert circuit_choice.compare_coils(alike, over) == ()


@pytest.mark.slow
def test_all_are_scanned_alike():
    """Each has the places of the scan, in rounds; one of a quarter of the power ends there, the other continues."""
    told = []
    powers = {"weak": 0.0025, "strong": 0.01}
    asked = {
        name: SearchRequest.of(
            systems.scene(systems.linear(0.5, 1.0, 0.1, n1=n1)),
            {"nondimensional.mu": (0.1, 10.0)},
            hv.Ensemble(trajectories=256, duration=50.0),
            "5%",
            "60s",  # far more than it takes, also on a busy machine that compiles first
        )
        for name, n1 in powers.items()
    }

    class Told(CallingBack):
        def start(self, total=None, what="", done=0):
            plans.append(what)

    plans = []
    race = Race(asked, Told(lambda done, _: told.append(done)))
    assert race.order() == ["strong", "weak"]
    scans = [[tuple(p.u) for p in race.searches[name].surface.points] for name in powers]
    assert scans[0] == scans[1] and len(scans[0]) == 13
    (plan,) = plans
    assert re.fullmatch(
        r"the first point of all 2 circuits needed .* s: at least \d+ of the 13 points .*", plan
    )
    strong, weak = race.optimum("strong", None), race.optimum("weak", None)
    assert str(weak.warnings[0]).startswith(
        "its search ended with the first scan, whose largest power is 25 % of that"
    )
    assert has(weak.diagnostics, "ended_with_scan") and not has(
        strong.diagnostics, "ended_with_scan"
    )
    assert len(weak.points) == 14 < len(strong.points)
    assert told == sorted(told) and told[-1] <= 1.0
    assert (
        "first scan only"
        in CircuitChoice.of({"strong": strong, "weak": weak}, 1.0).table.csv().splitlines()[2]
    )


def test_scans_that_are_cut_short_are_compared():
    """What all have seen when the budget ends states which continues first; too little to end the search of another."""
    powers = {"weak": 0.0025, "strong": 0.01}
    asked = {
        name: SearchRequest.of(
            systems.scene(systems.linear(0.5, 1.0, 0.1, n1=n1)),
            {"nondimensional.mu": (0.1, 10.0)},
            hv.Ensemble(trajectories=256, duration=50.0),
            "5%",
            1e-4,
        )
        for name, n1 in powers.items()
    }
    race = Race(asked)
    assert race.order() == ["strong", "weak"] and race.top == "strong"
    assert not has(race.optimum("weak", None).diagnostics, "ended_with_scan")


def test_under_a_steady_drive_ngspice_has_no_scout():
    """Its periodic response needs less time than paths with ideal elements, and is nearer to the truth."""
    drive = hv.Excitation(acceleration_amplitude="0.2 g", frequency="3 Hz")
    scenes = {False: hv.load(BRIDGE).replace(excitation=drive), True: hv.load(BRIDGE)}
    for has_scout, scene in scenes.items():
        asked = SearchRequest.of(scene, {"load.parameters.R": (3e5, 3e6)}, "spice", "5%", "60s")
        sampled = Search.begin(asked).sampled_search
        assert sampled is not None and (sampled.scout() is not None) == has_scout


@pytest.mark.ngspice
@pytest.mark.slow
def test_a_last_run_that_is_cut_off_loses_no_optimum(monkeypatch):
    """Under a steady excitation the best that was found before remains, as nothing random favoured
    it."""
    drive = hv.Excitation(acceleration_amplitude="0.2 g", frequency="3 Hz")
    asked = SearchRequest.of(
        hv.load(BRIDGE).replace(excitation=drive),
        {"load.parameters.R": (3e5, 3e6)},
        "spice",
        "5%",
        60.0,
    )
    search = Search.begin(asked)
    assert search.sampled_search is not None
    before = search.surface.evaluate(np.array([[0.3], [0.5]]), search.sampled_search.engine, "scan")
    search.surface.budget = 1e-3
    # or a fast machine ends it in time
    monkeypatch.setattr("harvester.studies.optimum.evaluations.SHORTEST", 1e-3)
    found = search.finish(result=SearchResult((search.sampled_search.best_so_far(before),)))
    assert not search.surface.points[-1].is_sound, "the run at the optimum has no time"
    assert found.estimate.is_sound and found.mean_power.value == max(p.power.value for p in before)


@pytest.mark.slow
def test_the_table():
    """The best first, what cannot be distinguished from it named, and a circuit without an answer with its error."""
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    one = hv.optimise(scene, vary={"nondimensional.mu": (0.1, 10.0)}, engine="exact")
    two = hv.optimise(scene, vary={"nondimensional.mu": (3.0, 10.0)}, engine="exact")
    found = CircuitChoice.of(
        {"two": two, "broken": hv.SimulationError("does not converge"), "one": one, "same": one},
        1.0,
    )
    assert found.best == "one" and found.alike == ("same",) and found.unfinished == ()
    assert "the best circuit is one, statistically indistinguishable from same" in str(found)
    assert "broken: no optimum: does not converge" in str(found)
    assert [row.split(",")[0] for row in found.table.csv().splitlines()] == [
        "load.netlist",
        "two",
        "broken",
        "one",
        "same",
    ]


@pytest.mark.slow
def test_no_best_circuit_where_a_scan_was_cut_short():
    """A circuit of less power whose range was not looked at may have more; the one of most power has it anyway."""
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    one = hv.optimise(scene, vary={"nondimensional.mu": (0.1, 10.0)}, engine="exact")
    two = hv.optimise(scene, vary={"nondimensional.mu": (3.0, 10.0)}, engine="exact")
    spent = warning(
        "budget_spent",
        budget=1.0,
        stage="first scan",
        evaluations=3,
        engine="exact",
        typical=44,
        each=None,
    )
    cut = {"scanned": False, "diagnostics": (spent,)}
    found = CircuitChoice.of({"one": one, "two": dataclasses.replace(two, **cut)}, 1.0)
    assert found.best is None and found.unscanned == ("two",) and found.as_json()["best"] is None
    assert "no best circuit: the budget ended before the first scan of two did" in str(found)
    assert [row.split(",")[-2] for row in found.table.csv().splitlines()] == [
        "search",
        "complete",
        "scan cut short",
    ]
    assert CircuitChoice.of({"one": dataclasses.replace(one, **cut), "two": two}, 1.0).best == "one"
    figure = found.ranked["two"].plot(None)
    labels = [
        text.get_text().splitlines()[0] for legend in figure.legends for text in legend.get_texts()
    ]
    assert "optimum" not in labels and "highest so far: the scan was cut short" in labels


def test_what_is_not_known_stands_once():
    """Rows of circuits hold the errors that are known; a note states which are not, once."""
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    one = hv.optimise(scene, vary={"nondimensional.mu": (0.1, 10.0)}, engine="exact")
    value = hv.Value(
        one.mean_power.value, stderr=1e-3 * one.mean_power.value, unknown="ideal diodes"
    )
    one = dataclasses.replace(one, estimate=dataclasses.replace(one.estimate, mean_power=value))
    assert (
        str(CircuitChoice.of({"one": one, "two": one}, 1.0)).count(
            "the error of ideal diodes is not known"
        )
        == 1
    )


def unsettled(optimum, times):
    """An optimum of so many times the power, by a run that was cut off before it had settled."""
    answer, power = optimum.estimate, optimum.mean_power
    doubts = (
        *answer.diagnostics,
        warning("mean_while_settling", covered=2.0, why="time is over", steady=False),
    )
    cut = hv.Value(times * power.value, unknown="a response that was cut short")
    estimate = dataclasses.replace(answer, mean_power=cut, diagnostics=doubts)
    return dataclasses.replace(
        optimum, estimate=estimate, diagnostics=(*optimum.diagnostics, doubts[-1])
    )


def test_a_power_that_has_not_settled_is_never_chosen_over_one_that_has():
    """Twice the power of a run that was cut off is not a reason to choose that circuit; alone it is all there is."""
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    one = hv.optimise(scene, vary={"nondimensional.mu": (0.1, 10.0)}, engine="exact")
    found = CircuitChoice.of({"cut": unsettled(one, 2.0), "bridge": one}, 1.0)
    assert (found.best, found.unsound, found.alike) == ("bridge", ("cut",), ())
    assert found.mean_power == one.mean_power and [*found.ranked] == ["bridge", "cut"]
    assert has(found.warnings, "circuit_unsound") and "cut: its power has not settled" in str(found)
    alone = CircuitChoice.of({"cut": unsettled(one, 2.0), "less": unsettled(one, 1.0)}, 1.0)
    assert (alone.best, alone.unsound) == ("cut", ())


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--vary", "load.netlist=bridge,sec"), "unknown netlist 'sec': did you mean 'sece'?"),
        (
            ("--vary", "load.netlist=bridge"),
            "--vary must be load.netlist=A,B,... with two circuits or more",
        ),
        (
            ("--vary", "netlist=bridge,bridge"),
            "--vary must be load.netlist=A,B,... with two circuits or more",
        ),
        (
            ("--vary", "load.netlist=bridge,"),
            "--vary must be load.netlist=A,B,... with two circuits or more",
        ),
        (
            ("--vary", "load.netlist=bridge,sece", "--constraint", "voltage_rms < 2"),
            "must be left out if circuits are",
        ),
        (("--vary", "load.netlist=bridge,../../etc/passwd"), "passwd"),
    ],
)
def test_what_is_refused(harvester, words, error):
    status, out, err = harvester("optimise", BRIDGE, *OVER, *words)
    assert (status, out) == (2, "")
    assert error in err and err.count("\n") == 1
