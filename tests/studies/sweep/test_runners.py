"""The same answers whoever computes them; a worker that dies costs its point one try, and the sweep nothing."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import pytest

import harvester as hv
from harvester.engines.protocol import Engine, Progress
from harvester.errors import InputError, SimulationError
from harvester.machine.cores import THREADS_VARIABLE, cores, limited_environment
from harvester.presentation import plot
from harvester.studies.sweep import compute, runners, shared_budget, tasks
from harvester.studies.sweep.cluster import dask_client
from harvester.studies.sweep.points import grid, read_axis
from harvester.studies.sweep.shared_budget import SharedBudget
from harvester.studies.sweep.tasks import Task
from tests.support.bimorph import bimorph
from tests.support.paths import EXAMPLES
from tests.support.sweeps import swept, telling

pytestmark = [pytest.mark.ngspice, pytest.mark.slow]

PLATE = hv.load(EXAMPLES / "plate.toml")
LOADS = read_axis("load.resistance=100k:1M:6")
ENGINES = [
    hv.Averaged(),
    hv.Ensemble(trajectories=300, duration=5.0),
    hv.Spice(trajectories=2, duration=5.0, alone=True, dt=0.01),
]


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    monkeypatch.setattr(plot, "save", lambda *_: None)


def bare(table):
    return [replace(row, seconds=None) for row in table.rows]


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """In this process, one point after the other."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(plot, "save", lambda *_: None)
        rows = bare(
            swept(PLATE, [LOADS], engines=ENGINES, out=tmp_path_factory.mktemp("here"), workers=1)
        )
    assert [row.error for row in rows] == [""] * 18
    return rows


@pytest.mark.thorough("test_tasks_are_whole_batches")
def test_a_pool_gives_the_same(tmp_path, expected):
    """Three processes, whatever the machine has; ngspice in processes of theirs; nothing is left of any."""
    told = []
    table = swept(
        PLATE, [LOADS], engines=ENGINES, out=tmp_path, workers=3, progress=telling(told.append)
    )
    assert bare(table) == expected
    assert sorted(told) == sorted(row.engine for row in expected)
    end = time.monotonic() + 10
    while children() and time.monotonic() < end:
        time.sleep(0.05)
    assert children() == []


def children():
    """Processes of this one that loky started for a pool (its idle ngspice processes stay a minute)."""
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            mine = (
                int((path.parent / "stat").read_text().rpartition(")")[2].split()[1]) == os.getpid()
            )
            if mine and f"{THREADS_VARIABLE}=".encode() in path.read_bytes():
                found.append(int(path.parent.name))
        except OSError:
            continue
    return found


@pytest.mark.thorough("test_tasks_are_whole_batches")
def test_an_executor_that_is_handed_over_gives_the_same(expected):
    """Any of concurrent.futures: here two processes that Python starts; one that has ended is reported so."""
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as executor:
        assert bare(swept(PLATE, [LOADS], engines=ENGINES[:2], executor=executor)) == [
            row for row in expected if row.engine != "spice"
        ]
    with pytest.raises(
        SimulationError, match=r"^the executor has disappeared: start another, and `resume`$"
    ):
        swept(PLATE, [LOADS], engines=ENGINES[:1], executor=executor)


@pytest.mark.thorough("test_tasks_are_whole_batches")
def test_dask_gives_the_same(tmp_path, expected, monkeypatch):
    """A worker of two threads, whose process is a daemon that may have no children, but has ngspice's all the same.

    A sweep whose workers all end is an error, and does not wait for ever.
    """
    pytest.importorskip("distributed")
    dask = str(Path(sys.executable).with_name("dask"))
    file = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    where = ["--scheduler-file", str(file), "--no-dashboard"]
    ran = [
        subprocess.Popen([dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *where], **quiet)
    ]
    ran.append(subprocess.Popen([dask, "worker", *where, "--nthreads", "2"], **quiet))
    try:
        end = time.monotonic() + 30
        while not file.exists() and time.monotonic() < end:
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        with dask_client(address) as client:
            table = swept(PLATE, [LOADS], engines=ENGINES, out=tmp_path / "out", executor=client)
            monkeypatch.setattr(runners, "PATIENCE", 5.0)
            many = {
                "vary": {"load.resistance": "100k:1M:500"},
                "engines": [hv.Ensemble(trajectories=2000)],
            }
            with pytest.raises(
                SimulationError, match="has lost all its workers: start some, and `resume`"
            ):
                swept(
                    PLATE, **many, executor=client, progress=telling(lambda _: ran[1].terminate())
                )
    finally:
        for one in reversed(ran):
            one.terminate()
            one.wait(30)
    assert bare(table) == expected


@pytest.mark.parametrize(
    "address", ["", "nonsense", "tcp://me:secret@127.0.0.1:1", "tcp://nowhere.invalid:80"]
)
def test_no_scheduler(address):
    """Without the password that it was given, as others read the log of a cluster's jobs."""
    pytest.importorskip("distributed")
    must = r"^`scheduler` must be the address of a Dask scheduler that answers"
    with pytest.raises(InputError, match=must) as told, dask_client(address):
        pass
    assert "secret" not in str(told.value)


@pytest.mark.parametrize("workers", [0, -1, 1001])
def test_no_workers(tmp_path, workers):
    with pytest.raises(
        InputError, match=f"^`workers` must be between 1 and 1000, but is {workers}$"
    ):
        swept(PLATE, [LOADS], engines=ENGINES, out=tmp_path / "out", workers=workers)
    assert not (tmp_path / "out").exists()


@dataclass(frozen=True)
class Deadly(Engine):
    """An engine whose process dies at the loads below ``limit``: always, or where ``once`` is a folder, once."""

    limit: float
    once: str = ""
    NAME: ClassVar[str] = "published"

    def run(self, scene: hv.Scene, progress: Progress | None = None) -> hv.Estimate:
        load = scene.load.resistance
        if load < self.limit and not (self.once and (Path(self.once) / repr(load)).exists()):
            if self.once:
                (Path(self.once) / repr(load)).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return hv.Published().run(scene)


@dataclass(frozen=True)
class DeadlyMany(Deadly):
    """One that answers many scenes at once, and dies at one of them."""

    NAME: ClassVar[str] = "averaged"
    is_formula: ClassVar[bool] = True

    def run_many(self, scenes):
        for scene in scenes:
            self.run(scene)
        return hv.Averaged().run_many(scenes)


@pytest.mark.thorough("nothing: a worker process is killed")
def test_a_worker_that_dies_is_tried_again(tmp_path):
    """Once: nobody notices.  Always: that point is an error, and the others of its batch are not."""
    expected = bare(
        swept(
            PLATE, [LOADS], engines=[hv.Published(), hv.Averaged()], out=tmp_path / "a", workers=1
        )
    )
    (tmp_path / "once").mkdir()
    first = LOADS.values[0]
    deadly = [Deadly(1.1 * first, str(tmp_path / "once")), DeadlyMany(1.1 * first)]
    table = swept(PLATE, [LOADS], engines=deadly, out=tmp_path / "b", workers=2)
    assert [p.name for p in (tmp_path / "once").iterdir()] == [repr(first)]
    lost = next(row for row in table.rows if row.engine == "averaged")
    assert lost.error == tasks.LOST
    place = table.rows.index(lost)
    found = bare(table)
    assert found[:place] + found[place + 1 :] == expected[:place] + expected[place + 1 :]


class Broken(Deadly):
    def run(self, scene, progress=None):
        raise ZeroDivisionError("division by\nzero")


def test_a_defect_of_ours_is_a_row(tmp_path, monkeypatch):
    monkeypatch.delenv("HARVESTER_TRACEBACK", raising=False)
    with pytest.raises(
        SimulationError, match=r"^internal error, please report it: ZeroDivisionError"
    ):
        swept(PLATE, [LOADS], engines=[Broken(0.0)], out=tmp_path, workers=1)
    assert len((tmp_path / "sweep.csv").read_text().splitlines()) == 7  # each row one line


def test_tasks_are_whole_batches():
    """Also if some of a batch are done: its answers' last digits depend on the batch."""
    points = grid([read_axis("load.resistance=1k:1M:600")])
    done = {(k, 0) for k in range(256)} | {(300, 0), (5, 1)}
    asked = list(
        tasks.tasks(PLATE, points, [hv.Averaged(), hv.Ensemble()], lambda p, e: (p, e) not in done)
    )
    assert [t.points for t in asked if t.engine_index == 0] == [
        tuple(range(256, 512)),
        tuple(range(512, 600)),
    ]
    assert [t.points for t in asked if t.engine_index == 1] == [
        (k, k + 1) for k in range(0, 600, 2)
    ]
    assert all(t.values == tuple(points.values(p) for p in t.points) for t in asked)


def test_the_first_call_of_many_points_is_a_short_one():
    """The bar knows the time for all of them after two points, not after a whole call."""
    scene = hv.load("examples/plate_with_stop.toml")
    points = grid([read_axis("load.resistance=1k:1M:40")])
    asked = [
        t.points for t in tasks.tasks(scene, points, [hv.Ensemble(within="0.1%")], lambda *_: True)
    ]
    sizes = [len(numbers) for numbers in asked]
    assert sizes[0] == 2 and sizes[0] + sizes[1] == sizes[2] > 4
    assert sum(asked, ()) == tuple(range(40))


@pytest.mark.thorough("test_resume_computes_what_is_missing_or_failed")
def test_an_interrupted_sweep_along_loads_ends_with_the_same_answers(tmp_path):
    """Answers along loads depend on where they begin: always at the same ones, whatever is done already, and by whom.

    Two processes, each with an ngspice of its own, here; later one, with ngspice in others.
    """
    scene = hv.loads(bimorph('R = "100 kohm", C = "10 uF"', "1 g", "45.6 Hz"))
    points = grid([read_axis("load.parameters.R=90k:125k:8")])
    shared = [t.points for t in tasks.tasks(scene, points, [hv.Spice()], lambda p, e: p != 3)]
    assert shared == [(0, 1), (2, 3, 4, 5, 6), (7,)]
    whole = swept(scene, points, engines=[hv.Spice()], out=tmp_path / "a", workers=2)
    told = []

    def interrupt(name):
        told.append(name)
        if len(told) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        swept(
            scene,
            points,
            engines=[hv.Spice()],
            out=tmp_path / "b",
            workers=1,
            progress=telling(interrupt),
        )
    again = swept(scene, points, engines=[hv.Spice()], out=tmp_path / "b", workers=1, resume=True)
    assert bare(again) == bare(whole)
    assert all(row.mean_power.bias < 1e-3 * row.mean_power.value for row in whole.rows)


def test_few_points_are_not_worth_a_process(tmp_path, monkeypatch):
    monkeypatch.setattr(runners, "pool", None)
    monkeypatch.setattr(compute, "pool", None)
    assert len(swept(PLATE, [LOADS], engines=[hv.Averaged()], out=tmp_path).rows) == 6


def test_cores(monkeypatch):
    monkeypatch.delenv(THREADS_VARIABLE, raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert cores() == 4
    for text, expected in (("1", 1), ("3", 3), ("9", 4), ("", 4), ("0", 4), ("x", 4), ("-1", 4)):
        monkeypatch.setenv(THREADS_VARIABLE, text)
        assert cores() == expected
    assert limited_environment(2)[THREADS_VARIABLE] == "2"
    assert limited_environment(2)["OPENBLAS_NUM_THREADS"] == "1"


@pytest.mark.parametrize(
    ("rows", "beyond", "answered"), [(12, 0.0, 12), (12, 2.0, 12), (12, 10.0, 5), (1, 50.0, 1)]
)
def test_a_budget_holds_for_all_rows(monkeypatch, rows, beyond, answered):
    """Rows of 60 s in all that use what they are given and more: they end in time, but for one; some are left out."""
    clock = [1000.0]
    monkeypatch.setattr(shared_budget, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    shared = SharedBudget(60.0, rows, 1)
    todo = [Task(PLATE, hv.Ensemble(budget=60.0), 0, (), (point,), ((),)) for point in range(rows)]

    def compute():
        for task in shared.share(iter(todo)):
            clock[0] += 0.0 if task.left_out else task.engine.budget + beyond
            yield task, [SimulationError("a made-up one")]

    done = [task for task, _ in shared.watch(compute())]
    assert sum(task.left_out is None for task in done) == answered
    assert clock[0] - 1000.0 <= 60.0 + beyond + 1e-9
    assert clock[0] - 1000.0 >= 50.0


def test_a_point_that_a_budget_leaves_out_says_so():
    """Without time nothing is computed, and each row has the reason."""
    with pytest.raises(
        SimulationError, match=r"left out, as the `budget` of 1e-09 s for the whole sweep was spent"
    ):
        compute.compute_table(PLATE, grid([LOADS]), [hv.Ensemble()], budget=1e-9)
