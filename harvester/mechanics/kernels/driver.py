"""Questions of a driver to any mechanics and any load, answered by the types of both.

A driver, such as that of a recorded path (`harvester.mechanics.trace`), is written once. It asks
the questions below about the state ``s``, the coefficients ``c`` and the ``load``, and is compiled
with the answers for their types (`harvester.mechanics.kernels.compiled.version_of`):

    one mode            `State`, `Coefficients`         this file
    several modes       an array, `ModalCoefficients`   `harvester.mechanics.modes.modal_driver`

    resistor            None, as c has its mu           both files
    ideal circuit       `IdealLoad`                     both files
    compiled circuit    `NetlistLoad`                   `harvester.circuits.circuit_path`

A further load is a type with its answers to `drifted`, `aside` and `noted`; no driver changes.
"""

from typing import Any, NamedTuple

from harvester.arrays import Floats
from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import version_of
from harvester.mechanics.kernels.ideal_circuit import Store, fly
from harvester.mechanics.kernels.offset_stops import kick_at_stops, move


class IdealLoad(NamedTuple):
    """An ideal ``circuit`` on a trajectory, its present ``store``, and room for U at samples, (n, 2)."""

    circuit: Any
    store: Store
    charge: Floats


def drifted(s, d, c, a, load):
    """The state and the load after the interval d, with the `Impacts`; a is the mean excitation.

    An interval shorter than its step leads aside, to mid-drift (`aside`).
    """


def kicked(s, xi, h, c, a):
    """The state after a kick of length h with the variate xi and the excitation a."""


def beside(s, room, c):
    """A copy of the state, to drift on its own; an array is copied to ``room``."""


def aside(load):
    """A copy of the load, to drift on its own."""


def read(s, c):
    """Displacement, velocity and voltage of a state."""


def noted(load, mid, row):
    """Note a sample of the load, at the kick and in ``mid`` drift, in its own records."""


@version_of(drifted, c=Coefficients, load=None)
def _with_resistor(s, d, c, a, load):
    s1, did = move(s, d, c, a)
    return s1, load, did


@version_of(drifted, c=Coefficients, load=IdealLoad)
def _with_ideal(s, d, c, a, load):
    s1, store, did = fly(s, load.store, d, c, load.circuit, a)
    return s1, IdealLoad(load.circuit, store, load.charge), did


@version_of(kicked, c=Coefficients)
def _kicked(s, xi, h, c, a):
    return State(s.x, kick_at_stops(s, xi, h, c, a), s.V)


@version_of(beside, c=Coefficients)
def _beside(s, room, c):
    return s


@version_of(read, c=Coefficients)
def _read(s, c):
    return s.x, s.v, s.V


@version_of(aside, load=None)
@version_of(aside, load=IdealLoad)
def _aside(load):
    return load


@version_of(noted, load=None)
def _none_noted(load, mid, row):
    return None


@version_of(noted, load=IdealLoad)
def _ideal_noted(load, mid, row):
    load.charge[row, 0] = load.store.U
    load.charge[row, 1] = mid.store.U
