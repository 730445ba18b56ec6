"""The interval of a real device on the page: that of `harvester.predict`, discarded once a slider moves."""

import queue
import re

import pytest

import harvester as hv
from harvester.explore import toolbar
from harvester.explore.draft import Draft
from tests.support.paths import EXAMPLES

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::PendingDeprecationWarning"),  # of Panel
]
COMING = "computing a real device ..."


class Page:
    """A bar whose actions wait until the test calls them; it has the scene of `tables`, but no class."""

    def __init__(self):
        self.actions = queue.Queue()
        self.bar = toolbar.RealDeviceBar(self.actions.put)
        self.bar.predict(tables())

    @property
    def lines(self):
        """The lines that are there now."""
        return re.findall("<div[^>]*>(.*?)</div>", self.bar.line.object)

    def result(self):
        """The lines once nothing is being computed."""
        while self.lines == [COMING]:
            self.actions.get(timeout=120)()
        return self.lines


@pytest.fixture
def page():
    page = Page()
    yield page
    page.bar.close()


def tables(resistance="1 Mohm"):
    draft = Draft.read(EXAMPLES / "plate_harmonic.toml")
    draft.type("load.resistance", resistance)
    return draft.tables()


def predicted():
    """The two lines of the scene, from the library's own numbers."""
    own = hv.predict(hv.Scene(**tables()), prior="composite", seed=0)
    low, high = (f"{1e6 * end:.4g} µW" for end in (own.power.low, own.power.high))
    return [
        f"computed: {own.computed.format('W')}".replace(" uW", " µW"),
        f"a real device: {low} to {high} (95 %), measure {own.next_measurement} next",
    ]


def test_the_error_of_the_computation_and_the_real_device_are_two_lines(page):
    page.bar.choice.value = "composite"
    assert page.result() == predicted()
    text = page.bar.line.object
    assert "As by harvester run --predict --prior composite" in text
    assert "the origin of damping is unknown: state a better one with --known" in text


def test_a_slider_that_moves_discards_the_interval(page):
    """One that is being computed ends without a result; one that is shown disappears at once."""
    page.bar.choice.value = "composite"
    page.bar.predict(tables("100 kohm"))
    page.bar.predict(tables("150 kohm"))
    page.bar.predict(tables())
    assert page.result() == predicted()
    page.bar.predict(tables("200 kohm"))
    assert page.lines == [COMING]
    late = page.actions.get(timeout=120)  # a result that comes after the slider has moved
    page.bar.predict(tables("300 kohm"))
    late()
    assert page.lines == [COMING]
    page.bar.choice.value = ""
    page.bar.predict(tables())
    assert page.lines == []


def test_without_a_class_nothing_is_computed(page, monkeypatch):
    begun = []
    monkeypatch.setattr(toolbar.POOL, "submit", lambda *given: begun.append(given))
    page.bar.predict(tables())
    assert (begun, page.lines) == ([], [])
    page.bar.choice.value = "film"
    assert (len(begun), page.lines) == (1, [COMING])


def test_a_scene_without_a_prediction_has_the_reason(page):
    page.bar.predict(Draft.read(EXAMPLES / "paper_figure3.toml").tables())
    page.bar.choice.value = "bulk"
    assert page.result() == [
        "a real device: a prediction needs a scene with units, but the scene is nondimensional: "
        "give [oscillator] and [piezo]"
    ]


def test_a_prediction_has_a_time_limit(page, monkeypatch):
    monkeypatch.setattr(toolbar, "TIME_LIMIT", 0.0)
    page.bar.choice.value = "bulk"
    assert page.result() == [
        "a real device: no answer within 2 min; harvester run --predict has no time limit"
    ]
