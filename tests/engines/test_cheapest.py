"""The choice among engines for a netlist: which come first, what one that gives up leaves, and why one was chosen."""

import dataclasses
import json

import pytest

import harvester as hv
from harvester.engines.cheapest import Tried, is_slow
from harvester.engines.compiled import Compiled
from harvester.engines.selection import default_engine, sooner
from harvester.engines.slow import Slow
from harvester.engines.spice import spice
from harvester.engines.spice.spice import Spice
from harvester.equations.problem import Problem
from harvester.errors import CircuitError
from harvester.presentation.diagnostic import has, warning
from harvester.uncertainty.target import Target
from tests.support.netlists import BRIDGE, STORE, on_plate
from tests.support.paths import EXAMPLES

BEHIND = "R1 a m 100\nC2 m b {farads}\nRload m b 330k\n"


def behind_a_filter(tmp_path, farads):
    """A plate with a bridge whose load is behind a resistor and a capacitor."""
    folder = tmp_path / farads
    folder.mkdir()
    return on_plate(folder, BRIDGE.format("1N4148") + BEHIND.format(farads=farads))


def test_a_filter_behind_a_bridge_is_no_chip(tmp_path):
    """A slow circuit is for chips, and for capacitors that charge for long."""
    quick, long = (behind_a_filter(tmp_path, farads) for farads in ("2.2u", "2.2m"))
    assert Slow.refusal(Problem(quick)) is None
    assert [is_slow(Problem(scene)) for scene in (quick, long)] == [False, True]
    assert is_slow(Problem.of(EXAMPLES / "bimorph_bq25570.toml"))
    assert [default_engine(scene) for scene in (quick, long)] == ["spice", "slow"]
    assert [sooner(hv.Spice(), scene) for scene in (quick, long)] == [(), ("slow",)]


def test_engines_for_a_netlist(tmp_path):
    """Others follow if the first one misses the target."""
    bridge = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    chosen = hv.Cheapest(within=0.01)
    assert chosen._for_netlist(Problem(bridge)) == [Spice, Compiled]
    stopped = dataclasses.replace(bridge, stop=hv.Stop(restitution=0.9))
    assert chosen._for_netlist(Problem(stopped)) == [Compiled, Spice]
    recorded = hv.load(EXAMPLES / "plate_recorded.toml").with_load(netlist="bridge")
    assert chosen._for_netlist(Problem(recorded)) == [Compiled, Spice]
    chip = Problem.of(EXAMPLES / "bimorph_bq25570.toml")
    assert chosen._for_netlist(chip)[0] is Slow
    assert Slow not in hv.Cheapest(within=0.01, dt=1e-3)._for_netlist(chip)


@pytest.fixture
def bridge(tmp_path):
    """A bridge, and engines that are asked for it with their answers by name, in place of long runs."""
    return on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)


def answering(monkeypatch, answers):
    """Let engines give one of their ``answers`` after the other, and keep who was asked, and how."""
    asked = []

    def run(self, problem, progress=None):
        asked.append((self.NAME, self.GIVES_UP))
        found = answers[self.NAME].pop(0)
        if isinstance(found, Exception):
            raise found
        return found

    for kind in (Compiled, Spice):
        monkeypatch.setattr(kind, "run", run)
    return asked


def answer_of(engine, error, unknown="", enough=None):
    """An answer of 1 W with a relative error; ``enough`` seconds would have reached the target."""
    power = hv.Value(1.0, error / 1.96, unknown=unknown, unit="W")
    missed = warning(
        "target_missed", within=0.01, budget=30.0, error=error, more=enough, enough=enough
    )
    return dataclasses.replace(
        EXACT, engine=engine, mean_power=power, diagnostics=(missed,) if enough else (), seconds=2.0
    )


EXACT = hv.run(EXAMPLES / "plate.toml")


def test_who_gives_up_leaves_the_budget_to_the_next(monkeypatch, bridge):
    asked = answering(
        monkeypatch,
        {
            "spice": [answer_of("spice", 0.03, enough=400.0)],
            "compiled": [answer_of("compiled", 0.005)],
        },
    )
    found = hv.run(bridge, within="1%", budget="30s")
    assert asked == [("spice", True), ("compiled", True)]
    assert found.engine == "compiled"
    assert (
        "engine 'compiled' was chosen as the cheapest: its stated error, 0.5 %, is within 1 % "
        "('spice' would need about 6 min 40 s)" in found.reason
    )


def test_the_rest_of_a_budget_is_used_by_the_one_that_was_closest(monkeypatch, bridge):
    asked = answering(
        monkeypatch,
        {
            "spice": [answer_of("spice", 0.03, enough=80.0), answer_of("spice", 0.009)],
            "compiled": [answer_of("compiled", 0.02, enough=500.0)],
        },
    )
    found = hv.run(bridge, within="1%", budget="30s")
    assert [name for name, *_ in asked] == ["spice", "compiled", "spice"]
    assert not asked[-1][1]  # the last does not give up
    assert found.engine == "spice" and "is within 1 %" in found.reason


def test_an_answer_without_its_whole_error_is_the_last_choice(monkeypatch, bridge):
    answering(
        monkeypatch,
        {
            "spice": [answer_of("spice", 0.001, unknown="leaving ngspice out")],
            "compiled": [answer_of("compiled", 0.2)],
        },
    )
    assert hv.run(bridge, within="1%").engine == "compiled"
    unknown = [answer_of(name, 0.001, unknown="the step") for name in ("spice", "compiled")]
    answering(monkeypatch, {"spice": unknown[:1], "compiled": unknown[1:]})
    found = hv.run(bridge, within="1%")
    assert "none reaches 1 %, and no total error is known" in found.reason
    json.dumps([said.as_json() for said in found.diagnostics], allow_nan=False)


def test_the_first_error_is_raised_if_none_answers(monkeypatch, bridge):
    failures = {"spice": [CircuitError("no step")], "compiled": [CircuitError("no start")]}
    answering(monkeypatch, failures)
    with pytest.raises(CircuitError, match="no step"):
        hv.run(bridge, within="1%")


def test_more_samples_do_not_measure_a_difference_from_ngspice_that_is_missing(monkeypatch, bridge):
    """`Compiled` is not run again if its error would still not be known."""
    unknown = answer_of("compiled", 0.02, unknown="leaving ngspice out", enough=12.0)
    asked = answering(
        monkeypatch, {"spice": [answer_of("spice", 0.03)], "compiled": [unknown, unknown]}
    )
    assert hv.run(bridge, within="1%", budget="30s").engine == "spice"
    assert [name for name, *_ in asked] == ["spice", "compiled"]
    assert Tried(Compiled, unknown).needed == float("inf")


def test_needed_seconds_are_those_of_the_last_look():
    assert Tried(Spice, answer_of("spice", 0.03, enough=400.0)).needed == 400.0
    assert Tried(Spice, answer_of("spice", 0.03)).needed == float("inf")


@pytest.mark.ngspice
def test_a_tolerance_of_ngspice_that_is_too_large_is_made_smaller(monkeypatch, bridge):
    """Once the runs show it, they begin again with a tenth, and the answer states so; a given one stays."""
    said = warning("needs_smaller_tolerance", within=0.2, error=0.3, reltol=1e-5)
    found = []

    def refine(runs, target):
        found.append(runs.setup.device.reltol)
        return said if len(found) == 1 else None

    monkeypatch.setattr(spice, "refine", refine)
    answer = hv.Spice(within=0.2).run(bridge)
    assert found == [pytest.approx(1e-4), pytest.approx(1e-5)]
    assert has(answer.diagnostics, "tolerance_chosen")
    assert not has(answer.diagnostics, "needs_smaller_tolerance")
    found.clear()
    given = hv.Spice(within=0.2, reltol=1e-3).run(bridge)
    assert found == [1e-3] and has(given.diagnostics, "needs_smaller_tolerance")


def test_a_target_that_gives_up():
    """At twice the budget: the seconds of sampling so far count, not those of the burn-in."""
    value = hv.Value(1.0, 0.05)
    target = Target(0.01, budget=10.0, sampling_seconds=0.1, gives_up=True)
    assert target.more_seconds(value) == pytest.approx(0.1 * (9.8**2 - 1.0))
    assert not target.is_hopeless(value)
    target.sampling_seconds = 0.3
    assert target.is_hopeless(value)
    assert not dataclasses.replace(target, gives_up=False).is_hopeless(value)
    assert not dataclasses.replace(target, budget=None).is_hopeless(value)
    biased = hv.Value(1.0, 0.05, bias=0.009)
    assert target.more_seconds(biased) == pytest.approx(0.3 * ((0.098 / 0.003) ** 2 - 1.0))


@pytest.mark.ngspice
def test_no_further_engine_is_asked_if_the_join_of_a_record_is_beyond_the_target(monkeypatch):
    """The join is an error that all engines have: one answers, and states that no effort helps."""
    asked = []
    for kind in (Compiled, Spice):
        run = kind.run

        def counted(self, *given, run=run):
            asked.append(self.NAME)
            return run(self, *given)

        monkeypatch.setattr(kind, "run", counted)
    plate = hv.load(EXAMPLES / "plate.toml")
    shaken = dataclasses.replace(
        plate, excitation=hv.Excitation(acceleration_file=str(EXAMPLES / "shake.csv"))
    )
    scene = shaken.with_load(netlist="bridge", parameters={"R": "1.5 Mohm", "C": "1 uF"})
    answer = hv.Cheapest(within=0.1).run(scene)
    assert asked == ["compiled"]
    assert {"within_record_join", "record_join"} <= {said.code for said in answer.diagnostics}
    assert answer.mean_power.model > 0.1 * answer.mean_power.value


@pytest.mark.ngspice
def test_a_board_behind_a_rectifier_is_known_to_a_per_cent_by_its_slow_circuit():
    """Its rectifier differs by much less from ngspice's than compiled circuits in general."""
    answer = hv.run(EXAMPLES / "bimorph_board.toml", within="1%")
    assert answer.engine == "slow"
    assert answer.mean_power.error95 < 0.01 * answer.mean_power.value
