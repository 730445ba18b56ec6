"""`make docs` builds without a warning, offline, and the reference has every public name."""

import inspect
import re
import runpy
import subprocess
import sys

import pytest

import harvester as hv
from tests.support.pages import ROOT

SOURCES = ("harvester", "tests", "benchmarks", "docs", "examples")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built pages."""
    out = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-E", "-b", "html", "-d", out / "trees",
         "docs", out / "html"],
        cwd=ROOT, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    return out / "html"


@pytest.mark.thorough("test_example")
@pytest.mark.slow
def test_reference(site):
    """Each name of `__all__` is there, in its own words."""
    page = (site / "api.html").read_text()
    assert {f"harvester.{name}" for name in hv.__all__} <= set(re.findall(r'id="([\w.]+)"', page))


def test_public_names_say_what_they_are():
    """A docstring of its own, and one for each public method."""
    for name in hv.__all__:
        one = getattr(hv, name)
        assert one.__doc__, name
        methods = inspect.getmembers(one, inspect.isfunction) if inspect.isclass(one) else []
        missing = [f"{name}.{k}" for k, v in methods if not k.startswith("_") and not inspect.getdoc(v)]
        assert missing == []


@pytest.mark.slow
def test_pages(site):
    """All are there; formulas are MathML, figures are files; nothing is fetched from elsewhere."""
    names = {path.stem for path in (ROOT / "docs").glob("*.md")}
    assert names <= {path.stem for path in site.glob("*.html")}
    theory = (site / "theory.html").read_text()
    labels = re.findall(r"^\$\$ \(\w+\)$", (ROOT / "docs" / "theory.md").read_text(), re.MULTILINE)
    assert theory.count('class="formula"') >= len(labels) == theory.count('class="eqno"') > 20
    assert theory.count("<math") > 40
    for path in site.glob("*.html"):
        text = path.read_text()
        for source in re.findall(r'<(?:img|script|link)[^>]*(?:src|href)="([^"]+)"', text):
            if "://" not in source:
                assert (site / source.partition("?")[0].partition("#")[0]).exists(), f"{path.name}: {source}"
            else:
                pytest.fail(f"{path.name} fetches {source}")


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("draw_*.py")), ids=lambda path: path.name)
def test_the_scripts_that_draw_find_what_they_import(path):
    """They run for long, and by hand: what they take from the package must be there."""
    assert callable(runpy.run_path(str(path), run_name="imported")["main"])


@pytest.mark.parametrize(
    "page", ["README.md", "CONTRIBUTING.md", *(f"docs/{one.name}" for one in (ROOT / "docs").glob("*.md"))]
)
def test_files_that_pages_name_are_there(page):
    """With their folder or without: some file of the package, the tests or the scripts ends so."""
    files = [str(one.relative_to(ROOT)) for top in SOURCES for one in (ROOT / top).rglob("*.py*")]
    named = re.findall(r"`((?:\w+/)*\w+\.pyi?)`", (ROOT / page).read_text())
    strangers = {"random.py"}  # a user's own, in the page on reliability
    assert [name for name in named if not any(f"/{one}".endswith(f"/{name}") for one in files)] == [
        name for name in named if name in strangers
    ]
