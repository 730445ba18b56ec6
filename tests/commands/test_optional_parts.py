"""What may be missing: without each optional part its command states in one line how to get it, and
no other needs it."""

import sys
import tomllib

import pytest

from harvester.machine.system import this_system
from tests.support.paths import EXAMPLES, ROOT

PLATE = EXAMPLES / "plate_bridge.toml"
# Each extra that users get: the modules that it brings, a command that needs it, and how the
# command states so.
PARTS = {
    "ngspice": (
        ["piezo_harvester_ngspice"],
        ["run", PLATE, "--engine", "spice"],
        "pip install piezo-harvester[ngspice]",
    ),
    "explore": (["panel"], ["explore"], "pip install 'piezo-harvester[explore]'"),
    "dask": (
        ["distributed"],
        ["sweep", PLATE, "--vary", "load.parameters.R=1k,2k", "--scheduler", "tcp://127.0.0.1:1"],
        "pip install 'piezo-harvester[dask]'",
    ),
    "fmu": (
        ["ziglang"],
        ["export", PLATE, "--fmu", "/nowhere/plate.fmu"],
        "pip install 'piezo-harvester[fmu]'",
    ),
    "tolerance": (
        ["SALib.analyze"],
        [
            "tolerance",
            EXAMPLES / "plate.toml",
            "--vary",
            "oscillator.damping=10%",
            "--samples",
            "256",
        ],
        "pip install 'piezo-harvester[tolerance]'",
    ),
}
ANSWERED = {"tolerance"}  # without these the command answers, and states the missing parts in it
OF_DEVELOPERS = {"test", "docs", "bench"}


@pytest.fixture
def without(monkeypatch):
    """Takes the modules of a part away, and for ngspice the system's library as well."""

    def remove(extra):
        for name in PARTS[extra][0]:
            monkeypatch.setitem(sys.modules, name, None)
        if extra == "ngspice":
            monkeypatch.delenv("NGSPICE_LIBRARY_PATH", raising=False)
            monkeypatch.setattr(this_system, "library", lambda name: None)

    return remove


def test_every_extra_is_here():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    assert set(PARTS) | OF_DEVELOPERS == set(extras)


@pytest.mark.ngspice
@pytest.mark.parametrize("extra", PARTS)
def test_a_part_that_is_missing(harvester, without, extra):
    without(extra)
    _, command, remedy = PARTS[extra]
    status, out, err = harvester(*command)
    if extra in ANSWERED:
        assert (status, out.count(remedy)) == (0, 1)
    else:
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert remedy in err


@pytest.mark.ngspice
def test_without_all_of_them_the_formulas_answer(harvester, without):
    for extra in PARTS:
        without(extra)
    status, out, err = harvester("run", EXAMPLES / "plate.toml", "--engine", "exact", "--json")
    assert (status, err) == (0, "")
    assert '"mean_power"' in out


def test_a_library_that_is_nowhere_is_told_with_its_path(harvester, monkeypatch):
    """The wheel has no library where it is this repository's own folder: then the system's is looked for."""
    monkeypatch.syspath_prepend(ROOT / "packaging/ngspice")
    monkeypatch.delenv("NGSPICE_LIBRARY_PATH")
    from harvester.cosimulation.ngspice.locate_libngspice import code_models, find_library

    monkeypatch.setattr(this_system, "library", lambda name: f"/system/lib{name}.so")
    assert find_library() == "/system/libngspice.so"
    assert code_models(find_library()) == []
    sys.modules.pop("piezo_harvester_ngspice", None)
