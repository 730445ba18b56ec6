"""The reports: whole HTML in one file, that states the computation, how well, and how to do it again."""

import base64
import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from urllib.parse import urlparse

import pytest

import harvester as hv
from harvester import report
from harvester.answers.estimate import Estimate
from harvester.equations.coefficients import Equations
from harvester.equations.effects import EFFECTS as REGISTRY
from harvester.equations.problem import Problem
from harvester.errors import InputError, SimulationError
from harvester.machine.provenance import origin
from harvester.presentation.diagnostic import note, warning
from harvester.presentation.scene_words import EFFECTS
from harvester.report.numbers import amount, share, signs
from harvester.report.scenes import effects_section
from harvester.studies.compare import Comparison
from harvester.studies.optimum.circuit_choice import CircuitChoice
from harvester.studies.optimum.pareto_front import FrontPoint, ParetoFront
from harvester.studies.paper import FigurePoint, PaperFigure
from harvester.studies.stability.exponent import Stability
from harvester.studies.stability.region import Edge
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.studies.work_precision.cost_table import Cost, CostRow
from harvester.uncertainty.value import Value
from tests.support.paths import ROOT
from tests.support.systems import BEAM

PLATE = ROOT / "examples" / "plate_with_stop.toml"
VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(HTMLParser):
    """Checks that tags are closed in order; keeps text, addresses, figures, tables and ids."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open = []
        self.tags = []
        self.ids = []
        self.addresses = []
        self.text = ""
        self.alts = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        assert len(given) == len(attributes), f"<{tag}> has an attribute twice"
        self.tags.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        self.ids += [given["id"]] if "id" in given else []
        self.addresses += [
            given[name] for name in ("src", "href", "action", "data", "srcset") if name in given
        ]
        if tag == "img":
            assert given["src"].startswith("data:image/svg+xml;base64,")
            self.alts.append(given["alt"])
        assert not any(name.startswith("on") for name in given)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data if "style" not in self.open else ""


def checked(text):
    """A page that is alone; its figures are whole SVG without scripts or links."""
    page = Page(text)
    assert text.startswith('<!DOCTYPE html>\n<html lang="en">')
    assert 'name="viewport"' in text
    assert {"script", "link", "iframe", "object"}.isdisjoint(page.tags)
    assert len(page.ids) == len(set(page.ids))
    for address in page.addresses:
        assert address.startswith("data:") or (address.startswith("#") and address[1:] in page.ids)
    assert not re.search(r"@import|url\(", text)
    assert page.tags.count("h1") == page.tags.count("main") == 1
    assert page.alts and all(page.alts)
    for source in re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', text):
        svg = base64.b64decode(source, validate=True)
        assert svg.rstrip().endswith(b"</svg>") and b"<script" not in svg
        linked = re.findall(rb'xlink:href="([^"]+)"', svg)
        assert all(one.startswith((b"#", b"data:")) for one in linked)
    return page


def provenance_of(page):
    for word in (
        "numpy",
        "scipy",
        "matplotlib",
        "python",
        "cores",
        "seed",
        "date",
        "The command that remakes it",
    ):
        assert word in page.text


def command(text):
    return shlex.split(
        Page(re.search(r'<pre class="command"[^>]*>(.*?)</pre>', text, re.S)[1]).text
    )


def test_run(harvester, tmp_path):
    file = tmp_path / "mine.html"
    args = (
        "run",
        PLATE,
        "--engine",
        "ensemble",
        "--trajectories",
        "256",
        "--seed",
        "7",
        "--report",
        file,
    )
    status, out, _ = harvester(*args)
    assert status == 0
    assert out.endswith(f"report: {file}\n")
    text = file.read_text()
    page = checked(text)
    provenance_of(page)
    assert "Plate (Shock and Vibration 2019, 9093605) with a stop" in page.text
    assert "restitution = 0.96" in page.text  # the scene file
    assert "ensemble" in page.text and "(95 %, sampling)" in page.text
    for line in (
        "impact",
        "rigid stop: impacts",
        "compliant_stop",
        "time-constant ratio",
        "50.2 nF",
        "1 MΩ",
    ):
        assert line in page.text
    assert command(text) == ["harvester", *map(str, args)]
    assert "7" in re.search(r"seed</th><td>(.*?)</td>", text)[1]


def test_json_stands_alone(harvester, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, _ = harvester("run", PLATE, "--engine", "averaged", "--report", "--json")
    assert status == 0
    assert json.loads(out)["engine"] == "averaged"
    page = checked((tmp_path / "report.html").read_text())
    assert "no sampling error" in page.text
    assert "nothing was sampled" in page.text


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("run", "--report", PLATE), "put --report after SCENE or give it a name"),
        (
            ("run", PLATE, "--report", "mine.htm"),
            "--report must be followed by a name that ends in .html",
        ),
        (
            ("run", PLATE, "--report", "/proc/none/mine.html"),
            "--report must be in a folder that can be written",
        ),
        (("run", PLATE, "--report", "folder.html"), "--report must be a file"),
        (
            ("cost", PLATE, "--out", "/proc/none", "--report"),
            "--out must be in a folder that can be written",
        ),
        (
            ("sweep", PLATE, "--vary", "load.resistance=1k", "--out", "x", "--vector", "eps"),
            "--vector must be svg or pdf",
        ),
        (("stability", PLATE, "--vector", "svg"), "--vector must be used with --out"),
        (
            ("optimise", PLATE, "--vary", "load.resistance=1k:1M", "--vector", "svg"),
            "--vector must be used with --out",
        ),
        (("compare", PLATE, "--json", "--vector", "svg"), "--vector must be used with --out"),
    ],
)
def test_bad_input(harvester, tmp_path, monkeypatch, args, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.html").mkdir()
    status, out, err = harvester(*args)
    assert (status, out) == (2, "")
    assert says in err


@pytest.mark.parametrize("failures", [0, 1, 2])
def test_each_failed_row_of_a_sweep_has_its_reason(failures):
    """Also of one alone: the page promises reasons in its table."""
    rows = [
        SweepRow("averaged", mean_power=Value(2e-6, 1e-8), varied={"load.resistance": 1e6}),
        *(
            SweepRow("averaged", error=f"reason {k}", varied={"load.resistance": 1e3 * (k + 1.0)})
            for k in range(failures)
        ),
    ]
    axes = (Axis("load.resistance", tuple(row.varied["load.resistance"] for row in rows)),)
    about = origin() | {"scene": {}, "engines": {"averaged": {}}}
    swept = SweepTable(axes, tuple(rows), tuple(range(len(rows))), False, about)
    page = checked(report.html(report.of_sweep(hv.load(PLATE), swept)))
    points = page.text[page.text.index("Points") :]
    assert all(f"reason {k}" in points for k in range(failures))
    assert ("rows failed" in page.text) == bool(failures)


@pytest.mark.slow
def test_sweep_with_failed_points(harvester, tmp_path):
    out = tmp_path / "out"
    keys = (
        "--vary",
        "excitation.acceleration_psd=0,1e-4,1e-3",
        "--engine",
        "averaged",
        "--engine",
        "published",
    )
    status, told, _ = harvester("sweep", PLATE, *keys, "--out", out, "--report", "--vector", "svg")
    assert status == 0
    assert "sweep.png, sweep.svg" in told
    assert sorted(p.suffix for p in out.glob("sweep.*")) == [".csv", ".nc", ".png", ".svg"]
    page = checked((out / "report.html").read_text())
    provenance_of(page)
    assert "2 of 6 rows failed" in page.text
    assert "averaged: largest" in page.text
    assert "excitation.acceleration_psd" in page.text
    assert page.text.count("Warning:") >= 1


def test_paper(harvester, tmp_path):
    points = [
        FigurePoint("lambda against mu", "beta = 1", mu, 2.0, 1.0, 1.0, 0.01) for mu in (0.1, 1.0)
    ]
    page = checked(
        report.html(
            report.of_paper([PaperFigure("8", "Figure 8: <exponents>", tuple(points), 1.5)])
        )
    )
    provenance_of(page)
    assert "Figure 8: <exponents>" in page.text
    assert "100 %" in page.text  # published is off by as much as the value


def estimates():
    power = Value(2e-6, 1e-8, 2e-9)
    sampled = Estimate(
        "ensemble",
        True,
        power,
        Value(1.0, 0.01),
        {"beta": 0.1},
        (),
        0.3,
        1000,
        (warning("step_bias_not_measured", error="<b>beware</b>"),),
    )
    none = note("theory")
    formula = Estimate(
        "averaged", True, Value(2.01e-6, model=1e-8), Value(1.0), {}, (), 0.01, 0, (none,)
    )

    return sampled, formula


def test_comparison():
    result = Comparison(estimates(), {"spice": "ngspice is <missing>"}, ())
    page = checked(report.html(report.of_comparison(hv.load(PLATE), result, 3)))
    provenance_of(page)
    assert "ensemble: the time-step bias could not be measured: <b>beware</b>" in page.text
    assert "ngspice is <missing>" in page.text
    z = result.z(result.estimates[1])
    assert f"{z:.4g}" in page.text
    assert f"Against {result.reference.engine}" in page.text
    assert "none" in page.text and "0.98 %" in page.text and "0.5 %" in page.text


PLATE_HARMONIC = ROOT / "examples" / "plate_harmonic.toml"
OPTIMUM = (
    "optimise",
    PLATE,
    "--engine",
    "averaged",
    "--vary",
    "load.resistance=100k:1M",
    "--within",
    "5%",
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("args", "says"),
    [
        (
            ("response", PLATE_HARMONIC, "--sweep", "3Hz:6Hz:7", "--out", "."),
            ["half-power bandwidth", "4.5 Hz", "up"],
        ),
        (
            ("motion", PLATE_HARMONIC, "--duration", "2", "--out", "."),
            ["single trajectory is not a mean", "largest", " mm/s"],
        ),
        (
            OPTIMUM,
            [
                "The largest power is at",
                "The highest powers that averaged evaluated",
                "(model, estimated) µW",
            ],
        ),
        (
            (
                "charge",
                ROOT / "examples" / "plate_bridge.toml",
                "--to",
                "2V",
                "--trajectories",
                "64",
            ),
            ["mean time: ", "On the way", "2 V"],
        ),
    ],
    ids=lambda one: one[0] if isinstance(one, tuple) else "",
)
def test_studies_that_say_what_they_found(harvester, tmp_path, monkeypatch, args, says):
    monkeypatch.chdir(tmp_path)
    status, _, err = harvester(*args, "--report", "mine.html")
    assert (status, err) == (0, "")
    text = (tmp_path / "mine.html").read_text()
    page = checked(text)
    provenance_of(page)
    for word in says:
        assert word in page.text
    assert command(text) == ["harvester", *map(str, args), "--report", "mine.html"]
    assert page.tags.count("figure") == 1


@pytest.mark.slow
def test_front_and_circuits():
    """The other answers of `optimise`: a table of designs, or of circuits, those without an optimum as well."""
    scene = hv.load(ROOT / "examples" / "plate.toml")
    points = tuple(
        FrontPoint({"load.resistance": r}, Value(1e-6 * r**0.1, model=1e-8), 1e-9 * r)
        for r in (1e5, 1e6)
    )
    front = ParetoFront(
        "averaged",
        "peak_displacement",
        -1,
        points,
        True,
        1.0,
        (warning("step_bias_not_measured", error="beware"),),
    )
    page = checked(report.html(report.of_search(scene, front, 0)))
    for word in ("100 µm", "100 kΩ", "peak displacement", "beware"):
        assert word in page.text
    best = hv.optimise(scene, vary={"load.resistance": ("100k", "1M")}, engine="exact")
    choice = CircuitChoice.of({"bridge": best, "sece": SimulationError("it <failed>")}, 2.0)
    page = checked(report.html(report.of_search(scene, choice, 0)))
    for word in ("The best circuit is bridge", "no optimum", "it <failed>", "664.7 kΩ"):
        assert word in page.text


@pytest.mark.slow
def test_stability():
    """With the region there is a figure; without it only the exponents."""
    beware = (warning("not_followed", error="beware"),)
    answer = Stability(True, -1.0, -1.1, 0.01, Value(-1.2, 0.1, 0.0), None, beware)
    bare = report.html(report.of_stability(hv.load(PLATE), answer, 3))
    assert "averaged: -1.1 ± 0.01 (model, estimated) 1/s" in bare
    assert "rest: stable" in bare and "beware" in bare and "<figure>" not in bare
    edges = [Edge(0.1, 0.2, 0.1, 0.1, 0.01), Edge(1.0, float("inf"), 0.2, 0.2, float("inf"))]
    page = checked(
        report.html(report.of_stability(hv.load(PLATE), replace(answer, region=tuple(edges)), 3))
    )
    for word in ("The edge of stability", "0.01", "inf"):
        assert word in page.text


def test_a_scene_without_a_title_has_that_of_its_file(harvester, tmp_path):
    scene = tmp_path / "my <beam>.toml"
    scene.write_text(re.sub("title = .*", "", PLATE.read_text()))
    file = tmp_path / "mine.html"
    assert harvester("run", scene, "--engine", "averaged", "--report", file)[0] == 0
    text = file.read_text()
    assert '<h1 id="answer">my &lt;beam&gt;</h1>' in text
    assert "A scene without a title" in report.html(
        report.of_run(hv.load(scene), estimates()[0], 0)
    )


def test_a_page_shows_what_the_user_wrote():
    page = report.html(report.of_run(hv.load(PLATE), estimates()[0], 0))
    text = Page(page).text
    assert 'capacitance = "50.2 nF"' in text and "10⁻⁵ g²/Hz" in text
    assert "0000000" not in text


@pytest.mark.thorough("test_studies_that_say_what_they_found")
@pytest.mark.slow
def test_elasticities_stand_in_the_report_of_a_run():
    found = hv.sensitivity(PLATE, within=1e-2)
    page = report.html(report.of_run(hv.load(PLATE), estimates()[0], 0, None, found))
    assert "Normalised sensitivity of the mean power in each key, the largest first" in page
    assert page.index("oscillator.mass", page.index("Normalised sensitivity of the mean power")) > 0
    assert "normalised sensitivity: change" in page


def test_figures_are_as_wide_as_the_page():
    """On a phone as well: no figure has a width of its own."""
    template = (ROOT / "harvester" / "report" / "page.html").read_text()
    rule = re.search(r"figure img \{([^}]*)\}", template)[1]
    assert "width: 100%" in rule and "min-width" not in rule


@pytest.mark.slow
def test_cost():
    rows = (
        CostRow(
            "ensemble",
            "a",
            0.01,
            1.0,
            64,
            None,
            "",
            1e-6,
            0.1,
            1.0,
            0.01,
            1e-3,
            1e-4,
            0.0,
            0.0,
            0.011,
            True,
        ),
        CostRow("spice", "b", error="it <failed>"),
    )
    cost = Cost(rows, "ensemble", Value(1e-6, 1e-9), {"published": "it refuses"})
    page = checked(report.html(report.of_cost(hv.load(PLATE), cost, 5, 30.0)))
    provenance_of(page)
    for line in ("it <failed>", "it refuses", "Within 3 %: ensemble in 0.1 s", "1.1 %", "30 s"):
        assert line in page.text


NASTY = "<script>alert(1)</script>\"'&<img src=x onerror=alert(2)>"


def test_what_a_user_gives_is_text(tmp_path):
    (tmp_path / "mine.cir").write_text(
        f".subckt mine a b R=1\n* {NASTY}\nRload a b {{R<2&&R>0?R:R}}\n.ends mine\n"
    )
    toml = PLATE.read_text().replace(
        'resistance = "1 Mohm"', 'netlist = "mine.cir"\nparameters = { R = 1e6 }'
    )
    toml = re.sub("title = .*", f"title = '''{NASTY}'''", toml)
    scene = hv.loads(toml, tmp_path)
    answer = estimates()[0]
    text = report.html(report.of_run(scene, answer, 0))
    page = checked(text)
    assert page.text.count(NASTY) == 2  # title and heading, and in no tag
    assert page.text.count("alert(1)") == 3  # the scene file escapes it its own way
    assert "rload" in page.text
    assert "<script" not in text and "onerror=alert(2)>" not in text


def test_a_report_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    file = tmp_path / "mine.html"
    file.write_text("old")
    page = report.of_run(hv.load(PLATE), estimates()[0], 0)
    monkeypatch.setattr(
        "os.fsync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left on device"))
    )
    with pytest.raises(InputError, match=r"`report` must accept mine\.html"):
        report.write(file, page)
    assert file.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["mine.html"]


def test_every_effect_has_a_word():
    many = Equations(**dict.fromkeys(Equations.__dataclass_fields__, 1.0) | {"modes": None})
    several = [
        Problem.of(ROOT / "examples" / f"{name}.toml").equations
        for name in ("two_modes_with_stop", "magnifier")
    ]
    several.append(
        Problem(BEAM.replace(ball=hv.Ball(mass=1e-3, room=1e-3, restitution=0.5))).equations
    )
    variants = [many, Equations(alpha=-1.0, coloured=1.0), *several]
    names = {name for eqs in variants for name in eqs.effects} | {"netlist"}
    assert names >= set(EFFECTS)
    rows = [row for table in effects_section(Problem.of(PLATE)).tables for row in table.rows]
    assert {name for name, words in rows if words} == names


def test_present_and_absent_make_all():
    for path in (PLATE, ROOT / "examples" / "plate_bridge.toml"):
        problem = Problem.of(path)
        tables = effects_section(problem).tables
        assert sorted(row[0] for table in tables for row in table.rows) == sorted(
            {effect.name for effect in REGISTRY} | {"netlist"}
        )


@pytest.mark.parametrize(
    ("found", "shown"),
    [
        (amount(0.04, "kg"), "40 g"),
        (amount(50.2e-9, "F"), "50.2 nF"),
        (amount(8.3e-6, "W"), "8.3 µW"),
        (amount(1e6, "ohm"), "1 MΩ"),
        (amount(3e-5, "V^2"), "3·10⁻⁵ V²"),
        (
            signs("8.36 +- 0.05 (95 %, sampling) +- 0.01 (step) uW"),
            "8.36 ± 0.05 (95 %, sampling) ± 0.01 (step) µW",
        ),
        (share(None, 1.0), "-"),
        (share(0.1, 0.0), "-"),
        (share(-3.3, 1.0), "330 %"),
        (share(1e-9, 1.0), "< 0.001 %"),
        (share(0.0, 1.0), "0 %"),
    ],
)
def test_numbers(found, shown):
    assert found == shown


@pytest.mark.slow
def test_no_report_loads_neither_templates_nor_figures():
    """In a fresh interpreter: what a page needs costs nothing if none is written.

    The scene is one of bare numbers, as pint loads dask where that is installed, which loads
    jinja2.
    """
    scene = ROOT / "examples" / "paper_figure3.toml"
    code = (
        f"import atexit, sys; from harvester.cli import main; sys.argv = ['harvester', 'run', {str(scene)!r}, "
        "'--engine', 'averaged']; atexit.register(lambda: print([m for m in sys.modules"
        " if m.split('.')[0] in ('jinja2', 'matplotlib', 'numba')])); main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "[]")


def test_no_address_but_data():
    """The template itself names no place in the net."""
    template = (ROOT / "harvester" / "report" / "page.html").read_text()
    assert not [
        word
        for word in re.split(r"[\s\"'()<>]+", template)
        if urlparse(word).scheme in ("http", "https")
    ]


def test_a_title_with_control_characters():
    """Shown as what they are, in the page and in a figure's title."""
    text = report.html(report.Page("a\x1b[2J\u202ez", "run", [], [], "", {}))
    assert "\x1b" not in text and "\u202e" not in text
    assert "a\\x1b[2J\\u202ez" in text
