"""Computations of the app when a slider turns, in threads and in a worker process: the server itself only hands on."""

import contextlib
import dataclasses
import functools
import json
import threading
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from harvester.engines.selection import refusals
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, named
from harvester.explore import circuits, html_text, in_worker
from harvester.explore.draft import Draft
from harvester.explore.in_worker import Job, Overtaken
from harvester.explore.live import Live, PowerCurve, grid, live
from harvester.explore.runs import without
from harvester.explore.slider_scale import Slide
from harvester.scene.scene import Scene

T = TypeVar("T")


class Newest(Generic[T]):
    """Runs ``work(request, overtaken)`` in a pool, one request at a time, always the newest.

    The work reports its own errors: one that it raises is lost, and the next request continues.

    ``overtaken()`` informs the work that a newer request waits, so that it may end early.  `ask`
    never waits.
    """

    def __init__(self, pool: Executor, work: Callable[[T, Callable[[], bool]], None]) -> None:
        self._pool, self._work = pool, work
        self._news = threading.Condition()
        self._waiting: list[T] = []
        self._busy = self._closed = False

    def ask(self, request: T) -> None:
        """Put a request in the place of the one that waits."""
        with self._news:
            self._waiting[:] = [] if self._closed else [request]
            self._news.notify_all()
            if self._busy or self._closed:
                return
            self._busy = True
        self._pool.submit(self._run)

    def close(self) -> None:
        """Begin nothing more."""
        with self._news:
            self._closed = True
            self._waiting.clear()
            self._news.notify_all()

    def rests(self, seconds: float) -> bool:
        """Wait that long, or until something newer is asked for: whether nothing was."""
        with self._news:
            return not self._news.wait_for(self._overtaken, seconds)

    def _overtaken(self) -> bool:
        return self._closed or bool(self._waiting)

    def _run(self) -> None:
        while True:
            with self._news:
                if not self._waiting:
                    self._busy = False
                    return
                request = self._waiting.pop()
            with contextlib.suppress(Exception):
                self._work(request, self._overtaken)


# of all users, most of them waiting; the server's own thread only hands on
POOL = ThreadPoolExecutor(32, "explore")
# seconds without a change before the other formulas follow: the first one's curve is drawn
# meanwhile
PAUSED = 0.06
# seconds without a change before more is computed than a slider needs that goes on turning
RESTED = 0.3
HASTE = 8.0  # the same, of the power of a circuit
# seconds that the power of a circuit may take before the formulas' curves begin to compete with it
FIRST = 0.15
KEPT = 200  # designs whose power is remembered, the last ones
CURVE_POINTS = 9  # of a circuit's curve, none at an end, where half of its mark would be cut off
# seconds that a path may take after it is overtaken: kernels may be compiled meanwhile
PATIENCE = 60.0


class PageRequest(NamedTuple):
    """A computation: the draft, its scene, that as tables, and the key, its value and range on the axis."""

    draft: Draft
    scene: Scene
    tables: dict[str, Any]
    key: str
    at: float
    slide: Slide


class Shown(Protocol):
    """The actions on the answers, on the server's thread: see `harvester.explore.page.Explorer`."""

    def show(self, request: PageRequest, snapshot: Live, rested: bool) -> None:
        """Draw the formulas' results; in all its words if the sliders have ``rested``.

        Without ``serving`` it is that of a circuit whose power is to be drawn first.
        """
        ...

    def show_power(self, request: PageRequest, answer: dict[str, Any]) -> None:
        """Draw and state the circuit's own results; ``error``: why that is not known."""
        ...

    def mean(self, text: str, warnings: list[str]) -> None:
        """State the meaning of the numbers."""
        ...

    def fail(self, text: str) -> None:
        """State that there is no answer, and why."""
        ...

    def say_of_path(self, text: str) -> None:
        """State the progress of the trajectory."""
        ...

    def show_path(self, request: PageRequest, path: dict[str, Any]) -> None:
        """Draw a trajectory."""
        ...

    def show_life(self, request: PageRequest, life: dict[str, Any]) -> None:
        """State how the node lives; ``error``: why that is not known."""
        ...


class Computing:
    """The work of one page, for the newest state of its sliders.

    ``soon`` calls a function on the server's thread.
    """

    def __init__(self, page: Shown, soon: Callable[[Callable[[], None]], None]) -> None:
        self._page, self._soon = page, soon
        self._ended = threading.Event()
        self._shown: Live | None = None  # the last answer that the page has
        # the last fine curves, and what they are of
        self._fine: tuple[Any, dict[str, PowerCurve]] | None = None
        self._circuit: Any = None  # the circuit and the axis whose power was asked for last
        # what circuits give, by their designs as JSON
        self._at_once: dict[str, dict[str, Any]] = {}
        self._curve_of: Any = None  # the circuit and the axis whose curve is drawn
        self._live_work: Newest[PageRequest] = Newest(POOL, self._compute)
        self._path_work: Newest[PageRequest] = Newest(POOL, self._trace)
        self._power_work: Newest[PageRequest] = Newest(POOL, self._power)
        # In another process, which holds up no quick one.
        self._fine_work: Newest[PageRequest] = Newest(POOL, self._fine_power)

    def ask(self, request: PageRequest) -> None:
        """Compute all of it anew; earlier requests are given up."""
        self._live_work.ask(request)

    def close(self) -> None:
        """End the work."""
        self._ended.set()
        for work in (self._live_work, self._path_work, self._power_work, self._fine_work):
            work.close()

    def _compute(self, request: PageRequest, overtaken: Overtaken) -> None:
        """In a thread: the curves, coarse, and when the sliders rest, fine.

        Each if nothing newer waits.

        A slider that is the axis itself moves the working point along a curve that is known.
        """
        try:
            same = (without(request.tables, request.key), request.key, request.slide)
            curves = self._fine[1] if self._fine and self._fine[0] == same else None
            at = functools.partial(live, request.scene, request.key, request.at, request.slide)
            if self._circuit != (request.tables, same) and "netlist" in request.tables.get(
                "load", {}
            ):
                self._circuit = request.tables, same
                self._show(
                    request,
                    Live(Problem(request.scene), request.key, request.at, True),
                    False,
                    more=True,
                )
                self._power_work.ask(request)
                if not self._live_work.rests(FIRST):
                    return
            # the best formula's, long before the others'
            snapshot = at(False, curves=curves, first=True)
            self._show(request, snapshot, False, more=True)
            if not self._live_work.rests(PAUSED):
                return
            snapshot = at(False, overtaken, curves=curves, known=snapshot)
            self._show(request, snapshot, False)
            if not self._live_work.rests(RESTED):
                return
            snapshot = at(True, overtaken) if curves is None else snapshot
            if snapshot is not None:
                self._show(request, snapshot, True)
                self._fine = (same, snapshot.curves)
                self._path_work.ask(request)
        except Exception as error:  # any is one line on the page
            self._soon(functools.partial(self._page.fail, str(named(error))))

    def _show(
        self, request: PageRequest, snapshot: Live | None, rested: bool, more: bool = False
    ) -> None:
        """Hand the formulas' results to the page.

        If ``more`` is to come, with the others' curves as they were.
        """
        if snapshot is not None:
            shown = self._shown
            if (
                more
                and shown is not None
                and (shown.key, shown.instead) == (snapshot.key, snapshot.instead)
            ):
                here = {*snapshot.curves, *snapshot.refused}
                earlier = {name: curve for name, curve in shown.curves.items() if name not in here}
                snapshot = dataclasses.replace(
                    snapshot, curves=earlier | snapshot.curves, earlier=frozenset(earlier)
                )
            self._shown = snapshot
            self._soon(functools.partial(self._page.show, request, snapshot, rested))

    def _trace(self, request: PageRequest, overtaken: Overtaken) -> None:
        """In a thread: the meaning of the numbers, and one trajectory of the scene, from a process of its own."""
        if not self._path_work.rests(RESTED):
            return
        try:
            self._soon(
                functools.partial(self._page.mean, *html_text.meanings(Problem(request.scene)))
            )
        except HarvesterError as error:
            self._soon(functools.partial(self._page.mean, html_text.problem_line(str(error)), []))
        if overtaken():
            return
        self._soon(
            lambda: self._page.say_of_path("computing a path ... (new code is compiled first)")
        )
        path = self._elsewhere(in_worker.path, request, overtaken, PATIENCE)
        if path is not None and "error" in path:
            self._soon(functools.partial(self._page.say_of_path, f"no path: {path['error']}"))
        elif path is not None and not overtaken():
            self._soon(functools.partial(self._page.show_path, request, path))
        if not overtaken() and "node" in request.tables:
            life = self._elsewhere(in_worker.life, request, overtaken, PATIENCE)
            if life is not None and not overtaken():
                self._soon(functools.partial(self._page.show_life, request, life))
        self._foresee(request, overtaken)

    def _power(self, request: PageRequest, overtaken: Overtaken) -> None:
        """In a thread: the circuit's own results, at once, from a process."""
        answer = self._power_at_once(request, overtaken, HASTE, True)
        if answer is not None and "error" not in answer:
            self._soon(functools.partial(self._page.show_power, request, answer))
        self._fine_work.ask(request)

    def _power_at_once(
        self, request: PageRequest, overtaken: Overtaken, patience: float, first: bool
    ) -> dict[str, Any] | None:
        """The circuit's results, from memory if it was asked for before.

        None once that is overtaken.
        """
        name = json.dumps(request.tables, sort_keys=True)
        how = in_worker.QUICK
        given = in_worker.power, request, overtaken, patience, *how
        answer = self._at_once.get(name) or self._elsewhere(*given, first=first)
        if answer is not None:  # that it is not known, too: to try it again takes seconds
            self._at_once[name] = answer
        for old in [*self._at_once][:-KEPT]:
            self._at_once.pop(old, None)
        return answer

    def _foresee(self, request: PageRequest, overtaken: Overtaken) -> None:
        """The results of the other circuits, which are there at once if one of them is chosen."""
        for name in circuits.names() if request.draft.physical else ():
            draft = request.draft.copy()
            if overtaken() or self._ended.is_set():
                return
            draft.choose(None if name == "resistor" else name)
            if name == "bridge":
                refusals(draft.scene())  # which loads what circuits need, 0.4 s, in this process
            # then the first process has nothing else to do
            resistor = "netlist" not in request.tables.get("load", {})
            self._power_at_once(
                request._replace(tables=draft.tables()), overtaken, PATIENCE, resistor
            )

    def _fine_power(self, request: PageRequest, overtaken: Overtaken) -> None:
        """In a thread: the same when the sliders rest, finely and along the axis."""
        if not self._fine_work.rests(RESTED):
            return
        answer = self._elsewhere(in_worker.power, request, overtaken, HASTE, *in_worker.FINE)
        if answer is None:
            return
        self._soon(functools.partial(self._page.show_power, request, answer))
        same = (without(request.tables, request.key), request.key, request.slide)
        for value in (
            ()
            if "error" in answer or self._curve_of == same
            else grid(request.slide, CURVE_POINTS + 2)[1:-1]
        ):
            if overtaken() or self._ended.is_set():
                return
            point = request._replace(
                tables=at_place(request.tables, request.key, float(value)), at=float(value)
            )
            answer = self._elsewhere(in_worker.power, point, overtaken, HASTE, *in_worker.COARSE)
            if answer is not None and "error" not in answer:
                self._soon(functools.partial(self._page.show_power, point, answer))
        self._curve_of = same

    def _elsewhere(
        self,
        job: Job,
        request: PageRequest,
        overtaken: Overtaken,
        patience: float,
        *how: float,
        first: bool = False,
    ) -> dict[str, Any] | None:
        """The result of a function of `in_worker`.

        ``error`` why it does not, None if it was overtaken.
        """
        try:
            return in_worker.elsewhere(
                job, (request.tables, *how), overtaken, self._ended.is_set, patience, first
            )
        except Exception as error:
            return {"error": str(named(error))}


def at_place(tables: dict[str, Any], key: str, value: float) -> dict[str, Any]:
    """The tables of a scene with another value of a key."""
    first, *rest = key.split(".", 1)
    return {**tables, first: at_place(tables.get(first, {}), rest[0], value) if rest else value}
