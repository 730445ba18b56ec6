"""Mechanics with its load, as kernels advance many trajectories of both: a class for each pair.

`loaded` alone asks which load there is, and how many modes; whoever advances trajectories asks
neither.  Rows of states are x, x' and V, then those of the load, and then those of further modes.
Long because six pairs have the same methods.
"""

import math
from typing import Any, Protocol

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.own_circuit import OwnCircuit
from harvester.mechanics.kernels.circuit_control_variates import circuit_boundary, interleaved
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.control_variates import boundary
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.intervals import update_of
from harvester.mechanics.kernels.moments import Moments
from harvester.mechanics.kernels.offset_stops import loss_unit
from harvester.mechanics.kernels.path import Path
from harvester.mechanics.kernels.shaken_control_variates import martingales
from harvester.mechanics.kernels.shaking import Filter
from harvester.mechanics.kernels.trajectory_batch import (
    IDEAL_SUMS,
    MASS_ROWS,
    SUMS,
    Batch,
    Schedule,
    advance,
    mid_drift,
)
from harvester.mechanics.modes.modal_driver import RESISTOR_ROWS, ModalMotion
from harvester.mechanics.trace import follow, ideal_load, mechanics_of

LOAD_TIMES = 5.0  # time constants of the load
CHARGING_TIMES = 6.0  # time constants of a smoothing capacitor
IDEAL_ROWS = 5  # x, x', V, the voltage of the storage capacitor, and the place of the switch
# of a state that a kernel of its own advances: what is above grows without bound, by steps that
# take ever longer
LARGEST = 1e100


class Loaded(Protocol):
    """A pair of mechanics and load, as `harvester.mechanics.ensemble.trajectories` needs it.

    ``rows`` are those of states, ``sums`` those that a run adds up, ``martingales`` those of its
    controls.  A state beyond ``largest`` grows without bound.  ``is_dear``: a step costs as much as
    many of one mode with a resistor.  ``balances``: `Moments.balance` has all powers.  The load
    forgets the start in ``memories`` of its time constant, whose name is ``constant``.
    """

    rows: int
    sums: int
    martingales: int
    largest: float
    is_dear: bool
    balances: bool
    memories: float
    constant: str
    coefficients: Any

    @property
    def memory(self) -> float:
        """The time constant of the load; 0 for an open circuit."""

    @property
    def has_controls(self) -> bool:
        """Whether sums of mean zero are known."""

    @property
    def loss_unit(self) -> float:
        """The unit of the sums of impact losses."""

    @property
    def numbers(self) -> object:
        """The numbers for the kernels of one mode; None for other kernels."""

    def begin(self, state: Floats) -> None:
        """Fill the rows below x, x' and V of states at the beginning, shape (blocks, rows, BATCH)."""

    def batch(
        self, state: Floats, words: Floats, sums: Floats | None, controls: Floats | None
    ) -> Batch:
        """A block for the kernels."""

    def advance(
        self,
        batch: Batch,
        state: Floats,
        schedule: Schedule,
        h: float,
        shaker: Filter | None,
        ngspice_rule: bool,
    ) -> None:
        """Advance a block, whose states are all in ``state``, by a schedule of steps of h."""

    def mid_drift(
        self, batch: Batch, state: Floats, out: Floats, h: float, shaker: Filter | None
    ) -> None:
        """Go from the states of a block after a kick to x, x' and V half a step later."""

    def follow(self, state: Floats, noise: Floats, h: float, shaking: Floats | None) -> Path:
        """One trajectory on from a trajectory's ``state`` after a kick, shape (rows,), with a sample a kick.

        ``noise`` and ``shaking`` are as of `harvester.mechanics.trace.trace`, from that kick on.
        """

    def start(self, state: Floats) -> tuple[Any, ...]:
        """A trajectory's ``state``, shape (rows,), as the start of a run of ngspice.

        x, x', V and that of the storage capacitor; and if there are any, as the fifth, a circuit's state
        and y_2, ... and y_2', ... in one array.
        """

    def boundary(self, states: Floats) -> Floats:
        """The functions of states, shape (rows, count), whose changes are one kind of controls."""

    def controls(self, martingale: Floats, change: Floats) -> Floats:
        """All controls, of martingales and of the change of the functions, each of shape (n, count)."""

    def powers(self, means: Moments, state: Floats) -> list[tuple[Floats, Floats]]:
        """The load's mean power in a window, and its power now, if it has one other than that of V^2."""

    @property
    def has_counts(self) -> bool:
        """Whether functions of a circuit count, as those of clocks."""

    def stored(self, state: Floats) -> Floats:
        """Energy in storage that no moment shows, by trajectories, in the unit of `Moments.load` times time."""

    def check(self, own_sums: Floats, state: Floats) -> None:
        """Raise CircuitError if too many circuit steps failed.

        ``own_sums`` are those of the load alone.
        """


class WithResistor:
    """One mode with the load resistor of its equations, or an open circuit.

    Rows of one mode with the load are ``load_rows``, and those of further modes follow.
    """

    rows = load_rows = RESISTOR_ROWS
    sums = len(SUMS)
    largest = math.inf
    is_dear = False
    balances = True
    memories = LOAD_TIMES
    constant = "1/mu"
    circuit: Any = None  # an ideal one

    def __init__(self, eqs: Equations) -> None:
        self.eqs = eqs
        self.mechanics = mechanics_of(eqs)
        self.coefficients: Any = self.mechanics.coefficients
        self.martingales = martingales(eqs.coloured is not None)

    @property
    def memory(self) -> float:
        """The time constant of the piezo with the resistor."""
        return 0.0 if self.eqs.mu is None else 1.0 / self.eqs.mu

    @property
    def has_controls(self) -> bool:
        """Whether the noise is new from step to step."""
        return self.eqs.has_new_noise

    @property
    def loss_unit(self) -> float:
        """The unit of the sums of impact losses."""
        return loss_unit(self.coefficients)

    @property
    def numbers(self) -> object:
        """The coefficients, and those of an ideal circuit."""
        return self.coefficients, self.circuit

    def begin(self, state: Floats) -> None:
        """There are no further rows."""

    def batch(
        self, state: Floats, words: Floats, sums: Floats | None, controls: Floats | None
    ) -> Batch:
        """A block for the kernels."""
        s0, s1 = words
        return Batch(state, s0, s1, sums, controls)

    def advance(
        self,
        batch: Batch,
        state: Floats,
        schedule: Schedule,
        h: float,
        shaker: Filter | None,
        ngspice_rule: bool,
    ) -> None:
        """Advance a batch by a schedule of steps of h."""
        update = update_of(self.eqs, h, ngspice_rule)
        part = self._ordered(batch, state)
        advance(part, schedule, h, self.circuit, c=self.coefficients, shaker=shaker, update=update)
        self._put_back(part, batch, state)

    def _ordered(self, batch: Batch, state: Floats) -> Batch:
        """The batch with the rows of its ``state`` in the order of kernels."""
        return batch

    def _put_back(self, part: Batch, batch: Batch, state: Floats) -> None:
        """Write the results in ``part``, made by `_ordered`, to the batch and its ``state``."""

    def mid_drift(
        self, batch: Batch, state: Floats, out: Floats, h: float, shaker: Filter | None
    ) -> None:
        """Go from the states of a block after a kick to x, x' and V half a step later."""
        part = self._ordered(batch, state)
        mid_drift(part, out, h, self.coefficients, self.circuit, shaker)

    def follow(self, state: Floats, noise: Floats, h: float, shaking: Floats | None) -> Path:
        """One trajectory on from a state after a kick."""
        load = None
        if self.circuit is not None:
            held, switch = map(float, state[RESISTOR_ROWS:IDEAL_ROWS])
            load = ideal_load(self.circuit, held, switch, len(noise))
        return follow(
            self.eqs,
            noise,
            h,
            stride=1,
            start=state[self.mechanics.order(self.load_rows)],
            shaking=shaking,
            load=load,
            goes_on=True,
        )

    def start(self, state: Floats) -> tuple[Any, ...]:
        """A state as the start of a run of ngspice."""
        below = state[self.load_rows :]
        held = float(state[RESISTOR_ROWS]) if self.load_rows > RESISTOR_ROWS else 0.0
        return (*map(float, state[:RESISTOR_ROWS]), held, *([below] if below.size else []))

    def boundary(self, states: Floats) -> Floats:
        """See `harvester.mechanics.kernels.control_variates`."""
        return boundary(states, self.eqs)

    def controls(self, martingale: Floats, change: Floats) -> Floats:
        """The martingales, and then the changes."""
        return np.vstack([martingale, change])

    def powers(self, means: Moments, state: Floats) -> list[tuple[Floats, Floats]]:
        """No power other than that of V^2."""
        return []

    @property
    def has_counts(self) -> bool:
        """False: there is no function."""
        return False

    def stored(self, state: Floats) -> Floats:
        """Nothing: the moments of V^2 and of the load's power show all storage."""
        return np.zeros(state[:, 0].size)

    def check(self, own_sums: Floats, state: Floats) -> None:
        """No circuit step can fail."""


class WithStore(WithResistor):
    """A load with a capacitor for the rectified voltage, which is empty at first."""

    balances = False
    memories = CHARGING_TIMES
    constant = "R C w0"
    store: IdealCircuit | OwnCircuit

    @property
    def memory(self) -> float:
        """The time constant of the capacitor with the load."""
        return self.store.memory

    @property
    def loss_unit(self) -> float:
        """The sums are energies."""
        return 1.0

    def boundary(self, states: Floats) -> Floats:
        """See `harvester.mechanics.kernels.circuit_control_variates`."""
        return circuit_boundary(states, self.eqs)

    def controls(self, martingale: Floats, change: Floats) -> Floats:
        """Each martingale with its change."""
        return interleaved(martingale, change)

    def powers(self, means: Moments, state: Floats) -> list[tuple[Floats, Floats]]:
        """The load's mean power in a window, and its power now."""
        return [(means.load, self.store.mu * state[:, RESISTOR_ROWS].ravel() ** 2)]


class WithIdeal(WithStore):
    """One mode with an ideal circuit."""

    rows = load_rows = IDEAL_ROWS
    sums = len(IDEAL_SUMS)

    def __init__(self, eqs: Equations, circuit: IdealCircuit) -> None:
        super().__init__(eqs)
        self.circuit = circuit
        self.store = circuit

    def begin(self, state: Floats) -> None:
        """Place the switch at the displacement."""
        state[:, 4] = state[:, 0]


class WithCircuit(WithStore):
    """One mode with a circuit that brings kernels of its own."""

    largest = LARGEST
    is_dear = True

    def __init__(self, eqs: Equations, circuit: OwnCircuit) -> None:
        super().__init__(eqs)
        self.kernels = circuit
        self.store = circuit
        self.rows = self.load_rows = circuit.rows
        self.sums = circuit.sums

    @property
    def numbers(self) -> object:
        """None, as the kernels are the circuit's."""
        return None

    def begin(self, state: Floats) -> None:
        """As the circuit begins."""
        self.kernels.begin(state)

    def advance(
        self,
        batch: Batch,
        state: Floats,
        schedule: Schedule,
        h: float,
        shaker: Filter | None,
        ngspice_rule: bool,
    ) -> None:
        """Advance a batch by the circuit's kernel."""
        self.kernels.advance(batch, state, schedule, h, self.eqs, shaker)

    def mid_drift(
        self, batch: Batch, state: Floats, out: Floats, h: float, shaker: Filter | None
    ) -> None:
        """As the circuit's kernel drifts."""
        self.kernels.mid_drift(state, out, h, self.eqs, shaker)

    def follow(self, state: Floats, noise: Floats, h: float, shaking: Floats | None) -> Path:
        """One trajectory on from a state after a kick, by the circuit's kernel."""
        return self.kernels.trace(
            self.eqs,
            noise,
            h,
            stride=1,
            start=state[self.mechanics.order(self.load_rows)][:-1],
            state=state[MASS_ROWS : self.load_rows],
            shaking=shaking,
            kicked=True,
        )

    def start(self, state: Floats) -> tuple[Any, ...]:
        """A state as the start of a run of ngspice, with the circuit's own."""
        return (*map(float, state[:MASS_ROWS]), state[MASS_ROWS:])

    @property
    def has_counts(self) -> bool:
        """As the circuit has."""
        return self.kernels.has_counts

    def stored(self, state: Floats) -> Floats:
        """The energy in the circuit's capacitors."""
        return self.kernels.stored(state)

    def check(self, own_sums: Floats, state: Floats) -> None:
        """Raise CircuitError if too many circuit steps failed."""
        self.kernels.check_sums(own_sums, state)


class ModesWithResistor(WithResistor):
    """Several modes with the load resistor of their equations, or an open circuit."""

    largest = LARGEST

    def __init__(self, eqs: Equations) -> None:
        super().__init__(eqs)
        self.motion = ModalMotion(eqs)
        self.rows = self.load_rows + self.motion.further_rows
        self.order = [*self.motion.order(self.load_rows), *range(RESISTOR_ROWS, self.load_rows)]
        self.martingales = self.motion.martingales

    def _ordered(self, batch: Batch, state: Floats) -> Batch:
        """The batch with a copy of its state in their order, and rows for controls below it."""
        rows = len(self.order)
        both = aligned((rows + (0 if batch.controls is None else len(batch.controls)), BATCH))
        both[:rows] = state[self.order]
        return batch._replace(state=both)

    def _put_back(self, part: Batch, batch: Batch, state: Floats) -> None:
        """Write the state to its places, and add the rows below it to the controls."""
        rows = len(self.order)
        state[self.order] = part.state[:rows]
        if batch.controls is not None:
            batch.controls[:] += part.state[rows:]

    @property
    def has_controls(self) -> bool:
        """Whether the noise is new from step to step, and white."""
        return self.eqs.has_new_noise and self.eqs.coloured is None

    @property
    def loss_unit(self) -> float:
        """The sums are of momenta of the modes."""
        return 1.0 / self.motion.mobility

    @property
    def numbers(self) -> object:
        """None, as the kernels are those of several modes."""
        return None

    def begin(self, state: Floats) -> None:
        """Place a ball amid its box."""
        self.motion.begin(state, self.load_rows)

    def boundary(self, states: Floats) -> Floats:
        """One form of all states: see `ModalMotion.boundary`."""
        return self.motion.boundary(states, self.eqs)


class ModesWithIdeal(WithStore, ModesWithResistor):
    """Several modes with an ideal circuit."""

    load_rows = IDEAL_ROWS
    sums = len(IDEAL_SUMS)
    loss_unit = ModesWithResistor.loss_unit

    def __init__(self, eqs: Equations, circuit: IdealCircuit) -> None:
        self.circuit = circuit
        self.store = circuit
        super().__init__(eqs)
        self.martingales = martingales(eqs.coloured is not None)

    def begin(self, state: Floats) -> None:
        """Place the switch at the displacement, and a ball amid its box."""
        state[:, 4] = state[:, 0]
        self.motion.begin(state, self.load_rows)

    def boundary(self, states: Floats) -> Floats:
        """Those of the modes and the storage capacitor."""
        return self.motion.circuit_boundary(states, self.eqs, self.load_rows)


class ModesWithCircuit(WithCircuit):
    """Several modes with a circuit that brings kernels of its own: rows of further modes follow its own."""

    has_controls = ModesWithResistor.has_controls
    loss_unit = ModesWithResistor.loss_unit

    def __init__(self, eqs: Equations, circuit: OwnCircuit) -> None:
        super().__init__(eqs, circuit)
        self.motion = ModalMotion(eqs)
        self.rows = circuit.rows + self.motion.further_rows

    def begin(self, state: Floats) -> None:
        """As the circuit begins; a ball is placed amid its box."""
        self.kernels.begin(state)
        self.motion.begin(state, self.load_rows)

    def boundary(self, states: Floats) -> Floats:
        """Those of the modes and the storage capacitor."""
        return self.motion.circuit_boundary(states, self.eqs, self.load_rows)


def loaded(eqs: Equations, circuit: IdealCircuit | OwnCircuit | None) -> Loaded:
    """The mechanics of the equations with a circuit, or with their own load resistor."""
    alone = eqs.modes is None
    if circuit is None:
        return WithResistor(eqs) if alone else ModesWithResistor(eqs)
    if isinstance(circuit, IdealCircuit):
        return WithIdeal(eqs, circuit) if alone else ModesWithIdeal(eqs, circuit)
    return WithCircuit(eqs, circuit) if alone else ModesWithCircuit(eqs, circuit)
