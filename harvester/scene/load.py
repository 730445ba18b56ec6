"""The load of a scene: a resistance, or a circuit from a netlist."""

import dataclasses
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator
from pydantic.dataclasses import dataclass as checked_dataclass

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import RESISTANCE, VOLTAGE, any_quantity
from harvester.scene.table import CONFIG, SceneTable


@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class Load(SceneTable):
    """A load resistance in ohm, or a netlist (a name of netlists/ or a path) and its parameters.

    >>> import harvester as hv
    >>> hv.Load(resistance="1 Mohm").resistance
    1000000.0
    """

    TABLE: ClassVar[str] = "load"
    resistance: Annotated[float, RESISTANCE, "load resistor across the electrodes"] | None = None
    netlist: Annotated[str, "instead of resistance: a circuit of netlists/, or a path", "'bridge'"] | None = None
    parameters: Annotated[
        dict[str, Annotated[float, BeforeValidator(any_quantity)]], "of the netlist", "{ R = '1 Mohm' }"
    ] = dataclasses.field(default_factory=dict)
    terminals: (
        Annotated[tuple[str, str], "nets of the piezo in a flat netlist, such as KiCad's", "['/PZ_P', '/PZ_N']"] | None
    ) = None
    resistor: Annotated[str, "of a flat netlist, whose power is asked for; else Rload", "'R3'"] | None = None
    store: Annotated[str, "capacitor of a flat netlist that is the store; else Csmooth", "'C1'"] | None = None
    supplies: Annotated[
        dict[str, Annotated[float, BeforeValidator(VOLTAGE.read)]],
        "nets of a flat netlist that an ideal source feeds",
        "{ VCC = '3.3 V' }",
    ] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if (self.resistance is None) == (self.netlist is None):
            which = "neither is" if self.resistance is None else "both are"
            raise InputError(f"load must have either resistance or netlist, but {which} given")
        if self.netlist is not None and not (self.netlist.strip() and self.netlist.isprintable()):
            raise invalid("load.netlist", "be the name of a netlist or a path", self.netlist)
        if self.parameters and self.netlist is None:
            raise InputError("load.parameters must go with a netlist, but the load is a resistance")
        flat = [key for key in ("resistor", "store", "supplies") if getattr(self, key)]
        if flat and self.terminals is None:
            raise InputError(f"load.{flat[0]} must go with load.terminals, the piezo's nets, but they are missing")
        if self.terminals is not None and (self.netlist is None or not is_path(self.netlist)):
            raise InputError("load.terminals must go with the file of a flat netlist, but load.netlist is none")


def is_path(netlist: str) -> bool:
    """Whether a netlist is named by its path, rather than by its name in netlists/."""
    return "/" in netlist or netlist.endswith(".cir")


def Netlist(name: str, /, **parameters: float | str) -> Load:  # noqa: N802, as it reads as one of the tables
    """The load of a netlist, by its name in netlists/ or its path, with its parameters (numbers are SI).

    >>> import harvester as hv
    >>> hv.Netlist("bridge", R="1 Mohm", C=1e-5).parameters
    {'R': 1000000.0, 'C': 1e-05}

    Raises
    ------
    InputError
        for a parameter that is no number and no quantity.
    """
    unread: Any = parameters  # read by `Load`
    return Load(netlist=name, parameters=unread)
