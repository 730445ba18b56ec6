"""What the page computes while a slider turns, and what it reports of it."""

import dataclasses
import math
import os
import re
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.explore import (
    beside,
    computing,
    downloads,
    html_text,
    in_worker,
    job,
    pictures,
    runs,
)
from harvester.explore.computing import Newest
from harvester.explore.draft import Draft, first
from harvester.explore.live import Live, best, engineering, live
from harvester.explore.slider_scale import slide
from harvester.presentation.diagnostic import warning
from harvester.storage import quick_power
from tests.support.paths import ROOT
from tests.support.systems import BEAM


def looked(draft, key="load.resistance", fine=False, first=False):
    """What the formulas state of a draft."""
    at = draft.value(key)
    return live(draft.scene(), key, at, slide(key, at), fine, first=first)


@pytest.mark.slow
@pytest.mark.parametrize(("fine", "within"), [(False, 5e-3), (True, 5e-4)])
def test_the_curve_is_that_of_the_engines(fine, within):
    """Between its points it is near the engine's answer; the answer at the working point is the engine's own."""
    draft = first()
    found = looked(draft, fine=fine)
    scene = draft.scene()
    own = hv.Averaged().run(scene).mean_power
    assert found.here["averaged"].mean_power.value == pytest.approx(own.value, rel=1e-9)
    assert found.here["averaged"].mean_power.known_error95 == pytest.approx(
        own.known_error95, rel=1e-6
    )
    assert "cannot model impact" in found.refused["exact"]
    for name in ("averaged", "published"):
        curve = found.curves[name]
        places = curve.x[5::17]
        truth = [
            hv.run(scene.vary("load.resistance", float(x)), name).mean_power.value for x in places
        ]
        np.testing.assert_allclose(curve.power[5::17], truth, rtol=within)
    band = found.curves["averaged"]
    assert (band.low < band.power).all()
    assert (band.high > band.power).all()
    quick = looked(draft, first=True).curves["averaged"]  # while a slider turns
    np.testing.assert_allclose(quick.power, np.interp(quick.x, band.x, band.power), rtol=0.05)


@pytest.mark.slow
def test_a_resonance_is_seen():
    """Under a harmonic base the exact curve over the frequency has its peak at the resonance, with Q = 125."""
    draft = Draft.read(ROOT / "examples" / "plate_harmonic.toml")
    key = "excitation.frequency"
    found = looked(draft, key, fine=True)
    curve = found.curves["exact"]
    at = draft.value(key)
    scene = draft.scene()
    truth = [
        hv.run(scene.vary(key, float(f)), "exact").mean_power.value
        for f in np.linspace(0.8 * at, 1.6 * at, 1501)
    ]
    assert curve.power.max() == pytest.approx(max(truth), rel=0.02)


def test_words_have_errors_and_no_markup():
    """The large number has its total error; what a scene is called cannot become a part of the page."""
    draft = first()
    draft.title = "<script>alert(1)</script>"
    found = looked(draft)
    power = found.here["averaged"].mean_power
    large = html_text.headline(found, [])
    number, error = (
        float(one) * 1e-6
        for one in re.search(r"([\d.]+) µW.*± ([\d.]+) µW \(95 %\)", large).groups()
    )
    assert number == pytest.approx(power.value, abs=power.known_error95)
    assert error == pytest.approx(power.known_error95, rel=0.05)
    assert "its error is not known" in html_text.headline(published_only(found), [])
    text, _ = html_text.meanings(found.problem)
    assert "Coupling: strong" in text
    assert "<script>" not in text + html_text.answers(found, []) + html_text.problem_line(
        "<script>"
    )


def published_only(found):
    """The same, but as if only the published theory had answered."""
    here = {"published": found.here["published"]}
    return type(found)(found.problem, found.key, found.at, found.instead, found.curves, here, {})


def test_a_netlist_has_the_resistor_beside_it():
    draft = first()
    draft.choose("bridge")
    found = looked(draft, "load.parameters.R")
    assert found.instead
    own = hv.Averaged().run(first().scene()).mean_power
    assert best(found.here).mean_power.value == pytest.approx(own.value, rel=1e-9)
    large = html_text.headline(found, [])
    # the resistor's is not the circuit's
    assert "Computing the circuit's power" in large and "µW" not in large
    assert "is not known" in html_text.headline(found, [], "no engine serves it")
    with pytest.raises(hv.SimulationError, match="run 'ideal' or 'spice' first"):
        downloads.table(found, [])


def run_of(engine, x, power, **more):
    """A run as the page keeps it, of the design that is shown."""
    known = {
        "engine": engine,
        "x": x,
        "y": power,
        "error": 0.1 * power,
        "known": False,
        "share": 0.25,
    }
    return known | {"own": True} | more


def test_a_pinned_circuit_has_its_own_power_and_never_that_of_a_resistor():
    """Side by side with the present design: its curve and its numbers are those of its own runs, or not known yet."""
    draft = first()
    draft.choose("bridge")
    pinned = looked(draft, "load.parameters.R")
    now = looked(first())
    assert html_text.power_here(pinned, []) is None
    assert pictures.pinned_curve(pinned, []) is None
    runs = [
        run_of("ideal", 2e6, 5e-6),
        run_of("ideal", 1e6, 4e-6),
        run_of("ideal", 3e6, 9e-6, own=False),
    ]
    x, y = pictures.pinned_curve(pinned, runs)
    assert (x.tolist(), y.tolist()) == ([1e6, 2e6], [4e-6, 5e-6])
    before = html_text.power_here(pinned, runs[1:])
    after = html_text.power_here(now, [])
    assert (before.engine, before.value, before.share) == ("ideal", 4e-6, 0.25)
    assert (after.engine, after.share) == ("averaged", now.here["averaged"].share_of_possible)
    rows = [("load.netlist", "bridge", "absent")]
    shown = html_text.difference(rows, before, after, ({"largest displacement": "1 mm"}, {}))
    assert "4 µW ± 0.4 µW (95 %) of what is known, by ideal" in shown and "by averaged" in shown
    assert f"{after.value / 4e-6:.4g}" in shown and "25 %" in shown
    assert "<td>largest displacement</td><td>1 mm</td><td>not computed yet</td>" in shown
    assert "not computed yet" in html_text.difference(rows, None, after)
    # neither sampled, nor a closed form
    large = html_text.headline(pinned, [run_of("ideal", 1e6, 4e-6, error=0.0)])
    assert "its error is not known" in large and "closed form" not in large


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")  # of Panel
def test_a_power_that_has_not_settled_is_pale_and_takes_the_place_of_none():
    """It is reported, but is in no line and no pinned curve, whatever error it states."""
    draft = first()
    told = []
    tables = draft.tables()
    key = "load.resistance"
    found = hv.run(draft.scene(), "ensemble", trajectories=64)
    cut_off = warning("burn_in_stopped", time=1.0, why="load", constant="R C w0 = 9")
    early = dataclasses.replace(
        found, mean_power=hv.Value(1.0, stderr=1e-9), diagnostics=(cut_off,)
    )
    panel = runs.RunPanel(lambda: None, lambda: None, told.append)
    for at, one in ((1e5, early), (1e6, early), (1e6, found), (1e6, early)):
        panel.add("ensemble", (tables, key, at), job.told_of(one))
    shown, drawn = panel.shown(tables, key), panel.drawn(tables, key)
    assert [(one["x"], one["own"]) for one in shown] == [(1e5, True), (1e6, True)]
    assert [(one["x"], one["own"]) for one in drawn] == [(1e5, False), (1e6, True)]
    assert shown[1]["y"] == found.mean_power.value


@pytest.mark.slow
def test_a_node_goes_with_its_circuit_and_not_with_the_resistor():
    """The page's scene with [node] has the reference curve of a resistor, and a day of the node in a few words."""
    draft = Draft.read(ROOT / "examples" / "bimorph_packets.toml")
    assert "exact" in looked(draft, "oscillator.mass").here
    found, own = in_worker.life(draft.tables()), hv.node(draft.scene())
    assert found["short"]["packets per hour"] == f"{own.packets_per_hour.value:.4g}"
    assert found["short"]["awake after"] == f"{own.first_packet.value:.4g} s"
    told = html_text.life(found)
    assert (
        "packets per hour" in told
        and "of the upper bound" in told
        and "limited by its sending interval" in told
    )
    assert "no such circuit" in html_text.life({"error": "no such circuit"})


UNDER = hv.Magnifier(mass="30 g", stiffness="4 N/mm", restitution=0.4, gap="0.02 mm")
BESIDE = {
    "modes": (BEAM.replace(stop=hv.Stop(restitution=0.9, gap="0.05 mm")), "the stop is not drawn"),
    "magnifier": (BEAM.replace(mode=(), magnifier=UNDER), "the stop is not drawn"),
    "ball": (
        BEAM.replace(mode=(), ball=hv.Ball(mass="2 g", room="0.1 mm", restitution=0.7)),
        "the ball is not drawn",
    ),
}


@pytest.mark.parametrize("name", BESIDE)
def test_what_the_numbers_of_several_masses_mean(name):
    """A stop is hit by all modes together, and a ball's box is not a stop to be reached."""
    scene, _ = BESIDE[name]
    told, _ = html_text.meanings(Problem(scene))
    assert "Coupling" in told
    assert ("without it the displacement is" in told) == (name != "ball")
    assert f"[{name.rstrip('s')}]" in html_text.without_knobs(Draft(scene).beside)


@pytest.mark.slow
@pytest.mark.thorough("test_what_the_numbers_of_several_masses_mean")
@pytest.mark.parametrize("name", BESIDE)
def test_a_path_of_several_masses(name):
    """It shows the mass alone, and counts the impacts; stops that the displacement alone does not meet are left out."""
    scene, said = BESIDE[name]
    found = in_worker.path(scene.tables())
    assert found["stops"] == [] and found["impacts"] > 0
    told = beside.sentence(found, beside.of_path(scene, found))
    assert f"{found['impacts']} impacts" in told and said in told


def test_what_is_known_beside_the_power_goes_with_its_design():
    """The present design and the pinned one have them, no other that the sliders passed on the way."""
    draft = Draft.read(ROOT / "examples" / "bimorph_packets.toml")
    tables, known = draft.tables(), beside.Beside()
    path = {"x": [0.0, -2e-3], "V": [1.0, 0.5], "physical": True}
    scene = draft.scene()
    assert beside.of_path(scene, path) == {"largest displacement": "2 mm", "largest voltage": "1 V"}
    strained = scene.vary("piezo.strain_per_displacement", 0.5)
    assert beside.of_path(strained, path)["largest strain"] == "1000 microstrain"
    known.add(tables, {"a": "1"}, None)
    known.add({**tables, "title": "another name"}, {"b": "2"}, None)
    assert known.of(tables) == {"a": "1", "b": "2"}
    draft.turn("oscillator.mass", 0.02)
    known.add(draft.tables(), {"c": "3"}, tables)
    assert (known.of(tables), known.of(draft.tables())) == ({"a": "1", "b": "2"}, {"c": "3"})
    known.add(draft.tables(), {"d": "4"}, None)
    assert known.of(tables) == {}


@pytest.mark.slow
def test_the_power_of_the_circuit_itself():
    """It comes from a process of its own, to 2 %; what no engine without ngspice supports is one line."""
    draft = first()
    draft.choose("bridge")
    scene = draft.scene()
    found = in_worker.elsewhere(
        in_worker.power, (scene.tables(), *in_worker.FINE), lambda: False, lambda: False, 60.0
    )
    said = found["answer"]["mean_power"]
    own = hv.Ideal(within="1%", seed=3).run(scene).mean_power
    assert found["engine"] == "ideal"
    assert found["known_error95"] >= 1.9 * said["stderr"] + said["step_bias"]
    stderr = math.hypot(said["stderr"], own.stderr)
    assert abs(said["value"] - own.value) < 4.0 * stderr + said["step_bias"] + own.bias
    several = hv.load(ROOT / "examples" / "two_modes_with_stop.toml")
    with pytest.raises(hv.CannotServeError, match="needs a netlist"):
        in_worker.power(several.tables(), *in_worker.FINE)


@pytest.mark.thorough("test_the_power_of_the_circuit_itself")
@pytest.mark.parametrize("name", ["bridge", "parallel_sshi", "sece", "bimorph_ltc3588"])
def test_the_power_at_once_is_near_and_its_refinement_is_that_of_run(name):
    """At once within its own error and a few per cent, finely as the engine itself states; without the resistor's."""
    example = ROOT / "examples" / f"{name}.toml"
    draft = Draft.read(example if example.exists() else ROOT / "examples" / "plate_with_stop.toml")
    if not example.exists():
        draft.choose(name)
    scene = draft.scene()
    quick, fine = (
        in_worker.power(scene.tables(), *how) for how in (in_worker.QUICK, in_worker.FINE)
    )
    own = hv.run(
        scene, fine["engine"], within="1%" if fine["engine"] == "ideal" else None
    ).mean_power
    at_once, refined = (one["answer"]["mean_power"]["value"] for one in (quick, fine))
    assert quick["engine"] == fine["engine"] == ("slow" if example.exists() else "ideal")
    assert refined == pytest.approx(own.value, abs=own.known_error95, rel=1e-6)
    sampled = 1.0 if example.exists() else 2.0
    assert abs(at_once - own.value) < sampled * quick["known_error95"] + own.known_error95
    assert 0.0 < quick["known_error95"] < 0.1 * at_once


@pytest.mark.slow
@pytest.mark.statistics
@pytest.mark.parametrize("circuit", ["bridge", "parallel_sshi", "series_sshi", "sece"])
def test_the_first_power_of_a_circuit_is_right_wherever_its_knob_stands(circuit):
    """What the page shows first, of 64 trajectories, is that of `ideal` within its sampling errors and step."""
    draft = first()
    key = "load.parameters.R"
    draft.choose(circuit)
    at = draft.value(key)
    for factor in (0.2, 1.0, 5.0):
        draft.turn(key, factor * at)
        soon = in_worker.power(draft.tables(), *in_worker.QUICK)["answer"]["mean_power"]
        own = (
            dataclasses.replace(hv.Ideal(within="1%", seed=5), judged=False)
            .run(draft.scene())
            .mean_power
        )
        known = 4.0 * math.hypot(soon["stderr"], own.stderr) + soon["step_bias"] + own.bias
        assert abs(soon["value"] - own.value) < known < 0.25 * own.value


def test_a_rectifier_is_measured_once_for_the_loads_behind_it(monkeypatch):
    """The first power of a chip at another load is the same as without what is kept, and measures no current."""
    draft = Draft.read(ROOT / "examples" / "bimorph_bq25570.toml")
    monkeypatch.setattr(quick_power, "MEASURED", {})
    hv.Slow().quick(draft.scene())
    other = draft.scene().vary("load.parameters.R", 2e4)
    with monkeypatch.context() as nothing:
        nothing.setattr(quick_power, "measured_current", None)
        kept = hv.Slow().quick(other).mean_power
        with pytest.raises(TypeError):
            hv.Slow().quick(other.vary("excitation.acceleration_amplitude", 3.0))
    quick_power.MEASURED.clear()
    assert hv.Slow().quick(other).mean_power == kept


class Emptied(dict):
    """Kept currents that another thread removes right after each look."""

    def __contains__(self, key):
        found = super().__contains__(key)
        self.clear()
        return found

    def get(self, key, default=None):
        found = super().get(key, default)
        self.clear()
        return found


@pytest.mark.slow
def test_a_kept_current_that_another_thread_removes_is_still_an_answer(monkeypatch):
    """Between the look for a kept current and its use another thread put its own there: a KeyError."""
    scene = Draft.read(ROOT / "examples" / "bimorph_bq25570.toml").scene()
    kept = Emptied()
    monkeypatch.setattr(quick_power, "MEASURED", kept)
    first_power = hv.Slow().quick(scene).mean_power
    assert len(kept) == 1
    assert hv.Slow().quick(scene).mean_power == first_power


class Told:
    """A page that notes what it is told."""

    def __init__(self):
        self.told = []
        self.power = threading.Event()

    def __getattr__(self, name):
        return lambda *given: self.told.append((name, given))

    def show_power(self, request, answer):
        self.told.append(("show_power", (request, answer)))
        self.power.set()


@pytest.mark.slow
def test_a_circuit_s_power_is_asked_for_before_all_else():
    """Until it is there the page keeps its picture; the formulas and which engines support the scene come after it."""
    draft, page = first(), Told()
    draft.choose("bridge")
    key = "load.parameters.R"
    at = draft.value(key)
    # it has begun
    in_worker.elsewhere(in_worker.power, (draft.tables(), *in_worker.QUICK), bool, bool, 60.0, True)
    work = computing.Computing(page, lambda action: action())
    work.ask(computing.PageRequest(draft, draft.scene(), draft.tables(), key, at, slide(key, at)))
    assert page.power.wait(60.0)
    shown = [given for name, given in page.told if name in ("show", "show_power")]
    assert shown[0][1].instead and not shown[0][1].serving
    assert all(given[1].serving for given in shown[1:] if isinstance(given[1], Live))
    assert shown[-1][1]["engine"] == "ideal"
    for load in (
        2.0 * at,
        at,
    ):  # the last one's power is remembered, and yet not shown before its design
        draft.turn(key, load)
        asked = computing.PageRequest(
            draft.copy(), draft.scene(), draft.tables(), key, load, slide(key, load)
        )
        work.ask(asked)
        while "show_power" not in (
            told := [name for name, given in page.told if given[0] is asked]
        ):
            assert page.power.wait(60.0)
            page.power.clear()
        assert told[0] == "show"
    work.close()


def priority():
    return {"nice": os.nice(0)}


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "nice"), reason="the system has no such priorities")
def test_what_is_computed_in_the_background_gives_way_to_the_first_power():
    background, soon = (
        in_worker.elsewhere(priority, (), bool, bool, 60.0, first)["nice"]
        for first in (False, True)
    )
    assert soon == os.nice(0)
    assert background == max(soon, in_worker.GIVES_WAY)


@pytest.mark.slow
def test_downloads():
    """The table has the engines' numbers, and the page of the report is whole."""
    found = looked(first())
    table = downloads.table(found, [])
    assert set(table.to_pandas()["engine"]) == {"averaged", "published"}
    page = downloads.page(found, [])
    assert page.endswith("</html>\n") or page.rstrip().endswith("</html>")
    assert "averaged: largest" in page


def test_only_the_newest_is_computed():
    """Among many requests during one computation only the last follows it; an error of the work stops nothing."""
    begun = threading.Event()
    done = threading.Event()
    seen = []

    def work(request, overtaken):
        seen.append((request, overtaken()))
        if request == 0:
            begun.set()
            assert done.wait(10)
            seen.append(("overtaken", overtaken()))
            raise ValueError

    with ThreadPoolExecutor(1) as pool:
        newest = Newest(pool, work)
        newest.ask(0)
        assert begun.wait(10)
        for number in range(1, 50):
            newest.ask(number)
        done.set()
    assert seen == [(0, False), ("overtaken", True), (49, False)]


def test_who_waits_for_rest_is_woken_by_a_request():
    """A slider that turns on does not wait for the rest of the slider before; without a request there is a rest."""
    rested = []
    waits = threading.Event()

    def work(request, overtaken):
        waits.set()
        rested.append(newest.rests(60.0 if request == 0 else 0.0))

    with ThreadPoolExecutor(1) as pool:
        newest = Newest(pool, work)
        newest.ask(0)
        assert waits.wait(10)
        newest.ask(1)
    assert rested == [False, True]


@pytest.mark.parametrize(
    ("values", "power"), [([3e-6, 8e-6], -6), ([0.0], 0), ([1e3], 3), ([float("nan"), 2.0], 0)]
)
def test_prefixes(values, power):
    assert engineering(values) == power


def test_the_axis_of_power_stands_while_the_curve_fits():
    """It ends at a round number above the curve, and changes only when the curve leaves it or becomes small."""
    from harvester.explore.pictures import axis_end

    assert [axis_end(top, 1.0) for top in (9.42, 4.1, 310.0, 0.0, 99.0)] == [
        10.0,
        5.0,
        400.0,
        1.0,
        120.0,
    ]
    assert axis_end(8.0, 10.0) == axis_end(5.1, 10.0) == 10.0
    assert axis_end(4.0, 10.0) == 5.0
    for top in 10.0 ** np.linspace(-3, 3, 601):
        assert 1.04 * top <= axis_end(top, 1e9) <= 1.6 * top


def test_the_numbers_of_an_axis_of_one_and_a_half_decades_have_room_on_a_phone():
    """None is nearer to the next than by a factor of 2: evenly spaced ones was on top of each other at its end."""
    for mass in (0.04, 0.016542, 1.0):
        range_of_mass = slide("oscillator.mass", mass)
        plot = pictures.PowerPlot("oscillator.mass", range_of_mass).plot
        seen = [
            one
            for one in plot.xaxis[0].ticker.ticks
            if range_of_mass.low <= one <= range_of_mass.high
        ]
        assert 4 <= len(seen) <= 6
        assert min(np.divide(seen[1:], seen[:-1])) >= 1.99
