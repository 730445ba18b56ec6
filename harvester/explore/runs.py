"""The buttons that run an engine in the background, with progress, a way to cancel, and the points that come out."""

import contextlib
import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from html import escape
from typing import Any

import panel as pn

from harvester.engines.selection import ENGINES
from harvester.explore.html_text import plain
from harvester.explore.widgets import button, column, field, flow, words
from harvester.machine.processes import SAFE
from harvester.machine.system import this_system
from harvester.presentation.diagnostic import Diagnostic

# seconds that processes get to end by themselves; between two looks at them
PATIENCE, LOOK = 2.0, 0.02
Listener = Callable[[dict[str, Any]], None]


class Background:
    """A run in a process ``group`` of its own.

    ``listener`` gets each of its JSON objects, in a thread of its own.

    The last one has ``answer``, ``error`` or ``cancelled``.
    """

    def __init__(
        self, tables: dict[str, Any], engine: str, within: str, listener: Listener
    ) -> None:
        self._listener = listener
        self._cancelled = False
        self._process = subprocess.Popen(
            [sys.executable, "-m", "harvester.explore.job", engine, within],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, **SAFE},
            **this_system.own_group(),
        )
        self.group = self._process.pid
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it died at once, and stdout will say nothing
            self._process.stdin.write(json.dumps(tables) + "\n")
            self._process.stdin.flush()
        threading.Thread(target=self._listen, daemon=True).start()

    def cancel(self) -> None:
        """End the run and all the processes that it started: it ends itself when its stdin is closed."""
        self._cancelled = True
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()

    def _listen(self) -> None:
        """Hand on the output of the process; at its end, report if it ended without any."""
        ended = False
        with self._process as process:
            for line in process.stdout or ():
                with contextlib.suppress(ValueError):
                    said = json.loads(line)
                    if not isinstance(said, dict) or self._cancelled:
                        continue
                    ended = ended or "answer" in said or "error" in said
                    self._listener(said)
            self._end_group()
        status = self._process.returncode
        if self._cancelled:
            self._listener({"cancelled": True})
        elif not ended:
            self._listener({"error": f"the run ended without an answer (status {status})"})

    def _end_group(self) -> None:
        """Wait until the processes of the run have ended, which free their shared memory, and kill those left."""
        for _ in range(round(PATIENCE / LOOK)):
            if not this_system.group_lives(self.group):
                return
            self._process.poll()
            time.sleep(LOOK)
        this_system.kill_group(self.group)


SAMPLERS = tuple(name for name, kind in ENGINES.items() if kind.samples)
# drawn as points
POINTS = tuple(name for name, kind in ENGINES.items() if kind.samples or kind.by_mean_current)
Point = tuple[dict[str, Any], str, float]  # tables of a design, and a key with its value


class RunPanel:
    """The buttons of a page and the points of its runs.

    ``point`` gives tables, key and value of the working point, or None; ``changed`` is reported
    when a run has ended; ``soon`` calls a function on the page's thread.
    """

    def __init__(
        self,
        point: Callable[[], Point | None],
        changed: Callable[[], None],
        soon: Callable[[Callable[[], None]], None],
    ) -> None:
        self._point = point
        self._changed = changed
        self._soon = soon
        self.points: list[dict[str, Any]] = []
        self._running: dict[str, Background] = {}
        self._begun: dict[str, Point] = {}
        self.within = field(
            pn.widgets.Select,
            "within",
            options=["5%", "2%", "1%", "0.5%"],
            value="2%",
            width=76,
            margin=(4, 10, 4, 4),
        )
        self.buttons = {}
        self.cancels = {}
        self.bars = {}
        self.why, self.outcome = (
            words(name, margin=(0, 0, 2, 2)) for name in ("why-not", "run-told")
        )
        for engine in SAMPLERS:
            self.buttons[engine] = self._button(f"Run {engine}", engine, "run", self._start)
            self.cancels[engine] = self._button("Cancel", engine, "cancel", self._cancel)
            self.cancels[engine].visible = False
            self.bars[engine] = field(
                pn.indicators.Progress,
                f"bar-{engine}",
                value=0,
                max=100,
                width=110,
                height=8,
                margin=(14, 8, 4, 2),
                visible=False,
            )
        parts = [
            part for e in SAMPLERS for part in (self.buttons[e], self.bars[e], self.cancels[e])
        ]
        label = words("within-what", "within", sizing_mode=None, margin=(10, 0, 4, 6))
        self.view = column(flow(*parts, label, self.within), self.why, self.outcome)

    def _button(self, name: str, engine: str, kind: str, action: Callable[[str], None]) -> Any:
        return button(name, f"{kind}-{engine}", lambda: action(engine), right=6)

    def serve(self, refusals: dict[str, Diagnostic | None]) -> None:
        """Let those engines be run that support the scene, and state below why the others are greyed."""
        reasons = [
            f"{name}: {why}"
            for name, why in refusals.items()
            if name in SAMPLERS and why is not None
        ]
        without = [name for name in SAMPLERS if name not in refusals]
        reasons += [
            f"{' and '.join(without)}: for a load that is a netlist, such as a bridge"
        ] * bool(without)
        items = "".join(f"<li>{escape(plain(reason))}</li>" for reason in reasons)
        self.why.object = (
            f"<details><summary>Why some are grey</summary><ul>{items}</ul></details>"
            if reasons
            else ""
        )
        for engine in SAMPLERS:
            known = engine in refusals and refusals[engine] is None
            self.buttons[engine].disabled = engine in self._running or not known

    def _start(self, engine: str) -> None:
        point = self._point()
        if point is None or engine in self._running:
            return
        self._begun[engine] = point
        self.outcome.object = ""
        self._show(engine, running=True)
        self._running[engine] = Background(
            point[0],
            engine,
            self.within.value,
            lambda said: self._soon(lambda: self._take(engine, said)),
        )

    def _cancel(self, engine: str) -> None:
        if engine in self._running:
            self._running[engine].cancel()

    def _show(self, engine: str, running: bool) -> None:
        self.buttons[engine].disabled = running
        self.cancels[engine].visible = self.bars[engine].visible = running
        # moving: nobody knows yet how long compiling and settling take
        self.bars[engine].value = -1

    def _take(self, engine: str, said: dict[str, Any]) -> None:
        """Accept the output of a run."""
        if "fraction" in said:
            self.bars[engine].value = max(1, min(round(100 * said["fraction"]), 100))
            return
        self._running.pop(engine, None)
        self._show(engine, running=False)
        if "answer" in said:
            self.add(engine, self._begun[engine], said)
        elif "error" in said:
            self.outcome.object = (
                f'<div class="error">{escape(engine)}: {escape(plain(said["error"]))}</div>'
            )
        else:
            self.outcome.object = f'<div class="by">{escape(engine)} was cancelled.</div>'
        self._changed()

    def add(self, engine: str, begun: Point, said: dict[str, Any]) -> None:
        """Take the answer of a run in the place of that of the same point, unless that is known better."""
        new = _point(engine, begun, said)
        same = ("engine", "key", "x", "rest")
        before = [run for run in self.points if all(run[name] == new[name] for name in same)]
        best = min(
            [*before, new], key=lambda run: (not run["settled"], float(run["error"]) or math.inf)
        )
        self.points = [run for run in self.points if run not in before] + [best]

    def shown(self, tables: dict[str, Any], key: str) -> list[dict[str, Any]]:
        """The points over a key; ``own`` states that one is of this very design but for the key."""
        rest = without(tables, key)
        return [run | {"own": run["rest"] == rest} for run in self.points if run["key"] == key]

    def drawn(self, tables: dict[str, Any], key: str) -> list[dict[str, Any]]:
        """As `shown`, for the picture: a power that has not settled is pale, as another design's, and in no line."""
        return [run | {"own": run["own"] and run["settled"]} for run in self.shown(tables, key)]

    def close(self) -> None:
        """Kill all runs."""
        for run in [*self._running.values()]:
            run.cancel()


def _point(engine: str, begun: Point, said: dict[str, Any]) -> dict[str, Any]:
    """A run's answer as a point of the picture.

    ``error`` is the known part of its 95 % error, ``known`` if all is.
    """
    tables, key, at = begun
    power = said["answer"]["mean_power"]
    return {
        "engine": engine,
        "key": key,
        "x": at,
        "y": power["value"],
        "error": said["known_error95"],
        "known": power["error95"] is not None,
        "settled": said["settled"],
        "share": said["answer"].get("share_of_possible"),
        "rest": without(tables, key),
        "row": said["row"],
        "text": said["power"],
        "voltage": said["voltage"],
        "warnings": said["answer"]["warnings"],
    }


def without(tables: dict[str, Any], key: str) -> str:
    """The identity of a design but for one key and its title."""
    copy = json.loads(json.dumps(tables))
    copy.pop("title", None)
    table, *names = key.split(".")
    inside = copy.get(table, {})
    for name in names[:-1]:
        inside = inside.get(name, {})
    inside.pop(names[-1], None)
    return json.dumps(copy, sort_keys=True)
