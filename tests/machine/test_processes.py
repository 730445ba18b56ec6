"""Worker processes: what starts them may be a thread among several, of a process that is a daemon (as Dask's are)."""

import errno
import os
import subprocess
import sys
from collections import deque

import pytest

from harvester.machine import processes

pytestmark = pytest.mark.slow

THREADS = """
import multiprocessing, threading
from collections import deque
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


def test_several_threads_start_processes_at_once():
    done = subprocess.run([sys.executable, "-c", THREADS], capture_output=True, text=True, check=False, timeout=120)
    assert (done.stdout, done.stderr) == ("[0, 1, 2, 3, 4, 5] True\n", "")


def test_a_process_that_the_system_refuses(monkeypatch):
    """With too few descriptors left loky has an error of its own, of a variable without a value."""
    process = processes.create()

    def refuse():
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(os, "pipe", refuse)
    with pytest.raises(OSError, match="Too many open files"):
        processes.submit_to_one(deque([process]), processes.create, abs, (-1,))
