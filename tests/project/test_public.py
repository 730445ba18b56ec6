"""The public names: as ARCHITECTURE writes them, their examples, their types, and how they look in a notebook."""

import copy
import dataclasses
import doctest
import pickle
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
DEAR = (*COMPARING, "node", "Densities", "ChargingResult", "sensitivity")
SLOW = (
    *("Density", "Sensitivity", "ToleranceResult", "Optimum", "ParetoFront", "RobustOptimum"),
    *("charge", "densities", "design", "optimise", "tolerance"),
)


def test_names_are_one_list():
    assert sorted(hv.__all__) == hv.__all__ == dir(hv)
    assert all(getattr(hv, name).__doc__ for name in hv.__all__)
    with pytest.raises(AttributeError, match="attribute swep"):
        _ = hv.swep


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name,
            marks=[
                *([pytest.mark.ngspice] if name in COMPARING else []),
                *([pytest.mark.thorough("test_example")] if name in DEAR else []),
                *([pytest.mark.slow] if name in SLOW else []),
            ],
        )
        for name in hv.__all__
    ],
)
def test_example(name):
    """Each public name has one, and it does what it states."""
    thing = getattr(hv, name)
    found = [
        one
        for one in doctest.DocTestFinder(recurse=False).find(thing, name, globs={})
        if one.examples
    ]
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
from harvester.studies.sweep.sweep_table import SweepTable
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
    for bad, says in (
        ("5", "`within` must be a percentage"),
        ("0%", "`within` must be"),
        (2.0, "`within` must be"),
    ):
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
    table = hv.sweep(
        PLATE, vary={"load.resistance": LOADS}, engines=[hv.Averaged(), hv.Published()]
    )
    assert list(tmp_path.iterdir()) == []
    for engine in (hv.Averaged(), hv.Published()):
        powers = [engine.run(PLATE.with_load(r)).mean_power.value for r in (1e5, 10**5.5, 1e6)]
        assert table.column("mean_power", engine.NAME) == pytest.approx(powers, rel=1e-6)
    data = table.to_xarray()
    assert data["mean_power"].sizes == {"engine": 2, "load.resistance": 3}
    assert data["load.resistance"].attrs["units"] == "ohm"
    figure = table.plot()
    assert "load resistance" in figure.axes[-1].get_xlabel()


@pytest.mark.slow
def test_sweep_of_several_keys_and_its_files(tmp_path):
    vary = {"load.resistance": "1k:1M:2", "stop.restitution": [0.9, 0.96]}
    table = hv.sweep(
        PLATE, vary=vary, engines=[hv.Published()], execution=hv.Execution(out=tmp_path)
    )
    places = [tuple(row.varied.values()) for row in table.rows]
    assert places == [(1e3, 0.9), (1e3, 0.96), (1e6, 0.9), (1e6, 0.96)]
    assert {path.name for path in tmp_path.iterdir()} == {
        "sweep.csv",
        "sweep.nc",
        "sweep.png",
        "provenance.json",
    }


@pytest.mark.parametrize(
    ("vary", "says"),
    [
        ({"load.resistanc": [1.0]}, "did you mean 'resistance'"),
        ({"load.resistance": []}, "load.resistance must have values, but has none"),
        ({"load.resistance": ["1 kV"]}, "load.resistance must be a load resistance"),
        (
            {"load.resistance": hv.logspace("1 kV", "10 kV", 3)},
            "load.resistance must be a load resistance",
        ),
        ({}, "`vary` must have a scene key, such as"),
        (None, "`vary` must have a scene key, such as"),
    ],
)
def test_sweep_of_what_cannot_be(vary, says):
    with pytest.raises(InputError, match=re.escape(says)):
        hv.sweep(PLATE, vary=vary, engines=[hv.Published()])


def test_spaces():
    assert hv.logspace("1k", "10M", 5) == (
        "1000.0",
        "10000.0",
        "100000.0",
        "1000000.0",
        "10000000.0",
    )
    assert hv.logspace("1 kohm", "1 Mohm", 2) == ("1.0 kohm", "1000.0 kohm")
    assert hv.linspace(1, 3, 3) == (1.0, 2.0, 3.0)
    for ends in (("1 kohm", "1 uF"), ("1 kohm", 1e6), ("much", "more")):
        with pytest.raises(
            InputError,
            match="the ends of the values must be two numbers or two quantities of one kind",
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
        self.open = []
        self.texts = []
        self.tags = set()
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
    """Values with unit, error, engine and warnings; what a scene states is escaped."""
    scene = dataclasses.replace(PLATE, title="<script>alert(1)</script> & co")
    answer = hv.Averaged(within="1%").run(scene)
    answer = dataclasses.replace(
        answer, diagnostics=(*answer.diagnostics, note("not_followed", error="a < b"))
    )
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
    assert any(
        "`within` 1 % cannot be guaranteed" in text for text in Html(answer._repr_html_()).texts
    )
    assert any(
        text.startswith("warning: published: at 3 of 3 points: ")
        for text in Html(table._repr_html_()).texts
    )


RIGHT = """
from pathlib import Path

import harvester as hv

oscillator = hv.Oscillator(mass="40 g", stiffness="16 N/m", damping_ratio=0.004)
piezo, noise = hv.Piezo(coupling=1e-3, capacitance="50.2 nF"), hv.Excitation(acceleration_psd="1e-5 g^2/Hz")
scene: hv.Scene = hv.Scene(oscillator=oscillator, piezo=piezo, excitation=noise)
mass: float = oscillator.mass
ratio: float | None = oscillator.damping_ratio
load: hv.Load = hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": 1e-5})
other: hv.Load = hv.Netlist("bridge", R="1 Mohm", C=1e-5)
machine = hv.Excitation(profile="machine", frequency="50 Hz", harmonics=["0.1 g", 0.3])
stiffer = scene.replace(oscillator=oscillator.replace(stiffness="20 N/m"), load=load, excitation=machine)
varied: hv.Scene = scene.vary("oscillator.mass", "50 g").varied({"load.resistance": 1e6, "stop.gap": None})
answer: hv.Estimate = hv.run(scene, "ensemble", within="1%", seed=1, trajectories=64)
answers: list[hv.Estimate] = hv.run([scene, Path("plate.toml")], hv.Spice(within="3%", budget="30s"))
power: float = float(answer.mean_power)
best: hv.Value = max(one.mean_power for one in answers)
text: str = f"{best:.3g} {best.unit}" if best > 1e-6 and answers[0] == answers[1] else ""
known: dict[hv.Scene, hv.Estimate] = {scene: answer}
values = hv.logspace("1 kohm", "10 Mohm", 25)
table: hv.SweepTable = hv.sweep(scene, vary={"load.resistance": values}, execution=hv.Execution(out="grid", workers=2))
optimum: hv.Optimum = hv.optimise(scene, vary={"load.resistance": ("1 kohm", 1e7)}, engine="averaged", within="2%")
found: hv.Comparison = hv.compare(scene, engines=["averaged", hv.Ensemble()], within=0.01)
path: hv.Motion = hv.motion(scene, duration=1.0, probe=["store"])
table.plot().savefig("sweep.pdf")
"""
WRONG = {  # a call, and the code of mypy's error
    "hv.Ensemble(within=[1])": "arg-type",
    "hv.swep": "attr-defined",
    "hv.load(3)": "arg-type",
    "hv.run(scene, sead=1)": "call-overload",
    "hv.Oscillator(mass=[40], stiffness=16)": "arg-type",
    "hv.Piezo(coupling=1e-3)": "call-arg",
    "scene.replace(lod=hv.Load(resistance=1e6))": "call-arg",
    'hv.Load(netlist="bridge").parameters["R"] = 5': "index",
    "hv.Oscillator(mass=1.0, stiffness=16.0).mass = 2.0": "misc",
    "power: float = hv.run(scene).mean_power": "assignment",
    'hv.sweep(scene, vry={"load.resistance": "1k:1M:3"})': "call-arg",
    'hv.optimise(scene, vary={"load.resistance": ("1k", "1M")}, engin="averaged")': "call-overload",
    "hv.compare(scene, trajectoris=5)": "call-arg",
    "hv.run(scene).plott()": "attr-defined",
}


@pytest.mark.thorough("nothing: mypy reads a script from outside")
@pytest.mark.slow
def test_a_users_script_is_typed(tmp_path):
    """mypy --strict, away from this checkout: right calls pass, and each wrong one is an error in its line."""
    (tmp_path / "right.py").write_text(RIGHT)
    (tmp_path / "wrong.py").write_text(
        "import harvester as hv; scene = hv.Scene()\n" + "\n".join(WRONG) + "\n"
    )
    # of the check before these tests: the package itself is not read again
    cache = ROOT / ".mypy_cache"
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--cache-dir",
        cache,
        "--config-file",
        ROOT / "pyproject.toml",
    ]
    done = subprocess.run(
        [*command, "right.py", "wrong.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    errors = re.findall(r"^(\w+)\.py:(\d+): error:.*\[([\w-]+)\]$", done.stdout, re.MULTILINE)
    assert {(file, int(line), code) for file, line, code in errors} == {
        ("wrong", line, code) for line, code in enumerate(WRONG.values(), 2)
    }, done.stdout


def test_a_scene_cannot_change_and_is_a_key():
    scene = PLATE.with_load(hv.Netlist("bridge", R="1 Mohm"))
    for change in (
        lambda: scene.load.parameters.update(R=5.0),
        lambda: scene.load.parameters.__setitem__("R", 5.0),
        lambda: setattr(scene, "load", None),
        lambda: setattr(scene.oscillator, "mass", 1.0),
    ):
        with pytest.raises((TypeError, dataclasses.FrozenInstanceError), match=r"cannot|assign"):
            change()
    assert scene.load.parameters == {"R": 1e6} and scene.tables()["load"]["parameters"] == {
        "R": 1e6
    }
    for again in (
        pickle.loads(pickle.dumps(scene)),
        copy.deepcopy(scene),
        hv.loads(scene.to_toml()),
    ):
        assert again == scene and {scene: "known"}[again] == "known"
    other = scene.varied({"load.parameters.R": "2 Mohm"})
    assert other != scene and other.load.parameters["R"] == 2e6


def test_a_scene_is_replaced_table_by_table():
    stiffer = PLATE.replace(stop=None, oscillator=PLATE.oscillator.replace(stiffness="20 N/m"))
    assert (stiffer.stop, stiffer.oscillator.stiffness) == (None, 20.0) and PLATE.stop is not None
    assert (
        eval(repr(stiffer), vars(hv) | {name: getattr(hv, name) for name in hv.__all__}) == stiffer
    )
    with pytest.raises(InputError, match="did you mean 'load'"):
        PLATE.replace(lod=None)
    with pytest.raises(InputError, match="did you mean 'mass'"):
        PLATE.oscillator.replace(mas="40 g")


def test_a_netlist_is_read_when_it_is_made():
    with pytest.raises(InputError, match="unknown netlist 'bridg': did you mean 'bridge'"):
        hv.Netlist("bridg")
    with pytest.raises(InputError, match="unknown parameter of netlist bridge 'Q'"):
        hv.Netlist("bridge", Q=3)


@pytest.mark.thorough("test_sweep_of_several_keys_and_its_files")
def test_run_of_a_list():
    """In its order, one by one or together, with the share of the whole as progress; an error names its scene."""
    scenes = [PLATE.with_load(r) for r in ("100 kohm", "1 Mohm")]
    told = []
    for engine in ("averaged", hv.Ensemble(trajectories=64, seed=1)):
        together = hv.run(scenes, engine, progress=told.append)
        assert together == [hv.run(scene, engine) for scene in scenes]
    assert (
        told == sorted(told[: told.index(1.0) + 1]) + told[told.index(1.0) + 1 :]
        and told[-1] == 1.0
    )
    assert [one.engine for one in hv.run([ROOT / "examples" / "plate.toml"])] == ["exact"]
    with pytest.raises(hv.CannotServeError) as caught:
        hv.run([*scenes, PLATE.with_load(hv.Netlist("bridge"))], "averaged")
    assert caught.value.__notes__ == ["at index 2 of 3 scenes"]


@pytest.mark.parametrize("engine", [hv.Averaged(), hv.Ensemble(trajectories=64, seed=1)])
def test_equal_answers_are_equal(engine):
    """Two runs differ only in their seconds; another load or seed is another answer."""
    first, second, other = (
        engine.run(scene) for scene in (PLATE, PLATE, PLATE.with_load("1 kohm"))
    )
    assert first == second and first != other
    assert (
        dataclasses.replace(first, seconds=1e9)
        == first
        != dataclasses.replace(first, steps=first.steps + 1)
    )
    assert engine.run(PLATE).mean_power.unit == "W" and first.mean_square_voltage.unit == "V^2"
