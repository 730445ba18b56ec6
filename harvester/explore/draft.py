"""The scene that a page works on: every key as the text that is in its field, and the effects that are switched on.

Long because keys, effects, circuit and files of a scene are one state, which is read and written as
a whole.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harvester.errors import InputError
from harvester.explore.effects import EffectCard, effects, present
from harvester.explore.first_values import first_text
from harvester.explore.texts import exactly, in_file, normal, written
from harvester.machine import files
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.keys import read_value
from harvester.scene.load import Load
from harvester.scene.modal_parameters import ModalParameters, modal_parameters
from harvester.scene.physical import FILES, Ball, Magnifier, Mode, Oscillator, Piezo
from harvester.scene.scene import Scene
from harvester.scene.toml import MOST_BYTES, load, loads

PROFILE, HARMONICS = "excitation.profile", "excitation.harmonics"
# keys that are no number, and what they are at first
WORDS = {PROFILE: "walking", HARMONICS: "0.1 g, 0.03 g"}
CARRIED = ("storage", "node", "chip")  # tables that no slider turns, which go with a netlist
RESISTANCE, PARAMETER = "load.resistance", "load.parameters."
MOST_KNOBS = 50  # of a netlist
FIRST = """
title = "A plate against a stop, to begin with"
oscillator = { mass = "40 g", stiffness = "16 N/m", damping = "6.4 mN s/m" }
piezo = { coupling = "1 mN/V", capacitance = "50.2 nF" }
stop = { restitution = 0.96 }
excitation = { acceleration_psd = "1e-5 g^2/Hz" }
load = { resistance = "1 Mohm" }
"""  # the first scene of a page without one: examples/plate_with_stop.toml


class Draft:
    """A scene under edit: it may be wrong at any moment, and `scene` states the fault.

    ``texts`` are those of all keys that were ever present, in or out of the scene; ``on`` the
    effects that are switched on; ``netlist`` the circuit, None for a resistance (or none);
    ``files`` the paths of records by key; ``words`` the keys that are not number; ``load`` the text
    that a flat netlist needs in addition; ``untouched`` the texts of elements as a custom
    netlist has them.
    """

    def __init__(self, scene: Scene, raw: Mapping[str, Any] | None = None) -> None:
        self.physical = scene.physical
        self.title = scene.title
        self.netlist = scene.load.netlist if scene.load else None
        self.texts: dict[str, str] = {}
        self.files: dict[str, str] = {}
        self.words: dict[str, str] = {}
        self.load: dict[str, Any] = {}
        self.loaded = scene.load is not None
        tables = scene.tables()
        self.carried: dict[str, dict[str, Any]] = {}
        self.beside = _taken(tables)
        for table, entries in tables.items():
            for name, value in entries.items() if isinstance(entries, dict) else ():
                self._take(f"{table}.{name}", value, (raw or {}).get(table, {}).get(name))
        has = {*self.texts, *self.files, *self.words}
        self.on: set[EffectCard] = {
            e for e in self.effects if e.fixed or any(key in has for key in e.keys)
        }
        if PROFILE in has:  # whose amplitude and frequency are those of no harmonic
            self.on = {e for e in self.on if e.choice != "shaking" or PROFILE in e.keys}
        self.untouched: dict[str, str] = {}
        self._offer_elements(scene.load)

    @classmethod
    def read(cls, path: str | Path) -> "Draft":
        """The draft of a scene file, its values as they are written there.

        Raises as `harvester.load`.
        """
        return cls(load(path), tomllib.loads(files.read(path, "scene", MOST_BYTES).decode()))

    @classmethod
    def of_text(cls, text: str, folder: Path) -> "Draft":
        """The draft of a scene file's text, whose netlist and records must be in ``folder``.

        Raises as `loads`.
        """
        return cls(loads(text, folder), tomllib.loads(text))

    @property
    def effects(self) -> tuple[EffectCard, ...]:
        """All effects that the scene could have."""
        return effects(self.physical)

    def _take(self, key: str, value: Any, raw: Any) -> None:
        """Take the value of a key, as ``raw``, the text of the file, if there is one."""
        table, _, name = key.partition(".")
        if table in CARRIED:
            self.carried.setdefault(table, {})[name] = value
        elif key == "load.supplies":
            self.load["supplies"] = value
        elif isinstance(value, dict):
            for name, entry in value.items():
                self._take(f"{key}.{name}", entry, raw.get(name) if isinstance(raw, dict) else None)
        elif key.partition(".")[2] in FILES:
            self.files[key] = value
        elif key in WORDS:
            self.words[key] = value if isinstance(value, str) else ", ".join(map(str, raw or value))
        elif key.startswith("load.") and key != "load.netlist" and not isinstance(value, float):
            self.load[key.removeprefix("load.")] = value
        elif isinstance(value, float):
            self.texts[key] = raw if isinstance(raw, str) else exactly(key, value)

    def own_netlist(self, path: str) -> None:
        """Take the circuit of a custom netlist, as its file has it."""
        self.netlist = path
        self.loaded = True
        self.load = {}
        self.texts = {
            key: text for key, text in self.texts.items() if not key.startswith(PARAMETER)
        }
        self._offer_elements(Load(netlist=path))

    def _offer_elements(self, load: Load | None) -> None:
        """Texts for parameters and elements of a custom netlist that the scene does not name, `MOST_KNOBS` in all."""
        if load is None or not load.file:
            return
        circuit = load_circuit(load, self.value("piezo.capacitance") if self.physical else None)
        named = {circuit.own_name(name) for name in load.parameters}
        self.untouched = {}
        for name, value in (circuit.values | circuit.elements).items():
            has_knob = name in circuit.values or len(self.untouched) + len(named) < MOST_KNOBS
            if has_knob and value != 0.0 and name != "Cp" and name.lower() not in named:
                self.untouched[PARAMETER + name] = exactly(PARAMETER + name, value)
        self.texts |= self.untouched

    def has(self, effect: EffectCard) -> bool:
        """Whether an effect is present."""
        return present(effect, self.on)

    def switch(self, effect: EffectCard, on: bool) -> None:
        """Switch an effect on or off.

        On, others of its choice are switched off, and keys without a text get one.
        """
        same = self._said_otherwise(effect) if on else {}
        self.on.discard(effect)
        if on:
            self.texts |= same
            self.on = {
                other for other in self.on if not effect.choice or other.choice != effect.choice
            } | {effect}
            for key in effect.keys:
                if key in WORDS:
                    self.words.setdefault(key, WORDS[key])
                elif key.partition(".")[2] not in FILES:
                    self.texts.setdefault(key, first_text(key, self._modal()))

    def _said_otherwise(self, effect: EffectCard) -> dict[str, str]:
        """The texts of an effect's keys that describe the present device in another way."""
        modal = self._modal()
        values = {} if modal is None else modal.by_key()
        return {key: written(key, values[key]) for key in effect.keys if key in values}

    def _modal(self) -> ModalParameters | None:
        """The device without excitation, stops and load; None if it is wrong or nondimensional."""
        tables: dict[str, dict[str, Any]] = {"oscillator": {}, "piezo": {}}
        for table, name in (key.split(".", 1) for key in self.present_keys()):
            if table in tables:
                tables[table][name] = self.texts[f"{table}.{name}"]
        try:
            return modal_parameters(Oscillator(**tables["oscillator"]), Piezo(**tables["piezo"]))
        except InputError:
            return None

    def value(self, key: str) -> float:
        """The value of a key in SI units."""
        return read_value(key, self.texts[key])

    def type(self, key: str, text: str) -> None:
        """Take a text that was typed; InputError in one line if it is not a value of the key."""
        if key in WORDS:
            self.words[key] = text.strip()
        else:
            self.texts[key] = normal(key, text)

    def turn(self, key: str, value: float) -> None:
        """Set a value in SI units, in the unit of the present text."""
        self.texts[key] = written(key, value, self.texts.get(key, ""))

    def choose(self, netlist: str | None) -> None:
        """Choose another circuit (None: a resistance), with a known load resistance."""
        before = self.texts.get(
            PARAMETER + "R" if self.netlist is not None else RESISTANCE, "1 Mohm"
        )
        self.netlist = netlist
        self.loaded = True
        self.load = {}
        self.untouched = {}
        self.texts = {
            key: text for key, text in self.texts.items() if not key.startswith(PARAMETER)
        }
        if netlist is None:
            self.texts[RESISTANCE] = before
            return
        circuit = load_circuit(
            Load(netlist=netlist), self.value("piezo.capacitance") if self.physical else None
        )
        for name, value in circuit.values.items():
            if name != "Cp":  # that of the piezo, as long as the scene does not say otherwise
                self.texts[PARAMETER + name] = written(PARAMETER + name, value)
        self.texts[PARAMETER + "R"] = before

    @property
    def load_keys(self) -> list[str]:
        """The keys with a number of the present load."""
        if self.netlist is not None:
            return self.parameters
        return [RESISTANCE] * (self.physical and RESISTANCE in self.texts and self.loaded)

    @property
    def parameters(self) -> list[str]:
        """The keys of the netlist's parameters."""
        return [key for key in self.texts if key.startswith(PARAMETER)]

    def _named(self) -> list[str]:
        """The keys of the parameters that the scene has: elements of a custom netlist once they are changed."""
        return [key for key in self.parameters if self.texts[key] != self.untouched.get(key)]

    def present_keys(self) -> list[str]:
        """The keys with a number that the scene has, in the order of the page."""
        keys = [key for e in self.effects if self.has(e) for key in e.keys if key in self.texts]
        return [*dict.fromkeys(keys), *self.load_keys]

    def tables(self) -> dict[str, Any]:
        """The scene as the nested tables of a scene file.

        InputError if a record is wanted and none is there.
        """
        tables: dict[str, Any] = {"title": self.title} if self.title else {}
        if not self.physical:
            tables["nondimensional"] = {}
        for key in (key for effect in self.effects if self.has(effect) for key in effect.keys):
            table, name = key.split(".", 1)
            if (value := self._in_file(key)) is not None:
                tables.setdefault(table, {})[name] = value
        if self.netlist is None:
            for key in self.load_keys:
                tables["load"] = {"resistance": in_file(key, self.texts[key])}
            return tables | self.beside
        values = {
            key.removeprefix(PARAMETER): in_file(key, self.texts[key]) for key in self._named()
        }
        tables["load"] = {"netlist": self.netlist, **self.load} | (
            {"parameters": values} if values else {}
        )
        return tables | self.beside | self.carried

    def _in_file(self, key: str) -> Any:
        """The entry of a scene file for a key; None if it has no text."""
        if key.partition(".")[2] in FILES:
            if key not in self.files:
                raise InputError(
                    f"{key} must be a CSV file, but none is open: open one under 'Open and save'"
                )
            return self.files[key]
        if key == HARMONICS:
            return [part.strip() for part in self.words[key].split(",")]
        if key in WORDS:
            return self.words[key]
        return in_file(key, self.texts[key]) if key in self.texts else None

    def check_knobs(self) -> None:
        """Raise InputError for a netlist or a link with more parameters than a page has sliders."""
        if (count := len(self.parameters)) > MOST_KNOBS:
            raise InputError(
                f"a netlist must have at most {MOST_KNOBS} parameters, each a slider here, "
                f"but has {count}"
            )

    def scene(self) -> Scene:
        """The scene; InputError with the first thing that is wrong."""
        return Scene(**self.tables())

    def toml(self) -> str:
        """The scene file, values as they were typed.

        Paths of files are those next to the scene file.
        """
        import tomli_w

        tables = self.tables()
        for table, name in (("load", "netlist"), *(("excitation", record) for record in FILES)):
            path = tables.get(table, {}).get(name)
            if path and "/" in path:
                tables[table][name] = (
                    f"./{Path(path).name}" if name == "netlist" else Path(path).name
                )
        return tomli_w.dumps(tables)

    def copy(self) -> "Draft":
        """Another draft of the same content."""
        other = object.__new__(Draft)
        other.__dict__.update(self.__dict__)
        other.texts = dict(self.texts)
        other.files = dict(self.files)
        other.on = set(self.on)
        other.words, other.load = dict(self.words), dict(self.load)
        return other


def _taken(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables that the page has no sliders for, removed from a scene's: they stay as they are."""
    return {
        table: tables.pop(table)
        for table in (Mode.TABLE, Magnifier.TABLE, Ball.TABLE)
        if table in tables
    }


def first() -> Draft:
    """The draft that a page begins with if no scene is given."""
    return Draft(loads(FIRST), tomllib.loads(FIRST))


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The keys in which two scenes' `Draft.tables` differ, each with both texts ("absent" if it is not there)."""
    flat = [dict(_flat(tables)) for tables in (before, after)]
    names = dict.fromkeys([*flat[0], *flat[1]])
    rows = [
        (name, str(flat[0].get(name, "absent")), str(flat[1].get(name, "absent"))) for name in names
    ]
    return [row for row in rows if row[1] != row[2] and row[0] != "title"]


def _flat(tables: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    entries: list[tuple[str, Any]] = []
    for name, value in tables.items():
        entries += (
            _flat(value, f"{above}{name}.") if isinstance(value, dict) else [(above + name, value)]
        )
    return entries
