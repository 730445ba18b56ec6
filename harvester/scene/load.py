"""The load of a scene: a resistance, or a circuit from a netlist."""

from typing import Annotated, ClassVar

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import ANY, RESISTANCE, VOLTAGE, any_quantity
from harvester.scene.table import (
    NO_NUMBERS,
    NONE,
    FrozenNumbers,
    Numbers,
    OptNumber,
    SceneTable,
    scene_table,
)

FILES = (".cir", ".net", ".sp", ".spi", ".spice", ".ckt")  # what files of netlists end with


@scene_table
class Load(SceneTable):
    """A load resistance in ohm, or a netlist (a name of netlists/ or a path) and its parameters.

    >>> import harvester as hv
    >>> hv.Load(resistance="1 Mohm").resistance
    1000000.0
    """

    TABLE: ClassVar[str] = "load"
    resistance: Annotated[OptNumber, RESISTANCE, "load resistor across the electrodes"] = NONE
    netlist: (
        Annotated[str, "built-in circuit or path of a netlist, instead of resistance", "'bridge'"]
        | None
    ) = None
    parameters: Annotated[
        Numbers, FrozenNumbers(any_quantity, ANY), "parameters of the netlist", "{ R = '1 Mohm' }"
    ] = NO_NUMBERS
    terminals: (
        Annotated[
            tuple[str, str],
            "nets of the piezo in a flat netlist, such as KiCad's",
            "['/PZ_P', '/PZ_N']",
        ]
        | None
    ) = None
    resistor: Annotated[str, "load resistor of a flat netlist; default Rload", "'R3'"] | None = None
    store: Annotated[str, "storage capacitor of a flat netlist; default Csmooth", "'C1'"] | None = (
        None
    )
    supplies: Annotated[
        Numbers,
        FrozenNumbers(VOLTAGE.read, VOLTAGE),
        "nets of a flat netlist that ideal sources feed",
        "{ VCC = '3.3 V' }",
    ] = NO_NUMBERS

    def __post_init__(self) -> None:
        if (self.resistance is None) == (self.netlist is None):
            both = "both are given: the resistance of a netlist is a parameter, such as load.parameters.R"
            which = "neither is given" if self.resistance is None else both
            raise InputError(f"load must have either resistance or netlist, but {which}")
        if self.netlist is not None and not (self.netlist.strip() and self.netlist.isprintable()):
            raise invalid("load.netlist", "be the name of a netlist or a path", self.netlist)
        if self.parameters and self.netlist is None:
            raise InputError(
                "load.parameters must be used with a netlist, but the load is a resistance"
            )
        flat = [key for key in ("resistor", "store", "supplies") if getattr(self, key)]
        if flat and self.terminals is None:
            raise InputError(
                f"load.{flat[0]} must be used with load.terminals, the piezo's nets, but they are missing"
            )
        if self.terminals is not None and not self.file:
            raise InputError(
                "load.terminals must be used with the file of a flat netlist, but load.netlist is not one"
            )

    @property
    def file(self) -> str | None:
        """The path of the netlist's file; None for a netlist by its name, and for a resistance."""
        return self.netlist if is_path(self.netlist or "") else None


def is_path(netlist: str) -> bool:
    """Whether a netlist is named by its path, rather than by its name in netlists/."""
    return "/" in netlist or netlist.lower().endswith(FILES)
