"""^C in a Python program ends whatever the library computes, with a KeyboardInterrupt."""

import signal
import subprocess
import sys
import time

import pytest

from tests.support.paths import EXAMPLES

pytestmark = [
    pytest.mark.thorough("nothing: programs are interrupted while they compute"),
    pytest.mark.slow,
]

BEGIN = "import sys\nimport harvester as hv\n"
PLATE = repr(str(EXAMPLES / "plate_with_stop.toml"))
BOARD = repr(str(EXAMPLES / "bimorph_board.toml"))
COSIMULATION = f"""
sys.path.insert(0, {str(EXAMPLES)!r})
import electromagnetic_bridge
print("begin", flush=True)
electromagnetic_bridge.run(duration="300 s")
"""
WORK = {
    "ensemble": f"hv.Ensemble(within='0.005%').run({PLATE})",
    "many at once": f"hv.Ensemble(within='0.05%').run_many([{PLATE}] * 64)",
    "compiled": f"hv.Compiled(within='0.02%').run({BOARD})",
    "tolerance": f"hv.tolerance({BOARD}, vary={{'load.parameters.R1': '5%'}}, runs=2000)",
    "sweep": f"hv.sweep({PLATE}, vary={{'load.resistance': '1k:10M:5000'}}, engines=[hv.Ensemble(within='0.3%')])",
    "cosimulate": COSIMULATION,
}


@pytest.mark.ngspice
@pytest.mark.parametrize("name", WORK)
def test_python_programs_hear_it(name):
    """2 s at most on an idle machine; the test allows for a busy one."""
    work = WORK[name] if name == "cosimulate" else f"print('begin', flush=True)\n{WORK[name]}"
    with subprocess.Popen(
        [sys.executable, "-c", BEGIN + work],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as program:
        assert program.stdout.readline() == "begin\n"
        time.sleep(4.0)
        assert program.poll() is None, "it ended before"
        begin = time.monotonic()
        program.send_signal(signal.SIGINT)
        said = program.communicate(timeout=60)[1]
        took = time.monotonic() - begin
    assert said.strip().splitlines()[-1].startswith("KeyboardInterrupt")
    assert program.returncode == -signal.SIGINT
    assert took < 6.0
