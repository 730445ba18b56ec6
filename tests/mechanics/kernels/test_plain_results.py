"""^C in a kernel that is called from Python is a KeyboardInterrupt."""

import signal
import subprocess
import sys
from typing import NamedTuple

import pytest

from harvester.mechanics.kernels.compiled import kernel
from tests.support.paths import EXAMPLES

PATH = f"""
import os, signal, threading
import numpy as np
import harvester as hv
from harvester.equations.problem import Problem
from harvester.mechanics.trace import trace

equations = Problem.of(hv.load({str(EXAMPLES / "plate_with_stop.toml")!r})).equations
trace(equations, np.zeros(1000), 0.01)
noise = np.zeros(2_000_000)
threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()
while True:
    trace(equations, noise, 0.01)
"""


class Pair(NamedTuple):
    """Two numbers."""

    first: float
    second: float


def test_a_path_hears_it():
    """The process crashed before: Numba made a NamedTuple of the last state."""
    program = subprocess.run(
        [sys.executable, "-c", PATH], check=False, capture_output=True, text=True, timeout=120
    )
    assert program.returncode == -signal.SIGINT, program.stderr
    assert program.stderr.strip().endswith("KeyboardInterrupt")


@pytest.mark.parametrize("depth", [0, 1])
def test_a_named_result_is_refused(depth):
    @kernel
    def doubled(x):
        pair = Pair(x, 2.0 * x)
        return (x, pair) if depth else pair

    with pytest.raises(TypeError, match=r"must return plain tuples, not .*Pair"):
        doubled(1.0)
