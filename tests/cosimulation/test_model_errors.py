"""A model that raises, ends the program or is not compiled: one error with the model's line."""

import subprocess
import sys
import threading
import traceback
from typing import NamedTuple

import pytest

import harvester as hv
from harvester.cosimulation import Coil, cosimulate
from tests.support.models import Motion

COIL = Coil(coupling=10.0)
HERE = r"\(test_model_errors\.py, line \d+\)"


class Raising:
    """An oscillator one of whose functions raises ``error``, at once or after some steps."""

    def __init__(self, error, where, below):
        self.error, self.where, self.below = error, where, below

    def check(self, where, s):
        if where == self.where and s.x < self.below:
            raise self.error

    def drift(self, s, h):
        self.check("drift", s)
        return Motion(s.x + h * s.v, s.v)

    def kick(self, s, h, reaction, noise):
        self.check("kick", s)
        return Motion(s.x, s.v - h * (300.0 * s.x + reaction) / 0.02)

    def source(self, s):
        self.check("source", s)
        return s.v


def run(model, **options):
    return cosimulate(model, "bridge", COIL, Motion(1e-3, 0.0), "0.1 s", "1 ms", **options)


class OfTwo(Exception):
    """An exception that no process can hand to another one."""

    def __init__(self, first, second):
        super().__init__(first)
        self.second = second


ENDS = [SystemExit(3), KeyboardInterrupt(), GeneratorExit(), StopIteration(3)]


@pytest.mark.parametrize("error", [*ENDS, OfTwo("a", "b")], ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("where", ["drift", "kick", "source"])
def test_what_ends_programs_is_an_error_of_the_model(error, where):
    """At the first call, in the user's process: a notebook ended with the model's `sys.exit`."""
    words = rf"^`model\.{where}` must give its numbers, but raises {type(error).__name__}.*{HERE}$"
    with pytest.raises(hv.InputError, match=words):
        run(Raising(error, where, 1.0))


def test_an_interrupt_of_the_user_s_stays_one():
    """^C while a function of the model works, rather than `raise KeyboardInterrupt` in it."""

    class Slow(Raising):
        def drift(self, s, h):
            import signal

            signal.raise_signal(signal.SIGINT)
            return s

    with pytest.raises(KeyboardInterrupt):
        run(Slow(None, "", 0.0))


@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize("where", ["drift", "kick", "source"])
@pytest.mark.parametrize("error", ENDS, ids=lambda error: type(error).__name__)
def test_the_same_on_the_way(error, where):
    """In the worker: ctypes printed the exception, the run continued, and "did not converge"."""
    words = rf"^`model\.{where}` must give its numbers, but raises {type(error).__name__}.*{HERE}$"
    with pytest.raises(hv.InputError, match=words):
        run(Raising(error, where, 5e-4))


@pytest.mark.ngspice
@pytest.mark.slow
def test_an_exception_comes_through_with_the_line_and_without_the_worker_s_traceback():
    """It keeps its type; from the worker's traceback, 50 lines and more, it has the model's line."""
    with pytest.raises(ValueError, match="boom") as told:
        run(Raising(ValueError("boom"), "kick", 5e-4))
    text = "".join(traceback.format_exception(told.value))
    assert "raised by `model.kick` (test_model_errors.py, line " in text
    assert "_RemoteTraceback" not in text
    assert len(text.splitlines()) < 40


def positive(x):
    if x < 5e-4:
        raise ValueError("too small")
    return x


class Compiled(NamedTuple):
    """The same model, compiled, whose drift calls a function that raises."""

    k: float = 300.0

    def drift(self, s, h):
        return Motion(positive(s.x) + h * s.v, s.v)

    def kick(self, s, h, reaction, noise):
        return Motion(s.x, s.v - h * (self.k * s.x + reaction) / 0.02)

    def source(self, s):
        return s.v


@pytest.mark.ngspice
@pytest.mark.slow
def test_a_compiled_model_that_raises_gives_no_answer(capfd):
    """Its exception was printed by the worker, and a model that was at rest was the answer."""
    with pytest.raises(ValueError, match="too small") as told:
        run(Compiled())
    assert any("(test_model_errors.py, line " in note for note in told.value.__notes__)
    assert capfd.readouterr().err == ""


class Mixed(Compiled):
    """numba cannot compile it."""

    def kick(self, s, h, reaction, noise):
        return Motion({"a": s.x, 1: 2.0}["a"], s.v)


class Unknown(Compiled):
    """A name that is not defined, on a branch that the first call does not enter."""

    def kick(self, s, h, reaction, noise):
        return Motion(s.x, s.v if s.x < 1.0 else undefined(s.v))  # noqa: F821


@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "why"), [(Mixed, f".*{HERE}"), (Unknown, "NameError: name 'undefined' .*")]
)
def test_a_model_that_is_not_compiled_is_named_with_its_line(kind, why):
    """Or, if numba does not report the line, with the name that it does not know."""
    words = rf"^`model` must be such that numba compiles it, but {kind.__name__} is not: {why} "
    with pytest.raises(hv.InputError, match=words) as told:
        run(kind())
    assert "\n" not in str(told.value)
    assert len("".join(traceback.format_exception(told.value)).splitlines()) < 40


class WithLock(Raising):
    """What it has cannot be handed to another process."""

    def __init__(self):
        super().__init__(None, "", 0.0)
        self.lock = threading.Lock()


@pytest.mark.ngspice
def test_a_model_that_no_process_can_have():
    words = r"^`model` and `start` must be such that .* to another one, but WithLock is not: "
    with pytest.raises(hv.InputError, match=words):
        run(WithLock())


@pytest.mark.ngspice
@pytest.mark.slow
def test_a_model_that_ends_its_process(tmp_path):
    """By `os._exit`, which nothing can catch: one HarvesterError, and nothing on stderr."""
    (tmp_path / "mine.py").write_text(MINE)
    call = [sys.executable, "mine.py"]
    done = subprocess.run(
        call, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.stdout.splitlines()[-1] == "CircuitError one line"
    assert done.stderr == ""


MINE = """
import os
from typing import NamedTuple

import harvester as hv
from harvester.cosimulation import Coil, cosimulate


class State(NamedTuple):
    x: float
    v: float


class Mine:
    def drift(self, s, h):
        if s.x < 5e-4:
            os._exit(0)
        return State(s.x + h * s.v, s.v)

    def kick(self, s, h, reaction, noise):
        return State(s.x, s.v - h * (300.0 * s.x + reaction) / 0.02)

    def source(self, s):
        return s.v


if __name__ == "__main__":
    try:
        cosimulate(Mine(), "bridge", Coil(coupling=10.0), State(1e-3, 0.0), "0.1 s", "1 ms")
    except hv.HarvesterError as error:
        print(type(error).__name__, "one line" if "\\n" not in str(error) else "more")
"""
