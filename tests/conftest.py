"""The shared parts of all tests: the command line as a fixture, and a guard that keeps the marker `ngspice` true."""

import contextlib
import gc
import os
import signal
import sys
from unittest import mock

import pytest

import harvester as hv
from harvester.machine.cores import ONE_THREAD
from harvester.machine.imports import search_garbage_rarely
from harvester.machine.processes import kill
from tests.support.judge import asked

os.environ.update(ONE_THREAD)  # as the program does, before NumPy is loaded
os.environ["NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING"] = "1"  # of overloads that do not fit
gc.disable()  # while tests are collected
if (
    signal.getsignal(signal.SIGINT) is signal.SIG_IGN
):  # as in the background of a script: programs must hear their ^C
    signal.signal(signal.SIGINT, signal.default_int_handler)

LIBRARY = "NGSPICE_LIBRARY_PATH"
NOWHERE = "/this test lacks the marker ngspice"
ATTEMPTS = pytest.StashKey[list]()


@pytest.fixture
def harvester():
    """The command line, run in this process: arguments -> exit status, stdout, stderr."""
    return asked


@pytest.hookimpl(trylast=True)
def pytest_collection_finish():
    """Python's search for garbage begins here, and leaves out what is there until the end: libraries, and tests."""
    gc.collect()
    gc.freeze()
    search_garbage_rarely()
    gc.enable()


@contextlib.contextmanager
def without_workers():
    """Keep the idle workers of tests with the marker, which have found ngspice, for those; a test's own end with it."""
    name = "harvester.cosimulation.worker_pool"
    kept = [*sys.modules[name].idle_workers] if name in sys.modules else []
    if kept:
        sys.modules[name].idle_workers.clear()
    try:
        yield
    finally:
        if name in sys.modules:
            pool = sys.modules[name]
            for process in (*pool.idle_workers, *(ahead for ahead, _ in pool.workers_ahead)):
                kill(process)
            pool.workers_ahead.clear()
            pool.idle_workers.clear()
            pool.idle_workers.extend(kept)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Without the marker a test finds no ngspice: not here, not in fixtures of any scope, not in programs it starts."""
    attempts = item.stash[ATTEMPTS] = []
    if item.get_closest_marker("ngspice"):
        return (yield)
    made = hv.MissingProgramError.__init__

    def noted(error, *args):
        attempts.extend(str(one) for one in args if NOWHERE in str(one))
        made(error, *args)

    with (
        mock.patch.dict(os.environ, {LIBRARY: NOWHERE}),
        mock.patch.object(hv.MissingProgramError, "__init__", noted),
        without_workers(),
    ):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    """A test that mistakes the missing ngspice for an answer fails as well."""
    done = yield
    if item.stash[ATTEMPTS]:
        pytest.fail("this test looks for ngspice, so it must have the marker `ngspice`")
    return done
