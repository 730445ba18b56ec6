"""One key on the page: a field and a slider for a number, a choice or a text for anything else."""

from collections.abc import Callable
from typing import Any, ClassVar

import panel as pn

from harvester.errors import InputError
from harvester.explore.draft import PROFILE, Draft
from harvester.explore.looks import SLIDER
from harvester.explore.slider_scale import STEPS, Slide, slide
from harvester.explore.texts import meaning_of, unit_on_page
from harvester.explore.widgets import field
from harvester.records.profiles.catalogue import PROFILES

Changed = Callable[[str], None]  # is called with an error, "" if there is none


class QuickField(pn.widgets.TextInput):  # type: ignore[misc]
    """A field whose text is read at once: Panel waits 50 ms for more changes otherwise."""

    _priority_changes: ClassVar[list[str]] = ["value"]


class QuickSlider(pn.widgets.IntSlider):  # type: ignore[misc]
    """A slider whose value is read at once, as that of `QuickField`."""

    _priority_changes: ClassVar[list[str]] = ["value"]


class Knob:
    """The field and the slider of one key."""

    def __init__(self, draft: Draft, key: str, changed: Changed) -> None:
        self.draft = draft
        self.key = key
        self._changed = changed
        self._quiet = False
        self.slide: Slide = slide(self.key, self._value() or 1.0)
        name = key.rpartition(".")[2].replace("_", " ")
        unit = unit_on_page(key)
        description = f"{meaning_of(key)} ({unit})" if unit else meaning_of(key)
        style = f"knob-{key.replace('.', '-')}"
        look = {"description": description, "width": 128, "margin": (0, 6, 2, 0)}
        self.field = field(
            QuickField, "field", style, name=name, value=draft.texts.get(key, ""), **look
        )
        look = {
            "show_value": False,
            "tooltips": False,
            "css_classes": ["slider", style],
            "stylesheets": [SLIDER],
        }
        room = {
            "sizing_mode": "stretch_width",
            "align": "end",
            "margin": (0, 8, 4, 8),
            "min_width": 90,
        }
        position = self.slide.position(self._value() or 1.0)
        self.slider = QuickSlider(name="", start=0, end=STEPS, value=position, **look, **room)
        self.field.param.watch(self._typed, "value")
        self.slider.param.watch(self._turned, "value")
        self.view = pn.Row(
            self.field, self.slider, sizing_mode="stretch_width", margin=(2, 0, 3, 0)
        )

    def _value(self) -> float:
        return self.draft.value(self.key) if self.key in self.draft.texts else 0.0

    def refresh(self) -> None:
        """Show the draft."""
        self._quiet = True
        if self.key in self.draft.texts:
            value = self._value()
            if not self.slide.holds(value):
                self.slide = slide(self.key, value)
            self.field.value = self.draft.texts[self.key]
            self.slider.value = self.slide.position(value)
        self._quiet = False

    def _typed(self, event: Any) -> None:
        if self._quiet:
            return
        try:
            self.draft.type(self.key, event.new)
        except InputError as error:
            self._changed(str(error))
            return
        self.refresh()
        self._changed("")

    def _turned(self, event: Any) -> None:
        if self._quiet:
            return
        try:
            self.draft.turn(self.key, self.slide.value(event.new))
        except InputError as error:
            self._changed(str(error))
            return
        self._quiet = True
        self.field.value = self.draft.texts[self.key]
        self._quiet = False
        self._changed("")


class WordKnob:
    """A key that is not a number: a choice of names for a profile, else a text."""

    def __init__(self, draft: Draft, key: str, changed: Changed) -> None:
        self.draft = draft
        self.key = key
        self._changed = changed
        self._quiet = False
        options: dict[str, Any] = {
            "name": key.rpartition(".")[2].replace("_", " "),
            "sizing_mode": "stretch_width",
            "margin": (2, 8, 5, 0),
        }
        kind: Any = pn.widgets.Select if key == PROFILE else pn.widgets.TextInput
        choices = {"options": [*PROFILES]} if key == PROFILE else {"description": meaning_of(key)}
        self.view = field(
            kind, "word", f"knob-{key.replace('.', '-')}", value=self._word(), **choices | options
        )
        self.view.param.watch(self._chosen, "value")

    def _word(self) -> str:
        return self.draft.words.get(self.key, "")

    def refresh(self) -> None:
        """Show the draft."""
        self._quiet = True
        self.view.value = self._word()
        self._quiet = False

    def _chosen(self, event: Any) -> None:
        if not self._quiet:
            self.draft.type(self.key, event.new)
            self._changed("")
