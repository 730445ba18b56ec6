"""A scene made ready to be solved: its equations, scales, effects and circuit, made once and handed down."""

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from harvester.equations.from_scene import equations_at
from harvester.equations.repeated_shaking import Events, events
from harvester.equations.scales import Scales, scales
from harvester.errors import invalid
from harvester.presentation.diagnostic import Diagnostic
from harvester.scene.load import Load
from harvester.scene.plausibility import unusual_values
from harvester.scene.scene import Scene
from harvester.scene.toml import load

if TYPE_CHECKING:
    from harvester.netlists.load_circuit import LoadCircuit


class Problem:
    """The problem that an engine solves.

    ``equations`` are nondimensional, with one coefficient for each of the ``effects`` that are
    present; ``scales`` are those of the device that carries them in ngspice; ``units`` those of the
    scene's own units, which for a nondimensional scene are all 1: a time tau is
    tau/units.frequency, a power p is p units.watts. InputError if one is too large or too small to
    compute with.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.scales = scales(scene)
        self.equations = equations_at(scene, self.scales)
        self.effects = self.equations.effects
        self.physical = scene.physical
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
        resistance = (
            None if self.netlist is None or self.circuit is None else self.circuit.resistance
        )
        return (
            self
            if resistance is None
            else Problem(replace(self.scene, load=Load(resistance=resistance)))
        )

    @property
    def load_circuit(self) -> "LoadCircuit":
        """The load's circuit for an engine that has refused an open circuit."""
        assert self.circuit is not None, "an engine's refusal checks this"
        return self.circuit

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
        """Name or path of the load's netlist; None for a load resistance and for an open circuit."""
        return None if self.scene.load is None else self.scene.load.netlist

    @property
    def netlist_text(self) -> str | None:
        """The text of the load's netlist; None for a load resistance and for an open circuit."""
        return None if self.netlist is None else self.load_circuit.text

    @property
    def present_effects(self) -> tuple[str, ...]:
        """The names of the effects, and "netlist" if the load is one."""
        return self.effects if self.netlist is None else (*self.effects, "netlist")

    @cached_property
    def events(self) -> Events | None:
        """The shocks or steps that shake the base; None if the excitation is not a sequence of events."""
        shaking = self.scene.excitation
        return None if shaking is None or shaking.profile is None else events(self.scene)

    @property
    def value_warnings(self) -> list[Diagnostic]:
        """Warnings of probably unintended values, in the scene and in its netlist."""
        circuit = self.circuit if self.netlist else None
        return [*unusual_values(self.scene), *(circuit.value_warnings if circuit else ())]

    @cached_property
    def circuit(self) -> "LoadCircuit | None":
        """The load as a circuit for ngspice, None for an open one; InputError for a netlist that cannot be used."""
        from harvester.netlists.load_circuit import load_circuit

        if self.scene.load is not None:
            return load_circuit(self.scene.load, self.scales.capacitance)
        mu = self.equations.load  # of a nondimensional scene
        return None if mu is None else load_circuit(Load(resistance=self.scales.resistance(mu)))
