"""`make docs` builds without a warning, offline, and the reference has every public name."""

import inspect
import json
import re
import runpy
import subprocess
import sys
from functools import cache

import pytest

import harvester as hv
from tests.support.browser import DESKTOP, PHONE, chromium
from tests.support.pages import ROOT, theory_pages

NOTEBOOK = """
import json, runpy, sys
sys.path.insert(0, "docs")
page = json.load(open("docs/tasks.ipynb"))
runpy.run_path("docs/run_notebook.py", run_name="imported")["run"](page)
json.dump(page, open(sys.argv[1], "w"))
"""
FONT = "STIXTwoMath.woff"
PAGES = [page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts]
SOURCES = ("harvester", "tests", "benchmarks", "docs", "examples", "packaging")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built pages."""
    out = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", "-b", "html", "-d", out / "trees",
         "docs", out / "html"],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=400,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    return out / "html"


@pytest.mark.thorough("nothing: sphinx builds all pages")
@pytest.mark.thorough("test_example")
@pytest.mark.slow
def test_reference(site):
    """Each name of `__all__` is there, in its own words."""
    page = "".join(path.read_text() for path in (site / "api").rglob("*.html"))
    assert {f"harvester.{name}" for name in hv.__all__} <= set(re.findall(r'id="([\w.]+)"', page))


def test_public_names_say_what_they_are():
    """A docstring of its own, and one for each public method."""
    for name in hv.__all__:
        one = getattr(hv, name)
        assert one.__doc__, name
        methods = inspect.getmembers(one, inspect.isfunction) if inspect.isclass(one) else []
        missing = [
            f"{name}.{k}" for k, v in methods if not k.startswith("_") and not inspect.getdoc(v)
        ]
        assert missing == []


@pytest.mark.thorough("nothing: sphinx builds all pages")
@pytest.mark.slow
def test_no_example_is_listed_as_an_error(site):
    """Each doctest is under a heading of its own: read as an exception it would be set in bold."""
    pages = {path.name: path.read_text() for path in (site / "api").rglob("*.html")}
    assert len(pages) > len(hv.__all__)
    assert [name for name, text in pages.items() if "<strong>&gt;&gt;&gt;" in text] == []
    assert ">Examples<" in pages["harvester.run.html"] or "rubric" in pages["harvester.run.html"]


@pytest.mark.thorough("nothing: sphinx builds all pages")
@pytest.mark.slow
def test_pages(site):
    """All are there; formulas are MathML, figures are files; nothing is fetched from elsewhere."""
    names = {path.relative_to(ROOT / "docs").with_suffix("") for path in PAGES}
    assert names <= {path.relative_to(site).with_suffix("") for path in site.rglob("*.html")}
    theory = "".join((site / f"{page.stem}.html").read_text() for page in theory_pages())
    text = "".join(page.read_text() for page in theory_pages())
    labels = re.findall(r"^\$\$ \(\w+\)$", text, re.MULTILINE)
    assert theory.count('class="formula"') >= len(labels) == theory.count('class="eqno"') > 20
    assert theory.count("<math") > 40
    assert (site / "_static" / FONT).stat().st_size > 100_000
    assert FONT in (site / "_static" / "own.css").read_text()
    for path in site.rglob("*.html"):
        text = path.read_text()
        for source in re.findall(r'<(?:img|script|link)[^>]*(?:src|href)="([^"]+)"', text):
            if "://" not in source:
                assert (path.parent / source.partition("?")[0].partition("#")[0]).exists(), (
                    f"{path.name}: {source}"
                )
            else:
                pytest.fail(f"{path.name} fetches {source}")


@pytest.mark.thorough("nothing: sphinx builds all pages")
@pytest.mark.slow
def test_pages_in_a_browser(site):
    """At 1280 and 390 px: nothing is wider than the page, the font is there, and contents are next to a long page.

    A formula that is wider than a phone scrolls in its own box; on a desk none does.
    """
    wider = "() => document.documentElement.scrollWidth - innerWidth"
    boxes = "[...document.querySelectorAll('.formula .equations > div')]"
    cut = f"() => {boxes}.filter(e => e.scrollWidth > e.clientWidth + 1).length"
    font = "async () => { await document.fonts.ready; return document.fonts.check('16px \"STIX Two Math\"') }"
    with chromium() as browser:
        for size in (DESKTOP, PHONE):
            page = browser.new_page(viewport=size)
            theory = [page.stem for page in theory_pages()]
            scrolled = 0
            for name in ("tour", *theory, "audit", "api/pages/harvester.run", "commands/power"):
                page.goto((site / f"{name}.html").as_uri())
                assert page.evaluate(wider) <= 0, name
                if name in theory[1:]:  # those with formulas
                    assert page.evaluate(font)
                    scrolled += page.evaluate(cut)
                contents = page.locator(".toc-drawer").bounding_box()
                assert (contents["x"] + contents["width"] <= size["width"]) is (size == DESKTOP), (
                    name
                )
            assert scrolled <= (0 if size == DESKTOP else 15)


NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


@pytest.mark.thorough("test_example")
@pytest.mark.slow
@pytest.mark.ngspice
def test_the_notebook_runs(tmp_path):
    """Each cell prints what the page has of it: the same words, and numbers within two percent; figures are drawn.

    It runs in a program of its own: idle workers of tests without ngspice would find none.
    """
    page = json.loads((ROOT / "docs" / "tasks.ipynb").read_text())
    subprocess.run([sys.executable, "-c", NOTEBOOK, tmp_path / "made.ipynb"], cwd=ROOT, check=True)
    made = json.loads((tmp_path / "made.ipynb").read_text())
    code = [cell for cell in page["cells"] if cell["cell_type"] == "code"]
    assert code and sum(cell["source"][0].startswith("## ") for cell in page["cells"]) == 10
    for before, after in zip(page["cells"], made["cells"], strict=True):
        for old, new in zip(before.get("outputs", ()), after.get("outputs", ()), strict=True):
            texts = ["".join(one.get("text") or one["data"]["text/plain"]) for one in (old, new)]
            assert NUMBER.sub("#", texts[0]) == NUMBER.sub("#", texts[1])
            first, second = ([float(one) for one in NUMBER.findall(text)] for text in texts)
            assert second == pytest.approx(first, rel=0.02, abs=1e-9)
            assert ("image/png" in old.get("data", {})) == ("image/png" in new.get("data", {}))


@pytest.mark.thorough("nothing: sphinx builds all pages")
@pytest.mark.slow
def test_the_first_page_has_figures_of_the_gallery(site):
    """Six, each with a text in its place and a link to its section; installing comes before them."""
    first, gallery = ((site / f"{name}.html").read_text() for name in ("index", "gallery"))
    wall = re.findall(
        r'href="gallery\.html#([\w-]+)"><img alt="[^"]+" src="_images/([\w.]+)"', first
    )
    assert len({figure for _, figure in wall}) == 6
    assert set(re.findall(r'<section id="([\w-]+)"', gallery)) >= {section for section, _ in wall}
    assert first.index("install.html", first.index("<article")) < first.index("_images/")


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", sorted((ROOT / "docs").glob("draw_*.py")), ids=lambda path: path.name
)
def test_the_scripts_that_draw_find_what_they_import(path):
    """They run for long, and by hand: what they import from the package must be there."""
    assert callable(runpy.run_path(str(path), run_name="imported")["main"])


@cache
def scripts():
    """Every Python file of the project, from its root."""
    return [str(one.relative_to(ROOT)) for top in SOURCES for one in (ROOT / top).rglob("*.py*")]


@pytest.mark.parametrize(
    "page", ["README.md", "CONTRIBUTING.md", *sorted(str(one.relative_to(ROOT)) for one in PAGES)]
)
def test_files_that_pages_name_are_there(page):
    """With their folder or without: some file of the package, the tests or the scripts ends so."""
    named = re.findall(r"`((?:\w+/)*\w+\.pyi?)`", (ROOT / page).read_text())
    strangers = {"random.py"}  # a user's own, in the page on reliability
    assert [
        name for name in named if not any(f"/{one}".endswith(f"/{name}") for one in scripts())
    ] == [name for name in named if name in strangers]


SEARCHED = "tutorial,quickstart,accelerometer,duty cycle,inductor,PSD,MPPT,license,optimize"


@pytest.mark.parametrize("word", SEARCHED.split(","))
def test_a_search_word_is_a_keyword_of_few_pages(word):
    """A keyword of every page would make each of them a result of the search."""
    heads = [re.search(r"^    keywords: (.*)$", page.read_text(), re.MULTILINE) for page in PAGES]
    found = [head for head in heads if head and word in re.split(r", ", head[1])]
    assert 1 <= len(found) <= 3


def test_the_link_to_the_repository(monkeypatch):
    """From the remote of the clone, by https and without a password; none for a folder."""
    head = runpy.run_path(str(ROOT / "docs" / "page_head.py"))
    addresses = {
        "https://user:secret@example.org/group/harvester.git\n": "https://example.org/group/harvester",
        "ssh://git@example.org:2222/group/harvester.git": "https://example.org/group/harvester",
        "git@example.org:group/harvester": "https://example.org/group/harvester",
        "/srv/git/harvester.git": "",
        "../harvester": "",
        "": "",
    }
    assert {remote: head["web_address"](remote) for remote in addresses} == addresses
    monkeypatch.setenv("HARVESTER_REPOSITORY", "https://example.org/h")
    assert head["repository_options"]()["footer_icons"][0]["url"] == "https://example.org/h"
