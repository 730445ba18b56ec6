"""What an effect costs a scene without it: instructions of the kernel with and without the effect's own lines.

    python benchmarks/absent.py                  # quadratic damping, a minute
    python benchmarks/absent.py softening inertia gamma

The package is copied to a folder of its own, where the blocks ``if c.NAME is not None:`` are taken out of all kernels,
and the conditions ``c.NAME is None`` are true.  Both compile the paper's scene anew; their instructions are counted.
A count that is the same says that the effect costs nothing where it is absent.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from harvester.machine import folders

ROOT = Path(__file__).parents[1]
COUNT = """
import re, sys
sys.path.insert(0, "benchmarks")
import dataclasses, effects
from harvester.mechanics.kernels.trajectory_batch import advance
free = {"restitution": None} if sys.argv[1] == "gamma" else {}  # which has no stop
for change in (free, free | {sys.argv[1]: 0.1}):
    before = set(advance.signatures)
    effects.prepared(dataclasses.replace(effects.PAPER, **change), effects.arrays(), readings=2)()
    for signature in set(advance.signatures) - before:
        lines = advance.inspect_asm(signature).splitlines()
        print(sum(re.match(r"\\s+[a-z]\\w*(\\s|$)", line) is not None for line in lines))
"""


def without(text: str, name: str) -> str:
    """The source without the blocks that only the coefficient ``name`` needs."""
    block = rf"^( *)if (?:c\.)?{name} is not None:\n(?:\1 +.*\n|\n(?=\1 +))+"
    text = re.sub(block, "", text, flags=re.MULTILINE)
    text = re.sub(rf" and c\.{name} is None", "", text)
    return re.sub(rf"\bc\.{name} is None\b", "True", text)


def instructions(package: Path, name: str) -> list[int]:
    """Instructions of the kernel for the paper's scene, and for it with the effect, compiled anew."""
    with tempfile.TemporaryDirectory() as cache:
        environment = os.environ | {
            "PYTHONPATH": str(package),
            "XDG_CACHE_HOME": cache,
            folders.VARIABLE: cache,
        }
        done = subprocess.run(
            [sys.executable, "-c", COUNT, name],
            cwd=package,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
    return [int(line) for line in done.stdout.split()]


def counted(name: str) -> tuple[int, int, int]:
    """Instructions where the effect is absent, without its lines, and with it."""
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder)
        for part in ("harvester", "benchmarks"):
            shutil.copytree(
                ROOT / part, package / part, ignore=shutil.ignore_patterns("__pycache__")
            )
        whole = instructions(package, name)
        sources = list((package / "harvester/mechanics/kernels").glob("*.py"))
        texts = [source.read_text() for source in sources]
        for source, text in zip(sources, texts, strict=True):
            source.write_text(without(text, name))
        assert [source.read_text() for source in sources] != texts, f"no block of {name}"
        alone = instructions(package, name)
    return whole[0], alone[0], whole[1]


def main() -> None:
    """A line for each effect."""
    for name in sys.argv[1:] or ["cv"]:
        absent, alone, present = counted(name)
        print(
            f"{name}: {absent} instructions where it is absent, {alone} without its lines, "
            f"{present} with it",
            flush=True,
        )


if __name__ == "__main__":
    main()
