"""The answers of several modes to `harvester.mechanics.kernels.driver`.

Their state is an array of which lane 0 is used (`harvester.mechanics.modes.modal_step`).
"""

from typing import Any, NamedTuple

from harvester.arrays import Floats
from harvester.mechanics.kernels.compiled import version_of
from harvester.mechanics.kernels.driver import aside, beside, drifted, kicked, noted, read
from harvester.mechanics.kernels.trajectory_batch import BATCH
from harvester.mechanics.modes.modal_circuit import drift_with_ideal
from harvester.mechanics.modes.modal_step import ModalCoefficients, dot, drift_modes, kick_modes


class ModalIdealLoad(NamedTuple):
    """An ideal ``circuit`` on a path of several modes: U and m are lane 0 of ``store``."""

    circuit: Any
    store: Floats
    charge: Floats


@version_of(drifted, c=ModalCoefficients, load=None)
def _with_resistor(s, d, c, a, load):
    return s, load, drift_modes(0, s, d, c, a)


@version_of(drifted, c=ModalCoefficients, load=ModalIdealLoad)
def _with_ideal(s, d, c, a, load):
    return s, load, drift_with_ideal(0, s, load.store, d, c=c, a=a, circuit=load.circuit)


@version_of(kicked, c=ModalCoefficients)
def _kicked(s, xi, h, c, a):
    kick_modes(0, s, xi, h, c, a)
    return s


@version_of(beside, c=ModalCoefficients)
def _beside(s, room, c):
    for j in range(0, len(s), BATCH):
        room[j] = s[j]
    return room


@version_of(read, c=ModalCoefficients)
def _read(s, c):
    n = len(c.k)
    return dot(c.e, s, 0, 0), dot(c.e, s, n, 0), s[2 * n * BATCH]


@version_of(aside, load=ModalIdealLoad)
def _aside(load):
    return ModalIdealLoad(load.circuit, load.store.copy(), load.charge)


@version_of(noted, load=ModalIdealLoad)
def _noted(load, mid, row):
    load.charge[row, 0] = load.store[0, 0]
    load.charge[row, 1] = mid.store[0, 0]
