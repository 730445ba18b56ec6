"""What the parts of the attack share: the count of what was tried, its breaks, and the processes below a program."""

import contextlib
import os
import random
import time
from collections import Counter
from pathlib import Path

from hypothesis.control import BuildContext
from hypothesis.errors import StopTest
from hypothesis.internal.conjecture.data import ConjectureData

TICK = os.sysconf("SC_CLK_TCK")


class Tally:
    """How often each thing was tried and how it ended; each break with the command, what it printed, and its seed."""

    def __init__(self, count, budget, before=()):
        """``before`` is what `found` said of the first of them."""
        before = {"outcomes": (), "breaks": (), "tried": 0, "seconds": 0, **dict(before)}
        self.count = count
        self.begin = time.monotonic()
        self.budget = budget
        self.outcomes, self.breaks = Counter(before["outcomes"]), [*before["breaks"]]
        self.tried, self.seconds = before["tried"], before["seconds"]

    def numbers(self, step=1):
        """Every so many of the numbers that are left, up to the count, as long as the budget (s) lasts."""
        for number in range(self.tried, self.count, step):
            if time.monotonic() - self.begin > self.budget:
                return
            yield number

    def note(self, what, outcome, wrong="", **more):
        """Count one that was tried; where something is ``wrong``, print and keep all that reproduces it."""
        self.tried += 1
        self.outcomes[f"{what}: {outcome}"] += 1
        if wrong:
            self.breaks.append({"what": what, "wrong": wrong, **more})
            print("BREAK", self.breaks[-1], flush=True)

    def found(self):
        """All of it as a dictionary."""
        seconds = round(self.seconds + time.monotonic() - self.begin)
        outcomes = dict(sorted(self.outcomes.items()))
        return {"asked for": self.count, "tried": self.tried, "seconds": seconds, "outcomes": outcomes,
                "breaks": self.breaks}  # fmt: skip


def drawn(strategy, count, seed):
    """So many examples of a hypothesis strategy, the same ones for the same seed, each independent of the others.

    Hypothesis's own loop would vary each one a few times before it draws another, and take ten
    times as long.
    """
    found = []
    number = 0
    while len(found) < count:
        number += 1
        data = ConjectureData(random=random.Random(f"{seed} {number}"))
        # StopTest: it is too large
        with contextlib.suppress(StopTest), BuildContext(data, wrapped_test=drawn):
            found.append(data.draw(strategy))
    return found


def living():
    """For each process that is not a zombie: parent, session, and CPU time (s) with that of its dead children."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = stat.read_text().rpartition(")")[2].split()
            if fields[0] != "Z":
                found[int(stat.parent.name)] = (
                    int(fields[1]),
                    int(fields[3]),
                    sum(map(int, fields[11:15])) / TICK,
                )
    return found


def below(pid):
    """The living processes that descend from one, and itself, with what `living` says of them."""
    every = living()
    tree = [pid]
    for one in tree:
        tree += [child for child, (parent, _, _) in every.items() if parent == one]
    return {one: every[one] for one in tree if one in every}


def processor(pid):
    """Processor time (s) that a process and its descendants have used."""
    return sum(seconds for _, _, seconds in below(pid).values())
