"""How wide the vectors of kernels are: 512 bits if a measurement of this processor finds them faster than 256.

LLVM uses 256 bits even if a processor has 512, because some clock themselves down at 512; only a
trial shows whether 512 are worth it.  It is made once, when a first kernel is compiled, lasts half
a second, and is kept with the kernels; a file that is missing, wrong, or of another processor or
numba is no more than a new trial.  A processor without AVX-512 is not tried.  If the user sets
NUMBA_CPU_FEATURES or NUMBA_CPU_NAME, these hold.

Lanes are added up each by itself, so that results do not depend on the width.
"""

import contextlib
import json
import time
from functools import cache
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import compiler as numba_compiler
from numba.core import config as numba_config
from numba.core import lowering as numba_lowering
from numba.core import typed_passes as numba_passes
from numba.core.compiler_machinery import register_pass

from harvester.errors import InputError
from harvester.machine import files, folders, locks

config: Any = numba_config
passes: Any = numba_passes
compiler: Any = numba_compiler
lowering: Any = numba_lowering
binding: Any = llvm

FILE = "vector-width.json"
NEEDED = ("avx512f", "avx512dq", "avx512vl")
FASTER = 1.05  # times, at least, that 512 bits must be faster
TRIES, ROUNDS = 10, 500
_LONGEST = 10_000  # bytes of the file


def may_be_wide() -> bool:
    """Whether the processor has vectors of 512 bits, and the user does not choose the processor."""
    if config.CPU_FEATURES is not None or config.CPU_NAME is not None:
        return False
    with contextlib.suppress(RuntimeError):  # LLVM does not know the processor
        supported = binding.get_host_cpu_features()
        return all(supported.get(name, False) for name in NEEDED)
    return False


@cache
def width() -> int:
    """The bits of a vector in this process: as kept with the kernels, else as measured.

    256 if neither is possible.
    """
    cached = folders.cache_folder() if may_be_wide() else None
    if cached is None:
        return 256
    known = {"processor": binding.get_host_cpu_name(), "numba": numba.__version__}
    # two that measure at a time would disturb each other
    with locks.alone(cached / f"{FILE}.turn"):
        with contextlib.suppress(
            InputError, ValueError, KeyError, TypeError, AttributeError, RecursionError
        ):
            kept = json.loads(files.read(cached / FILE, FILE, _LONGEST))
            if known.items() <= kept.items() and kept["bits"] in (256, 512):
                return int(kept["bits"])
        ratio = faster()
        bits = 512 if ratio >= FASTER else 256
        with contextlib.suppress(InputError):
            files.write(
                cached / FILE,
                json.dumps({**known, "bits": bits, "times_faster": round(ratio, 3)}) + "\n",
            )
    return bits


def faster() -> float:
    """How many times faster 512 bits are than 256 on a loop that resembles a step: the shortest of `TRIES` each."""
    x = np.ones(64)
    v = np.zeros(64)
    bits = np.arange(1, 65, dtype=np.uint64)
    kinds = {
        width: numba.njit(fastmath=True, nogil=True, pipeline_class=kind)(_steps)
        for width, kind in _KINDS.items()
    }
    shortest = dict.fromkeys(kinds, float("inf"))
    for k in range(TRIES + 1):
        for width_, steps in kinds.items():
            begin = time.perf_counter()
            steps(x, v, bits, ROUNDS)
            if k > 0:  # the first call compiles
                shortest[width_] = min(shortest[width_], time.perf_counter() - begin)
    return shortest[256] / shortest[512]


def _steps(x: Any, v: Any, bits: Any, rounds: int) -> None:
    """Steps of a mass with a stop, a stiffness that hardens, damping and noise, 64 side by side."""
    for _ in range(rounds):
        for i in range(64):
            b = bits[i]
            b ^= b << np.uint64(13)
            b ^= b >> np.uint64(7)
            b ^= b << np.uint64(17)
            bits[i] = b
            noise = 0.1 if b & np.uint64(1) else -0.1
            a = x[i] + 0.1 * v[i]
            u = -0.96 * v[i] if a < 0.0 else v[i]
            a = -0.96 * a if a < 0.0 else a
            y = a * a * (0.01 * a * a - 0.005)
            damped = 1.0 - y * (1.0 - 0.5 * y)
            x[i] = a
            v[i] = damped * u + damped * (noise - 0.1 * (a + 0.5 * a * a * a))


class _WideLower(lowering.Lower):  # type: ignore[misc]
    """Lowering of a function to LLVM with the request for 512 bits."""

    def lower_function_body(self) -> Any:
        # which llvmlite does not know
        set.add(self.function.attributes, '"prefer-vector-width"="512"')
        return super().lower_function_body()


@register_pass(mutates_CFG=True, analysis_only=False)
class _WideLowering(passes.NativeLowering):  # type: ignore[misc]
    """The pass that does it."""

    _name = "wide_lowering"

    @property
    def lowering_class(self) -> Any:
        return _WideLower


class _Wide(compiler.Compiler):  # type: ignore[misc]
    """The compiler of numba with that pass."""

    def define_pipelines(self) -> list[Any]:
        managers: list[Any] = super().define_pipelines()
        for manager in managers:
            steps = [
                (_WideLowering if step is passes.NativeLowering else step, what)
                for step, what in manager.passes
            ]
            manager.passes = steps
        return managers


class Chosen(_Wide):
    """The compiler of kernels: with vectors of the `width` that is asked for when the first one is compiled."""

    def define_pipelines(self) -> list[Any]:
        """The passes."""
        passes_of = _Wide if width() == 512 else compiler.Compiler
        pipelines: list[Any] = passes_of.define_pipelines(self)
        return pipelines


_KINDS = {256: compiler.Compiler, 512: _Wide}
