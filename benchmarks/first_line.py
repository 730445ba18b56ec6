"""When work that lasts shows how long it will take, and when ^C ends it, each command typed on a terminal.

    python benchmarks/first_line.py                 all commands and Python programs
    python benchmarks/first_line.py --only charge   those whose name matches

Each starts on a pty.  "line" is the time until a duration of the whole or a time left is on the
screen, "CPU" what the process and its children had used until then, "number" the time until a
number with an error or a unit is on the screen or the output; --patience seconds after its start
SIGINT comes, as of ^C, and "end" is the time until the program has ended.
"""

import argparse
import contextlib
import os
import pty
import re
import select
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"
COMMANDS = {
    "run ensemble": "run plate_with_stop.toml --within 0.005%",
    "run density": "run plate_with_stop.toml --engine density --within 0.01%",
    "run spice": "run plate_bridge.toml --engine spice --within 0.3%",
    "run ideal": "run plate_bridge.toml --engine ideal --within 0.05%",
    "run compiled": "run bimorph_board.toml --engine compiled --within 0.1%",
    "run slow": "run bimorph_bq25570.toml --engine slow",
    "run compiled, steady": "run bimorph_self_powered_sshi.toml --engine compiled",
    "run sensitivity, board": "run plate_sece.toml --engine ideal --sensitivity",
    "run lifetime": "run plate_with_stop.toml --lifetime '5 years'",
    "run predict": "run plate_bridge.toml --engine ideal --predict",
    "sweep": "sweep plate_with_stop.toml --engine ensemble --within 0.1% "
    "--vary load.resistance=1k:10M:500",
    "sweep spice": "sweep plate_bridge.toml --engine spice --vary load.parameters.R=100k:10M:5",
    "sweep default": "sweep plate_with_stop.toml --vary load.resistance=1k:10M:25",
    "response": "response plate_harmonic_stop.toml --sweep 2Hz:6Hz:200",
    "tolerance": "tolerance plate_with_stop.toml --engine ensemble --vary stop.restitution=0.9:0.98 "
    "--vary load.resistance=10%",
    "tolerance board": "tolerance bimorph_board.toml --vary load.parameters.R1=5%",
    "optimise": "optimise plate_with_stop.toml --engine ensemble --vary load.resistance=1k:10M",
    "design": "design plate_harmonic.toml --needs '40 uW at 3.3 V'",
    "compare": "compare plate_with_stop.toml",
    "charge slow": "charge {out}/store.toml --to 1V",
    "charge ideal": "charge plate_bridge.toml --to 1V --engine ideal --trajectories 20000",
    "charge compiled": "charge plate_bridge.toml --to 1V --engine compiled",
    "charge spice": "charge plate_bridge.toml --to 1V --engine spice",
    "cost": "cost plate.toml --budget 20s",
    "motion": "motion plate.toml --duration 1600",
    "stability": "stability plate.toml --trajectories 200000",
    "extremes": "extremes plate_with_stop.toml --lifetime '5 years'",
    "densities": "densities plate_with_stop.toml",
    "node": "node bimorph_packets.toml",
    "node chip": "node bimorph_chip.toml",
    "node, noise": "node {out}/node.toml",
    "identify": "identify bench_impedance.csv bench_bounce.csv",
    "paper": "paper",
    "export": "export plate_with_stop.toml --out {out}/e.lib",
    "report": "run plate_with_stop.toml --within 0.01% --report {out}/r.html",
}
PYTHON = {
    "hv.run": "hv.run('plate_with_stop.toml', within='0.005%')",
    "hv.Compiled": "hv.Compiled(within='0.1%').run('bimorph_board.toml')",
    "hv.sweep": "hv.sweep('plate_with_stop.toml', vary={'load.resistance': '1k:10M:500'}, "
    "engines=[hv.Ensemble(within='0.1%')])",
    "hv.charge": "hv.charge('{out}/store.toml', to='1 V')",
    "hv.node": "hv.node('{out}/node.toml')",
    "hv.tolerance": "hv.tolerance('bimorph_board.toml', vary={'load.parameters.R1': '5%'})",
    "hv.optimise": "hv.optimise('plate_with_stop.toml', vary={'load.resistance': '1k:10M'}, "
    "engine='ensemble')",
    "hv.compare": "hv.compare('plate_with_stop.toml')",
    "hv.design": "hv.design('plate_harmonic.toml', needs='40 uW at 3.3 V')",
    "hv.identify": "hv.identify(['bench_impedance.csv', 'bench_bounce.csv'])",
    "hv.sensitivity": "hv.sensitivity('plate_sece.toml')",
    "hv.response": "hv.response('plate_harmonic_stop.toml', sweep='2Hz:6Hz:200')",
    "hv.cosimulate": "import electromagnetic_bridge; electromagnetic_bridge.run(duration='300 s')",
}
STORE = """
[oscillator]
mass = "40 g"
stiffness = 16.0
damping = 6.4e-3
[piezo]
coupling = 1e-3
capacitance = "50.2 nF"
[excitation]
acceleration_psd = "1e-5 g^2/Hz"
[load]
netlist = "bridge"
[load.parameters]
R = "1.5 Mohm"
C = "100 uF"
"""
# the packets of an example under noise
NODE = re.sub(
    r"(?s)\[excitation\].*?(?=\n\[)",
    '[excitation]\nacceleration_psd = "3e-3 g^2/Hz"',
    (EXAMPLES / "bimorph_packets.toml").read_text(),
)
TELLS = re.compile(r"\d\d:\d\d left|in all|first answer|seconds? left")
NUMBER = re.compile(r"\d (?:\+- |[munp]?[WVA]\b|packets|[munkM]?Hz)")


def family(pid):
    """A process and all below it."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
    found = [pid]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


def used(pid):
    """CPU seconds of a process, its children and those that it has waited for."""
    ticks = 0
    for one in family(pid):
        with contextlib.suppress(OSError):
            fields = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
            ticks += sum(map(int, fields[11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def on_terminal(arguments):
    """The program in a session of its own with a terminal, and the terminal's other end."""
    (master, slave) = pty.openpty()
    program = subprocess.Popen(
        arguments,
        stdin=slave,
        stdout=slave,
        stderr=slave,
        cwd=EXAMPLES,
        env=os.environ | {"TERM": "xterm", "PYTHONSAFEPATH": ""},
        start_new_session=True,
    )
    os.close(slave)
    return program, master


def watch(arguments, patience):
    """Run a program, type ^C after ``patience`` seconds: what was seen, and when."""
    begin = time.monotonic()
    (program, master) = on_terminal(arguments)
    seen = {}
    shown = ""
    typed = None
    while True:
        now = time.monotonic() - begin
        if typed is None and now > patience and program.poll() is None:
            typed = time.monotonic()
            os.killpg(program.pid, signal.SIGINT)
        if typed is not None and time.monotonic() - typed > 60.0:
            os.killpg(program.pid, signal.SIGKILL)
        if not select.select([master], [], [], 0.02)[0]:
            if program.poll() is not None:
                break
            continue
        try:
            piece = os.read(master, 65536)
        except OSError:  # nobody has the other end
            break
        shown += piece.decode(errors="replace")
        now = time.monotonic() - begin
        for name, pattern in {"line": TELLS, "number": NUMBER}.items():
            if name not in seen and (match := pattern.search(shown)):
                words = shown[: match.end()].replace("\r", "\n").splitlines()[-1]
                seen[name] = (now, used(program.pid), words)
    program.wait()
    os.close(master)
    end = time.monotonic()
    seen["end"] = (end - (typed or begin), typed is not None, program.returncode)
    return seen, shown


def main():
    """A line for each program."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--only", default="", help="regular expression of the names")
    parser.add_argument("--patience", type=float, default=6.0, help="seconds until ^C is typed")
    parser.add_argument("--screen", action="store_true", help="print what the screen was sent")
    options = parser.parse_args()
    print(f"{'':24} {'line':>7} {'CPU':>7} {'number':>7} {'end':>7} status  line")
    with tempfile.TemporaryDirectory() as out:
        (Path(out) / "store.toml").write_text(STORE)
        (Path(out) / "node.toml").write_text(NODE)
        both = {
            name: ["-P", "-m", "harvester", *shlex.split(words.format(out=out))]
            for name, words in COMMANDS.items()
        } | {
            name: ["-c", "import harvester as hv\n" + code.replace("{out}", out)]
            for name, code in PYTHON.items()
        }
        for name, words in both.items():
            if not re.search(options.only, name):
                continue
            (seen, shown) = watch([sys.executable, *words], options.patience)
            line = seen.get("line")
            number = seen.get("number")
            (took, was_typed, status) = seen["end"]
            cells = [
                f"{line[0]:5.1f} s" if line else "-",
                f"{line[1]:5.1f} s" if line else "-",
                f"{number[0]:5.1f} s" if number else "-",
                f"{took:5.1f} s" if was_typed else f"({took:.1f} s)",
            ]
            said = re.sub(r"[█▏▎▍▌▋▊▉ ]{3,}", " ", line[2]) if line else ""
            print(f"{name:24} {' '.join(f'{c:>7}' for c in cells)} {status:>4}  {said}", flush=True)
            if options.screen:
                print(shown)


if __name__ == "__main__":
    main()
