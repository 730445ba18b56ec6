"""The public names: as ARCHITECTURE writes them, their examples, their types, and how they look in a notebook."""

import dataclasses
import doctest
import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest

import harvester as hv
from harvester.errors import InputError
from harvester.presentation.diagnostic import note
from tests.support.paths import ROOT

PLATE = hv.load(ROOT / "examples" / "plate_with_stop.toml")
LOADS = hv.logspace("100 kohm", "1 Mohm", 3)
COMPARING = ("Comparison", "compare")  # whose examples ask every engine


def test_names_are_one_list():
    assert sorted(hv.__all__) == hv.__all__ == dir(hv)
    assert all(getattr(hv, name).__doc__ for name in hv.__all__)
    with pytest.raises(AttributeError, match="attribute swep"):
        _ = hv.swep


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.ngspice] if name in COMPARING else []) for name in hv.__all__]
)
def test_example(name):
    """Each public name has one, and it does what it says."""
    thing = getattr(hv, name)
    found = [one for one in doctest.DocTestFinder(recurse=False).find(thing, name, globs={}) if one.examples]
    assert found, f"{name} has no example"
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS)
    told = []
    for one in found:
        runner.run(one, out=told.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(told)


@pytest.mark.slow
def test_a_module_does_not_hide_a_function():
    """Whichever is imported first, the package's name is the function, and what the module held is found."""
    code = """
from harvester.studies.sweep.table import SweepTable
import harvester.studies.sweep.sweep
import harvester.studies.compare, harvester.studies.stability.exponent
import harvester as hv
assert all(callable(f) for f in (hv.sweep, hv.compare, hv.stability, hv.optimise, hv.response, hv.motion))
assert SweepTable is hv.SweepTable
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_texts_are_options():
    assert hv.Ensemble(within="1%", budget="2min") == hv.Ensemble(within=0.01, budget=120.0)
    assert dataclasses.replace(hv.Spice(within="1%"), seed=3).within == 0.01
    assert hv.Averaged(within="5%").within == 0.05
    assert hv.Ensemble().within is None
    for bad, says in (("5", "`within` must be a percentage"), ("0%", "`within` must be"), (2.0, "`within` must be")):
        with pytest.raises(InputError, match=says):
            hv.Ensemble(within=bad)
    with pytest.raises(InputError, match="`budget` must be a time above 0"):
        hv.Ensemble(budget="soon")


def test_netlist_is_a_load():
    load = hv.Netlist("bridge", R="1 Mohm", C="10 uF")
    assert load.netlist == "bridge"
    assert load.parameters == pytest.approx({"R": 1e6, "C": 1e-5})
    assert PLATE.with_load(load).load == load
    with pytest.raises(InputError, match=r"load\.parameters\.R must be"):
        hv.Netlist("bridge", R="many")


def test_sweep_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = hv.sweep(PLATE, vary={"load.resistance": LOADS}, engines=[hv.Averaged(), hv.Published()])
    assert list(tmp_path.iterdir()) == []
    for engine in (hv.Averaged(), hv.Published()):
        powers = [engine.run(PLATE.with_load(r)).mean_power.value for r in (1e5, 10**5.5, 1e6)]
        assert table.column("mean_power", engine.NAME) == pytest.approx(powers, rel=1e-6)
    data = table.to_xarray()
    assert data["mean_power"].sizes == {"engine": 2, "load.resistance": 3}
    assert data["load.resistance"].attrs["units"] == "ohm"
    figure = table.plot()
    assert "load resistance" in figure.axes[-1].get_xlabel()


def test_sweep_of_several_keys_and_its_files(tmp_path):
    vary = {"load.resistance": "1k:1M:2", "stop.restitution": [0.9, 0.96]}
    table = hv.sweep(PLATE, vary=vary, engines=[hv.Published()], execution=hv.Execution(out=tmp_path))
    places = [tuple(row.varied.values()) for row in table.rows]
    assert places == [(1e3, 0.9), (1e3, 0.96), (1e6, 0.9), (1e6, 0.96)]
    assert {path.name for path in tmp_path.iterdir()} == {"sweep.csv", "sweep.nc", "sweep.png", "provenance.json"}


@pytest.mark.parametrize(
    ("vary", "says"),
    [
        ({"load.resistanc": [1.0]}, "did you mean 'resistance'"),
        ({"load.resistance": []}, "load.resistance must have values to take, but has none"),
        ({"load.resistance": ["1 kV"]}, "load.resistance must be a load resistance"),
        ({"load.resistance": hv.logspace("1 kV", "10 kV", 3)}, "load.resistance must be a load resistance"),
        ({}, "`vary` must have a scene key, such as"),
        (None, "`vary` must have a scene key, such as"),
    ],
)
def test_sweep_of_what_cannot_be(vary, says):
    with pytest.raises(InputError, match=re.escape(says)):
        hv.sweep(PLATE, vary=vary, engines=[hv.Published()])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("load.resistance",), "`values` must go with a single key, but is left out"),
        (({"load.resistance": "1k,2k"}, [1.0]), "`values` must go with a single key, but is given"),
        (("load.resistance", [1e5]), None),
        (({"load.resistance": [1e5]},), None),
    ],
)
def test_sweep_as_in_version_0_1(tmp_path, arguments, says):
    """A key and its values, or a mapping, without a name; each call warns in the line that made it."""
    told = []
    with pytest.warns(DeprecationWarning) as caught:
        if says is None:
            hv.sweep(PLATE, *arguments, engines=[hv.Published()], out=tmp_path, tick=told.append)
            assert told == ["published"] and (tmp_path / "sweep.csv").exists()
        else:
            with pytest.raises(InputError, match=re.escape(says)):
                hv.sweep(PLATE, *arguments, engines=[hv.Published()])
    assert {one.filename for one in caught} == {__file__}


def test_spaces():
    assert hv.logspace("1k", "10M", 5) == ("1000.0", "10000.0", "100000.0", "1000000.0", "10000000.0")
    assert hv.logspace("1 kohm", "1 Mohm", 2) == ("1.0 kohm", "1000.0 kohm")
    assert hv.linspace(1, 3, 3) == (1.0, 2.0, 3.0)
    for ends in (("1 kohm", "1 uF"), ("1 kohm", 1e6), ("much", "more")):
        with pytest.raises(
            InputError, match="the ends of the values must be two numbers or two quantities of one kind"
        ):
            hv.logspace(*ends, 3)
    with pytest.raises(InputError, match="the ends of logspace must be above 0"):
        hv.logspace(0.0, 1.0, 3)
    with pytest.raises(InputError, match="the count of values must be a whole number"):
        hv.linspace(0.0, 1.0, 1)


class Html(HTMLParser):
    """Texts of a page; every tag is closed by its own."""

    def __init__(self, page):
        super().__init__()
        self.open, self.texts, self.tags = [], [], set()
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.tags.add(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.mark.slow
def test_notebook():
    """Values with unit, error, engine and warnings; what a scene says is escaped."""
    scene = dataclasses.replace(PLATE, title="<script>alert(1)</script> & co")
    answer = hv.Averaged(within="1%").run(scene)
    answer = dataclasses.replace(answer, diagnostics=(*answer.diagnostics, note("not_followed", error="a < b")))
    table = hv.sweep(scene, vary={"load.resistance": LOADS}, engines=[hv.Published()])
    best = hv.optimise(scene, vary={"load.resistance": ("100 kohm", "1 Mohm")}, engine="averaged")
    comparison = hv.Comparison((answer, hv.Published().run(scene)), {"spice": "no <ngspice>"}, ())
    for thing, texts in (
        (scene, ["<script>alert(1)</script> & co", "[oscillator]", "kg"]),
        (answer, [answer.mean_power.format("W"), "note: ngspice does not follow it: a < b"]),
        (table, ["load.resistance", "mean power", "error, 95 %", "published", "1 Mohm"]),
        (best, ["load.resistance", best.mean_power.format("W")]),
        (comparison, ["averaged", "published", "note: spice: did not run: no <ngspice>"]),
    ):
        page = Html(thing._repr_html_())
        assert page.tags <= {"div", "table", "caption", "thead", "tbody", "tr", "th", "td"}
        assert set(texts) <= set(page.texts)
    assert any("`within` 0.01 cannot be promised" in text for text in Html(answer._repr_html_()).texts)
    assert any(text.startswith("warning: published: at 3 of 3 points: ") for text in Html(table._repr_html_()).texts)


USER = """
import harvester as hv

scene: hv.Scene = hv.load("plate.toml")
power: float = hv.Averaged(within="1%").run(scene).mean_power.value
answer: hv.Estimate = hv.Ensemble(within="1%", budget="30s", seed=1).run(scene.with_load(1e6))
load: hv.Load = hv.Netlist("bridge", R="1 Mohm", C=1e-5)
loads = {"load.resistance": hv.logspace("1 kohm", "10 Mohm", 25)}
table: hv.SweepTable = hv.sweep(scene, vary=loads, engines=[hv.Spice()])
vary = {"load.resistance": "1k:10M:5", "stop.restitution": "0.9,0.96"}
grid = hv.sweep(scene, vary=vary, execution=hv.Execution(out="grid", workers=2))
best: hv.Optimum = hv.optimise(scene, vary={"load.resistance": ("1 kohm", 1e7)}, engine="averaged")
found: hv.Comparison = hv.compare(scene, within=0.01)
verdict: str = hv.stability(scene).verdict
table.plot().savefig("sweep.pdf")
"""
WRONG = {"hv.Ensemble(within=[1])": "arg-type", "hv.swep": "attr-defined", "hv.load(3)": "arg-type"}


@pytest.mark.thorough("nothing: mypy reads a script from outside")
@pytest.mark.slow
def test_a_users_script_is_typed(tmp_path):
    """mypy --strict, away from this checkout: right calls pass, wrong ones do not."""
    (tmp_path / "user.py").write_text(USER)
    (tmp_path / "wrong.py").write_text("import harvester as hv\n" + "\n".join(WRONG) + "\n")
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--cache-dir",
        str(ROOT / ".mypy_cache"),  # of the check before these tests: the package itself is not read again
        "--config-file",
        str(ROOT / "pyproject.toml"),
    ]
    done = subprocess.run(
        [*command, "user.py", "wrong.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300
    )
    lines = done.stdout.splitlines()
    assert [line for line in lines if line.startswith("user.py")] == []
    assert [line.rsplit("[", 1)[1][:-1] for line in lines if line.startswith("wrong.py") and "error:" in line] == list(
        WRONG.values()
    ), done.stdout
