"""The controls that predict a real device, pin a design, open files and save contents."""

import io
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import panel as pn

from harvester.errors import InputError, named
from harvester.explore import downloads, html_text, in_worker, links, uploads
from harvester.explore.computing import POOL, RESTED, Newest
from harvester.explore.draft import Draft
from harvester.explore.in_worker import Overtaken
from harvester.explore.live import Live
from harvester.explore.looks import BUTTON
from harvester.explore.widgets import button, column, field, flow, words
from harvester.studies.prediction.priors import data
from harvester.uncertainty.value import duration

ARROW = (  # Panel's own would be fetched from another server
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="2">'
    '<path d="M12 4V15M7 11L12 16L17 11M5 20H19"/></svg>'
)

TablesAndClass = tuple[dict[str, Any], str]  # the scene that is predicted
TIME_LIMIT = 120.0  # s for a prediction: twice the default time of a netlist's devices
WITHOUT_LIMIT = "harvester run --predict has no time limit"
TOO_LATE = f"a real device: no answer within {duration(TIME_LIMIT)}; {WITHOUT_LIMIT}"


class PageShape(Protocol):
    """The part of a page that the files' buttons use."""

    draft: Draft
    live: Live | None

    def replace(self, draft: Draft) -> None:
        """Work on another draft."""
        ...

    def soon(self, action: Callable[[], None]) -> None:
        """Call a function on the page's thread."""
        ...

    def shown_runs(self) -> list[dict[str, Any]]:
        """The runs over the key of the axis."""
        ...


class PinBar:
    """The buttons to pin the present design and, once that is done, to unpin it."""

    def __init__(self, pin: Callable[[], None], unpin: Callable[[], None]) -> None:
        self._unpin = button("Unpin", "unpin", unpin)
        self._unpin.visible = False
        self.view = pn.Row(button("Pin this design", "pin", pin), self._unpin, margin=0)

    def show(self, pinned: bool) -> None:
        """Show "Unpin" if a design is pinned."""
        self._unpin.visible = pinned


class RealDeviceBar:
    """A choice of the device's class, below which its power has an interval; else it is empty.

    The prediction is that of the newest scene, one at a time, in a process of its own.
    """

    def __init__(self, soon: Callable[[Callable[[], None]], None]) -> None:
        self._soon = soon
        self._request: TablesAndClass = ({}, "")
        self._work = Newest(POOL, self._predict)
        self.line = words("real-device")
        self.choice = field(
            pn.widgets.Select,
            "device-class",
            name="predict a real device of the class",
            options=["", *data()["classes"]],
            width=210,
            margin=0,
        )
        self.choice.param.watch(lambda _: self.predict(self._request[0]), "value")
        self.view = column(self.choice, self.line)
        self.close = self._work.close

    def predict(self, tables: dict[str, Any]) -> None:
        """Predict a device of this scene; the interval of an earlier scene is given up."""
        prior = self.choice.value
        self._request = (tables, prior)
        if prior or self.line.object:
            self.line.object = html_text.by("computing a real device ...") * bool(prior)
            self._work.ask(self._request)

    def _predict(self, request: TablesAndClass, overtaken: Overtaken) -> None:
        """In a thread: the prediction, which ends if it is overtaken or lasts too long."""
        if not request[1] or not self._work.rests(RESTED):
            return
        end = time.monotonic() + TIME_LIMIT
        text = html_text.by(TOO_LATE)
        try:
            if answer := in_worker.elsewhere(
                in_worker.prediction, request, overtaken, lambda: time.monotonic() > end, 0.0
            ):
                text = html_text.real_device(answer["prediction"])
        except Exception as error:  # any is one line on the page
            text = html_text.by(f"a real device: {named(error)}")
        self._soon(
            lambda: self.line.param.update(object=text) if request is self._request else None
        )


class FilesBar:
    """The buttons that open files (``open``) and save them (``save``)."""

    def __init__(self, folder: Path, page: PageShape) -> None:
        self._folder, self._page = folder, page
        self.chooser = field(
            pn.widgets.FileInput,
            "open",
            accept=",".join(uploads.KINDS),
            multiple=True,
            sizing_mode="stretch_width",
            margin=(0, 0, 4, 0),
        )
        self.axis = field(
            pn.widgets.TextInput,
            "record-axis",
            name="column to use",
            placeholder="x, y, z or a column",
            width=190,
            margin=(0, 0, 6, 0),
        )
        self.outcome = words("open-told")
        self.chooser.param.watch(lambda _: self._opened(), "value")
        title = words("open-what", "Open a scene (.toml), a record (.csv) or a netlist (.cir)")
        self.open = column(title, self.chooser, self.axis, self.outcome, margin=(0, 0, 10, 0))
        self.failed = words("save-told")
        files = {
            "scene.toml": ("Scene (TOML)", lambda: self._page.draft.toml().encode()),
            "figure.png": ("Figure (PNG)", lambda: downloads.figure(*self._shown(), "png")),
            "figure.svg": ("Figure (SVG)", lambda: downloads.figure(*self._shown(), "svg")),
            "report.html": ("Report (HTML)", lambda: downloads.page(*self._shown()).encode()),
        }
        self.buttons = [self._download(name, label, make) for name, (label, make) in files.items()]
        self.link = words("link", margin=(2, 0, 4, 0))
        self.save = column(self.link, flow(*self.buttons), self.failed)

    def show_link(self) -> None:
        """Show the address that opens the page with this very design; none if it needs files."""
        held = links.held(self._page.draft)
        self.link.object = (
            '<div class="by">A design with files of its own has no link: save the scene.</div>'
            if held is None
            else f'<a href="?scene={held}">Link to this design</a>'
        )

    def _shown(self) -> tuple[Live, list[dict[str, Any]]]:
        if self._page.live is None:
            raise InputError("there is nothing to save yet: the scene has no answer")
        return self._page.live, self._page.shown_runs()

    def _download(self, name: str, label: str, make: Callable[[], bytes]) -> Any:
        def content() -> io.BytesIO:
            self.failed.object = ""
            try:
                return io.BytesIO(make())
            except (
                Exception
            ) as error:  # the page says why there is no such file, and the file says it too
                text = str(named(error))
                self.failed.object = html_text.problem_line(text)
                return io.BytesIO((text + "\n").encode())

        return pn.widgets.FileDownload(
            callback=content,
            filename=name,
            label=label,
            auto=True,
            embed=False,
            width=130,
            margin=(0, 8, 6, 0),
            css_classes=["save-" + name.replace(".", "-")],
            stylesheets=[BUTTON],
            icon=ARROW,
        )

    def _opened(self) -> None:
        """Take the files that were chosen."""
        contents, names = self.chooser.value, self.chooser.filename
        if not contents:
            return
        contents, names = (contents, names) if isinstance(contents, list) else ([contents], [names])
        self.outcome.object = '<div class="by">reading ...</div>'
        draft = self._page.draft
        axis = self.axis.value.strip()
        POOL.submit(self._read, draft, names, contents, axis)

    def _read(self, draft: Draft, names: list[str], contents: list[bytes], axis: str) -> None:
        """Read the files in a thread of its own, so that no other page waits; then the page uses them."""
        try:
            changed, messages = uploads.take(
                draft, uploads.keep(self._folder, names, contents), axis
            )
        except Exception as error:
            line = html_text.problem_line(str(named(error)).replace(f"{self._folder}{os.sep}", ""))
            self._page.soon(lambda: self.outcome.param.update(object=line))
            return
        self._page.soon(lambda: self._taken(changed, messages))

    def _taken(self, draft: Draft, messages: list[str]) -> None:
        self.outcome.object = html_text.by(*messages)
        self._page.replace(draft)
