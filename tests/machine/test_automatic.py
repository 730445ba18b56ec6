"""The bar of functions that are called from Python: on a terminal, if the work lasts, and nowhere else."""

import io
import os
import pty
import subprocess
import sys
import threading
import time

import pytest

import harvester as hv
from harvester.machine import automatic
from harvester.machine.automatic import AutomaticProgress, reporting
from harvester.machine.bars import Bar
from tests.support.paths import ROOT
from tests.support.screen import left_on_screen

LASTING = """
import time
import harvester as hv
from harvester.machine.automatic import AUTOMATIC, reporting
from harvester.machine.progress import NO_PROGRESS, working

def work(step, seconds):
    for k in range(1, 5):
        time.sleep(0.25 * seconds)
        step(0.25 * k)

with reporting({progress}, "lasting") as report:
    work(report or (lambda _: None), {seconds})
with working(hv.Execution(progress={study}).progress) as study:
    work(study.step, {seconds})
execution = hv.Execution(progress={study}).progress
execution.start(4, "exact")
execution.start(4, "spice")
for name in ("exact", "spice") * 4:
    time.sleep({seconds} / 8.0)
    execution.step(1, name)
execution.close()
"""


def on_terminal(seconds, progress="None", study="True"):
    """What a script shows on its terminal."""
    reader, writer = pty.openpty()
    script = LASTING.format(seconds=seconds, progress=progress, study=study)
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stderr=writer, cwd=ROOT) as process:
        os.close(writer)
        parts = []
        while True:
            try:
                part = os.read(reader, 4096)
            except OSError:  # the end of a terminal that nobody writes on
                break
            if not part:
                break
            parts.append(part)
    os.close(reader)
    assert process.returncode == 0
    return b"".join(parts).decode()


@pytest.mark.slow
def test_work_that_lasts_shows_the_time_that_is_left():
    shown = on_terminal(2.4)
    assert "lasting:" in shown and "harvester:" in shown and "spice" in shown
    assert "50%" in shown and " left" in shown


@pytest.mark.slow
@pytest.mark.parametrize("reports", [True, False])
def test_the_bar_leaves_the_screen_at_the_end(reports):
    """Also if the work reported nothing, so that the clock alone has drawn it."""
    screen = io.StringIO()
    bar = Bar("lasting", file=screen, delay=0.1, disable=False)
    time.sleep(0.3)
    if reports:
        bar.step(0.5)
    time.sleep(0.6)
    bar.close()
    assert "lasting" in screen.getvalue()
    assert left_on_screen(screen.getvalue()) == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "options"), [(0.2, {}), (1.6, {"progress": "False", "study": "False"})]
)
def test_short_work_and_silenced_work_show_nothing(seconds, options):
    assert on_terminal(seconds, **options) == ""


def test_nobody_is_told_of_work_on_a_pipe(monkeypatch):
    """Nor in a thread; a callback is called anyway."""
    told = []
    with reporting(told.append, "run") as report:
        report(0.5)
    assert told == [0.5]
    with reporting(None, "run") as report:
        assert report is None
    monkeypatch.setattr(automatic, "is_in_notebook", lambda: True)
    shown = [automatic.shows_bars()]
    thread = threading.Thread(target=lambda: shown.append(automatic.shows_bars()))
    thread.start()
    thread.join()
    assert shown == [True, False]


def test_a_study_in_a_study_leaves_the_bar_alone(monkeypatch, capsys):
    """Its rows are not those of the outer one, and its end does not close the bar."""
    monkeypatch.setattr(automatic, "is_in_notebook", lambda: True)
    monkeypatch.setattr(automatic, "DELAY", 0.0)
    progress = AutomaticProgress()
    progress.start()
    progress.step(0.5, "outer")
    progress.start(4, "exact")
    progress.start(4, "spice")
    progress.step(1, "exact")
    progress.close()
    progress.step(0.75, "outer")
    assert progress._bar.last[1] == 0.75
    progress.close()
    assert progress._bar is None
    assert "harvester:" in capsys.readouterr().err


def test_a_sentence_within_a_study_is_a_line_above_its_bar(monkeypatch, capsys):
    """It begins nothing: the bar continues, ends with the study, and the next study has one."""
    monkeypatch.setattr(automatic, "is_in_notebook", lambda: True)
    monkeypatch.setattr(automatic, "DELAY", 0.0)
    progress = AutomaticProgress()
    progress.start()
    progress.start(what="12 of 20 places fit")
    progress.step(0.5, "bridge")
    assert progress._bar.last[1] == 0.5
    progress.close()
    assert progress._bar is None
    assert "harvester: 12 of 20 places fit" in capsys.readouterr().err
    progress.start()
    assert progress._bar is not None
    progress.close()


class OnlyWritten:
    """A stream that can be written on, and nothing else."""

    def write(self, text):
        return len(text)


CLOSED = io.StringIO()
CLOSED.close()


@pytest.mark.parametrize("stream", [None, OnlyWritten(), CLOSED])
def test_a_stderr_that_is_no_terminal_shows_no_bar(monkeypatch, stream):
    monkeypatch.setattr(sys, "stderr", stream)
    assert not automatic.shows_bars()
    with reporting(None, "run") as report:
        assert report is None


RANGE = {"load.resistance": "100k:1M"}


@pytest.mark.parametrize(
    ("study", "options"),
    [
        ("sweep", {"vary": {"load.resistance": "100k:1M:2"}, "engines": ["exact"]}),
        ("optimise", {"vary": RANGE, "engine": "exact"}),
        ("compare", {"engines": ["exact"]}),
    ],
)
def test_the_bar_of_a_study_has_its_name(study, options, monkeypatch):
    """It was "harvester" for every study that is called from Python; afterwards the name is free again."""
    names = []
    monkeypatch.setattr(automatic, "shows_bars", lambda: True)
    monkeypatch.setattr(AutomaticProgress, "_open", lambda self, *_: names.append(self.what))
    getattr(hv, study)(ROOT / "examples" / "plate.toml", **options)
    assert names == [study]
    assert automatic.AUTOMATIC.what == ""


WAITED_FOR = {
    "node": lambda told: hv.node("examples/bimorph_packets.toml", progress=told),
    "extremes": lambda told: hv.extremes(
        "examples/plate_with_stop.toml", lifetime="1 day", progress=told
    ),
    "identify": lambda told: hv.identify("examples/bench_impedance.csv", progress=told),
    "charge": lambda told: hv.charge(
        "examples/bimorph_board.toml", "3 V", engine="slow", progress=told
    ),
    "slow": lambda told: hv.Slow().run(hv.load("examples/bimorph_ltc3588.toml"), told),
    "burn-in": lambda told: hv.Ensemble(trajectories=64).run("examples/plate.toml", told),
    "response": lambda told: hv.response(
        "examples/plate_harmonic_stop.toml", "3Hz:4Hz:3", progress=told
    ),
}


@pytest.mark.ngspice
@pytest.mark.parametrize("name", WAITED_FOR)
def test_work_reports_its_share_from_early_on(name):
    """Several shares, the first of them small."""
    told = []
    WAITED_FOR[name](told.append)
    assert 0.0 <= told[0] < 0.5 and told[-1] <= 1.0
    assert name == "identify" or len(told) >= 3
