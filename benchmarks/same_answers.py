"""This checkout's answers against those of another one: every number to the last digit, and every key of the JSON.

Each checkout has a process of its own, with its own folder as the current one; both are asked the
same command lines with the same seeds, short enough that all of them take a few minutes:

- `RUNS`, scenes of every kind, each by all engines, also by those that must refuse it: mean power, errors, steps
- `COMMANDS`, every other command that computes, but for `cost`, which measures times: the numbers of its JSON, and of
  the CSV files that it writes

What is compared: the exit status; every number, exactly, but for those that say how long something
took; the keys of the JSON and the columns of the CSV files, of which new ones may come and none may
go.  Sentences may be worded anew, and a text that must stay is printed where it changed, but does
not fail.  `--digits` shows how near two numbers are.

    git worktree add ../before main~20
    .venv/bin/python benchmarks/same_answers.py ../before                   all of it
    .venv/bin/python benchmarks/same_answers.py ../before --only "bridge"   the cases whose name has a match
    .venv/bin/python benchmarks/same_answers.py ../before --only "^run .* ensemble" --digits 12

The exit status is 1 where anything differs.
"""

import argparse
import csv
import itertools
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from harvester.engines.selection import ENGINES

HERE = Path(__file__).parents[1]
LOAD = "load.resistance=100k:1M"
TIMES = re.compile(r"seconds|\.cost|throughput|version|path", re.IGNORECASE)  # what no seed decides

# An example, and the duration of a trajectory: in s, or in 1/w0 for the scene without units.
RUNS = {
    "paper_figure3": "40",
    "plate": "3",
    "plate_with_stop": "3",
    "plate_bistable": "3",
    "plate_two_stops": "3",
    "plate_preloaded": "3",
    "plate_compliant_stop": "3",
    "plate_coloured": "3",
    "plate_recorded": "3",
    "plate_shock": "3",
    "plate_harmonic": "3",
    "plate_harmonic_stop": "3",
    "plate_weak": "1",
    "plate_bridge": "2",
    "plate_doubler": "2",
    "plate_parallel_sshi": "2",
    "plate_series_sshi": "2",
    "plate_sece": "1",
    "bimorph_machine": "1",
    "bimorph_sshc": "0.2",
    "stonehenge": "2",
    "bimorph_ltc3588": "0.5",
    "bimorph_board": "0.5",
    "two_modes_with_stop": "1",
    "magnifier": "1",
}
# trajectories; others take none
EFFORT = {"ensemble": "32", "ideal": "32", "compiled": "16", "spice": "3"}
WITHIN = {"density": "1%"}
# glibc fills memory with this byte's complement in the other one: its answers must not depend on it
FILLED = "128"

# Name: the words behind `harvester`; {out} is an empty folder of the case.
COMMANDS = {
    "run, default engine": "run examples/plate.toml --json",
    "run, within": "run examples/plate_with_stop.toml --within 5% --seed 3 --json",
    "run, lifetime": "run examples/plate_with_stop.toml --trajectories 64 --duration 5 --lifetime 1h --seed 3 --json",
    "run, probes": "run examples/plate_bridge.toml --probe store --probe i(d1) --ledger --trajectories 3 --duration 1 "
    "--json",
    "sweep, formulas": "sweep examples/paper_figure3.toml --vary nondimensional.mu=.01:10:5 --engine published "
    "--engine averaged --out {out}",
    "sweep, samples": "sweep examples/plate_with_stop.toml --vary load.resistance=100k:1M:3 --engine averaged "
    "--engine ensemble --trajectories 32 --duration 2 --workers 1 --seed 3 --out {out}",
    "sweep, circuit": "sweep examples/plate_bridge.toml --vary load.parameters.R=100k,1M --engine ideal --engine spice "
    "--trajectories 3 --duration 1 --workers 1 --seed 3 --out {out}",
    "compare": "compare examples/plate_with_stop.toml --trajectories 32 --duration 1 --seed 3 --out {out} --json",
    "stability": "stability examples/plate_weak.toml --trajectories 64 --seed 3 --json",
    "stability, paper": "stability examples/paper_figure3.toml --trajectories 64 --seed 3 --json",
    "optimise, linear": "optimise examples/plate.toml --vary load.resistance=10k:10M --out {out} --json",
    "optimise, formula": f"optimise examples/plate_with_stop.toml --vary {LOAD} --engine averaged --out {{out}} --json",
    "optimise, limit": f"optimise examples/plate.toml --vary {LOAD} --limit voltage_rms<2V --out {{out}} --json",
    "optimise, spread": f"optimise examples/plate_with_stop.toml --vary {LOAD} --spread piezo.capacitance=10% "
    "--objective 5% --engine averaged --seed 3 --out {out} --json",
    "optimise, front": f"optimise examples/plate.toml --vary {LOAD} --vary piezo.coupling=1e-4:1e-3 "
    "--objective voltage_rms --seed 3 --out {out} --json",
    "tolerance": "tolerance examples/plate_with_stop.toml --vary piezo.capacitance=10% --vary load.resistance=E24:5% "
    "--engine averaged --samples 500 --runs 60 --checks 0 --workers 1 --seed 3 --out {out} --json",
    "charge, ideal": "charge examples/plate_bridge.toml --to 0.5V --trajectories 32 --seed 3 --out {out} --json",
    "charge, spice": "charge examples/plate_bridge.toml --to 0.2V --engine spice --trajectories 2 --duration 5s "
    "--seed 3 --out {out} --json",
    "motion": "motion examples/plate_with_stop.toml --duration 1 --seed 3 --out {out}",
    "motion, spice": "motion examples/plate_bridge.toml --duration 0.5 --from-rest --probe store --seed 3 --out {out}",
    "response": "response examples/plate_harmonic_stop.toml --sweep 2Hz:4Hz:5 --seed 3 --out {out} --json",
    "response, linear": "response examples/plate_harmonic.toml --sweep 2Hz:4Hz:5 --engine exact --engine ensemble "
    "--seed 3 --out {out} --json",
    "response, ideal": "response examples/stonehenge.toml --sweep 5Hz:9Hz:3 --seed 3 --out {out} --json",
    "identify": "identify examples/bench_impedance.csv examples/bench_voltage.csv@100k --out {out}/mine.toml --json",
    "record": "record examples/shake.csv --out {out}/clean.csv --json",
    "paper": "paper 3 --out {out}",
    "export": "export examples/plate_with_stop.toml --out {out}/device.lib",
    "extremes": "extremes examples/plate_with_stop.toml --lifetime 1h --seed 3 --json",
    "densities": "densities examples/plate_with_stop.toml --within 1% --seed 3 --json",
    "node": "node examples/bimorph_packets.toml --days 0.02 --seed 3 --json",
    "design": "design examples/bimorph_sensor.toml --needs '40 uW at 3.3 V' --circuits bridge --seed 3 --json",
    "sensitivity": "run examples/plate_with_stop.toml --engine density --within 1% --sensitivity --json",
    "keys": "keys --json",
    "new": "new --mass 40g --stiffness 16N/m --damping-ratio 0.004 --capacitance 50.2nF --coupling 1e-3 "
    "--acceleration-psd 1e-5g^2/Hz --resistance 1Mohm --json {out}/mine.toml",
}

PROGRAM = """
import contextlib, io, json, sys
from unittest import mock
from harvester import cli
answers = sys.stdout
for line in sys.stdin:
    words, out, err = json.loads(line), io.StringIO(), io.StringIO()
    argv = mock.patch.object(sys, "argv", ["harvester", *words])
    with argv, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = cli.exit_status(words)
    print(json.dumps([status, out.getvalue(), err.getvalue()]), file=answers, flush=True)
"""


class Checkout:
    """A process that answers command lines by the code of one checkout, with this one's Python and libraries."""

    def __init__(self, folder, **environment):
        self.folder = Path(folder).resolve()
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-W", "ignore", "-c", PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=self.folder,
            env=os.environ | environment | {"PYTHONPATH": str(self.folder)},
        )

    def answer(self, words):
        """Exit status, the answer as flat JSON with the numbers of CSV files, and what was said on stderr."""
        with tempfile.TemporaryDirectory() as out:
            self.process.stdin.write(
                json.dumps([word.replace("{out}", out) for word in words]) + "\n"
            )
            self.process.stdin.flush()
            line = self.process.stdout.readline()
            if not line:
                raise SystemExit(f"{self.folder} ended with status {self.process.wait()}")
            status, text, err = json.loads(line)
            found = dict(flat(json.loads(text))) if "--json" in words and status == 0 else {}
            for file in sorted(Path(out).rglob("*.csv")):
                found |= columns(file)
        return status, found, err


def flat(found, where=""):
    """The numbers, texts and nulls of nested JSON, by their keys with dots: `errors.0.value`."""
    if isinstance(found, dict) and found:
        for key, value in found.items():
            yield from flat(value, f"{where}.{key}" if where else key)
    elif isinstance(found, list) and found:
        for k, value in enumerate(found):
            yield from flat(value, f"{where}.{k}")
    else:
        yield where, found


def columns(file):
    """The cells of a CSV file by file name, column and row; numbers where they are such."""
    rows = [
        row
        for row in csv.reader(file.read_text().splitlines())
        if row and not row[0].startswith("#")
    ]
    names = rows[0] if rows else []
    return {
        f"{file.name}:{name}.{k}": number(cell)
        for k, row in enumerate(rows[1:])
        for name, cell in zip(names, row, strict=False)
    }


def number(cell):
    """A cell as a number, or as the text that it is."""
    try:
        return float(cell)
    except ValueError:
        return cell


def keys(found):
    """The keys of an answer without the places in lists; for `rows.0.value` that is `rows.*.value`."""
    return {re.sub(r"\.\d+(?=\.|$)", ".*", key) for key in found}


def differences(here, there, digits):
    """What is not the same in two answers: lines to print that count, and lines that only tell."""
    wrong, told = [], []
    (status, found, err), (other_status, before, other_err) = here, there
    found, before = (
        {key: value for key, value in one.items() if not TIMES.search(key)}
        for one in (found, before)
    )
    if status != other_status:
        wrong.append(f"exit status {status}, there {other_status}: {(err or other_err).strip()}")
    elif status:
        told += (
            [f"refused otherwise: {err.strip()!r}, there {other_err.strip()!r}"]
            if err != other_err
            else []
        )
    if gone := sorted(keys(before) - keys(found)):
        wrong.append(f"keys that are gone: {', '.join(gone)}")
    if new := sorted(keys(found) - keys(before)):
        told.append(f"new keys: {', '.join(new)}")
    for key in before:
        if key not in found:
            continue
        one, other = found[key], before[key]
        if isinstance(one, str) and isinstance(other, str):
            told += [f"{key}: {one!r}, there {other!r}"] if one != other else []
        elif not same(one, other, digits):
            wrong.append(f"{key}: {one!r}, there {other!r}{apart(one, other)}")
    if len(found) != len(before) and not gone and not new:
        wrong.append(f"{len(found)} values, there {len(before)}")
    return wrong, told


def same(one, other, digits):
    """Whether two numbers, or two things that are none, are the same; nan is the same as nan."""
    if (
        isinstance(one, float)
        and isinstance(other, float)
        and math.isnan(one)
        and math.isnan(other)
    ):
        return True
    if (
        digits is None
        or isinstance(one, str | list | dict | None)
        or isinstance(other, str | list | dict | None)
    ):
        return one == other
    return math.isclose(one, other, rel_tol=10.0**-digits, abs_tol=0.0)


def apart(one, other):
    """How far two numbers are apart, as a share of the other; nothing for what is no number."""
    if (
        isinstance(one, str | list | dict | None)
        or isinstance(other, str | list | dict | None)
        or not other
    ):
        return ""
    return f" ({one / other - 1.0:+.1e})"


def cases():
    """Every case: its name, and the words behind `harvester`."""
    for (scene, duration), engine in itertools.product(RUNS.items(), ENGINES):
        words = ["run", f"examples/{scene}.toml", "--engine", engine, "--json"]
        if engine in EFFORT:
            words += ["--seed", "3", "--duration", duration, "--trajectories", EFFORT[engine]]
        words += ["--within", WITHIN[engine]] if engine in WITHIN else []
        yield f"run {scene} by {engine}", words
    for name, text in COMMANDS.items():
        yield name, shlex.split(text)


def main():
    """Ask both checkouts every case, and print what differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("other", type=Path, help="the folder of another checkout")
    parser.add_argument("--only", default="", help="regular expression of the names of cases")
    parser.add_argument("--digits", type=int, help="digits that must be the same; default: all")
    parser.add_argument(
        "--texts", action="store_true", help="also print texts and new keys, which may differ"
    )
    parser.add_argument("--list", action="store_true", help="only print the names of the cases")
    options = parser.parse_args()
    chosen = [(name, words) for name, words in cases() if re.search(options.only, name)]
    if options.list:
        print("\n".join(name for name, _ in chosen))
        return
    both = (Checkout(HERE), Checkout(options.other, MALLOC_PERTURB_=FILLED))
    failed = 0
    compared = 0
    with ThreadPoolExecutor(2) as pool:
        for name, words in chosen:
            begin = time.perf_counter()
            here, there = pool.map(lambda one, words=words: one.answer(words), both)
            wrong, told = differences(here, there, options.digits)
            failed = failed + bool(wrong)
            compared = compared + len(here[1])
            state = (
                "DIFFERS" if wrong else "same" if here[0] == 0 else f"same, exit status {here[0]}"
            )
            more = f", {len(told)} texts or new keys" if told else ""
            print(
                f"{name:<36} {time.perf_counter() - begin:5.1f} s  {state} ({len(here[1])} values{more})"
            )
            print(
                "".join(
                    f"    {line}\n" for line in [*wrong, *(told if options.texts else [])][:20]
                ),
                end="",
                flush=True,
            )
    print(f"{len(chosen)} cases, {compared} values: {failed or 'none'} differ")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
