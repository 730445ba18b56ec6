"""An interrupted response: what is done survives kill -9 and ^C, and `--resume` ends with the undisturbed answer."""

import contextlib
import dataclasses
import signal
import sqlite3
import subprocess
import sys

import pytest

import harvester as hv
from harvester.errors import InputError
from harvester.studies.frequency_response.response import draw
from harvester.studies.frequency_response.steps import RESPONSE
from harvester.studies.sweep.journal import Journal
from tests.support.bimorph import bimorph
from tests.support.systems import DRIVEN, TWO_MODES, changed, scene

pytestmark = pytest.mark.slow

HARDENING = scene(changed(DRIVEN, alpha=0.1))
KILLED = """
import os, signal, sys
import harvester as hv
from harvester.studies.frequency_response.response import draw

ticks = []

def tick(_):
    ticks.append(1)
    if len(ticks) == 4:
        os.kill(os.getpid(), signal.SIGKILL)

draw(hv.load(sys.argv[1]), "0.9:1.1:3", sys.argv[2], report=tick)
"""


def interrupted(some, sweep, out, engines, after):
    """The line of a response that ^C ends ``after`` so many frequencies."""
    ticks = []

    def tick(_):
        ticks.append(1)
        if len(ticks) == after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        draw(some, sweep, out, engines=engines, report=tick)
    return str(caught.value)


def resumed(some, sweep, out, engines=None):
    """The response that continues, and how many frequencies were computed and kept."""
    computed, kept = [], []
    found = draw(
        some,
        sweep,
        out,
        engines=engines,
        report=computed.append,
        report_reused=kept.append,
        resume=True,
    )
    return found, len(computed), len(kept)


@pytest.mark.thorough("test_what_is_no_step")
def test_killed(tmp_path):
    """Trajectories continue from where the killed program left them: on the way down, of an odd number of points."""
    (tmp_path / "scene.toml").write_text(HARDENING.to_toml())
    out = tmp_path / "out"
    done = subprocess.run(
        [sys.executable, "-c", KILLED, tmp_path / "scene.toml", out], timeout=60, check=False
    )
    assert done.returncode == -signal.SIGKILL and [path.name for path in out.iterdir()] == [
        RESPONSE.file
    ]
    found, computed, kept = resumed(HARDENING, "0.9:1.1:3", out)
    assert (computed, kept) == (2, 4)
    assert found.table.csv() == hv.responses(HARDENING, "0.9:1.1:3").table.csv()
    assert {path.name for path in out.iterdir()} == {
        "response.csv",
        "response.png",
        "provenance.json",
    }


@pytest.mark.thorough("test_what_is_no_step")
@pytest.mark.ngspice
def test_interrupted_with_ngspice(tmp_path):
    """Two engines: that which was done is not computed again, and ngspice continues from the last periodic state."""
    bridge = hv.loads(bimorph('R = "100 kohm", C = "0.3 uF"'))
    engines = ["ideal", "spice"]
    whole = draw(bridge, "44Hz:50Hz:3", tmp_path / "whole", engines=engines)
    out = tmp_path / "out"
    said = interrupted(bridge, "44Hz:50Hz:3", out, engines, 8)
    assert (
        said
        == f"interrupted: 8 of 9 points are in {str(out)!r}; the same command with `resume` continues from there"
    )
    found, computed, kept = resumed(bridge, "44Hz:50Hz:3", out, engines)
    assert (computed, kept) == (1, 8)
    assert found.table.csv() == whole.table.csv()


@pytest.mark.thorough("test_what_is_no_step")
def test_interrupted_with_several_modes(tmp_path):
    """A compiled circuit continues from the coordinates and speeds of all modes, as if nothing had ended it."""
    bridge = hv.loads(TWO_MODES).with_load(netlist="bridge", parameters={"R": "50 kohm"})
    whole = draw(bridge, "46Hz:50Hz:3", tmp_path / "whole", engines=["compiled"])
    out = tmp_path / "out"
    interrupted(bridge, "46Hz:50Hz:3", out, ["compiled"], 2)
    found, computed, kept = resumed(bridge, "46Hz:50Hz:3", out, ["compiled"])
    assert (computed, kept) == (1, 2)
    assert found.table.csv() == whole.table.csv()


def test_another_response_is_refused(harvester, tmp_path):
    """One line, status 2, and what is there stays; without --resume all begins anew."""
    (tmp_path / "scene.toml").write_text(HARDENING.to_toml())
    interrupted(HARDENING, "0.9:1.1:3", tmp_path, None, 1)
    asked = [
        "response",
        str(tmp_path / "scene.toml"),
        "--out",
        str(tmp_path),
        "--resume",
        "--sweep",
    ]
    for more, what in ((["0.9:1.1:4"], "sweep"), (["0.9:1.1:3", "--seed", "2"], "engines")):
        status, _, error = harvester(*asked, *more)
        assert status == 2
        assert error == (
            f"harvester: --resume must continue the same response, but {what} in '{tmp_path}' is another: "
            "use another --out\n"
        )
    assert resumed(HARDENING, "0.9:1.1:3", tmp_path)[1:] == (5, 1)
    assert resumed(HARDENING, "0.9:1.1:3", tmp_path)[1:] == (6, 0)  # its files are whole


@pytest.mark.parametrize(
    "forged",
    [
        lambda step: "{",
        lambda step: "[]",
        lambda step: '{"point": {}}',
        lambda step: step.replace('"frequency":', '"frequenzy":'),
        lambda step: step.replace('"words":', '"worts":'),
        lambda step: step.replace('"words":[[[', '"words":[[[-'),
        lambda step: step.replace('"filter":[[', '"filter":[[7,'),
    ],
)
def test_what_is_no_step(tmp_path, forged):
    """A row whose checksum fits and that still is not a step of this version: one line, no traceback."""
    interrupted(HARDENING, "0.9:1.1:3", tmp_path, None, 1)
    with contextlib.closing(sqlite3.connect(tmp_path / RESPONSE.file)) as database:
        now = dict(database.execute("SELECT what, hash FROM identity"))
    with contextlib.closing(Journal(tmp_path, RESPONSE)) as journal:
        (row,) = journal.earlier(now)
        journal.begin(now, [dataclasses.replace(row, content=forged(row.content))])
    with pytest.raises(
        InputError,
        match=r"^`resume` must find response.journal as it was written, but a step .*version",
    ):
        resumed(HARDENING, "0.9:1.1:3", tmp_path)


@pytest.mark.thorough("test_what_is_no_step")
@pytest.mark.ngspice
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"p":', '"p)=1\\n.control\\nshell touch x\\n.endc\\n*":'),
        ('"turns":1,', '"turns":1000000000,'),
    ],
    ids=["node", "periods"],
)
def test_a_state_that_is_none(tmp_path, old, new):
    """Names of nodes enter a netlist, periods into a run's length: a forged one of either is refused."""
    bridge = hv.loads(bimorph('R = "100 kohm", C = "0.3 uF"'))
    interrupted(bridge, "44Hz:50Hz:3", tmp_path, ["spice"], 1)
    with contextlib.closing(sqlite3.connect(tmp_path / RESPONSE.file)) as database:
        now = dict(database.execute("SELECT what, hash FROM identity"))
    with contextlib.closing(Journal(tmp_path, RESPONSE)) as journal:
        (row,) = journal.earlier(now)
        assert old in row.content
        journal.begin(now, [dataclasses.replace(row, content=row.content.replace(old, new))])
    with pytest.raises(InputError, match="of another version: remove it"):
        resumed(bridge, "44Hz:50Hz:3", tmp_path, ["spice"])
