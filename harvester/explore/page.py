"""One user's page: its draft, its pictures, and its reactions when a slider turns.

Long because every part of the page hears here of each result.
"""

import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import panel as pn

from harvester.errors import HarvesterError, InputError
from harvester.explore import html_text
from harvester.explore.beside import CHIP, PACKETS, Beside, of_chip, of_coil, of_path, sentence
from harvester.explore.computing import Computing, PageRequest
from harvester.explore.draft import PARAMETER, RESISTANCE, Draft, differences
from harvester.explore.knobs import Knobs
from harvester.explore.live import Live
from harvester.explore.looks import CHART, PICTURES
from harvester.explore.pictures import PathPlots, PowerPlot, pinned_curve
from harvester.explore.runs import RunPanel
from harvester.explore.slider_scale import Slide
from harvester.explore.toolbar import FilesBar, PinBar, RealDeviceBar
from harvester.explore.widgets import column, field, flow, words
from harvester.presentation.glossary import GLOSSARY

PLOT_AFTER = 120  # ms until the plot of another axis is drawn: the circuit's power is shown before


class Explorer:
    """The page of one user."""

    def __init__(self, draft: Draft, error: str = "") -> None:
        self.draft = draft
        self.document = pn.state.curdoc
        self._ended = threading.Event()
        self.folder = tempfile.TemporaryDirectory(prefix="harvester-explore-")
        self.live: Live | None = None
        self._request: PageRequest | None = None
        self.pinned: tuple[dict[str, Any], Live] | None = None
        self._warnings: list[str] = []
        self._beside = Beside()
        # the design that the table of answers is of; paler of another one
        self._answered: dict[str, Any] = {}
        # a design, and why the power of its circuit is not known
        self._unknown: tuple[dict[str, Any], str] = ({}, "")
        self._computing = Computing(self, self.soon)
        self.error = words("error-line")
        self.headline, self.answers, self.warnings = map(words, ("headline", "answers", "warnings"))
        others = ("meaning", "difference", "path-told", "life")
        self.meaning, self.difference, self.path_told, self.life = map(words, others)
        self.axis = field(
            pn.widgets.Select, "axis", options=["load.resistance"], width=210, margin=0
        )
        # Not where the key is gone with a circuit: `_axis` chooses another on the way to what is
        # asked for then.
        self.axis.param.watch(
            lambda event: self.changed("") if event.old in self.axis.options else None, "value"
        )
        self.plot = pn.pane.Bokeh(
            None, sizing_mode="stretch_width", height=380, margin=0, stylesheets=[CHART]
        )
        self.power: PowerPlot | None = None
        self._plot_comes: Any = None  # the callback that draws a plot of another axis
        self.paths = PathPlots()
        self.runs = RunPanel(self._point, self._draw, self.soon)
        self.real_device = RealDeviceBar(self.soon)
        self.pin = PinBar(self._pin, self._unpin)
        self.files = FilesBar(Path(self.folder.name), self)
        self.side = column()
        self._renew()
        self.said = words("said", html_text.problem_line(error))
        # what is computed would slow down the first sight of the page
        pn.state.onload(lambda: self.changed(""))

    def roots(self) -> dict[str, Any]:
        """The parts of the page by their names in page.html."""
        label = words(
            "over", '<div class="by">power over</div>', sizing_mode=None, width=76, align="center"
        )
        over = pn.Row(label, self.axis, margin=0, styles={"flex": "0 0 auto"})
        self.headline.styles = {"flex": "1 1 300px"}
        head = flow(self.headline, over, justify_content="space-between")
        return {
            "knobs": self.side,
            "power": column(self.said, self.error, head, self.plot, self.runs.view),
            "numbers": column(self.real_device.view, self.answers, self.life, self.warnings),
            "path": self.path_told,
            "orbit": pn.pane.Bokeh(
                self.paths.orbit, sizing_mode="stretch_width", margin=0, stylesheets=[PICTURES]
            ),
            "voltage": pn.pane.Bokeh(
                self.paths.voltage, sizing_mode="stretch_width", margin=0, stylesheets=[PICTURES]
            ),
            "meaning": self.meaning,
            "compare": column(self.pin.view, self.difference),
            "files": column(self.files.open, self.files.save),
        }

    def _renew(self) -> None:
        """Make the sliders anew, for another scene."""
        self.knobs = Knobs(self.draft, self.changed)
        self.side.objects = [self.knobs.view]

    def replace(self, draft: Draft) -> None:
        """Work on another draft."""
        self.draft = draft
        self._renew()
        self.changed("")

    def changed(self, error: str) -> None:
        """Take notice of a change: an ``error`` is shown.

        Else the formulas and then a path are asked for anew.
        """
        try:
            if error:
                raise InputError(error)
            scene = self.draft.scene()
            key, at, slide = self._axis()
        except HarvesterError as wrong:
            self.error.object = html_text.problem_line(str(wrong))
            return
        self.error.object = ""
        self._request = PageRequest(self.draft.copy(), scene, self.draft.tables(), key, at, slide)
        self._computing.ask(self._request)
        self.real_device.predict(self._request.tables)

    def _axis(self) -> tuple[str, float, Slide]:
        """The key of the axis, its value and its range.

        The load if the chosen key has disappeared.
        """
        options = self.draft.present_keys()
        if not options:
            raise InputError(
                "the scene must have a number to turn, but has none: switch something on"
            )
        load = [key for key in (RESISTANCE, PARAMETER + "R", "nondimensional.mu") if key in options]
        if self.axis.options != options:
            key = self.axis.value if self.axis.value in options else [*load, *options][0]
            self.axis.param.update(options=options, value=key)
        key = self.axis.value
        return key, self.draft.value(key), self.knobs.slide_of(key)

    def fail(self, text: str) -> None:
        """State that there is no answer, and why."""
        self.error.object = html_text.problem_line(text)

    def say_of_path(self, text: str) -> None:
        """State the progress of the path."""
        self.path_told.object = html_text.by(text)

    def show_path(self, request: PageRequest, path: dict[str, Any]) -> None:
        """Draw a path, and state next to the power how far it reached."""
        self.paths.show(path)
        sizes = of_path(request.scene, path)
        self.say_of_path(sentence(path, sizes))
        self._known_beside(
            request, {f"{name} of a trajectory": size for name, size in sizes.items()}
        )

    def show_life(self, request: PageRequest, life: dict[str, Any]) -> None:
        """State how the node lives of the device, as a table and next to the power."""
        self.life.object = html_text.life(life)
        if "error" not in life:
            self._known_beside(request, life["short"])

    def _known_beside(self, request: PageRequest, facts: dict[str, str]) -> None:
        """Keep the facts next to the power of a design, of those that are shown, and state them."""
        self._beside.add(request.tables, facts, self.pinned[0] if self.pinned else None)
        self._draw_words()

    def soon(self, action: Callable[[], None]) -> None:
        """Call a function on the server's thread, on which the page may change.

        Nothing if it is closed.
        """
        document = self.document
        if document is None or document.session_context is None or self._ended.is_set():
            return

        def act() -> None:
            with pn.io.hold(document):
                action()

        document.add_next_tick_callback(act)

    def show(self, request: PageRequest, snapshot: Live, rested: bool) -> None:
        """Draw the formulas' results, and let those engines be run that support the scene.

        Tables make the browser lay out the whole page anew, and wait until the sliders have
        ``rested``.  If it is not known yet which engines support it, the picture waits for the
        circuit power.
        """
        self.live, self._drawn = snapshot, request
        self._beside.add(
            request.tables, of_coil(snapshot.problem), self.pinned[0] if self.pinned else None
        )
        if snapshot.serving:
            self.runs.serve(snapshot.serving)
            self._draw(rested)

    def show_power(self, request: PageRequest, answer: dict[str, Any]) -> None:
        """Draw and state the circuit's own results; ``error``: why that is not known."""
        if "error" in answer:
            self._unknown = request.tables, answer["error"]
        else:
            self.runs.add(answer["engine"], (request.tables, request.key, request.at), answer)
            if request.tables == self._drawn.tables and CHIP in answer["answer"]["details"]:
                self._show_chip(request, answer["answer"]["details"])
        self._draw(self._answered == self._drawn.tables)

    def _show_chip(self, request: PageRequest, details: dict[str, float]) -> None:
        """Show how a chip's load and store live, as a table and next to the power."""
        rows = of_chip(details, {} if self.live is None else self.live.problem.load.values)
        self.life.object = html_text.life({"heads": ("the chip", ""), "rows": rows, "remarks": []})
        self._beside.add(request.tables, dict(rows[:2]), self.pinned[0] if self.pinned else None)

    def mean(self, text: str, warnings: list[str]) -> None:
        """State the meaning of the numbers."""
        self.meaning.object, self._warnings = text, warnings
        self._draw_words()

    def _draw(self, rested: bool = True) -> None:
        """Draw the results, and state them in all its words if the sliders have ``rested``."""
        if self.live is None:
            return
        self._draw_words(rested)
        request, document = self._drawn, self.document
        if self.power is not None and (self.power.key, self.power.slide) == (
            request.key,
            request.slide,
        ):
            self._draw_curves()
        elif self.power is None or document is None or document.session_context is None:
            self._draw_new_plot()
        elif self._plot_comes is None:  # it takes longer than the power that is to be shown first
            self._plot_comes = document.add_timeout_callback(self._draw_new_plot, PLOT_AFTER)

    def _draw_new_plot(self) -> None:
        """Draw the curves in a plot of the present axis, all in one message to the browser."""
        self._plot_comes = None
        self.power = PowerPlot(self._drawn.key, self._drawn.slide)
        with pn.io.hold(self.document):
            self.plot.object = self.power.plot
            self._draw_curves()

    def _draw_curves(self) -> None:
        """Draw the curves, the runs and the pinned design."""
        assert self.live is not None and self.power is not None, "the drawing"
        request = self._drawn
        pinned = None
        if self.pinned and self.pinned[1].key == request.key:
            pinned = pinned_curve(self.pinned[1], self.runs.drawn(self.pinned[0], request.key))
        self.power.show(self.live, self.runs.drawn(request.tables, request.key), pinned)

    def _draw_words(self, rested: bool = True) -> None:
        if self.live is None:
            return
        runs = self._runs_at(self._drawn.tables, self.live)
        tables, why = self._unknown
        beside = self._beside.of(self._drawn.tables)
        facts = [f"{name} {fact}" for name, fact in beside.items()]
        self.headline.object = html_text.headline(
            self.live, runs, why if tables == self._drawn.tables else "", facts
        )
        stale = not rested and self._answered != self._drawn.tables
        if self.answers.styles != (shade := {"opacity": "0.35" if stale else "1"}):
            self.answers.styles = shade
        if not rested:
            return
        self._answered = self._drawn.tables
        self.answers.object = html_text.answers(self.live, runs)
        if not beside.get(PACKETS) and not beside.get(GLOSSARY[CHIP].label):
            waiting = '<div class="by">Computing how the node lives ...</div>'
            self.life.object = waiting if "node" in self._drawn.tables else ""
        self.files.show_link()
        self.warnings.object = html_text.warnings(self.live, runs, self._warnings)
        self.difference.object = ""
        if self.pinned is None:
            return
        tables, before = self.pinned
        was = html_text.power_here(before, self._runs_at(tables, before))
        rows = differences(tables, self._drawn.tables)
        known = (self._beside.of(tables), beside)
        self.difference.object = html_text.difference(
            rows, was, html_text.power_here(self.live, runs), known
        )

    def _runs_at(self, tables: dict[str, Any], live: Live) -> list[dict[str, Any]]:
        """The runs at the working point of a design."""
        return [run for run in self.runs.shown(tables, live.key) if run["x"] == live.at]

    def _point(self) -> tuple[dict[str, Any], str, float] | None:
        """The working point for a run in the background: the sliders' values, be it drawn yet or not."""
        return (
            None
            if self._request is None
            else (self._request.tables, self._request.key, self._request.at)
        )

    def _pin(self) -> None:
        if self.live is not None:
            self.pinned = (self._drawn.tables, self.live)
            self.pin.show(True)
            self._draw()

    def _unpin(self) -> None:
        self.pinned = None
        self.pin.show(False)
        self._draw()

    def shown_runs(self) -> list[dict[str, Any]]:
        """The runs over the key of the axis."""
        return self.runs.shown(self._drawn.tables, self._drawn.key)

    def close(self) -> None:
        """End all that belongs to the page."""
        self._ended.set()
        self._computing.close()
        self.real_device.close()
        self.runs.close()
        self.folder.cleanup()
