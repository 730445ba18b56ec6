"""Runs in the background: their answer is that of the command line, and a cancelled one leaves no process."""

import os
import queue
import time
from pathlib import Path

import pytest

import harvester as hv
from harvester.explore import in_worker
from harvester.explore.computing import at_place
from harvester.explore.draft import Draft, first
from harvester.explore.runs import Background
from tests.support.paths import EXAMPLES

pytestmark = pytest.mark.slow


def last(told):
    """The last that a run states, and all before."""
    said = []
    while not said or "fraction" in said[-1]:
        said.append(told.get(timeout=60))
    return said.pop(), said


BALL = {"mass": "2 g", "room": "0.4 mm", "restitution": 0.7, "tilt": 30}


@pytest.mark.parametrize(
    "ball", [None, pytest.param(BALL, marks=pytest.mark.thorough("test_the_answer_is_the_engines"))]
)
def test_the_answer_is_the_engines(ball):
    """With a ball as well, which has no sliders."""
    told = queue.Queue()
    draft = first()
    if ball is not None:
        draft = Draft(draft.scene().replace(stop=None, ball=hv.Ball(**ball)))
    Background(draft.tables(), "ensemble", "5%", told.put)
    answer, before = last(told)
    own = hv.run(draft.scene(), "ensemble", within=0.05)
    assert answer["answer"]["mean_power"]["value"] == pytest.approx(own.mean_power.value, rel=1e-12)
    assert "ensemble" in answer["row"]
    assert all(0.0 <= one["fraction"] <= 1.0 for one in before)


def test_an_error_is_one_line():
    """Errors of the scene, of the engine, and of a process that cannot speak."""
    told = queue.Queue()
    draft = first()
    draft.choose("bridge")
    Background(draft.tables(), "averaged", "5%", told.put)
    assert "needs a load resistance" in last(told)[0]["error"]
    Background({"oscillator": {"mass": "heavy"}}, "ensemble", "5%", told.put)
    assert "oscillator.mass must be a mass" in last(told)[0]["error"]


def on_ngspice():
    """A run that starts workers, which share semaphores."""
    draft = first()
    draft.choose("bridge")
    return draft.tables(), "spice", "1%"


@pytest.mark.thorough("test_the_answer_is_the_engines")
@pytest.mark.parametrize(
    "started", [(first().tables(), "ensemble", "0.01%"), on_ngspice()], ids=["ensemble", "spice"]
)
@pytest.mark.ngspice
def test_cancel_kills_all(started):
    """The run and what it started end at once, and leave nothing that they shared."""
    told = queue.Queue()
    run = Background(*started, told.put)
    said = told.get(timeout=60)  # it is at work
    assert "fraction" in said
    begin = time.monotonic()
    run.cancel()
    assert last(told)[0] == {"cancelled": True}
    assert time.monotonic() - begin < 3.0
    assert not list(Path("/dev/shm").glob(f"*loky-{run.group}-*"))
    with pytest.raises(ProcessLookupError):
        os.killpg(run.group, 0)


@pytest.mark.ngspice
def test_a_board_with_a_store_has_a_curve():
    """The powers along the load, and that of the board itself when the sliders rest, within their errors."""
    tables = Draft.read(EXAMPLES / "bimorph_board.toml").tables()
    key = "load.parameters.R"
    coarse = [
        in_worker.power(at_place(tables, key, load), *in_worker.COARSE) for load in (3e3, 1e4, 3e4)
    ]
    assert {answer["engine"] for answer in coarse} == {"slow"}
    powers = [answer["answer"]["mean_power"] for answer in coarse]
    assert len({power["value"] for power in powers}) == 3
    fine = in_worker.power(tables, *in_worker.FINE)["answer"]["mean_power"]
    most = powers[1]["model_bias"] + fine["error95"]
    assert abs(powers[1]["value"] - fine["value"]) < most < 0.1 * fine["value"]
