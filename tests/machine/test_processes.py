"""Worker processes: what starts them may be a thread among several, of a process that is a daemon (as Dask's are)."""

import errno
import gc
import os
import subprocess
import sys
import time
import weakref
from collections import deque
from concurrent.futures.process import BrokenProcessPool

import pytest

from harvester.machine import processes

pytestmark = pytest.mark.slow

THREADS = """
import multiprocessing, threading
from collections import deque
from concurrent.futures.process import BrokenProcessPool
from harvester.machine import processes

multiprocessing.current_process()._config["daemon"] = True
ready, found = threading.Barrier(6), []

def start(number):
    ready.wait()
    process = processes.create()
    found.append(processes.submit_to_one(deque([process]), lambda: process, abs, (-number,))[0].result(60))
    processes.kill(process)

threads = [threading.Thread(target=start, args=(number,)) for number in range(6)]
[one.start() for one in threads]
[one.join() for one in threads]
print(sorted(found), multiprocessing.current_process().daemon)
"""


@pytest.mark.thorough("test_a_process_that_the_system_refuses")
def test_several_threads_start_processes_at_once():
    done = subprocess.run(
        [sys.executable, "-c", THREADS], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.stdout, done.stderr) == ("[0, 1, 2, 3, 4, 5] True\n", "")


@pytest.mark.parametrize("stream", [None, object()])
def test_a_process_starts_without_a_stderr_that_can_be_flushed(monkeypatch, stream):
    monkeypatch.setattr(sys, "stderr", stream)
    future, process = processes.submit_to_one(deque(), processes.create, abs, (-2,))
    assert future.result(60) == 2
    assert sys.stderr is stream
    processes.kill(process)


def test_a_process_that_the_system_refuses(monkeypatch):
    """With too few descriptors left loky has an error of its own, of a variable without a value."""
    process = processes.create()

    def refuse():
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(os, "pipe", refuse)
    with pytest.raises(OSError, match="Too many open files"):
        processes.submit_to_one(deque([process]), processes.create, abs, (-1,))


def alive(count):
    """Thresholds of a process's search for garbage, and how many of so many objects that hold themselves are left."""

    class Own:
        pass

    left = weakref.WeakSet()
    for _ in range(count):
        one = Own()
        one.self = one
        left.add(one)
    return gc.get_threshold(), len(left)


@pytest.mark.thorough("test_a_process_that_the_system_refuses")
def test_a_worker_searches_garbage_rarely_but_searches():
    process = processes.create()
    try:
        (_, *older), left = process.submit(alive, 20_000).result(60)
    finally:
        processes.kill(process)
    assert min(older) > 10  # Python's own
    assert left < 2_000


FORK = """
import os, signal, sys
from harvester.machine import processes

idle = processes.idle_processes()

def compute():
    job, process = processes.submit_to_one(idle, processes.create, abs, (-3,))
    print(job.result(), flush=True)
    idle.append(process)

compute()
child = os.fork()
if child == 0:
    signal.alarm(60)
    compute()
    sys.exit()
print(os.waitpid(child, 0)[1], flush=True)
compute()
"""


@pytest.mark.thorough("test_a_process_that_the_system_refuses")
def test_a_forked_program_starts_processes_of_its_own():
    """Those of its parent never answered it: it waited for ever, and ended with a traceback."""
    done = subprocess.run(
        [sys.executable, "-c", FORK], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.stdout, done.stderr) == ("3\n3\n0\n3\n", "")


FORK_BESIDE = """
import os, sys, time
from harvester.cosimulation import worker_pool

worker_pool.worker_count = lambda: 2
with worker_pool.ahead((time.sleep, (1.0,))) as job:
    assert job is not None
child = os.fork()
if child == 0:
    sys.exit()
print(os.waitpid(child, 0)[1], job.result())
"""


def test_a_forked_program_leaves_the_process_that_compiles_ahead_to_its_parent():
    """The end of the forked one had a traceback: it is not a child of its own that it would end."""
    done = subprocess.run(
        [sys.executable, "-c", FORK_BESIDE],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert (done.stdout, done.stderr) == ("0 None\n", "")


def test_a_process_that_dies_after_another_went_idle_is_noticed():
    """The next job of an executor whose process ended for want of work starts one that nobody looked at."""
    process = processes.create(idle=0.1)
    assert (
        processes.submit_to_one(deque([process]), processes.create, abs, (-1,))[0].result(60) == 1
    )
    deadline = time.monotonic() + 30.0
    while process._processes and time.monotonic() < deadline:
        time.sleep(0.05)
    future, _ = processes.submit_to_one(deque([process]), processes.create, os._exit, (3,))
    with pytest.raises(BrokenProcessPool):
        future.result(30)


SLOW_TO_END = """
import atexit, time
from harvester.machine import processes

idle = processes.idle_processes()
future, process = processes.submit_to_one(idle, processes.create, lambda: atexit.register(time.sleep, 60) and None, ())
future.result(60)
idle.append(process)
print("done", flush=True)
"""


def test_a_program_waits_for_no_idle_process():
    """A process that nobody needs any more is ended, however long its own end would last."""
    line = [sys.executable, "-c", SLOW_TO_END]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout.readline() == "done\n"
        begin = time.monotonic()
        assert program.wait(90) == 0
    assert time.monotonic() - begin < 30.0


TRACKER = """
import os, signal, warnings
from collections import deque
from loky.backend import resource_tracker
from harvester.machine import processes

warnings.simplefilter("ignore")  # as the command line does

def answer(number):
    process = processes.create()
    found = processes.submit_to_one(deque([process]), lambda: process, abs, (-number,))[0].result(60)
    processes.kill(process)
    return found

def begin():
    process = processes.create()
    return process, processes.submit_to_one(deque([process]), lambda: process, abs, (-1,))[0]

process, job = begin()
job.result(60)
for _ in range(2):  # of the first, and of the one that took its place
    os.kill(resource_tracker._resource_tracker._pid, signal.SIGKILL)
    print(answer(2))
print(processes.submit_to_one(deque([process]), lambda: process, abs, (-3,))[0].result(60))
processes.kill(process)
"""


def test_a_tracker_that_is_killed_costs_no_word():
    """The next one does not know the semaphores of before, and had a traceback for each of them."""
    done = subprocess.run(
        [sys.executable, "-c", TRACKER], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.stdout, done.stderr) == ("2\n2\n3\n", "")
