"""Answers of ten scenes and five engines at fixed seeds, to the last digit: what a reorganisation must not change.

    python benchmarks/answers.py --out FILE          write them
    python benchmarks/answers.py --against FILE      compare with another checkout's; status 1 on a difference

Times, which differ from run to run, are left out.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
SCENES = (
    "paper_figure3",
    "plate",
    "plate_with_stop",
    "plate_weak",
    "plate_bridge",
    "plate_parallel_sshi",
    "plate_two_stops",
    "plate_coloured",
    "plate_bistable",
    "plate_harmonic_stop",
)
OPTIONS = {
    "published": (),
    "averaged": (),
    "ensemble": ("--trajectories", "256", "--seed", "3"),
    "ideal": ("--trajectories", "256", "--seed", "3"),
    "spice": ("--alone", "--trajectories", "2", "--seed", "3"),
}
TIMES = ("seconds", "compilation_seconds", "warm_up_seconds")


def answer(scene, engine):
    """What ``harvester run --json`` says, without times; the error where the engine refuses."""
    words = [
        sys.executable,
        "-m",
        "harvester",
        "run",
        str(ROOT / "examples" / f"{scene}.toml"),
        "--engine",
        engine,
    ]
    done = subprocess.run(
        [*words, *OPTIONS[engine], "--json"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=900,
    )
    if done.returncode:
        return {"status": done.returncode, "error": done.stderr.strip()}
    found = json.loads(done.stdout)
    found.pop("seconds")
    found["details"] = {
        name: value for name, value in found["details"].items() if name not in TIMES
    }
    return found


def main():
    """Compute all answers, and write or compare them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path)
    parser.add_argument("--against", type=Path)
    asked = parser.parse_args()
    found = {f"{scene} {engine}": answer(scene, engine) for scene in SCENES for engine in OPTIONS}
    if asked.out is not None:
        asked.out.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")
    if asked.against is None:
        return 0
    before = json.loads(asked.against.read_text())
    changed = [name for name in before if before[name] != found.get(name)]
    for name in changed:
        print(
            f"{name}:\n  before {json.dumps(before[name])}\n  now    {json.dumps(found.get(name))}"
        )
    served = sum("error" not in one for one in found.values())
    print(
        f"{len(before) - len(changed)} of {len(before)} answers are the same ({served} served, the others refused)"
    )
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())
