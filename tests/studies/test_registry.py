"""One walk over every study: how it is called, and how its result shows itself wherever results are shown."""

import dataclasses
import inspect
import json
import pickle
from html.parser import HTMLParser

import pytest

import harvester as hv
from harvester.commands.study import study_commands
from harvester.presentation.result import Result
from harvester.presentation.sheet import sheet
from harvester.report import html
from harvester.report.result import of_result
from harvester.studies.registry import STUDIES
from tests.support.paths import ROOT

DRIVEN = hv.Scene(
    nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0)
)
NOISY = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, D11=0.01))
# The scene and the keywords of a call that takes a moment; of a study that is not here the scene
# alone is asked for.
CALLS = {
    "sweep": (NOISY, {"vary": {"nondimensional.mu": [0.5, 1.0]}, "engines": ["averaged"]}),
    "compare": (NOISY, {"engines": ["averaged", "published"]}),
    "optimise": (NOISY, {"vary": {"nondimensional.mu": (0.1, 10.0)}, "engine": "averaged"}),
    "tolerance": (NOISY, {"vary": {"nondimensional.mu": "5%"}, "samples": 64}),
    "charge": (
        ROOT / "examples" / "plate_bridge.toml",
        {"to": "0.5 V", "engine": "ideal", "trajectories": 64},
    ),
    "motion": (NOISY, {"duration": 20.0}),
    "response": (DRIVEN, {"sweep": [0.9, 1.0, 1.1]}),
    "stability": (NOISY, {"trajectories": 64, "duration": 20.0}),
    "extremes": (NOISY, {"lifetime": 1e6}),
    "densities": (NOISY, {"within": 1e-3}),
    "design": (
        ROOT / "examples" / "bimorph_sensor.toml",
        {"needs": "40 uW at 3.3 V", "circuits": ["bridge"]},
    ),
    "node": (ROOT / "examples" / "bimorph_packets.toml", {"days": 0.02}),
}
ELSEWHERE = {"cost"}  # measures for seconds: tests/studies/work_precision has its result
DEAR = {"densities"}  # a second, which make check leaves to make test


class Texts(HTMLParser):
    """The tags and texts of a fragment of HTML, every tag closed."""

    def __init__(self, page):
        super().__init__()
        self.open, self.texts = [], []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(one, id=one.name, marks=[pytest.mark.slow] if one.name in DEAR else [])
        for one in STUDIES
        if one.name not in ELSEWHERE
    ],
)
def case(request):
    """A study, a scene and what it found there."""
    study = request.param
    scene, options = CALLS.get(study.name, (NOISY, {}))
    return study, scene, study.run()(scene, **options)


def test_a_study_gives_its_result(case):
    study, _, found = case
    assert type(found).__name__ == study.result.rpartition(":")[2] and isinstance(found, Result)
    assert getattr(hv, type(found).__name__) is type(found)


def test_its_scene_comes_first(case):
    study, _, _ = case
    first, *rest = inspect.signature(study.run()).parameters.values()
    assert first.name == "scene"
    named = {one.name for one in rest}
    assert {option.name for option in study.options} <= named


def test_a_result_is_short_in_python_and_long_in_print(case):
    _, _, found = case
    assert (
        repr(found).startswith(f"{type(found).__name__}(")
        and len(repr(found)) < 300
        and "\n" not in repr(found)
    )
    assert str(found) == "\n".join(sheet(found).lines()) and "nan" not in str(found).lower().split()


def test_its_json_has_its_diagnostics(case):
    _, _, found = case
    told = json.loads(json.dumps(found.as_json(), allow_nan=False))
    for one in getattr(found, "diagnostics", ()):
        assert str(one) in json.dumps(told, ensure_ascii=False).replace('\\"', '"')


def test_a_notebook_and_a_page_show_its_numbers(case):
    study, scene, found = case
    texts = " ".join(Texts(found._repr_html_()).texts)
    page = html(of_result(scene, study.name, found))
    for _, text in sheet(found).rows:
        assert text in texts
    for one in sheet(found).warnings:
        assert one in texts
    assert "<h1" in page and ('class="warnings"' in page) == bool(sheet(found).warnings)


def test_rows_become_frames_and_datasets(case):
    _, _, found = case
    frame = found.to_pandas()
    table = found.table
    assert list(frame.columns) == [*table.plain()] and len(frame) == len(table)
    assert set(found.to_xarray().variables) <= {*table.plain(), "row"}


def test_a_copy_is_equal(case):
    """Arrays, tables and parts included, also from another process; seconds do not count."""
    _, _, found = case
    again = pickle.loads(pickle.dumps(found))
    assert again == found
    timed = [one.name for one in dataclasses.fields(found) if one.name == "seconds"]
    assert dataclasses.replace(found, **dict.fromkeys(timed, 1e9)) == found


def every(kind):
    """A class and all that derive from it."""
    return {kind}.union(*map(every, kind.__subclasses__()))


def test_every_result_compares_as_the_base_does():
    """A dataclass without eq=False would compare seconds, and arrays as if they were one truth."""
    assert all(getattr(hv, name) for name in hv.__all__)  # all are loaded
    assert len(every(Result)) > 15
    assert [kind.__name__ for kind in every(Result) if kind.__eq__ is not Result.__eq__] == []


def test_an_estimate_and_what_is_identified_are_tables_too():
    """An answer is one row, with the parts of its errors; its parts have the units of the whole."""
    answer = hv.Averaged().run(NOISY)
    assert (
        answer.to_pandas()["mean_power"].tolist() == [answer.mean_power.value]
        and len(answer.to_xarray()) > 10
    )
    found = hv.identify(str(ROOT / "examples" / "bench_impedance.csv"))
    assert "\n" not in repr(found) and len(repr(found)) < 300
    known = found.to_pandas().set_index("key")
    assert known.loc["piezo.capacitance", "value"] == found["piezo.capacitance"].value
    level = hv.charge(CALLS["charge"][0], **CALLS["charge"][1]).levels[-1]
    assert level.time.unit == "s" and "1/w0" not in str(level)


@pytest.mark.slow
def test_commands_come_from_the_registry(harvester, tmp_path):
    """A study without a file of its own in commands/ has its options, its JSON and its page."""
    for command in study_commands():
        scene = "bimorph_packets.toml" if command.name == "node" else "plate.toml"
        quick = [
            part
            for name, value in CALLS.get(command.name, ("", {}))[1].items()
            for part in (f"--{name}", value)
        ]
        asked = (
            command.name,
            ROOT / "examples" / scene,
            "--json",
            "--report",
            tmp_path / "x.html",
            *quick,
        )
        status, said, _ = harvester(*asked)
        assert status == 0 and json.loads(said)
        assert "<h1" in (tmp_path / "x.html").read_text()
