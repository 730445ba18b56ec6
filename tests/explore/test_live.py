"""What the page computes while a knob turns, and what it tells of it."""

import math
import re
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import harvester as hv
from harvester.explore import downloads, html_text, in_worker
from harvester.explore.draft import Draft, first
from harvester.explore.latest_request import Newest
from harvester.explore.live import best, engineering, live
from harvester.explore.slider_scale import slide
from tests.support.paths import ROOT


def looked(draft, key="load.resistance", fine=False):
    """What the formulas say of a draft."""
    at = draft.value(key)
    return live(draft.scene(), key, at, slide(key, at), fine)


@pytest.mark.parametrize(("fine", "within"), [(False, 5e-3), (True, 5e-4)])
def test_the_curve_is_that_of_the_engines(fine, within):
    """Between its points it is near the engine's answer; the answer at the working point is the engine's own."""
    draft = first()
    found = looked(draft, fine=fine)
    scene = draft.scene()
    own = hv.Averaged().run(scene).mean_power
    assert found.here["averaged"].mean_power.value == pytest.approx(own.value, rel=1e-9)
    assert found.here["averaged"].mean_power.known_error95 == pytest.approx(own.known_error95, rel=1e-6)
    assert "cannot model impact" in found.refused["exact"]
    for name in ("averaged", "published"):
        curve = found.curves[name]
        places = curve.x[5::17]
        truth = [hv.run(scene.vary("load.resistance", float(x)), name).mean_power.value for x in places]
        np.testing.assert_allclose(curve.power[5::17], truth, rtol=within)
    band = found.curves["averaged"]
    assert (band.low < band.power).all()
    assert (band.high > band.power).all()


def test_a_resonance_is_seen():
    """Under a harmonic base the exact curve over the frequency has its peak at the resonance, with Q = 125."""
    draft = Draft.read(ROOT / "examples" / "plate_harmonic.toml")
    key = "excitation.frequency"
    found = looked(draft, key, fine=True)
    curve, at = found.curves["exact"], draft.value(key)
    scene = draft.scene()
    truth = [hv.run(scene.vary(key, float(f)), "exact").mean_power.value for f in np.linspace(0.8 * at, 1.6 * at, 1501)]
    assert curve.power.max() == pytest.approx(max(truth), rel=0.02)


def test_words_have_errors_and_no_markup():
    """The large number has its whole error; what a scene is called cannot become a part of the page."""
    draft = first()
    draft.title = "<script>alert(1)</script>"
    found = looked(draft)
    power = found.here["averaged"].mean_power
    large = html_text.headline(found, [])
    number, error = (float(one) * 1e-6 for one in re.search(r"([\d.]+) µW.*± ([\d.]+) µW \(95 %\)", large).groups())
    assert number == pytest.approx(power.value, abs=power.known_error95)
    assert error == pytest.approx(power.known_error95, rel=0.05)
    assert "its error is not known" in html_text.headline(published_only(found), [])
    text, _ = html_text.meanings(found.problem)
    assert "Coupling: strong" in text
    assert "<script>" not in text + html_text.answers(found, []) + html_text.problem_line("<script>")


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
    assert "Computing the circuit's power" in large and "µW" not in large  # the resistor's is not the circuit's
    assert "is not known" in html_text.headline(found, [], "no engine serves it")
    with pytest.raises(hv.SimulationError, match="run 'ideal' or 'spice' first"):
        downloads.table(found, [])


@pytest.mark.slow
def test_the_power_of_the_circuit_itself():
    """It comes from a process of its own, to 2 %; what no engine without ngspice serves is one line."""
    draft = first()
    draft.choose("bridge")
    scene = draft.scene()
    found = in_worker.elsewhere(in_worker.power, (scene.tables(), *in_worker.FINE), lambda: False, lambda: False, 60.0)
    said, own = found["answer"]["mean_power"], hv.Ideal(within="1%", seed=3).run(scene).mean_power
    assert found["engine"] == "ideal"
    stderr = math.hypot(said["stderr"], own.stderr)
    assert abs(said["value"] - own.value) < 4.0 * stderr + said["step_bias"] + own.bias
    several = hv.load(ROOT / "examples" / "two_modes_with_stop.toml")
    with pytest.raises(hv.CannotServeError, match="cannot model"):
        in_worker.power(several.tables(), *in_worker.FINE)


def test_downloads():
    """The table has the engines' numbers, and the page of the report is whole."""
    found = looked(first())
    table = downloads.table(found, [])
    assert set(table.to_pandas()["engine"]) == {"averaged", "published"}
    page = downloads.page(found, [])
    assert page.endswith("</html>\n") or page.rstrip().endswith("</html>")
    assert "averaged: largest" in page


def test_only_the_newest_is_computed():
    """Of many requests while one is at work the last alone follows it; an error of the work stops nothing."""
    begun, done, seen = threading.Event(), threading.Event(), []

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


@pytest.mark.parametrize(("values", "power"), [([3e-6, 8e-6], -6), ([0.0], 0), ([1e3], 3), ([float("nan"), 2.0], 0)])
def test_prefixes(values, power):
    assert engineering(values) == power
