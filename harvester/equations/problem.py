"""A scene made ready to be solved: its equations, scales, effects and load, made once and handed down.

Its load is an open circuit, a resistance, or a netlist, each a class.  Callers ask the load for its
properties; `load_of` alone asks which one a scene has.
"""

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from harvester.equations.coefficients import Equations
from harvester.equations.from_scene import equations_at
from harvester.equations.repeated_shaking import Events, events
from harvester.equations.scales import Scales, scales
from harvester.errors import invalid
from harvester.presentation.diagnostic import Diagnostic, refusal
from harvester.scene.load import Load
from harvester.scene.plausibility import unusual_values
from harvester.scene.scene import Scene
from harvester.scene.toml import load

if TYPE_CHECKING:
    from harvester.netlists.load_circuit import LoadCircuit


class AnyLoad:
    """The properties of a load, with the values of one that is not a circuit.

    ``netlist`` is the name or path of a netlist, ``circuit`` the load as a circuit for ngspice, and
    ``text`` the text of a netlist; None without one.  ``effects`` are those that a netlist adds,
    ``value_warnings`` warnings of its probably unintended values.  ``is_in_equations`` is whether
    the equations have all of it.  ``lone_resistance`` is that of a netlist that is only a
    resistor (ohm), ``store`` the storage capacitor (F), ``values`` the parameters of its circuit.
    ``resistance_key`` is the scene key of the load's resistance.
    """

    netlist: str | None = None
    text: str | None = None
    effects: tuple[str, ...] = ()
    value_warnings: tuple[Diagnostic, ...] = ()
    is_in_equations = True
    lone_resistance: float | None = None
    store: float | None = None
    resistance_key = "load.resistance"

    @property
    def circuit(self) -> "LoadCircuit | None":
        """The load as a circuit for ngspice."""
        return None

    @property
    def values(self) -> dict[str, float]:
        """The parameters of the circuit."""
        return {}

    def refused_by_formulas(self, engine: str) -> Diagnostic | None:
        """The refusal of an engine that supports load resistances alone; None but for a netlist."""
        return None

    def refused_by_circuits(self, engine: str) -> Diagnostic | None:
        """The refusal of an engine that supports netlists alone; None for a netlist."""
        return refusal("needs_netlist", engine, engine=engine)


class OpenCircuit(AnyLoad):
    """No load."""


class LoadWithCircuit(AnyLoad):
    """A load of which ngspice has a circuit, which is read if it is needed.

    Parameters
    ----------
    load : Load
        the table of the scene.
    capacitance : float or None
        the piezo's (F), for a netlist that has it as a parameter.

    Raises InputError for a netlist that cannot be used, as soon as its circuit is needed.
    """

    def __init__(self, load: Load, capacitance: float | None = None) -> None:
        self.table = load
        self._capacitance = capacitance

    @cached_property
    def circuit(self) -> "LoadCircuit":
        """The load as a circuit for ngspice."""
        from harvester.netlists.load_circuit import load_circuit

        return load_circuit(self.table, self._capacitance)

    @property
    def store(self) -> float | None:  # type: ignore[override]
        """The storage capacitor (F); None without one."""
        return self.circuit.smoothing

    @property
    def values(self) -> dict[str, float]:
        """The parameters of the circuit."""
        return self.circuit.values


class LoadResistance(LoadWithCircuit):
    """A load resistance, which is a part of the equations."""


class LoadOfMu(LoadResistance):
    """The load resistance (ohm) of a nondimensional scene's mu.

    Its size matters to a circuit alone.
    """

    def __init__(self, resistance: float) -> None:
        self._resistance = resistance
        self._capacitance = None

    @cached_property
    def table(self) -> Load:  # type: ignore[override]
        """The table of its scene; InputError if ngspice cannot compute with the resistance."""
        return Load(resistance=self._resistance)


class LoadNetlist(LoadWithCircuit):
    """A netlist."""

    effects = ("netlist",)
    is_in_equations = False

    @property
    def netlist(self) -> str | None:  # type: ignore[override]
        """Its name or path."""
        return self.table.netlist

    @property
    def text(self) -> str:  # type: ignore[override]
        """The text of its circuit."""
        return self.circuit.text

    @property
    def value_warnings(self) -> tuple[Diagnostic, ...]:  # type: ignore[override]
        """Warnings of probably unintended values."""
        return self.circuit.value_warnings

    @property
    def lone_resistance(self) -> float | None:  # type: ignore[override]
        """The resistance (ohm) of a netlist that is only a resistor."""
        return self.circuit.resistance

    @property
    def resistance_key(self) -> str:  # type: ignore[override]
        """The scene key of the load's resistance: R, or of a flat netlist that of its resistor."""
        name = "R" if self.table.terminals is None else "Rload"
        return f"load.parameters.{self.table.resistor or name}"

    def refused_by_formulas(self, engine: str) -> Diagnostic | None:
        """The refusal of an engine that supports load resistances alone."""
        return refusal("needs_resistance", engine, engine=engine, netlist=self.netlist)

    def refused_by_circuits(self, engine: str) -> Diagnostic | None:
        """No refusal."""
        return None


def load_of(scene: Scene, equations: Equations, scales: Scales) -> AnyLoad:
    """The load of a scene; without the table a nondimensional one has the resistance of its mu."""
    if scene.load is not None:
        kind = LoadResistance if scene.load.netlist is None else LoadNetlist
        return kind(scene.load, scales.capacitance)
    if equations.load is None:
        return OpenCircuit()
    return LoadOfMu(scales.resistance(equations.load))


class Problem:
    """The problem that an engine solves.

    ``equations`` are nondimensional, with one coefficient for each of the ``effects`` that are
    present; ``load`` is that of the piezo; ``scales`` are those of the device
    that carries them in ngspice; ``units`` those of the scene's own units, which for a
    nondimensional scene are all 1: a time tau is tau/units.frequency, a power p is p units.watts.
    InputError if one is too large or too small to compute with.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.scales = scales(scene)
        self.equations = equations_at(scene, self.scales)
        self.effects = self.equations.effects
        self.physical = scene.physical
        self.load = load_of(scene, self.equations, self.scales)
        self.units = self.scales if self.physical else Scales(1.0, 1.0, 1.0, 1.0, 1.0)

    @classmethod
    def of(cls, scene: "Problem | Scene | str | Path") -> "Problem":
        """The problem of a scene, or of a scene file; a problem as it is."""
        if isinstance(scene, Problem):
            return scene
        if not isinstance(scene, Scene | str | Path):
            raise invalid("`scene`", "be a Scene, or the path of a scene file", scene)
        return cls(scene if isinstance(scene, Scene) else load(scene))

    @cached_property
    def plain(self) -> "Problem":
        """The same with a load resistance, if the netlist is only a resistor; else itself."""
        resistance = self.load.lone_resistance
        return (
            self
            if resistance is None
            else Problem(replace(self.scene, load=Load(resistance=resistance)))
        )

    @property
    def load_circuit(self) -> "LoadCircuit":
        """The load's circuit for an engine that has refused an open circuit."""
        assert isinstance(self.load, LoadWithCircuit), "an engine's refusal checks this"
        return self.load.circuit

    def in_circuit(self, unit: str) -> float:
        """The value of one of the scene's own units in the circuit that runs, for a quantity in V, A, W or J."""
        if self.physical:
            return 1.0
        s = self.scales
        charge = s.coupling * s.length
        return {"V": s.volts, "A": charge * s.frequency, "W": s.watts, "J": s.watts / s.frequency}[
            unit
        ]

    @property
    def netlist(self) -> str | None:
        """Name or path of the load's netlist.

        None for a load resistance and for an open circuit.
        """
        return self.load.netlist

    @property
    def present_effects(self) -> tuple[str, ...]:
        """The names of the effects, and "netlist" if the load is one."""
        return (*self.effects, *self.load.effects)

    @cached_property
    def events(self) -> Events | None:
        """The shocks or steps that shake the base.

        None if the excitation is not a sequence of events.
        """
        shaking = self.scene.excitation
        return None if shaking is None or shaking.profile is None else events(self.scene)

    @property
    def value_warnings(self) -> list[Diagnostic]:
        """Warnings of probably unintended values, in the scene and in its netlist."""
        return [*unusual_values(self.scene), *self.load.value_warnings]

    @property
    def circuit(self) -> "LoadCircuit | None":
        """The load as a circuit for ngspice, None for an open one.

        InputError for a netlist that cannot be used.
        """
        return self.load.circuit
