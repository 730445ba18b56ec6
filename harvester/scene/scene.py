"""The input of the user: one device, its excitation and its load, as a frozen dataclass of tables.

Long because a scene explains its methods to users.
"""

import dataclasses
import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypedDict, Unpack

from pydantic import ConfigDict
from pydantic.dataclasses import dataclass as checked_dataclass

from harvester.errors import InputError, names_arguments
from harvester.scene.checks import check_opposite_stop, check_stop_damping, check_together
from harvester.scene.further_modes import changed_modes, check_beside, contact_mass
from harvester.scene.keys import SEVERAL, TABLES, full_key, key_kind, read_value, split_key
from harvester.scene.load import Load
from harvester.scene.modal_parameters import ModalParameters, modal_parameters
from harvester.scene.nondimensional import Nondimensional
from harvester.scene.physical import (
    FILES,
    Ball,
    Excitation,
    Magnifier,
    Mode,
    OppositeStop,
    Oscillator,
    Piezo,
    Stop,
)
from harvester.scene.sensor_node import HarvestingChip, SensorNode, Storage, check_node
from harvester.scene.table import SceneTable, one_line_errors

LONGEST_TITLE = 1000  # letters, above tables and plots


class SceneTables(TypedDict, total=False):
    """The values that `Scene.replace` accepts."""

    title: str
    oscillator: Oscillator | None
    piezo: Piezo | None
    stop: Stop | None
    opposite_stop: OppositeStop | None
    mode: tuple[Mode, ...]
    magnifier: Magnifier | None
    ball: Ball | None
    excitation: Excitation | None
    load: Load | None
    storage: Storage | None
    node: SensorNode | None
    chip: HarvestingChip | None
    nondimensional: Nondimensional | None


@one_line_errors
@checked_dataclass(frozen=True, kw_only=True, repr=False, config=ConfigDict(extra="forbid"))
class Scene(SceneTable):
    """One device with its excitation and its load: physical (oscillator, piezo, ...) or nondimensional, never both.

    It cannot be changed: `replace`, `with_load`, `varied` and `without_stop` give another scene.

    Parameters
    ----------
    title : str, optional
        a name, for figures and reports.
    oscillator, piezo, stop, opposite_stop, excitation, load : scene tables, optional
        the tables of a physical scene, in SI units; one that is None is an effect that is absent.
    mode, magnifier, ball : scene tables, optional
        further modes of vibration, the second to the fourth, a mass on a spring under the device,
        and a free ball.
    storage, node, chip : scene tables, optional
        the storage, the sensor node and the chip between them that `node` follows behind the load's
        rectifier.
    nondimensional : Nondimensional, optional
        the table of a nondimensional scene, in place of all others.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> scene.physical, scene.vary("nondimensional.mu", 2.0).nondimensional.mu
    (False, 2.0)

    Raises
    ------
    InputError
        on the first thing that is wrong, in one line.
    """

    title: str = ""
    oscillator: Oscillator | None = None
    piezo: Piezo | None = None
    stop: Stop | None = None
    opposite_stop: OppositeStop | None = None
    mode: tuple[Mode, ...] = ()
    magnifier: Magnifier | None = None
    ball: Ball | None = None
    excitation: Excitation | None = None
    load: Load | None = None
    storage: Storage | None = None
    node: SensorNode | None = None
    chip: HarvestingChip | None = None
    nondimensional: Nondimensional | None = None

    def __post_init__(self) -> None:
        if len(self.title) > LONGEST_TITLE:
            raise InputError(
                f"title must have at most {LONGEST_TITLE} letters, but has {len(self.title)}"
            )
        physical = [name for name in TABLES if name != "nondimensional" and getattr(self, name)]
        if self.nondimensional is not None and physical:
            raise InputError(
                f"[{physical[0]}] must be left out if [nondimensional] is given, but both are given"
            )
        check_node(
            self.node, self.storage, None if self.load is None else self.load.netlist, self.chip
        )
        if self.nondimensional is None:
            for name in ("oscillator", "piezo"):
                if name not in physical:
                    raise InputError(
                        f"[{name}] must be given (or [nondimensional] alone), but the table is missing"
                    )
            check_together(self._has)
            stop = self.stop or Stop(restitution=1.0)
            opposite = self.opposite_stop
            noise = None if self.excitation is None else self.excitation.stiffness_noise
            check_beside(
                self.modal, self.mode, self.magnifier, self.ball, self.stop is not None, noise
            )
            check_stop_damping(
                "stop.damping", stop.damping, stop.stiffness, contact_mass(self.modal, self.mode)
            )
            if opposite is not None:
                rigid = self.stop is not None and self.stop.restitution is not None
                check_opposite_stop("opposite_stop.", rigid, stop.gap, opposite.gap)

    def _has(self, name: str) -> bool:
        """Whether it has a table, or a key of one that is not 0."""
        table, _, key = name.partition(".")
        value = getattr(self, table)
        return bool(getattr(value, key, None) if key else value)

    @property
    def physical(self) -> bool:
        """Whether the scene is in SI units, rather than nondimensional."""
        return self.nondimensional is None

    @property
    def modal(self) -> ModalParameters:
        """Mass, stiffness, damping, coupling and capacitance of a physical scene, from any of its keys."""
        assert self.oscillator is not None and self.piezo is not None, "a physical scene has both"
        return modal_parameters(self.oscillator, self.piezo)

    @names_arguments
    def with_load(
        self,
        load: Load | float | str | None = None,
        *,
        resistance: float | str | None = None,
        netlist: str | None = None,
        parameters: Mapping[str, float | str] | None = None,
    ) -> "Scene":
        """The same scene with another load: a `Load`, a resistance, or the keys of a `Load` by name.

        A resistance is a number in ohm or a text such as "470k" or "1 Mohm".

        Examples
        --------
        >>> import harvester as hv
        >>> oscillator, piezo = hv.Oscillator(mass="40 g", stiffness=16), hv.Piezo(coupling=1e-3, capacitance="50 nF")
        >>> hv.Scene(oscillator=oscillator, piezo=piezo).with_load(resistance="470k").load.resistance
        470000.0

        Raises
        ------
        InputError
            for both a load and keys of it, and for keys or values that no `Load` can have.
        """
        names = {"resistance": resistance, "netlist": netlist, "parameters": parameters}
        keys: dict[str, Any] = {name: value for name, value in names.items() if value is not None}
        if load is not None and keys:
            raise InputError(
                f"`load` must be left out if `{next(iter(keys))}` is given, but both are given"
            )
        if isinstance(load, Load):
            return dataclasses.replace(self, load=load)
        if load is not None:
            keys = {"resistance": load}
        if isinstance(text := keys.get("resistance"), str):
            keys["resistance"] = read_value("load.resistance", text)
        return dataclasses.replace(self, load=Load(**keys))

    @property
    def name(self) -> str:
        """Its title; for a scene without one the kind of device, for a figure's title."""
        if self.title or not self.physical:
            return self.title or "nondimensional device"
        return f"device of {1e3 * self.modal.mass:.4g} g and {self.modal.frequency / (2.0 * math.pi):.4g} Hz"

    def without_stop(self) -> "Scene":
        """The same scene without its stops."""
        if self.nondimensional is not None:
            keys = (
                "restitution",
                "gap",
                "opposite_restitution",
                "opposite_gap",
                "stop_stiffness",
                "stop_damping",
            )
            bare = dataclasses.replace(self.nondimensional, **dict.fromkeys(keys))
            return dataclasses.replace(self, nondimensional=bare)
        return dataclasses.replace(self, stop=None, opposite_stop=None)

    def replace(self, **tables: Unpack[SceneTables]) -> "Scene":  # type: ignore[override]
        """The same scene with other tables; one that is None is left out.

        Each table has such a method as well: ``scene.replace(stop=scene.stop.replace(gap="0.5
        mm"))``.  `varied` sets keys by their names, and `with_load` the load.

        Parameters
        ----------
        tables
            ``title``, ``oscillator``, ``piezo``, ``stop``, ``opposite_stop``, ``excitation``,
            ``load`` and ``nondimensional``, as `Scene` itself accepts them.

        Examples
        --------
        >>> import harvester as hv
        >>> scene = hv.load("examples/plate_with_stop.toml")
        >>> scene.replace(stop=None, title="without a stop").stop is None
        True

        Raises
        ------
        InputError
            for a table that no scene has, and a scene that cannot be.
        """
        return dataclasses.replace(self, **tables)

    def vary(self, key: str, value: float | str) -> "Scene":
        """The same scene with one key, such as ``load.resistance``, at a value in SI units or a text; as `varied`."""
        return self.varied({key: value})

    def varied(self, values: Mapping[str, float | str | None]) -> "Scene":
        """The same scene with several keys set at once, checked with all of them set.

        A key replaces another that states the same, such as oscillator.frequency that of
        stiffness.

        Parameters
        ----------
        values
            scene keys, such as "load.resistance", and their new values: a number in SI units, a
            text with its unit ("1 Mohm"), or None for a key that is left out.

        Raises
        ------
        InputError
            for a key that no scene has, or a value that the key does not accept.
        """
        changes: dict[str, dict[str, Any]] = {}
        for key, value in values.items():
            table, name = split_key(key if "." in key else full_key(key, self.tables()))
            changed = changes.setdefault(table, {})
            if name.startswith("parameters."):
                parameters = changed.setdefault(
                    "parameters", dict(self.load.parameters) if self.load else {}
                )
                parameters[name.split(".", 1)[1]] = value
            else:
                changed[name] = value
        tables: dict[str, Any] = {}
        for table, changed in changes.items():
            present = getattr(self, table)
            if table in SEVERAL:
                tables[table] = changed_modes(present, changed)
            else:
                tables[table] = present.replace(**changed) if present else TABLES[table](**changed)
        return dataclasses.replace(self, **tables)

    def tables(self) -> dict[str, Any]:
        """The scene as nested dictionaries of the keys that are present."""
        present: dict[str, Any] = {"title": self.title} if self.title else {}
        for name in TABLES:
            table = getattr(self, name)
            if name in SEVERAL:
                present |= {name: [mode.present() for mode in table]} if table else {}
            elif table is not None:  # an empty table is one too
                present[name] = table.present()
        return present

    def values(self) -> list[tuple[str, str, Any]]:
        """Table, name and value of each key that is present.

        Those of mode 2 have names such as "2.frequency".
        """
        every = [
            (table, "", keys) for table, keys in self.tables().items() if isinstance(keys, dict)
        ]
        every += [(Mode.TABLE, f"{i}.", mode.present()) for i, mode in enumerate(self.mode, 2)]
        return [
            (table, of + name, value) for table, of, keys in every for name, value in keys.items()
        ]

    def to_toml(self) -> str:
        """The scene file of this scene: `loads` gives the same scene back."""
        import tomli_w

        return tomli_w.dumps(self.tables())

    def _repr_html_(self) -> str:
        from harvester.presentation import html

        rows = [
            (f"[{table}]", key, str(value), kind.unit if (kind := key_kind(table, key)) else "")
            for table, key, value in self.values()
        ]
        return html.table(self.title or "scene", ("table", "key", "value", "SI unit"), rows)

    @property
    def digest(self) -> str:
        """A short hash of all contents of the scene, those of its recordings included."""
        whole = hashlib.sha256(self.to_toml().encode())
        for table, key in (
            *((self.excitation, key) for key in FILES),
            (self.node, "trace"),
            (self.chip, "efficiency_table"),
        ):
            if (name := getattr(table, key, None)) is not None and (path := Path(name)).is_file():
                with path.open("rb") as file:
                    hashlib.file_digest(file, lambda: whole)
        return whole.hexdigest()[:16]
