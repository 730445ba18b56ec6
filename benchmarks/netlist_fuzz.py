"""Random netlists, read by ngspice and by the package: equal, refused, or a fault.

    python benchmarks/netlist_fuzz.py --count 1000 --first 1          counts, and the seeds of each fault
    python benchmarks/netlist_fuzz.py --seed 17                       one netlist with both answers
    python benchmarks/netlist_fuzz.py --seed 17 --small               the fewest of its lines that show the fault
    python benchmarks/netlist_fuzz.py --count 200 --cases FOLDER      keeps the fewest lines of each fault
    python benchmarks/netlist_fuzz.py --file board.cir                the same of a file

The netlists are those of tests/support/netlist_grammar.py, the current that feeds them and
ngspice's answer those of tests/support/ngspice_oracle.py, and the package's is that of its
equations (tests/support/imposed_drive.py), or with --compiled that of its own solver.  Two powers
are the same where they differ by less than a thousandth of the larger one, or by TINY of what the
piezo could give; five times as much of netlists that jump.  The exit status tells whether a fault
was found: another power, an error that is no InputError, or a netlist that does not end.
"""

import argparse
import collections
import contextlib
import json
import re
import signal
import sys
import tempfile
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.support import imposed_drive
from tests.support.netlist_grammar import flat_netlist, is_rough, netlist
from tests.support.ngspice_oracle import LONGEST_STEP, Answer, Oracle

SAME, ROUGH = 1e-3, 5e-3  # relative differences of power
NEAR = 0.05  # below which both are integrated once more with shorter steps
ENDLESS = 1e12  # V, beyond which both grow as long as they are driven, and have no power to compare
TINY = 1e-9  # W, below which powers are equal: the drive gives some 1e-4 W
PATIENCE = 60  # s, for one netlist, its compilation included
AGAIN = 0.5  # s, after which a netlist that was not stopped is stopped once more
SIMPLEST = Path(__file__).parents[1] / "netlists/resistor.cir"
FAULTS = ("DIFFERENT", "CRASHED", "DOES NOT END")
KINDS = (
    "same",
    "refused by us",
    "refused by ngspice",
    "refused by both",
    "our steps fail",
    *FAULTS,
)


class TooLongError(Exception):
    """The package takes too long."""


@contextlib.contextmanager
def limited(seconds):
    """Raise TooLongError after some seconds, and again ever since: a finaliser may swallow one."""

    def late(*_):
        raise TooLongError

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds, AGAIN)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def ours(text, folder, compiled=False, flat=(), patience=PATIENCE):
    """The package's answer, and the kind of fault, if any."""
    file = Path(folder) / "board.cir"
    file.write_text(text)
    try:
        with limited(patience):
            circuit = imposed_drive.read(file, *flat)
            answer = imposed_drive.by_compiled_circuit if compiled else imposed_drive.by_machine
            return answer(circuit), ""
    except TooLongError:
        return Answer(why="does not end"), "DOES NOT END"
    except imposed_drive.NoMachineError as error:
        return Answer(why=f"MACHINE does not have {error}"), ""
    except imposed_drive.InputError as error:
        return Answer(why=str(error)), ""
    except Exception as error:  # whatever it is, it is a fault of the reader
        place = traceback.extract_tb(error.__traceback__)[-1]
        return Answer(
            why=f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"
        ), "CRASHED"


def compared(text, ask, folder, compiled=False, flat=()):
    """The kind of a netlist, and both answers: ngspice's and ours."""
    mine, fault = ours(text, folder, compiled, flat)
    theirs = ask(text, *flat)
    if fault:
        return fault, theirs, mine
    if mine.why.startswith("MACHINE"):
        return "our steps fail" if theirs.given else "refused by ngspice", theirs, mine
    if not mine.given or not theirs.given:
        both = "refused by both" if not theirs.given else "refused by us"
        return both if not mine.given else "refused by ngspice", theirs, mine
    if is_same(text, theirs, mine):
        return "same", theirs, mine
    if apart(theirs, mine) < NEAR:  # which may be the integrations
        fine, finer = finely(text, ask, folder, flat)
        if fine.given and finer.given and is_same(text, fine, finer):
            return "same", fine, finer
    return "DIFFERENT", theirs, mine


def finely(text, ask, folder, flat):
    """ngspice's answer and ours with shorter steps."""
    file = Path(folder) / "board.cir"
    file.write_text(text)
    circuit = imposed_drive.read(file, *flat)
    return ask(text, *flat, step=LONGEST_STEP / 5.0), imposed_drive.by_machine(
        circuit, 1e-5, LONGEST_STEP
    )


def is_same(text, theirs, mine):
    """Whether two answers are equal as far as two integrations can be."""
    if min(theirs.voltage, mine.voltage) > ENDLESS:
        return True
    share = ROUGH if is_rough(text) else SAME
    return abs(theirs.power - mine.power) <= share * max(theirs.power, mine.power) + TINY


def apart(theirs, mine):
    """The difference of two powers over the larger one."""
    return (
        abs(theirs.power - mine.power) / max(theirs.power, mine.power, TINY)
        if theirs.given and mine.given
        else 0.0
    )


def smaller(text, kind, ask, folder, compiled=False, flat=()):
    """The fewest lines of a netlist that show the same kind of fault: for another power, a third of its difference."""
    joined = text.replace("\n\n+", "\n+")
    title = ".title smaller" if flat else "* smaller"
    lines = [
        line
        for line in joined.splitlines()
        if line.strip() and not line.startswith(("* ", ".title"))
    ]

    _, theirs, mine = compared(text, ask, folder, compiled, flat)
    least = min(0.3 * apart(theirs, mine), 0.05)

    def shows(some):
        found, theirs, mine = compared("\n".join([title, *some, ""]), ask, folder, compiled, flat)
        return found == kind and (kind != "DIFFERENT" or apart(theirs, mine) > least)

    if not shows(lines):
        return text
    changed = True
    while changed:
        changed = False
        for k in reversed(range(len(lines))):
            if shows(some := [*lines[:k], *lines[k + 1 :]]):
                lines = some
                changed = True
    return "\n".join([title, *lines, ""])


def drawn(seed):
    """The netlist of a seed, and of every eighth, which is flat, its terminals and its load."""
    if seed % 8:
        return netlist(seed), ()
    text, terminals, load = flat_netlist(seed)
    return text, (terminals, load)


def run(seeds, ask, folder, compiled, told):
    """The kinds of many netlists: their seeds, with what was said."""
    found = collections.defaultdict(list)
    begin = time.perf_counter()
    for count, seed in enumerate(seeds, 1):
        text, flat = drawn(seed)
        kind, theirs, mine = compared(text, ask, folder, compiled, flat)
        found[kind].append((seed, theirs, mine))
        if kind in FAULTS:
            told(f"seed {seed}: {kind}: {said(theirs)} | {said(mine)}")
        if count % 200 == 0:
            rate = (time.perf_counter() - begin) / count
            told(
                f"{count}: "
                + ", ".join(f"{kind} {len(some)}" for kind, some in found.items())
                + f" ({rate:.3f} s each)"
            )
    return found


def general(why):
    """A reason without the names and numbers of one netlist."""
    why = re.sub(
        r"(board\.cir )?line \d+",
        "line N",
        re.sub(r"(element|model|parameter|card) \S+", r"\1 X", why),
    )
    return re.sub(r"'[^']*'|\[[^\]]*\]|[-+]?\d[\w.+-]*", "N", why)[:90]


def said(answer):
    """An answer in a few words."""
    return (
        f"{answer.power * 1e6:.5g} uW, {answer.voltage:.4g} V" if answer.given else answer.why[:110]
    )


def show(text, flat, ask, folder, compiled, small):
    """Print one netlist with both answers; whether it is a fault."""
    kind, theirs, mine = compared(text, ask, folder, compiled, flat)
    if small and kind in FAULTS:
        text = smaller(text, kind, ask, folder, compiled, flat)
        kind, theirs, mine = compared(text, ask, folder, compiled, flat)
    print(text, *flat)
    print(f"{kind}\n  ngspice: {said(theirs)}\n  ours:    {said(mine)}")
    return kind in FAULTS


def keep(found, cases, ask, folder, compiled, most):
    """Write the fewest lines of faults as files, and ngspice's answers as JSON."""
    cases.mkdir(parents=True, exist_ok=True)
    index = cases / "answers.json"
    answers = json.loads(index.read_text()) if index.exists() else {}
    for kind in FAULTS:
        for seed, *_ in found[kind][:most]:
            text, flat = drawn(seed)
            text = smaller(text, kind, ask, folder, compiled, flat)
            theirs = ask(text, *flat)
            if text in {(cases / f"{name}.cir").read_text() for name in answers}:
                continue
            name = f"seed_{seed}"
            (cases / f"{name}.cir").write_text(text)
            answers[name] = (
                {"power": theirs.power, "voltage": theirs.voltage}
                if theirs.given
                else {"refused": theirs.why}
            )
            index.write_text(json.dumps(answers, indent=1, sort_keys=True) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--file", type=Path)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--compiled", action="store_true")
    parser.add_argument("--cases", type=Path)
    parser.add_argument("--most", type=int, default=30, help="cases kept of each kind")
    parser.add_argument("--library", default="", help="another ngspice library")
    given = parser.parse_args()
    with Oracle(given.library) as ask, tempfile.TemporaryDirectory() as folder:
        imposed_drive.answered(SIMPLEST)  # which compiles the machine
        if given.seed is not None or given.file is not None:
            text, flat = drawn(given.seed) if given.file is None else (given.file.read_text(), ())
            sys.exit(show(text, flat, ask, folder, given.compiled, given.small))
        seeds = range(given.first, given.first + given.count)
        found = run(seeds, ask, folder, given.compiled, lambda line: print(line, flush=True))
        for kind in KINDS:
            print(f"{kind}: {len(found[kind])}")
        for whose, kinds in (
            ("ours", ("refused by us",)),
            ("ngspice's", ("refused by ngspice", "refused by both")),
        ):
            answers = [
                (theirs if whose != "ours" else mine)
                for kind in kinds
                for _, theirs, mine in found[kind]
            ]
            print(f"{whose}:")
            for why, count in collections.Counter(
                general(answer.why) for answer in answers
            ).most_common(25):
                print(f"  {count} x {why}")
        if given.cases is not None:
            keep(found, given.cases, ask, folder, given.compiled, given.most)
    sys.exit(any(found[kind] for kind in FAULTS))


if __name__ == "__main__":
    main()
