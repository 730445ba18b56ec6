"""The solver of a circuit's stages, generated for its topology and compiled once: all values are arguments.

Newton's method on Y y + A (i(w) + q(w)/tau) = r, w = W y: the functions and their derivatives as
straight lines (`harvester.circuits.derivatives`), the voltages of junctions limited, until no
function differs from its tangent by more than its tolerance.  A circuit without functions of its
own and with more junctions than `MOST_WRITTEN` is a tape of numbers, as the time of compilation
grows with the square of the lines.
"""

import hashlib
import itertools
import sys
import threading
import types
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.derivatives import Writer
from harvester.circuits.elimination import (
    joined,
    largest_factors,
    lines_of,
    pivots,
    tape_of,
    terms_of,
)
from harvester.circuits.newton_parts import EACH, HELD, LARGEST
from harvester.circuits.reduction import Reduction
from harvester.circuits.system import Row
from harvester.errors import InputError
from harvester.machine import files

_HEAD = '''"""Made by harvester.circuits.newton for one topology; it may be deleted at any time."""

import math

from numba import carray

from harvester.circuits.junctions import diode
from harvester.circuits.newton_parts import (
    ALMOST, DAMPED, MOST_ITERATIONS, RELATIVE, SIGNATURE, fudged, limited, power_slope, solve_dense, table_at,
    table_slope,
)
from harvester.circuits.pointers import data
from harvester.mechanics.kernels.compiled import c_function


@c_function(SIGNATURE)
def solve(y_at, r_at, Y_at, p_at, s_at, q_at, work_at, rate):
'''
_OF_A_TAPE = '''"""Made by harvester.circuits.newton for circuits of many junctions; it may be deleted at any time."""

from numba import carray

from harvester.circuits.newton_parts import SIGNATURE, solve_tape
from harvester.mechanics.kernels.compiled import c_function


@c_function(SIGNATURE)
def solve(y_at, r_at, Y_at, p_at, s_at, q_at, work_at, rate):
    p = carray(p_at, 3)
    p, n, many = carray(p_at, int(p[0])), int(p[1]), int(p[2])
    y, r, Y = carray(y_at, n), carray(r_at, n), carray(Y_at, n * n)
    work = carray(work_at, n * n + 3 * n + 10 * many)
    return solve_tape(y, r, Y, p, carray(q_at, many), work, rate)
'''
MOST_WRITTEN = 24  # junctions whose equations are straight lines
_ONE_AT_A_TIME = threading.Lock()
SAMPLES = 16  # of the matrix for each length of stages, by which pivots are chosen
FURTHEST = 1e15  # currents of the device, beyond which their rounding is no longer small beside one
FURTHEST_OF_SOURCE = 1e12  # the same of a function, which no junction limits
SMALL = 1e-7  # of the device's sizes: what a function may differ from its tangent by


class Solver:
    """A compiled solver: its source ``text``, and the ``arguments`` of its values."""

    def __init__(
        self, reduction: Reduction, impedance: float, volts: float, taus: Sequence[float]
    ) -> None:
        """``impedance`` (ohm) and ``volts`` are sizes of the device, for the knees of junctions and for tolerances.

        ``taus`` are lengths of stages among which all that are made lie.
        """
        self.reduction = reduction
        self.n = len(reduction.columns)
        system = reduction.system
        writer = Writer([f"w{k}" for k in range(len(system.inputs))], indent=8 * " ")
        self._row = {k: i for i, k in enumerate(reduction.rows)}
        self._column = {k: i for i, k in enumerate(reduction.columns)}
        self._before, self._tests, self._last, self._stamps, self._after, self._ends = (
            list[str]() for _ in range(6)
        )
        self._right: dict[int, list[str]] = {i: [f"r[{i}]"] for i in range(self.n)}
        # of each: where it enters, its input, its function
        self._slopes: list[tuple[Row, Row, int, bool]] = []
        self._terms: dict[tuple[int, int], list[str]] = {}
        for k, junction in enumerate(system.diodes):
            w = f"w{junction.input}"
            given = ", ".join(map(writer.argument, junction.arguments))
            writer.lines += [
                f"        i{k}, g{k}, x{k}, c{k} = diode({w}, {given})",
                f"        I{k}, G{k} = i{k} + rate*x{k}, g{k} + rate*c{k}",
            ]
            tolerance = writer.argument(SMALL * volts / impedance)
            self._add(f"{k}", f"I{k}", {junction.input: f"G{k}"}, junction.rows, tolerance)
            # A larger current, which only ideal sources drive, leaves too few digits to the others.
            furthest = writer.argument(FURTHEST * volts / impedance)
            self._tests[-1] += f" and abs(I{k}) <= {furthest}"
            self._before.append(f"Q{k} = 0.0")
            self._ends.append(f"Q{k} = x{k} + c{k}*(v{junction.input} - u{junction.input})")
            self._last.append(f"q[{k}] = Q{k}")
        for k, two in enumerate(system.functions, len(system.diodes)):
            value, slopes = writer.write(two.tree)
            is_voltage = all(i in system.owners for i in two.rows)
            size = 1.0 if is_voltage else 1e-2 / impedance
            self._add(f"{k}", value, slopes, two.rows, writer.argument(SMALL * size))
            if not is_voltage:
                furthest = writer.argument(FURTHEST_OF_SOURCE * volts / impedance)
                self._tests[-1] += f" and abs({value}) <= {furthest}"
        charges = len(system.charges) + len(system.diodes)
        self.work = self.n * self.n + 3 * self.n + 10 * charges
        linear = [reduction.stage(tau).admittances for tau in taus]
        if len(system.diodes) > MOST_WRITTEN and not system.functions:
            self.arguments = self._tape(volts, impedance, linear)
            self.text = _OF_A_TAPE
            return
        self._write_inputs(writer, impedance)
        solution = self._elimination(writer, impedance, linear)
        self.arguments, self._lines = writer.constants, writer.lines
        self.text = self._text(len(system.switches), len(system.diodes), solution)

    def _write_inputs(self, writer: Writer, impedance: float) -> None:
        """Add the lines that continue from a solution to the inputs: those of junctions are limited."""
        for k, (row, junction) in enumerate(self.reduction.system.inputs):
            self._before.append(f"w{k} = {self._at(row, 'y[{}]')}")
            self._after += [f"u{k} = w{k}", f"v{k} = {self._at(row, 'b[{}]')}"]
            if junction is None:
                self._after.append(f"w{k} = v{k} + held * (u{k} - v{k})")
                continue
            given = junction.limits(impedance)
            self._after += [
                f"l{k} = limited(v{k}, u{k}, {', '.join(map(writer.argument, given))})",
                f"w{k} = l{k} + held * (u{k} - l{k})",
                f"near &= w{k} == v{k}",
            ]

    def _add(
        self, name: str, value: str, slopes: dict[int, str], rows: Row, tolerance: str
    ) -> None:
        """Add a function F to the tests and to the matrix: its tangent is F + sum of F_k (w_k - u_k)."""
        self._before += [f"T{name} = 0.0", f"ok{len(self._tests)} = True"]
        self._ends.append(
            f"T{name} = "
            + _sum([value, *(f"{slope}*(w{k} - u{k})" for k, slope in slopes.items())])
        )
        self._tests.append(f"abs({value} - T{name}) <= RELATIVE*abs({value}) + {tolerance}")
        self._stamps.append(
            f"e{name} = " + _sum([value, *(f"-{slope}*w{k}" for k, slope in slopes.items())])
        )
        rows = self.reduction.equations.of(rows)
        for i, weight in rows.items():
            self._right[self._row[i]].append(_times(-weight, f"e{name}"))
        is_current = not any(i in self.reduction.system.owners for i in rows)
        for k, slope in slopes.items():
            row, _ = self.reduction.system.inputs[k]
            self._slopes.append((rows, row, len(self._tests), is_current))
            for (i, weight), (j, factor) in itertools.product(rows.items(), row.items()):
                entry = self._row[i], self._column[j]
                self._terms.setdefault(entry, []).append(_times(weight * factor, slope))

    def _samples(self, impedance: float, linear: list[Floats]) -> Floats:
        """Matrices as iterations meet them, with equations of like size: derivatives that are zero, small and large."""
        rng = np.random.default_rng(0)
        matrices = []
        sizes = [
            1.0 if i in self.reduction.system.owners else impedance for i in self.reduction.rows
        ]
        for matrix in linear * SAMPLES:
            weighted = np.array(sizes)[:, None] * matrix
            derivatives = dict[int, float]()
            for rows, row, function, is_current in self._slopes:
                slope = 0.0 if rng.random() < 0.3 else 10.0 ** rng.uniform(-3.0, 2.0)
                slope = (
                    derivatives.setdefault(function, slope)
                    if is_current
                    else slope * rng.choice([-1.0, 1.0])
                )
                for (i, weight), (j, factor) in itertools.product(rows.items(), row.items()):
                    weighted[self._row[i], self._column[j]] += weight * factor * slope
            matrices.append(weighted)
        return np.array(matrices)

    def _tape(self, volts: float, impedance: float, linear: list[Floats]) -> list[float]:
        """The circuit as numbers, for `newton_parts.solve_tape`.

        Its parts: voltages of junctions; 16 numbers of each; currents into equations; places in the
        linear matrix; slopes into the matrix; elimination; solution.
        """
        n = self.n
        system = self.reduction.system
        pattern = np.any(linear, axis=0)
        linear_at = np.flatnonzero(pattern).tolist()
        voltages, junctions, currents, slopes = (list[float]() for _ in range(4))
        tolerances = [SMALL * volts / impedance, FURTHEST * volts / impedance]
        for diode in system.diodes:
            row, junction = system.inputs[diode.input]
            assert junction is not None, "an input of a diode has a junction"
            read = {self._column[j]: factor for j, factor in row.items()}
            rows = self.reduction.equations.of(diode.rows)
            entered = {self._row[i]: weight for i, weight in rows.items()}
            pairs = itertools.product(entered.items(), read.items())
            both = {i * n + j: weight * factor for (i, weight), (j, factor) in pairs}
            pattern[np.ix_([*entered], [*read])] = True
            voltages += terms_of(read)
            junctions += [*diode.arguments, *junction.limits(impedance), *tolerances]
            currents += terms_of({i: -weight for i, weight in entered.items()})
            slopes += terms_of(both)
        order = pivots(self._samples(impedance, linear), pattern)
        steps = tape_of(order, pattern, self._factors(impedance))
        parts = voltages, junctions, currents, [len(linear_at), *linear_at], slopes, *steps
        return joined((n, len(system.diodes)), parts)

    def _factors(self, impedance: float) -> list[list[float]]:
        """The largest factors of the elimination."""
        voltages = [i in self.reduction.system.owners for i in self.reduction.rows]
        return largest_factors(voltages, LARGEST, impedance)

    def _elimination(self, writer: Writer, impedance: float, linear: list[Floats]) -> list[str]:
        """The lines that solve the equations of an iteration for b[0], b[1], ..."""
        n = self.n
        entries = dict[tuple[int, int], list[str]]()
        for i, j in np.argwhere(np.any(linear, axis=0)).tolist():
            entries[i, j] = [f"Y[{i * n + j}]"]
        for entry, terms in self._terms.items():
            entries[entry] = entries.get(entry, []) + terms
        pattern = np.zeros((n, n), dtype=bool)
        pattern[tuple(zip(*entries, strict=True))] = True
        furthest = self._factors(impedance)
        sizes = sorted({size for row in furthest for size in row})
        limit = {size: writer.argument(size) for size in sizes}
        limits = [[limit[size] for size in row] for row in furthest]
        order = pivots(self._samples(impedance, linear), pattern)
        return [
            *(f"a{i}_{j} = {_sum(terms)}" for (i, j), terms in entries.items()),
            *(f"b{i} = {_sum(terms)}" for i, terms in self._right.items()),
            *lines_of(order, pattern, limits),
            "if safe:",
            *(f"    b[{k}] = z{k}" for k in range(n)),
            "else:",
            f"    for k in range({n}, {n * n + n}):",
            "        b[k] = 0.0",
            *(f"    b[{i}] = b{i}" for i in range(n)),
            *(f"    b[{n + i * n + j}] = a{i}_{j}" for i, j in entries),
            f"    if not solve_dense(carray(data(b[{n} :]), ({n}, {n})), b, {n}):",
            "        return -1",
        ]

    def _at(self, row: Row, name: str) -> str:
        """The text of an input, from the unknowns by their ``name``."""
        return _sum([_times(value, name.format(self._column[k])) for k, value in row.items()])

    def _text(self, switches: int, charges: int, solution: list[str]) -> str:
        """The source of the solver."""
        n = self.n
        lines = [
            f"    y, r, Y = carray(y_at, {n}), carray(r_at, {n}), carray(Y_at, {n * n})",
            f"    b, q = carray(work_at, {n * n + n}), carray(q_at, {max(charges, 1)})",
            f"    p, s = carray(p_at, {max(len(self.arguments), 1)}), carray(s_at, {max(switches, 1)})",
            *(f"    {line}" for line in self._before),
            "    near = False",
            "    for iteration in range(MOST_ITERATIONS):",
            *self._lines,
            "        if near:",
            *(f"            ok{k} = {test}" for k, test in enumerate(self._tests)),
            f"            if {' & '.join(map('ok{}'.format, range(len(self._tests)))) or 'True'}:",
            *(f"                {line}" for line in self._last),
            *(f"                y[{k}] = b[{k}]" for k in range(n)),
            "                return iteration",
            *(f"        {line}" for line in self._stamps),
            *(f"        {line}" for line in solution),
            f"        near = iteration < DAMPED or iteration % {EACH} == 0",
            f"        held = 0.0 if near else {HELD}",
            *(f"        {line}" for line in self._after),
            *(f"        {line}" for line in self._ends),
            *(
                line
                for k in range(len(self._tests))
                for line in (f"    if not ok{k}:", f"        return {-2 - k}")
            ),
            "    return -1",
        ]
        return _HEAD + "\n".join(lines) + "\n"

    @property
    def address(self) -> int:
        """The address of the compiled function, which threads ask for side by side and one makes."""
        with _ONE_AT_A_TIME:
            return int(compiled_source(self.text).address)


def _sum(terms: list[str]) -> str:
    """The text of a sum."""
    return " + ".join(terms).replace("+ -", "- ") or "0.0"


def _times(weight: float, name: str) -> str:
    """The text of a product with a number that belongs to the topology."""
    return name if weight == 1.0 else f"-{name}" if weight == -1.0 else f"{weight!r}*{name}"


@cache
def compiled_source(text: str) -> Any:
    """The function ``solve`` of a source; its machine code is kept if there is a folder for it.

    Python code is compiled from ``text`` itself, never from a file: numba reads the file's name and
    time only, and bytecode that Python's own import would keep has no checksum.
    """
    from harvester.mechanics.kernels.compiled import _cache_folder

    name = f"circuit_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    file = _kept_source(name, text, _cache_folder())
    module = types.ModuleType(name)
    module.__file__ = file
    sys.modules[name] = module
    exec(compile(text, file, "exec"), module.__dict__)
    return module.__dict__["solve"]


def _kept_source(name: str, text: str, folder: str | None) -> str:
    """The path of a file with the ``text``, written if need be; no path if it cannot be."""
    absent = f"<{name}>"
    if folder is None:
        return absent
    path = Path(folder) / f"{name}.py"
    try:
        if not path.is_symlink() and files.read(path, "cache", len(text.encode())) == text.encode():
            return str(path)
    except InputError:  # missing, longer, or no file
        pass
    try:
        files.write(path, text)
    except InputError:  # a full disk, or something else in its place: for this process only
        return absent
    return str(path)
