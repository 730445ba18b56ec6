"""A load's netlist as a compiled circuit on a device, and its motion together with the mass.

Long because it is all that others see of a circuit: its sizes, its states, its paths, and the
arguments of kernels.
"""

import dataclasses
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.circuit_batch import MORE_SUMS, advance_circuit, circuit_mid_drift
from harvester.circuits.circuit_path import CircuitPath, TraceArguments, trace_circuit
from harvester.circuits.newton import Solver
from harvester.circuits.reduction import Reduction
from harvester.circuits.solvability import check_parts, check_size
from harvester.circuits.stamps import system_of, value_of
from harvester.circuits.substeps import (
    CHATTERS,
    CIRCUIT,
    DID,
    GAMMA,
    LEVELS,
    MOST,
    N_VOLTAGES,
    KernelCircuit,
    follow,
)
from harvester.equations.coefficients import Equations
from harvester.equations.scales import Scales
from harvester.errors import CircuitError
from harvester.mechanics.kernels.moments import Moments, from_path
from harvester.mechanics.kernels.shaking import Filter
from harvester.mechanics.kernels.trajectory_batch import MASS_ROWS, Batch, Schedule
from harvester.mechanics.trace import mechanics_of
from harvester.netlists.load_circuit import LoadCircuit
from harvester.netlists.part import ROOM, CircuitPart, UnservedError, by_name
from harvester.presentation.diagnostic import refusal

TYPICAL = 0.1  # nondimensional step: which pivots a reduction takes is decided there
# of a charge's size: what the two orders of a step may differ by; with inductors
TOLERANCE, RINGING = 0.03, 0.002
LEAST = 1e-2  # of theta l/Cp: the least size of a charge


class CompiledCircuit:
    """A load circuit on a device, compiled for its topology.

    ``rows`` and ``sums`` as of `OwnCircuit`.

    ``resistance`` (ohm) is that of Rload, ``mu`` the same as 1/(R Cp w0).

    ``elements`` are those that represent the load's, such as a part of them; ``tolerance`` is that
    of a step.

    Raises UnservedError for a construct that compiled circuits lack, and InputError for a circuit
    without a solution.
    """

    sums = len(MORE_SUMS)
    has_own_kernel = True

    def __init__(
        self,
        load: LoadCircuit,
        scales: Scales,
        elements: Sequence[CircuitPart] | None = None,
        tolerance: float = TOLERANCE,
    ) -> None:
        self.load = load
        self.scales = scales
        self.tolerance = tolerance
        parts = by_name(load.parts if elements is None else elements)
        if any(value != ROOM for value in load.settings.values()):
            raise UnservedError(
                f"netlist {load.name} sets a temperature other than {ROOM:g} degrees Celsius"
            )
        check_parts(parts.values())
        check_size(parts.values())
        self.system = system_of(parts, scales.capacitance)
        rload = parts["rload"]
        store = parts.get("csmooth")
        self.resistance = value_of(rload)
        self.load_row = self.system.across_part(rload)
        read_out = [
            self.system.across("p", "0"),
            self.system.across_part(store) if store is not None else {},
            self.load_row,
        ]
        self.reduction = Reduction(self.system, read_out, self._tau(TYPICAL))
        self._arrays: dict[float, tuple[Any, ...]] = {}

    @cached_property
    def solver(self) -> Solver:
        """The solver of its equations, which is written when it is first needed."""
        impedance = TYPICAL / (self.scales.frequency * self.scales.capacitance)
        taus = [self._tau(TYPICAL) / 2**k for k in (0, LEVELS // 2, LEVELS)]
        return Solver(self.reduction, impedance, self.scales.volts, taus)

    @property
    def has_coils(self) -> bool:
        """Whether charges are fluxes of inductors, which ring."""
        return any(
            k in self.system.owners for _, column, _, _ in self.system.charges for k in column
        )

    def _tau(self, h: float) -> float:
        return float(GAMMA * h / self.scales.frequency)

    @property
    def mu(self) -> float:
        """The load's power over its squared voltage, nondimensional."""
        return 1.0 / (self.resistance * self.scales.capacitance * self.scales.frequency)

    @property
    def memory(self) -> float:
        """Time constant of the smoothing capacitor with the load, at least that of the mass."""
        return max((self.load.storage or 0.0) * self.scales.frequency, 1.0)

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """The sizes of the parts of a state: charges, unknowns that functions read, switches, and linear charges."""
        charges = len(self.system.charges)
        return (
            charges + len(self.system.diodes),
            len(self.reduction.columns),
            len(self.system.switches),
            charges,
        )

    @property
    def switches_at(self) -> int:
        """The places of the switches in a state."""
        return sum(self.sizes[:2])

    @property
    def voltages_at(self) -> int:
        """The places of the voltages of piezo, store and load in a state."""
        return sum(self.sizes) + 1

    @property
    def rest(self) -> Floats:
        """The state of the circuit without voltages, but for those that the netlist begins with."""
        *_, switches, charges = self.sizes
        state = np.zeros(self.voltages_at + N_VOLTAGES + switches + DID)
        state[:charges] = self.system.starts
        state[self.switches_at : self.switches_at + switches] = [
            switch.closed for switch in self.system.switches
        ]
        return state

    @property
    def rows(self) -> int:
        """Rows of the states of many trajectories."""
        return MASS_ROWS + len(self.rest)

    @property
    def room(self) -> int:
        """Length of the workspace of kernels."""
        return max(len(self.rest), self.solver.work)

    def __reduce__(self):
        """Another process compiles, or reads from the cache, the code that it needs: addresses are of this one only."""
        return compiled_circuit, (self.load, self.scales, self.tolerance)

    def trace(
        self,
        eqs: Equations,
        noise: Floats,
        h: float,
        stride: int = 1,
        start: Sequence[float] | Floats | None = None,
        state: Floats | None = None,
        shaking: Floats | None = None,
        kicked: bool = False,
        keep: bool = False,
    ) -> CircuitPath:
        """One trajectory on a noise path, from rest or a ``state`` of the circuit.

        See `trace_circuit`.

        Without a ``start`` it is at x = 0. Raises CircuitError if too many steps do not converge.
        """
        state = self.rest if state is None else state
        if start is None:
            start = mechanics_of(eqs).started((0.0, 0.0, 0.0))[:-1]
        path = trace_circuit(
            eqs,
            self.for_kernels(h),
            state=state,
            noise=noise,
            h=h,
            stride=stride,
            start=start,
            shaking=shaking,
            kicked=kicked,
            keep=keep,
        )
        self.check(path.steps, path.failed, path.state)
        return path

    def begun(self, eqs: Equations, start: tuple[Any, ...]) -> tuple[Floats, Floats]:
        """The motion, y and y' of all modes, and the state of the circuit of a ``start``.

        That has x, x', V and U, and as its fifth, unless the circuit is at rest, the circuit's
        state and then y_2, ... and y_2', ... in one array, as rows of many trajectories.
        """
        rest = self.rest
        mechanics = mechanics_of(eqs)
        if len(start) < 5:
            return mechanics.started(start)[:-1], rest
        state, coordinates = np.split(np.asarray(start[4], dtype=np.float64), [len(rest)])
        return mechanics.started((*start[:4], coordinates))[:-1], state

    def check(self, steps: float, failed: float, state: Floats) -> None:
        """Raise CircuitError if more than `MOST` of so many steps ``failed``, before the ``state`` or states, (..., n).

        The elements that the solver reported in the last of them
        (`harvester.circuits.newton_parts.SIGNATURE`) are named, or all that have a function if it
        reported none; or the switches that chatter.
        """
        if not failed > MOST * steps:
            return
        returned = np.unique(state[..., -1])
        switches = [round(code - CHATTERS) for code in returned if code >= CHATTERS]
        if switches:
            chattering = ", ".join(self.system.switches[k].name for k in switches)
            raise CircuitError(str(refusal("switch_chatters", elements=chattering)))
        functions = sorted({round(-2.0 - code) for code in returned if code <= -2.0})
        many = len(self.system.diodes) + len(self.system.functions)
        names = dict.fromkeys(self.system.element_of(k) for k in functions or range(many))
        share = float(failed / max(steps, 1.0))
        raise CircuitError(str(refusal("circuit_fails", share=share, elements=", ".join(names))))

    def check_sums(self, sums: Floats, state: Floats) -> None:
        """As `check`, of sums as a batch has them, without those of ideal circuits, and states with all their rows."""
        self.check(sums[-2], sums[-1], np.moveaxis(state[:, MASS_ROWS : self.rows], 1, -1))

    def with_own_steps(self, path: CircuitPath, given: TraceArguments) -> CircuitPath:
        """The trajectory that `trace` made of the arguments ``given``, with the log of the circuit's own steps."""
        circuit = self.for_kernels(given["h"])
        rows = path.steps + 1
        width = 1 + sum(self.sizes[:3])
        log = np.zeros(2 + rows * width)
        record = circuit.record.copy()
        log[1] = rows
        record["log_at"] = log.ctypes.data
        again = trace_circuit(circuit=circuit._replace(record=record), **given)
        return dataclasses.replace(again, own_steps=log[2:].reshape(rows, width)[: int(log[0])])

    def path_moments(
        self,
        eqs: Equations,
        noise: Floats,
        h: float,
        stride: int,
        discard: float,
        batches: int,
        start: tuple[Any, ...],
        shaking: Floats | None = None,
    ) -> Moments:
        """Moments of one trajectory after the time ``discard``, one entry a batch (`from_path`).

        ``start`` is as of `begun`.
        """
        motion, state = self.begun(eqs, start)
        path = self.trace(
            eqs, noise, h=h, stride=stride, start=motion, state=state, shaking=shaking
        )
        moments = from_path(eqs, path, discard, batches)
        first = math.ceil(discard / (h * stride) - 1e-6)
        rows = (len(path.square) - first) // batches
        ends = np.concatenate([[0.0], path.square])[first + rows * np.arange(batches + 1)]
        seconds = rows * stride * h / self.scales.frequency
        return dataclasses.replace(moments, load=np.diff(ends) / seconds * self._unit)

    @property
    def _unit(self) -> float:
        """The load's power, as of `Moments`, over its mean squared voltage in V^2."""
        return self.mu / self.scales.volts**2

    def voltages(self, state: Floats) -> dict[str, float]:
        """The voltages of all nodes (V) in a state of the circuit, by their names."""
        voltages = self.unknowns(state[None])[0]
        return {
            name: float(voltages[k])
            for name, k in self.system.unknowns.items()
            if k not in self.system.owners
        }

    def unknowns(self, states: Floats) -> Floats:
        """All unknowns (V, A) in states of the circuit, shape (n, length of a state): shape (n, unknowns)."""
        ns, n, *_ = self.sizes
        still = self._tau(TYPICAL) / 2 ** (LEVELS - 1)
        return self.reduction.unknowns(states[:, :ns], states[:, ns : ns + n], still)

    def charge_at(self, name: str) -> int:
        """The place of a capacitor's charge in a state."""
        return [charge_name for charge_name, *_ in self.system.charges].index(name)

    @property
    def has_counts(self) -> bool:
        """Whether its functions count whole periods; see `harvester.circuits.clocks`."""
        return bool(self.system.counts)

    def stored(self, state: Floats) -> Floats:
        """The energy in the circuit's capacitors; see `OwnCircuit`.

        It is without the piezo's, whose voltage is seen as such, and without clocks.
        """
        charges = state[:, MASS_ROWS : MASS_ROWS + self.sizes[3]]
        joules = 0.5 * np.moveaxis(charges**2, 1, 2) @ self.system.elastances
        return np.asarray(joules.ravel() / (self.scales.capacitance * self.scales.volts**2))

    def begin(self, state: Floats) -> None:
        """Fill the rows of circuits at rest."""
        state[:, MASS_ROWS : self.rows] = self.rest[:, None]

    def charge_store(self, state: Floats, voltage: Floats) -> None:
        """Give the storage in states, shape (blocks, rows, BATCH), a nondimensional voltage, shape (blocks, BATCH)."""
        k = self.charge_at("csmooth")
        state[:, MASS_ROWS + k] = voltage * self.scales.volts / self.system.charges[k][3]

    def advance(
        self,
        batch: Batch,
        state: Floats,
        schedule: Schedule,
        h: float,
        eqs: Equations,
        shaker: Filter | None,
    ) -> None:
        """Advance a batch of trajectories; see `OwnCircuit`.

        Raises CircuitError as soon as a switch chatters so much that the rest cannot make up for
        it.
        """
        if follow.waits:  # a call without a step compiles this kernel meanwhile
            none = schedule._replace(samples=0)
            circuit = self._with_follow(h, 0)
            advance_circuit(
                batch,
                state,
                schedule=none,
                h=h,
                circuit=circuit,
                rows=self.rows,
                eqs=eqs,
                shaker=shaker,
            )
        chatters = advance_circuit(
            batch,
            state,
            schedule=schedule,
            h=h,
            circuit=self.for_kernels(h),
            rows=self.rows,
            eqs=eqs,
            shaker=shaker,
        )
        if chatters and batch.sums is not None:
            self.check_sums(batch.sums.sum(axis=1), state[None])

    def mid_drift(
        self, state: Floats, out: Floats, h: float, eqs: Equations, shaker: Filter | None
    ) -> None:
        """The states of a batch half a step later; see `OwnCircuit`."""
        circuit_mid_drift(
            state, out, h=h, circuit=self.for_kernels(h), rows=self.rows, eqs=eqs, shaker=shaker
        )

    def for_kernels(self, h: float) -> KernelCircuit:
        """The circuit at steps of h.

        Threads that ask at once get one record, as it has but addresses of its arrays.
        """
        return self._with_follow(h, follow.address)

    def _with_follow(self, h: float, address: int) -> KernelCircuit:
        """The same with the address of `follow`."""
        record, _ = self._arrays.get(h) or self._arrays.setdefault(h, self._record(h))
        return KernelCircuit(
            record, address, self.room, self.voltages_at, self.scales.volts, self._unit
        )

    def tables(self, h: float) -> tuple[dict[str, float], dict[str, Floats]]:
        """The numbers of `CIRCUIT` at steps of h without addresses, and the arrays at these."""
        stages = [self.reduction.stage(self._tau(h) / 2**k) for k in range(LEVELS)]
        names = "admittances", "right", "outputs"
        matrices = [np.array([getattr(stage, name) for stage in stages]) for name in names]
        switches = self.system.switches
        s = self.scales
        thresholds = np.array(
            [[switch.on for switch in switches], [switch.off for switch in switches]]
        ).reshape(2, -1)
        volts = np.array([volts for _, _, _, volts in self.system.charges])
        given = np.array(self.solver.arguments or [0.0])
        at = ("Y_at", "R_at", "O_at", "p_at", "thresholds_at", "volts_at")
        arrays = {
            name: np.ascontiguousarray(values, dtype=np.float64)
            for name, values in zip(at, (*matrices, given, thresholds, volts), strict=True)
        }
        ns, n, many, nz = self.sizes
        finest = RINGING if self.has_coils else self.tolerance
        record = {
            "n": n,
            "nz": nz,
            "ns": ns,
            "switches": many,
            "least": LEAST * s.volts,
            "tolerance": min(finest, self.tolerance),
            "charge": s.capacitance * s.volts,
            "seconds": h / s.frequency,
        }
        return record, arrays

    def _record(self, h: float) -> tuple[Any, ...]:
        """The record of `CIRCUIT`, and the arrays that it points to."""
        numbers, arrays = self.tables(h)
        record = np.zeros(1, CIRCUIT)
        for name, value in numbers.items():
            record[name] = value
        for name, array in arrays.items():
            record[name] = array.ctypes.data
        record["solver_at"] = self.solver.address
        return record, arrays


def compiled_circuit(
    load: LoadCircuit, scales: Scales, tolerance: float = TOLERANCE
) -> CompiledCircuit:
    """The compiled circuit of a load, which is made once for each load and device.

    Raises as `CompiledCircuit`.
    """
    key = repr((load, scales, tolerance))
    if (circuit := _MADE.get(key)) is None:
        if len(_MADE) >= MOST_KEPT:
            _MADE.clear()
        circuit = _MADE[key] = CompiledCircuit(load, scales, tolerance=tolerance)
    return circuit


_MADE: dict[str, CompiledCircuit] = {}
MOST_KEPT = 64
