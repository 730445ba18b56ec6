"""The electrical side in ngspice, in lock-step with the mass; and with a model of the user's own, `cosimulate`.

>>> from harvester.cosimulation import Coil
>>> Coil(coupling="10 V s/m", resistance="100 ohm").coupling
10.0
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
