"""Every command on the project's pages is run as it is; `LESS` lists all that is changed to make one short."""

import contextlib
import io
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import harvester as hv
from harvester.studies import paper
from tests.support import pages
from tests.support.pages import ROOT

BUILT = ROOT / "docs" / "_build"
PAGES = [
    "README.md",
    "CONTRIBUTING.md",
    *sorted(
        str(path.relative_to(ROOT))
        for path in (ROOT / "docs").rglob("*.md")
        if BUILT not in path.parents
    ),
]

# (what a command must hold, what is added at its end, ends of its words that are replaced: fewer
# points)
LESS = [
    ("harvester sweep", ["--workers", "1"], {"0.01:10:13": "1:10:2", ":13": ":3", ":1000": ":9"}),
    # With spice: `make demo` below.
    (
        "resistance=1k:10M:13 --out out/mine",
        ["--engine", "averaged", "--engine", "ensemble", "--trajectories", "64"],
        {},
    ),
    ("toml --engine spice", ["--trajectories", "2", "--duration", "1"], {" 1%": " 10%"}),
    ("harvester response", [], {":61": ":3", ":31": ":7", ":26": ":3", ":11": ":3", ":8": ":2"}),
    ("harvester cost", ["--budget", "1s"], {}),
    ("harvester optimise", ["--budget", "8s", "--within", "10%"], {}),
    ("harvester tolerance examples/bimorph_board", ["--runs", "first-order"], {}),
    (
        "harvester tolerance examples/plate",
        ["--runs", "16", "--samples", "256", "--checks", "2", "--engine", "averaged"],
        {},
    ),
    ("bridge,parallel_sshi,sece", ["--trajectories", "16"], {",parallel_sshi,sece": ",sece"}),
    ("harvester compare", ["--within", "10%"], {}),
    ("--within 0.3%", ["--within", "2%"], {}),
    ("spice --within 1%", ["--within", "10%"], {}),
    ("harvester design", ["--circuits", "bridge"], {}),
    ("harvester stability", ["--trajectories", "256"], {}),
    ("harvester paper", ["4"], {}),  # at its ends, by the fixture `place`
    ("harvester charge examples/plate", ["--trajectories", "256"], {}),
    ("harvester charge examples/bimorph", [], {"8s": "1s", "4s": "1s"}),
    ("motion examples/bimorph_board", [], {"4": "1"}),
    ("benchmarks/published.py", ["erturk_inman"], {}),
    ("benchmarks/predictions.py", ["--table"], {}),
    (
        "harvester tour",
        ["--help"],
        {},
    ),  # whose commands are on the page, and run whole in tests/commands/test_examples.py
    # which would serve for ever: tests/explore looks at its page
    ("harvester explore", ["--help"], {}),
    ("response examples/published", [], {":301": ":3"}),
]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A reader's folder; the paper's figures are drawn at their ends only."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            paper, "GRIDS", {name: grid[:: len(grid) - 1] for name, grid in paper.GRIDS.items()}
        )
        yield pages.folder(tmp_path_factory.mktemp("reader"))


@pytest.mark.thorough("test_cli.py")
@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_commands(page, place, monkeypatch):
    """Exit status 0, and each file under out/ that the page names is there afterwards."""
    monkeypatch.chdir(place)
    pages.run_page(page, LESS)
    for name in re.findall(r"`(out/[\w./-]+)`", pages.outside(page)):
        assert Path(name).exists(), f"{page} says that {name} is made"


@pytest.mark.parametrize("page", [*PAGES, "examples/README.md"])
def test_nothing_escapes(page):
    """All code is in fenced blocks of a known language, so that the tests find it; links and figures are there."""
    assert {block.language for block in pages.blocks(page)} <= pages.LANGUAGES
    text = pages.outside(page)
    assert not re.findall(
        r"^\s+(?:\.venv/bin|make |harvester |python |ngspice ).*", text, re.MULTILINE
    )
    for target in re.findall(r"\]\(([^)#:]+)\)", text):
        assert ((ROOT / page).parent / target).exists(), f"{page}: no {target}"
    for script in re.findall(r"`(?:\.venv/bin/)?python ([\w/]+\.py)", text):
        assert (ROOT / script).exists(), f"{page}: no {script}"


@pytest.mark.thorough("test_the_cheapest_engine_of_each_point_is_resumed")
@pytest.mark.ngspice
@pytest.mark.slow
def test_demo_at_reduced_size(place, monkeypatch):
    """The commands behind `make demo`, and the plots that it names."""
    monkeypatch.chdir(place)
    recipe = pages.made(["demo"])
    sweeps = [line for line in recipe.splitlines() if line.startswith(".venv/bin/harvester")]
    assert len(sweeps) == 2
    few = ["--trajectories", "2", "--duration", "1"]
    for line in sweeps:
        (words,) = pages.commands(line)
        engines = [] if "--engine" in words else ["--engine", "averaged", "--engine", "spice"]
        pages.run(words, "make demo", [*LESS, ("sweep", [*engines, *few], {":3": ":2"})])
    for name in set(re.findall(r"out/\w+/sweep\.png", recipe)):
        assert Path(name).exists()
    (last,) = re.findall(r"^\.venv/bin/python (benchmarks/\w+\.py) (.*)$", recipe, re.MULTILINE)
    done = subprocess.run(
        [sys.executable, ROOT / last[0], last[1]], capture_output=True, text=True, check=True
    )
    assert re.fullmatch(r"Best load \S+ kohm: \S+ uW; .* agree within \S+ %.*\.\n", done.stdout)


def test_the_answer_of_the_demo(tmp_path):
    """Computed from the table: the best load by the mean of the engines that state an error, and their agreement."""
    rows = [
        ("1000.0", "published", "9.9e-6", ""),
        ("1000.0", "averaged", "8.0e-6", "1e-8"),
        ("1000.0", "spice", "8.2e-6", "1e-8"),
        ("464000.0", "averaged", "8.5e-6", "1e-8"),
        ("464000.0", "spice", "8.5e-6", "1e-8"),
        ("464000.0", "ensemble", "", ""),
    ]
    head = "load.resistance,engine,mean_power,mean_power_error95"
    (tmp_path / "sweep.csv").write_text("\n".join([head, *map(",".join, rows)]) + "\n")
    answer = runpy.run_path(str(ROOT / "benchmarks" / "demo_answer.py"))["answer"](
        tmp_path / "sweep.csv"
    )
    assert answer == (
        "Best load 464 kohm: 8.5 uW; formula and ngspice agree within 1.2 %; published is up to 22 % too high."
    )


def skeleton(line):
    """A line with # for each of its numbers, and these numbers."""
    number = r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]\d+)?(?![\w.])"
    return re.sub(number, "#", " ".join(line.split())), [
        float(one) for one in re.findall(number, line)
    ]


@pytest.mark.parametrize(
    "page, quick",
    [
        ("README.md", True),
        pytest.param("docs/api.md", False, marks=pytest.mark.thorough("test_printed_results")),
        pytest.param(
            "docs/tour.md",
            False,
            marks=[
                pytest.mark.ngspice,
                pytest.mark.slow,
                pytest.mark.thorough("test_printed_results"),
            ],
        ),
    ],
)
def test_printed_results(page, quick, tmp_path, monkeypatch):
    """Each line of the page's blocks of output is printed by the page's own commands, at their full size."""
    monkeypatch.chdir(pages.folder(tmp_path))
    printed = io.StringIO()
    promised = []
    names = {"__name__": "page"}
    for block in pages.blocks(page):
        if block.language == "python":
            with contextlib.redirect_stdout(printed):
                exec(compile(block.text, block.where, "exec"), names)
        elif block.language == "sh":
            for words in pages.commands(block.text):
                if words[1] in ("new", "run", "optimise"):
                    printed.write(pages.run(words, block.where))
        elif block.language == "text":
            promised += block.text.splitlines()
    lines = [skeleton(line) for line in printed.getvalue().splitlines()]
    if quick:  # Python and the shell give the same
        assert len([words for words, _ in lines if words.endswith(skeleton(promised[0])[0])]) == 2
    for line in promised:
        words, numbers = skeleton(line)
        found = [at for at, (theirs, _) in enumerate(lines) if theirs.endswith(words)]
        assert found, f"{page}: nothing prints {line!r}"
        if not numbers:
            continue
        nearest = min(found, key=lambda at: abs(lines[at][1][-len(numbers)] - numbers[0]))
        theirs = lines.pop(nearest)[1]
        told = f"{page} says {line!r}, the command gives {theirs[-len(numbers) :]}"
        if "+-" in line:  # another processor may round otherwise, and its paths part at an impact
            value, *errors = numbers
            assert theirs[-len(numbers)] == pytest.approx(
                value, abs=0.5 * sum(e for e in errors if e != 95)
            ), told
        assert theirs[-len(numbers) :] == pytest.approx(numbers, rel=0.25), told


@pytest.mark.thorough("test_printed_results")
@pytest.mark.ngspice
@pytest.mark.slow
def test_the_powers_of_the_audit(tmp_path, monkeypatch):
    """The table of docs/audit.md is what its command gives."""
    monkeypatch.chdir(pages.folder(tmp_path))
    rows = re.findall(
        r"^\| `(\w+)` \| ([\d.]+) \| ([^|]*) \|", (ROOT / "docs/audit.md").read_text(), re.MULTILINE
    )
    compared = hv.compare(hv.load("examples/paper_figure3.toml"), within="1%")
    powers = {one.engine: one.mean_power for one in compared.estimates}
    assert {name for name, *_ in rows} == set(powers)
    for name, power, error in rows:
        assert 1e4 * powers[name].value == pytest.approx(
            float(power), abs=0.003 + 0.5e4 * (powers[name].error95 or 0.0)
        )
        assert (powers[name].error95 is None) == (error == "not known")


def test_readme_is_short():
    """Its first screen shows the program and the two commands that set up all; the paper's DOI is mentioned."""
    text = (ROOT / "README.md").read_text()
    assert len(text.splitlines()) <= 90
    assert text.index("![") < text.index("make demo") < text.index("```python")
    first = next(block for block in pages.blocks("README.md") if block.language == "sh")
    assert int(first.where.partition(":")[2]) < 30
    assert pages.commands(first.text) == [["make", "demo"], ["make", "test"]]
    assert "The text at hand prints no DOI" in text


def test_targets():
    """What the two commands of README and their kin do."""
    tests = pages.made(["test"])
    for tool in ("ruff check", "ruff format --check", "mypy", "pytest"):
        assert tool in tests
        assert tool in pages.made(["check"])
    assert "lint-imports" in pages.made(["check"])
    assert "sphinx" in pages.made(["docs"])
    assert "sh tools/setup.sh" in pages.made(["-B", "setup"])


def test_a_page_that_lies_is_found(tmp_path, monkeypatch):
    """A wrong command, a file that is not made and a block without a language are all seen."""
    monkeypatch.chdir(pages.folder(tmp_path))
    with pytest.raises(AssertionError, match=r"wrong\.md:1"):
        pages.run(
            [".venv/bin/harvester", "run", "examples/plate.toml", "--engine", "magic"], "wrong.md:1"
        )
    with pytest.raises(AssertionError, match="no way to run"):
        pages.run(["rm", "-rf", "nothing"], "wrong.md:1")
    assert pages.commands("# a remark\nmake demo   # tables\na b \\\n  c\n") == [
        ["make", "demo"],
        ["a", "b", "c"],
    ]
    assert pages.written("written: out/a.csv, b.png") == [Path("out/a.csv"), Path("out/b.png")]
