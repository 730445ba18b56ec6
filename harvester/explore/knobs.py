"""The sliders of the page: for every key a field and a slider, for every effect a switch, in a card for each table.

A `Knob` is one key: a field and a slider for a number, a choice or a text for anything else.
"""

from collections.abc import Callable
from html import escape
from typing import Any, ClassVar

import panel as pn

from harvester.errors import InputError
from harvester.explore import circuits, html_text
from harvester.explore.draft import PARAMETER, PROFILE, RESISTANCE, WORDS, Draft
from harvester.explore.effects import EffectCard, possible
from harvester.explore.looks import CARD, CHECKBOX, INK, PICTURE, SLIDER
from harvester.explore.slider_scale import STEPS, Slide, slide
from harvester.explore.texts import meaning_of, unit_on_page
from harvester.explore.widgets import column, field, flow, words
from harvester.records.profiles.catalogue import PROFILES
from harvester.scene.physical import FILES

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
        kind: Any = pn.widgets.Select if key == PROFILE else pn.widgets.TextInput
        choices = {"options": [*PROFILES]} if key == PROFILE else {"description": meaning_of(key)}
        self.view = field(
            kind,
            "word",
            f"knob-{key.replace('.', '-')}",
            name=key.rpartition(".")[2].replace("_", " "),
            value=self._word(),
            sizing_mode="stretch_width",
            margin=(2, 8, 5, 0),
            **choices,
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


AFTER = 250  # ms until the sliders of a circuit that was chosen are there
_CARDS = {
    "load": "Load",
    "oscillator": "Oscillator",
    "piezo": "Piezo",
    "stop": "Stop",
    "excitation": "Excitation",
}


class Knobs:
    """All cards of a draft; ``changed`` is called after each change, with an error if a text could not be read."""

    def __init__(self, draft: Draft, changed: Changed) -> None:
        self.draft = draft
        self._changed = changed
        self._quiet = False
        self.knobs: dict[str, list[Any]] = {}  # several where effects share a key
        self.switches: dict[EffectCard, Any] = {}
        self._bodies: dict[EffectCard, Any] = {}
        self._blocks: dict[EffectCard, Any] = {}
        self.pictures: dict[str, Any] = {}
        self._load = column()
        cards = [self._card(table) for table in _CARDS]
        if draft.beside:
            text = html_text.without_knobs(draft.beside)
            cards.insert(0, words("beside", text, sizing_mode=None, margin=(5, 10)))
        self.view = column(*cards)
        self.refresh()

    def _card(self, table: str) -> Any:
        inside: list[Any] = [
            self._block(effect) for effect in self.draft.effects if effect.table == table
        ]
        if table == "load" and self.draft.physical:
            inside = [self._circuits(), self._load, *inside]
            self._fill_load()
        return pn.Card(
            *inside,
            title=_CARDS[table],
            sizing_mode="stretch_width",
            margin=(0, 0, 10, 0),
            stylesheets=[CARD],
            css_classes=["card", f"card-{table}"],
            header_background="transparent",
            active_header_background="transparent",
            header_color=INK,
        )

    def _block(self, effect: EffectCard) -> Any:
        """An effect's switch, and under it its sliders."""
        self._bodies[effect] = column()
        parts = [self._bodies[effect]]
        if not effect.fixed:
            switch = pn.widgets.Checkbox(
                name=effect.label,
                value=self.draft.has(effect),
                margin=(3, 0, 2, 0),
                stylesheets=[CHECKBOX],
                css_classes=["switch", "switch-" + effect.keys[0].replace(".", "-")],
            )
            switch.param.watch(lambda event: self._switched(effect, event.new), "value")
            self.switches[effect] = switch
            parts.insert(0, switch)
        self._blocks[effect] = column(*parts)
        return self._blocks[effect]

    def _fill(self, effect: EffectCard) -> None:
        """Make the sliders of an effect when it is first present: most never are, and each needs some time."""
        body = self._bodies[effect]
        if not body.objects:
            body.objects = [
                pn.pane.HTML("", margin=(0, 0, 4, 2), css_classes=["file"])
                if key.partition(".")[2] in FILES
                else self._knob(key).view
                for key in effect.keys
            ]

    def _knob(self, key: str) -> Any:
        made = (WordKnob if key in WORDS else Knob)(self.draft, key, self._changed)
        self.knobs.setdefault(key, []).append(made)
        return made

    def _circuits(self) -> Any:
        """The pictures of the circuits."""
        for name in circuits.names():
            button = pn.widgets.Button(
                name=circuits.label(name),
                icon=circuits.picture(name),
                icon_size="6.9em",
                width=107,
                height=74,
                margin=(0, 6, 6, 0),
                css_classes=["circuit", f"circuit-{name}"],
                stylesheets=[PICTURE],
            )
            button.on_click(lambda _, name=name: self._choose(None if name == "resistor" else name))
            self.pictures[name] = button
        return flow(*self.pictures.values(), margin=(2, 0, 6, 0))

    def _choose(self, netlist: str | None) -> None:
        if netlist == self.draft.netlist and self.draft.loaded:
            return
        try:
            self.draft.choose(netlist)
        except InputError as error:
            self._changed(str(error))
            return
        self._changed("")
        document = pn.state.curdoc
        if document is None or document.session_context is None:
            self._refresh_load()
        else:  # which takes longer than the circuit's power: the browser lays out the whole page anew for each part
            self._load.styles = {"opacity": "0.35", "pointer-events": "none"}
            document.add_timeout_callback(self._refresh_load, AFTER)

    def _refresh_load(self) -> None:
        """Make the sliders of another load, and show the draft's values of the others."""
        self._fill_load()
        self._load.styles = {}
        self.refresh()

    def _fill_load(self) -> None:
        """Make the sliders of the load anew: the resistance, or the netlist's parameters."""
        for key in [key for key in self.knobs if key.startswith(PARAMETER) or key == RESISTANCE]:
            del self.knobs[key]
        if not self.draft.loaded:
            self._load.objects = [pn.pane.HTML("No load yet: choose one.", margin=(0, 0, 4, 2))]
            return
        self._load.objects = [self._knob(key).view for key in self.draft.load_keys]

    def _switched(self, effect: EffectCard, on: bool) -> None:
        if self._quiet:
            return
        try:
            self.draft.switch(effect, on)
        except InputError as error:
            self._changed(str(error))
        self.refresh()
        self._changed("")

    def refresh(self) -> None:
        """Show the draft: values, switches, the visible parts, and the circuit."""
        self._quiet = True
        for effect in self._blocks:
            self._refresh_effect(effect)
        for knob in (knob for knobs in self.knobs.values() for knob in knobs):
            knob.refresh()
        for name, button in self.pictures.items():
            chosen = name == (self.draft.netlist or ("resistor" if self.draft.loaded else ""))
            button.css_classes = ["circuit", f"circuit-{name}", *(["chosen"] if chosen else [])]
        self._quiet = False

    def _refresh_effect(self, effect: EffectCard) -> None:
        """Show whether an effect is there, its sliders, and the names of its files."""
        here = self.draft.has(effect)
        self._blocks[effect].visible = possible(effect, self.draft.on)
        self._bodies[effect].visible = here
        if here:
            self._fill(effect)
        if effect in self.switches:
            self.switches[effect].value = here
        panes = [pane for pane in self._bodies[effect].objects if isinstance(pane, pn.pane.HTML)]
        files = [key for key in effect.keys if key.partition(".")[2] in FILES]
        for pane, key in zip(panes, files, strict=False):
            name = (
                self.draft.files.get(key, "").rpartition("/")[2]
                or "none yet: open a CSV file above"
            )
            pane.object = f'<span style="font-size:13px">{escape(name)}</span>'

    def slide_of(self, key: str) -> Slide:
        """The range of a key's slider."""
        return self.knobs[key][0].slide if key in self.knobs else slide(key, self.draft.value(key))
