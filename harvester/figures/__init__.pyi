"""The names of `harvester.figures`, each with the file that it comes from."""

from .charging import charging as charging
from .cosimulations import cosimulation as cosimulation
from .density_curves import densities as densities
from .engines import comparison as comparison
from .engines import cost as cost
from .engines import estimate as estimate
from .fronts import front as front
from .identifications import identification as identification
from .motions import motion as motion
from .nodes import design as design
from .nodes import node as node
from .optima import optimum as optimum
from .papers import paper as paper
from .papers import region as region
from .records import record as record
from .responses import response as response
from .style import new as new
from .sweeps import sweep as sweep
from .tolerances import tolerance as tolerance
