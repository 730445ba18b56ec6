"""`harvester examples`, which lists and copies scenes, and `harvester tour`, which runs a page."""

import json
import re
import shlex

import pytest

import harvester as hv
from harvester.commands.tour import STEPS
from harvester.scene.schema import NAME
from tests.support import pages
from tests.support.paths import EXAMPLES

SCENES = [*sorted(EXAMPLES.glob("*.toml")), *sorted(EXAMPLES.glob("published/*.toml"))]


def test_list(harvester):
    status, out, _ = harvester("examples")
    listed = dict(line.split(maxsplit=1) for line in out.splitlines())
    assert status == 0
    assert listed == {path.stem: hv.load(path).title for path in SCENES}
    assert json.loads(harvester("examples", "--json")[1]) == listed


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_a_copy_is_the_same_scene(harvester, tmp_path, monkeypatch, path):
    """Its records and netlists come along: in an empty folder it states the same, to the last byte of its files."""
    monkeypatch.chdir(tmp_path)
    status, out, _ = harvester("examples", path.stem)
    assert status == 0
    copied = hv.load(f"{path.stem}.toml")
    scene = hv.load(path)
    assert copied.to_toml().replace(str(tmp_path), str(path.parent)) == scene.to_toml()
    assert (tmp_path / f"{path.stem}.toml").read_text() == f"#:schema ./{NAME}\n{path.read_text()}"
    written = re.findall(r"written: (\S+)", out)
    assert sorted(written) == sorted(one.name for one in tmp_path.iterdir())
    assert all(
        (path.parent / name).read_bytes() == (tmp_path / name).read_bytes()
        for name in written[1:-1]
    )


def test_a_board_comes_with_its_parts(harvester, tmp_path):
    copy = tmp_path / "mine.toml"
    assert json.loads(harvester("examples", "bimorph_board", "--out", copy, "--json")[1])[
        "written"
    ] == [str(tmp_path / name) for name in ("mine.toml", "board.cir", "board_parts.lib", NAME)]
    assert hv.load(copy).load.netlist == str(tmp_path / "board.cir")


def test_nothing_is_overwritten(harvester, tmp_path):
    """Neither the scene nor what it reads; if one file is in the way, none is written."""
    (tmp_path / "shake.csv").write_text("mine")
    (tmp_path / "plate.toml").write_text("mine")
    for name, says in (
        ("plate", "FILE must be new, but"),
        ("plate_recorded", "must be new, for the scene reads it"),
    ):
        status, out, err = harvester("examples", name, "--out", tmp_path / f"{name}.toml")
        assert (status, out) == (2, "")
        assert says in err
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "shake.csv": "mine",
        "plate.toml": "mine",
    }
    (tmp_path / NAME).write_text("mine")
    assert harvester("examples", "plate", "--out", tmp_path / "other.toml")[0] == 0
    assert (tmp_path / NAME).read_text() == "mine"


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("plate_brige",), "unknown example 'plate_brige': did you mean 'plate_bridge'?"),
        (
            ("--out", "x.toml"),
            "NAME must be given with --out, but is left out: 'harvester examples' lists them",
        ),
        (("plate", "--out", "x.txt"), "FILE must end in .toml, but is 'x.txt'"),
        (
            ("plate", "--out", "/proc/nowhere/x.toml"),
            "FILE must be in a folder that can be written, but '/proc/nowhere' is not: No such file or directory",
        ),
    ],
)
def test_what_cannot_be(harvester, args, says):
    assert harvester("examples", *args) == (2, "", f"harvester: {says}\n")


def test_the_tour_is_the_page():
    """docs/tour.md has the commands of `harvester tour`, in their order."""
    (setup, first, *rest) = [
        block for block in pages.blocks("docs/tour.md") if block.language == "sh"
    ]
    assert pages.commands(setup.text) == [["make", "setup"]]
    assert pages.commands(first.text) == [[".venv/bin/harvester", "tour"]]
    shown = [words for block in rest for words in pages.commands(block.text)]
    assert shown == [[".venv/bin/harvester", *shlex.split(line)] for _, line in STEPS]


def test_a_tour_needs_a_new_folder(harvester, tmp_path):
    assert harvester("tour", "--out", tmp_path)[0] == 2


@pytest.mark.thorough("test_the_tour_is_the_page")
@pytest.mark.ngspice
@pytest.mark.slow
def test_tour(harvester, tmp_path, monkeypatch):
    """Every step ends well, and what the steps name is there."""
    monkeypatch.chdir(tmp_path)
    status, out, err = harvester("tour")
    assert (status, "left out" in err) == (0, False), err
    assert out.count("\n$ harvester ") == len(STEPS)
    for text, _ in STEPS:
        for name in re.findall(r"[\w/]+\.(?:png|html)", text):
            assert (tmp_path / "tour" / name).is_file(), name


@pytest.mark.ngspice
def test_tour_without_ngspice(harvester, tmp_path, monkeypatch):
    """The step that needs it is left out, with the remedy in one line; the others continue."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NGSPICE_LIBRARY_PATH", "/nowhere/libngspice.so")
    formula = next(step for step in STEPS if "averaged" in step[1])
    spice = next(step for step in STEPS if "spice" in step[1])
    monkeypatch.setattr("harvester.commands.tour.STEPS", (STEPS[0], spice, formula))
    status, out, err = harvester("tour")
    assert status == 0
    assert err.startswith("harvester: this step is left out: ") and "NGSPICE_LIBRARY_PATH" in err
    assert "averaged: " in out
