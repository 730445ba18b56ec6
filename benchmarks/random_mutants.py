"""Random faults: how many of a seeded sample of small mutations do the tests of `make test` find?

Beside `benchmarks/mutants.py`, whose faults were thought of.  Each mutation turns a comparison, `and`, `or` or one of
+ - * /, changes a number, or drops a statement, somewhere in physics or statistics (`ROOMS`).  In a copy of the
repository it meets the tests of its room that import its file, then the room's other ones, then tests elsewhere that
import it, up to the first that fails.  Among those that survive, some change nothing that a test could see: read them.

    python benchmarks/random_mutants.py                    150 mutants, an hour
    python benchmarks/random_mutants.py --only density     those of one room
    python benchmarks/random_mutants.py --list             only what would be changed
"""

import argparse
import ast
import itertools
import random
import re
import time
from collections import Counter
from pathlib import Path

from mutants import ROOT, copy, run_tests

# How many mutants of each room; a room's own rooms, where they are named too, are drawn twice.
ROOMS = {"uncertainty": 9, "equations": 8, "linear": 7, "averaging": 11, "density": 8, "storage": 4, "engines": 6,
         "mechanics/kernels": 6, "mechanics/ensemble": 3, "studies/optimum": 3, "studies/tolerance": 3,
         "studies/charging": 2, "identification": 3, "devices": 3, "circuits": 9, "netlists": 8, "records": 7,
         "scene": 6, "cosimulation": 6, "mechanics": 6, "studies": 12, "quantities": 3, "machine": 3, "figures": 4,
         "presentation": 3, "commands": 3, "explore": 3, "report": 1}  # fmt: skip
TURNED = {ast.Lt: ">=", ast.GtE: "<", ast.Gt: "<=", ast.LtE: ">", ast.Eq: "!=", ast.NotEq: "=="}
SIGNS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
WORDS = {ast.And: ("and", "or"), ast.Or: ("or", "and")}


def changes(raw):
    """Each small change of a file's bytes: where it begins and ends, what stands there then, and its line."""
    lines = [0, *itertools.accumulate(map(len, raw.splitlines(keepends=True)))]

    def begin(node):
        return lines[node.lineno - 1] + node.col_offset

    def end(node):
        return lines[node.end_lineno - 1] + node.end_col_offset

    functions = [one for one in ast.walk(ast.parse(raw)) if isinstance(one, ast.FunctionDef)]
    for part in (part for one in functions for part in one.body[bool(ast.get_docstring(one)) :]):
        for node in ast.walk(part):
            if (found := change(node, raw, begin, end)) is not None:
                yield *found, node.lineno


def change(node, raw, begin, end):
    """The change of one node: where it begins and ends, and what stands there then; None for other nodes."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in TURNED:
        return end(node.left), begin(node.comparators[0]), f" {TURNED[type(node.ops[0])]} "
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        other = node.value + 1 if isinstance(node.value, int) else 1.25 * node.value or 0.25
        return begin(node), end(node), repr(other)
    if isinstance(node, ast.AugAssign) or (
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    ):
        return begin(node), end(node), "pass"
    if isinstance(node, ast.BinOp) and type(node.op) in SIGNS:
        left = node.left
        right = node.right
        (old, new) = SIGNS[type(node.op)]
    elif isinstance(node, ast.BoolOp) and len(node.values) == 2:
        (left, right) = node.values
        (old, new) = WORDS[type(node.op)]
    else:
        return None
    between = raw[end(left) : begin(right)].decode()
    texts = any(
        isinstance(one, ast.JoinedStr) or isinstance(getattr(one, "value", 0), str)
        for one in (left, right)
    )
    return (
        None
        if texts or between.count(old) != 1
        else (end(left), begin(right), between.replace(old, new))
    )


def chosen(seed):
    """The sample: each mutant's file below `ROOT` and its change."""
    rng = random.Random(seed)
    found = []
    for room, count in ROOMS.items():
        files = sorted((ROOT / "harvester" / room).rglob("*.py"))
        found += rng.sample(
            [(path.relative_to(ROOT), one) for path in files for one in changes(path.read_bytes())],
            count,
        )
    return found


def tests_of(path, folder):
    """The rounds of tests that a mutant of a file meets in a copy."""
    module, _, name = ".".join(path.with_suffix("").parts).rpartition(".")
    imports = re.compile(rf"from {re.escape(module)}(\.{name} import|.*import .*\b{name}\b)")
    room = Path("tests", *path.parts[1:-1])
    while not (folder / room).exists():
        room = room.parent
    importing = [
        file.relative_to(folder)
        for file in sorted((folder / "tests").rglob("test_*.py"))
        if imports.search(file.read_text())
    ]
    near = [str(one) for one in importing if room in one.parents]
    far = [
        str(one) for one in importing if room not in one.parents and "cosimulation" not in one.parts
    ][:3]
    return [one for one in (near, [str(room), *(f"--deselect={one}" for one in near)], far) if one]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=33)
    parser.add_argument("--only", default="", help="regular expression of the mutants' files")
    parser.add_argument(
        "--tier", default="not thorough", help="markers of the tests, as pytest's -m"
    )
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    fates = Counter()
    with copy() as folder:
        for path, (begin, end, new, line) in chosen(options.seed):
            if not re.search(options.only, str(path)):
                continue
            raw = (folder / path).read_bytes()
            since = time.perf_counter()
            fate = "listed"
            by = ""
            if not options.list:
                (folder / path).write_bytes(raw[:begin] + new.encode() + raw[end:])
                for tests in tests_of(path, folder):
                    fate, by = run_tests(folder, 300.0, [*tests, "-m", options.tier])
                    if fate != "survived":
                        break
                (folder / path).write_bytes(raw)
                by_test = fate == "killed" and not by.startswith("signal")
                if by_test and run_tests(folder, 300.0, [by])[0] != "survived":
                    fate = "unclear"  # the test fails without the mutant, too
            fates[fate] += 1
            told = f"{path}:{line}: {raw[begin:end].decode()!r} -> {new!r}"
            print(f"{fate:<9} {time.perf_counter() - since:6.1f} s  {told}  {by}", flush=True)
    print(", ".join(f"{count} {fate}" for fate, count in fates.items()))


if __name__ == "__main__":
    main()
