"""The names of `harvester.cosimulation`, each with the file that it comes from."""

from .coupled_models import Cosimulation as Cosimulation
from .coupled_models import cosimulate as cosimulate
from .model_protocol import Model as Model
from .ports import Coil as Coil
from .ports import Piezo as Piezo
