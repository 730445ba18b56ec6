"""The examples: every scene and script is on the page, with a command that is run and a figure that is small."""

import re

import pytest

from tests.support import pages
from tests.support.pages import ROOT

PAGE = "examples/README.md"
EXAMPLES = [
    path.name
    for path in sorted((ROOT / "examples").iterdir())
    if path.suffix in (".toml", ".py") and path.is_file()
]
FIGURES = sorted((ROOT / "docs" / "gallery").glob("*.png"))

# As in tests/project/test_readme.py.
LESS = [
    ("harvester sweep", ["--workers", "1", "--trajectories", "64"], {":13": ":3", ":61": ":3"}),
    ("harvester response", [], {":41": ":3", ":61": ":3"}),
    ("harvester optimise", ["--budget", "1s", "--within", "10%"], {}),
    ("harvester compare", ["--within", "10%"], {}),
    ("harvester motion", [], {"^4": ".5"}),
    ("bq25570.toml --from-rest", [], {"2": ".5"}),
    ("python examples/load_sweep.py", ["--quick"], {}),
    ("python examples/own_netlist.py", ["--quick"], {}),
    ("python examples/engines.py", ["--quick"], {}),
    ("examples/circuits.py", ["--circuit", "resistor", "--loads", "3", "--duration", ".2"], {}),
]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return pages.folder(tmp_path_factory.mktemp("gallery"))


def sections():
    """Each example's section: its title and its text."""
    parts = re.split(r"^### (.*)\n", (ROOT / PAGE).read_text(), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.thorough("test_cli.py")
@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize("title", sections())
def test_example(title, place, monkeypatch):
    """Its commands run, and those that draw into a folder leave a figure there."""
    monkeypatch.chdir(place)
    (block,) = pages.FENCE.findall(sections()[title])
    for words in pages.commands(block[1]):
        pages.run(words, f"{PAGE}: {title}", LESS)
        if "--out" in words:
            out = place / words[words.index("--out") + 1]
            assert list(out.glob("*.png")) if out.is_dir() else out.exists()


def test_every_example_is_on_the_page():
    text = "".join(sections().values())
    assert [
        name for name in EXAMPLES if f"`{name}`" not in text or f"examples/{name}" not in text
    ] == []


def test_figures():
    """Each that the page shows is there and small, and none is left over."""
    shown = re.findall(r"\]\(\.\./docs/gallery/(\w+)\.png\)", (ROOT / PAGE).read_text())
    assert sorted(shown) == [path.stem for path in FIGURES]
    assert all(path.stat().st_size < 60_000 for path in FIGURES)
