"""The functions that a scene passes on its way into ngspice and back, listed from a real run.

    python benchmarks/scene_path.py [SCENE]

Runs ``harvester run SCENE --engine spice --within 1%`` in this process under a profiler.  A
function of the package is listed when a scene is handed to it in any form: the scene, its load, its
equations and scales, the problem, the parsed circuit, the device that ngspice shares.  What a form
does with itself (its own methods) does not count; what is done in threads does, and in the worker
processes of ngspice not.
"""

import sys
import threading
from collections import Counter
from pathlib import Path

import harvester

ROOT = Path(harvester.__file__).parent
FORMS = {
    "Scene",
    "Load",
    "Equations",
    "Scales",
    "LoadCircuit",
    "Problem",
    "Device",
    "Prepared",
    "Model",
}


def main():
    """Print the list, and how long it is."""
    scene = (
        sys.argv[1] if len(sys.argv) > 1 else str(ROOT.parent / "examples" / "plate_bridge.toml")
    )
    passed = Counter()

    def look(frame, event, _):
        code = frame.f_code
        if (
            event != "call"
            or not code.co_filename.startswith(str(ROOT))
            or code.co_name.startswith("<")
        ):
            return
        count = code.co_argcount + code.co_kwonlyargcount
        values = [
            frame.f_locals.get(name)
            for name in code.co_varnames[:count]
            if name not in ("self", "cls")
        ]
        if any(type(value).__name__ in FORMS for value in values):
            where = Path(code.co_filename).relative_to(ROOT).as_posix()
            passed[
                f"{where}: {code.co_qualname if hasattr(code, 'co_qualname') else code.co_name}"
            ] += 1

    sys.argv = ["harvester", "run", scene, "--engine", "spice", "--within", "1%", "--json"]
    from harvester import cli

    threading.setprofile(look)
    sys.setprofile(look)
    try:
        status = cli.exit_status(sys.argv[1:])
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    for name, times in sorted(passed.items()):
        print(f"{name}  {times}", file=sys.stderr)
    print(f"{len(passed)} functions, {sum(passed.values())} calls", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
