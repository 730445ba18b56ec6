"""The rectifier's mean current in each window of a record, at held voltages: many lanes share the record's time.

A record has quiet and loud parts, so that I(V) alone is not enough.  Here the mass is followed
along the whole record with the storage capacitor held at each of some voltages, and I(V, t) is the
current that the rectifier gives in each window of time.  The record is cut into pieces; in each a
batch of trajectories has some parts of it side by side, which begin early by the time that the mass
needs to forget its start.

Long because windows, lanes and the table that they fill are of one design.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.fft import next_fast_len

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.machine.threads import in_threads
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_in_ngspice import Piece, error_of_circuit
from harvester.storage.held_stores import HELD, Elements, StoresOnRecord
from harvester.storage.measured_current import FADED, Rectifier, time_constant
from harvester.storage.rectified_current import MeanCurrent, RectifiedCurrent
from harvester.storage.time_limit import check_time, deadline_of_limit, working_seconds

VOLTAGES = 16
BATCHES = 2  # side by side
# s of a window; of the resonance in one; of a record
SHORTEST = 1.0
PERIODS = 8.0
MOST_WINDOWS = 20_000
PIECE = 2**22  # steps of a piece of the record
BEYOND = 3.0  # over the largest rms of the open piezo's voltage in a window
LOUD, JUDGED = 40, 3  # windows: storage compared, and ideal elements with the netlist's
PARTS = 64  # of a window, in which a storage voltage hardly changes


@dataclass(frozen=True)
class RecordedCurrent(MeanCurrent):
    """The mean ``current`` (A), shape (windows, n), in windows of a ``length`` (s), at ``voltages`` (V) from 0 on."""

    length: float


AnyCurrent = RectifiedCurrent | RecordedCurrent


class RecordGrid(NamedTuple):
    """How a record is divided: ``windows`` of so many ``samples`` of the file, each of ``steps`` of h."""

    windows: int
    samples: int
    steps: int
    h: float


def grid_of(problem: Problem, h: float | None = None) -> RecordGrid:
    """The windows of a record, whose ends are samples of it.

    The last samples that fill no window are left out.
    """
    record, w0 = problem.equations.record, problem.scales.frequency
    assert record is not None, "the caller checks"
    h = step_from_rest(replace(problem.equations, record=None)) if h is None else h
    seconds = max(
        SHORTEST * w0, PERIODS * 2.0 * math.pi, record.count * record.spacing / MOST_WINDOWS
    )
    samples = min(next_fast_len(max(round(seconds / record.spacing), 1), True), record.count)
    steps = 8 * next_fast_len(math.ceil(samples * record.spacing / (8.0 * h)), True)
    return RecordGrid(record.count // samples, samples, steps, samples * record.spacing / steps)


def _early(problem: Problem, grid: RecordGrid) -> int:
    """Windows in which the mass forgets its start."""
    return math.ceil(FADED * time_constant(problem.equations) / (grid.steps * grid.h))


def windows_of(
    problem: Problem, circuit: Elements, volts: Floats, grid: RecordGrid
) -> tuple[Floats, Floats, int]:
    """Charges (C) in windows at held voltages, shape (windows, n), the piezo's mean squares (V^2), and the steps made.

    The ``circuit`` has a held storage capacitor; the number of voltages divides `BATCH`.
    """
    count = len(volts)
    parts = BATCHES * BATCH // len(volts)
    early = _early(problem, grid)
    each = max(min(PIECE // grid.steps, grid.windows) // parts, 1)
    farads = HELD * problem.scales.capacitance
    steps = 0
    record = problem.equations.record
    assert record is not None, "the caller checks"
    moments = np.zeros((2, grid.windows, count))  # charges and mean squares
    held = np.tile(volts, parts // BATCHES)
    begun = working_seconds()
    for begin in range(0, grid.windows, parts * each):
        samples = record.resampled(begin - early, early + parts * each, grid.samples, grid.steps)

        def batch(k: int, begin: int = begin, samples: Floats = samples) -> int:
            stores = StoresOnRecord(problem, circuit, farads, grid.h)
            part = k * (parts // BATCHES) + np.repeat(np.arange(parts // BATCHES), count)
            stores.begin(samples, (part * each * grid.steps).astype(float))
            for i in range(early + each):
                gained = stores.advance(held, grid.steps * grid.h)
                both = np.array([gained.charges, gained.squares])
                at = begin + part * each + i - early
                good = (at < grid.windows) & (i >= early)
                moments[:, at[good], np.tile(np.arange(count), parts // BATCHES)[good]] = both[
                    :, good
                ]
            return (early + each) * grid.steps * BATCH

        with in_threads(batch, range(BATCHES)) as counts:
            steps += sum(counts)
        check_time(begun, min((begin + parts * each) / grid.windows, 1.0))
    return moments[0], moments[1], steps


class Recorded(NamedTuple):
    """I(V, t), the same of the scene's step, and their number of steps.

    ``separation`` is the relative difference of the charges of storage capacitors with their own
    capacitance, ``elements`` that behind the netlist's own elements, and that behind ngspice's;
    ``unknown`` states the unknown part of that.
    """

    best: RecordedCurrent
    rough: RecordedCurrent
    separation: float
    elements: float
    steps: int
    unknown: str = ""


def recorded(
    problem: Problem,
    farads: float | None = None,
    top: float | None = None,
    working: float | None = None,
) -> Recorded:
    """I(V, t) of a record, extrapolated from two steps, up to ``top`` (V) or a voltage that the piezo hardly reaches.

    It is that of ideal elements if the netlist has such ones, which are judged by its own.  In
    the loudest windows a storage capacitor of ``farads`` (None: a held one) that is not held gains
    the charge that it should as well, but for the effect of separating the time scales.  That of a
    custom netlist is compared with ngspice as well, on the way to the ``working`` voltage (V)
    of the storage capacitor; None: to half of the highest.

    Raises as `CompiledCircuit`.
    """
    grid = grid_of(problem)
    steps = 0
    rectifier = Rectifier(problem)
    if top is None:
        # to so high a voltage
        closed = IdealCircuit(mu=1e-12, kappa=HELD, n=1e-3, leak=1e-9, loss=0.0, bridge=True)
        _, squares, steps = windows_of(
            problem, closed, np.full(1, 1e3 * problem.scales.volts), grid
        )
        top = BEYOND * math.sqrt(float(squares.max()))
    volts = np.linspace(0.0, top, VOLTAGES)
    length = grid.steps * grid.h / problem.scales.frequency
    tables = []
    for step_grid in (grid, grid._replace(steps=grid.steps // 2, h=2.0 * grid.h)):
        charges, _, more = windows_of(problem, rectifier.fast(rectifier.held), volts, step_grid)
        tables.append(RecordedCurrent(volts, charges / length, None, length))
        steps += more
    separation, many = _separation(problem, rectifier, tables[0], grid, farads or rectifier.held)
    off, more = _elements(problem, rectifier, tables[0], grid) if rectifier.ideal else (0.0, 0)
    loud = _loudest(problem, tables[0], grid, 1)
    early = _early(problem, grid)
    record = problem.equations.record
    assert record is not None, "the caller checks"
    samples = record.resampled(
        loud.start - early, early + loud.stop - loud.start, grid.samples, grid.steps
    )
    piece = Piece(samples, early * grid.steps, grid.h)
    highest = float(tables[0].voltages[-1])
    judge, unknown = error_of_circuit(
        problem, min(working or 0.5 * highest, highest), piece=piece, deadline=deadline_of_limit()
    )
    every = steps + many + more
    return Recorded(
        tables[0].extrapolated(tables[1]), tables[0], separation, off + judge, every, unknown
    )


def _gained(
    problem: Problem, circuit: Elements, loud: slice, grid: RecordGrid, store: tuple[Floats, float]
) -> tuple[Floats, int]:
    """The charges that storage at voltages (V), of a capacitance (F), gain in ``loud`` windows, and the steps.

    The mass has forgotten its start by then.  Stores that are not slow compared with the vibration
    are not held.
    """
    early = _early(problem, grid)
    record = problem.equations.record
    (volts, farads) = store
    assert record is not None, "the caller checks"
    windows = loud.stop - loud.start
    stores = StoresOnRecord(problem, circuit, farads, grid.h)
    stores.begin(
        record.resampled(loud.start - early, early + windows, grid.samples, grid.steps),
        np.zeros(BATCH),
    )
    window = grid.steps * grid.h
    for _ in range(early):
        stores.advance(volts, window)
    gained = stores.advance(volts, window).charges
    for _ in range(windows - 1):
        gained = gained + stores.advance(None, window).charges
    return gained, (early + windows) * grid.steps * BATCH


def _loudest(problem: Problem, table: RecordedCurrent, grid: RecordGrid, count: int) -> slice:
    """The windows about the one of most current: so many at most, after those in which the mass forgets its start."""
    most = int(np.argmax(table.current.sum(axis=1)))
    early = _early(problem, grid)
    first = min(max(most - count // 2, early), grid.windows - 1)
    return slice(first, min(max(most, first) + (count + 1) // 2, grid.windows))


def _separation(
    problem: Problem, rectifier: Rectifier, table: RecordedCurrent, grid: RecordGrid, farads: float
) -> tuple[float, int]:
    """Relative difference of the charges of storage capacitors with their own capacitance, and the steps.

    Each begins at one of the voltages in the lower half, and continues for as long as all are below
    the highest.
    """
    volts = np.repeat(table.voltages[: VOLTAGES // 2], 2 * BATCH // VOLTAGES)
    count = LOUD
    v = np.full(BATCH, math.inf)
    while count and v.max() > table.voltages[-1]:
        loud = _loudest(problem, table, grid, count)
        count = count // 2
        v = volts.copy()
        for row in np.repeat(table.current[loud], PARTS, axis=0):
            v += np.interp(v, table.voltages, row) * table.length / PARTS / farads
    gained, steps = _gained(problem, rectifier.fast(farads), loud, grid, (volts, farads))
    return _off(gained, farads * (v - volts)), steps


def _elements(
    problem: Problem, rectifier: Rectifier, table: RecordedCurrent, grid: RecordGrid
) -> tuple[float, int]:
    """Relative difference of the charges behind the netlist's own elements, and the steps."""
    held = rectifier.held
    store = np.repeat(table.voltages, BATCH // VOLTAGES), held
    loud = _loudest(problem, table, grid, JUDGED)
    (ours, steps), (its, many) = (
        _gained(problem, circuit(held), loud, grid, store)
        for circuit in (rectifier.fast, rectifier.compiled)
    )
    return _off(ours, its), steps + many


def _off(charges: Floats, expected: Floats) -> float:
    return float(np.abs(charges - expected).sum() / max(np.abs(expected).sum(), 1e-300))
