"""The pages in Chromium: nothing is wider than a phone, a desktop or A4, and the answer is in the first screen."""

import pytest

import harvester as hv
from harvester import report
from harvester.presentation.table import Column, Table
from harvester.report.result import of_result, text_table
from tests.support.browser import CHROMIUM, DESKTOP, PHONE, chromium

PLATE = "examples/plate_with_stop.toml"
DRIVEN = "examples/plate_harmonic.toml"
A4 = {"width": 703, "height": 1000}  # CSS pixels between margins of 12 mm
WIDER = """() => [...document.querySelectorAll("table, pre, img, p, li")].filter(
    (one) => one.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
    .map((one) => one.innerText)"""
SMALL = """() => [...document.querySelectorAll("th, td, p, li, pre, caption, figcaption")].filter(
    (one) => parseFloat(getComputedStyle(one).fontSize) < 7 * 96 / 72 - 0.01).map((one) => one.innerText)"""
CUT = """() => [...document.querySelectorAll(".wide, pre")].filter((one) => one.scrollWidth > one.clientWidth + 1)
    .map((one) => one.innerText)"""


@pytest.fixture(scope="module")
def pages():
    """Seven pages: many columns, tolerances, engines, a sweep, a search, circuits, a node."""
    response = hv.responses(DRIVEN, [3.0, 4.0, 4.5, 5.0, 6.0])
    scattered = hv.tolerance(
        PLATE, vary={"load.resistance": "10%", "stop.restitution": "3%"}, engine="averaged"
    )
    compared = hv.compare(PLATE, engines=["published", "averaged"])
    swept = hv.sweep(
        PLATE, vary={"load.resistance": "1k:10M:13"}, engines=["published", "averaged"]
    )
    searched = hv.optimise(PLATE, vary={"load.resistance": "1k:10M"}, engine="averaged")
    designed = hv.design(
        "examples/bimorph_sensor.toml", needs="40 uW at 3.3 V", circuits=["bridge", "parallel_sshi"]
    )
    node = "examples/bimorph_packets.toml"
    return {
        "design": report.html(of_result(designed.scene, "design", designed)),
        "node": report.html(of_result(hv.load(node), "node", hv.node(node))),
        "sweep": report.html(report.of_sweep(hv.load(PLATE), swept)),
        "optimise": report.html(report.of_search(hv.load(PLATE), searched, 1)),
        "response": report.html(report.of_response(hv.load(DRIVEN), response, 1)),
        "tolerance": report.html(report.of_tolerance(hv.load(PLATE), scattered, 1)),
        "compare": report.html(report.of_comparison(hv.load(PLATE), compared, 1)),
    }


@pytest.mark.thorough("test_report.py")
@pytest.mark.slow
@pytest.mark.skipif(not CHROMIUM, reason="needs Chromium")
def test_nothing_is_wider_than_the_page(pages):
    with chromium() as browser:
        for text in pages.values():
            for size, medium in ((DESKTOP, "screen"), (PHONE, "screen"), (A4, "print")):
                page = browser.new_page(viewport=size)
                page.set_content(text)
                page.emulate_media(media=medium)
                assert page.evaluate(WIDER) == [] and page.evaluate(CUT) == []
                assert medium == "screen" or page.evaluate(SMALL) == []
                verdict = page.locator(".verdict").bounding_box()
                assert medium == "print" or verdict["y"] + verdict["height"] < size["height"]
                page.close()
            page = browser.new_page()
            page.set_content(text)
            assert page.pdf(prefer_css_page_size=True).startswith(b"%PDF")


@pytest.mark.thorough("test_report.py")
@pytest.mark.slow
def test_the_answer_leads_the_page(pages):
    assert "largest mean power" in pages["response"].partition("<nav")[0]
    leads = {
        name: pages[name].partition('<ul class="lead">')[2].split("<li>")[1]
        for name in ("design", "node")
    }
    assert leads["design"].startswith("circuit: bridge") and leads["node"].startswith(
        "sends its packets: yes"
    )
    assert "packets per hour: 359.9" in pages["node"].partition("<nav")[0]
    assert (
        "272.2 kΩ" in pages["design"]
        and pages["design"].count("<img") == pages["node"].count("<img") == 1
    )
    assert "Median mean power" in pages["tolerance"].partition("<nav")[0]
    assert "Against published: averaged differs by 5.8 %" in pages["compare"].partition("<nav")[0]
    assert "1 warning below: read before use." in pages["compare"]


def test_a_sentence_of_many_cells_is_said_once():
    why = "engine 'averaged' must have a load resistance, but the load is a bridge"
    rows = 20
    columns = (
        Column("load.resistance", [1e3 * (k + 1) for k in range(rows)], "ohm"),
        Column("engine", ["averaged"] * rows),
        Column("error", [why] * (rows - 1) + [""]),
        Column("seconds", [None] * rows),
    )
    shown = text_table(Table(columns, "points"))
    assert shown.heads == ["load.resistance", "error"]
    assert [row[1] for row in shown.rows] == ["[2]"] * (rows - 1) + [""]
    assert shown.note == f"In every row: engine averaged. [2] {why}."


def test_sentences_that_differ_in_their_numbers_are_said_once():
    late = [
        f"no density in a budget of {1.9 - k / 10:.2f}: it needs at least about 8.1 s"
        for k in range(3)
    ]
    columns = (
        Column("load.resistance", [1e3, 1e4, 1e5, 1e6], "ohm"),
        Column("error", [*late, "other, and alone " * 3]),
    )
    shown = text_table(Table(columns, "points"))
    assert [row[1] for row in shown.rows] == ["[1]"] * 3 + ["other, and alone " * 3]
    assert shown.note == f"[1] {late[0]} (elsewhere with other numbers)."
