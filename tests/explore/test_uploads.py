"""Files that a page is given: nothing outside of its folder is read, and what cannot be used is one line."""

import pytest

import harvester as hv
from harvester.explore.draft import first
from harvester.explore.uploads import keep, take
from tests.support.paths import ROOT

SCENE = (ROOT / "examples" / "plate.toml").read_text()


def given(folder, axis="", **files):
    """The draft after these files were given; `a__toml` is a.toml."""
    names = [name.replace("__", ".") for name in files]
    paths = keep(
        folder, names, [text.encode() if isinstance(text, str) else text for text in files.values()]
    )
    return take(first(), paths, axis)


def test_scene_record_and_netlist(tmp_path):
    """A scene, a record that shakes it instead of its noise, and a circuit of one's own."""
    netlist = (ROOT / "netlists" / "bridge.cir").read_text()
    draft, told = given(
        tmp_path,
        plate__toml=SCENE,
        shake__csv=(ROOT / "examples" / "shake.csv").read_text(),
        own__cir=netlist,
    )
    scene = draft.scene()
    assert scene.excitation.acceleration_psd is None
    assert scene.excitation.acceleration_file == str(tmp_path / "shake_clean.csv")
    assert scene.load.netlist == str(tmp_path / "own.cir")
    assert draft.value("load.parameters.R") == 1e6 and "load.parameters.Csmooth" not in draft.texts
    assert any("rms" in line for line in told)
    assert str(tmp_path) not in draft.toml()


FILE_ELSEWHERE = '[excitation]\nacceleration_file = "/etc/hostname"\n'


@pytest.mark.parametrize(("name", "content", "told"), [
    ("a.toml", SCENE.replace("[load]", "[other]"), "unknown"),
    ("a.toml", SCENE.partition("[load]")[0] + '[load]\nnetlist = "../secret.cir"\n', "be in the folder"),
    ("a.toml", SCENE.partition("[excitation]")[0] + FILE_ELSEWHERE, "in the folder"),
    ("a.toml", "", "must be given"),
    ("a.toml", b"\xff\xfe\x00", "UTF-8"),
    ("a.csv", "", "a.csv"),
    ("a.csv", "t,a\n1,2\n", "a.csv"),
    ("a.cir", ".subckt a p n\n.include /etc/passwd\nRload p n 1k\n.ends\n", "netlist"),
    ("a.cir", "* t\n.control\nshell id\n.endc\n", "netlist"),
    ("../a.csv", "x", "a file must be"),
    (".hidden.csv", "x", "a file must be"),
    ("a.py", "import os", "a file must be"),
])  # fmt: skip
def test_what_cannot_be_used_is_one_line(tmp_path, name, content, told):
    """And the draft that was there stays as it was."""
    folder = tmp_path / "session"
    folder.mkdir()
    (tmp_path / "secret.cir").write_text((ROOT / "netlists" / "bridge.cir").read_text())
    before = first()
    with pytest.raises(hv.HarvesterError, match=told) as error:
        take(
            before,
            keep(folder, [name], [content if isinstance(content, bytes) else content.encode()]),
            "",
        )
    assert "\n" not in str(error.value)
    assert before.tables() == first().tables()
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["secret.cir"]


def test_too_much(tmp_path):
    keep(tmp_path, ["a.csv"], [b"x" * 30_000_000])
    with pytest.raises(hv.InputError, match="at most 50 MB together"):
        keep(tmp_path, ["b.csv"], [b"x" * 30_000_000])


def test_a_netlist_of_too_many_parameters(tmp_path):
    """Each would be a slider: a thousand stalled every page for ten seconds."""
    many = " ".join(f"A{k}=1" for k in range(51))
    netlist = f".subckt mine p n R=1Meg {many}\nRload p n {{R}}\n.ends\n"
    with pytest.raises(
        hv.InputError, match="at most 50 parameters, each a slider here, but has 52"
    ):
        given(tmp_path, own__cir=netlist)
