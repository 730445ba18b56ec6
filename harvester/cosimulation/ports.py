"""The port through which a user's model and a circuit act on each other: a piezo, or a coil that moves in a magnet.

The port of a piezo is the table of scenes, `harvester.scene.physical.Piezo`.
"""

from typing import Annotated

from harvester.quantities.kinds import Kind
from harvester.scene.physical import Piezo
from harvester.scene.table import NONE, Number, OptNumber, SceneTable, scene_table

__all__ = ["Coil", "Piezo", "Port"]

TRANSDUCTION = Kind("a coupling of a coil (V s/m)", "V s/m", "'10 V s/m'", above=0.0)
RESISTANCE_OF_COIL = Kind("a resistance (ohm)", "ohm", "'100 ohm'", above=0.0)
INDUCTANCE = Kind("an inductance (H)", "H", "'10 mH'", above=0.0)


@scene_table
class Coil(SceneTable):
    """A coil that moves in a magnet: e.m.f. k v in series with its resistance and inductance, force k i.

    k is the coupling in V s/m, which is N/A.  A resistance or an inductance that is left out is not there.

    >>> from harvester.cosimulation import Coil
    >>> Coil(coupling="10 V s/m", resistance="100 ohm", inductance="20 mH")
    Coil(coupling=10.0, resistance=100.0, inductance=0.02)
    """

    TABLE = "coil"
    coupling: Annotated[Number, TRANSDUCTION, "e.m.f. per velocity, which is force per current"]
    resistance: Annotated[OptNumber, RESISTANCE_OF_COIL, "series resistance"] = NONE
    inductance: Annotated[OptNumber, INDUCTANCE, "inductance"] = NONE


Port = Piezo | Coil
