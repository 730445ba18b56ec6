"""Libraries of an FMU for several systems, linked on one machine by the C compiler of ziglang."""

import hashlib
import importlib.metadata
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from harvester.devices.fmu.objects import Platform, emitted
from harvester.errors import MissingProgramError, SimulationError
from harvester.machine import files, folders

SOURCES = Path(__file__).parents[1]
LONGEST = 600.0  # s, for one library: the first one of a system builds that system's C library too
REMEDY = "python -m pip install 'piezo-harvester[fmu]'"


def check_compiler() -> None:
    """Raise MissingProgramError without ziglang."""
    if importlib.util.find_spec("ziglang") is None:
        raise MissingProgramError(
            f"an FMU must be linked by the package ziglang, but it is missing: {REMEDY}"
        )


def library(code: dict[str, str], header: str, platform: Platform, fmi: int) -> bytes:
    """The library of compiled functions, by their names, and of the interface FMI 2 or 3.

    It is kept in the cache.  Raises SimulationError if the compiler fails, with its first line.
    """
    names = ("part.h", "instances.h", f"fmi{fmi}.c", "objects.py", "contents/build.py")
    sources = [(SOURCES / name).read_text() for name in names]
    return kept(
        [code, header, platform.name, *sources],
        platform.ending,
        lambda: _linked(code, header, platform, fmi),
    )


def kept(made_of: Sequence[object], ending: str, make: Callable[[], bytes]) -> bytes:
    """The bytes that ``make`` gives, kept in the cache by all that they are made of."""
    folder = folders.cache_folder()
    if folder is None:
        return make()
    compilers = [importlib.metadata.version(name) for name in ("ziglang", "llvmlite", "numba")]
    key = hashlib.sha256(json.dumps([*made_of, *compilers]).encode()).hexdigest()
    path = folder / "fmu" / f"{key}.{ending}"
    if not path.is_file():
        path.parent.mkdir(0o700, exist_ok=True)
        files.write(path, make(), "cache")
    return path.read_bytes()


def _linked(code: dict[str, str], header: str, platform: Platform, fmi: int) -> bytes:
    """The same, made anew."""
    with tempfile.TemporaryDirectory(prefix="harvester-fmu-") as scratch:
        folder = Path(scratch)
        (folder / "model.h").write_text(header)
        for name, llvm in code.items():
            (folder / f"{name}.o").write_bytes(emitted(llvm, platform, name))
        out = folder / f"part.{platform.ending}"
        command = [
            *(
                sys.executable,
                "-P",
                "-m",
                "ziglang",
                "cc",
                "-target",
                platform.target,
                "-O2",
                "-shared",
            ),
            *("-fPIC", "-fvisibility=hidden", "-fno-sanitize=undefined", "-w", "-g0"),
            *("-I", str(folder), "-I", str(SOURCES), "-o", str(out)),
            *(str(SOURCES / f"fmi{fmi}.c"), *(str(folder / f"{name}.o") for name in code)),
            *(["-lm"] if platform.has_libm else []),
            *(["-s"] if platform.ending != "dylib" else []),
        ]
        cache = folders.cache_folder()
        kept = {} if cache is None else {"ZIG_GLOBAL_CACHE_DIR": str(cache / "zig")}
        environment = {**os.environ, **kept, "ZIG_LOCAL_CACHE_DIR": str(folder / "zig")}
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                timeout=LONGEST,
                env=environment,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise SimulationError(
                f"the C compiler did not link the FMU for {platform.name}: {error}"
            ) from None
        if done.returncode != 0 or not out.is_file():
            first = next(
                (line for line in done.stderr.splitlines() if "error" in line), done.stderr[:200]
            )
            raise SimulationError(
                f"the C compiler did not link the FMU for {platform.name}: {first.strip()}"
            )
        return out.read_bytes()
