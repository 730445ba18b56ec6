"""A load circuit as the package has read it, fed by the oracle's current: mean load power and RMS voltage.

The equations are the compiled circuit's own (`harvester.circuits.system`), but nothing is compiled
for a topology: the trees are computed by a machine with a stack, whose code is data, so that a
thousand netlists cost one compilation. The method is Alexander's of second order, with steps of its
own choice, and Newton's iterations with derivatives by differences.  That tests what was read and
stamped; `by_compiled_circuit` is the same with the package's own solver.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.junctions import diode
from harvester.circuits.newton_parts import limited, solve_dense
from harvester.circuits.pointers import advance
from harvester.circuits.substeps import DID, FINEST
from harvester.equations.scales import Scales
from harvester.errors import InputError
from harvester.mechanics.kernels.compiled import kernel, own_cache
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.ngspice_oracle import (
    CAPACITANCE,
    LEAK,
    LONGEST_STEP,
    SECONDS,
    Answer,
    amplitudes,
)

GAMMA = 1.0 - math.sqrt(0.5)
TOLERANCE = 1e-4  # of a charge's largest size, which the two orders of a step may differ by
SHORTEST = 1e-9  # of SECONDS
PIECE = 64  # steps of a compiled circuit, between which a signal is handled
MOST_STEPS = 100_000
LEAST = 1e-2  # V, the least size of a charge
DEVICE = Scales(0.04, 2.0 * math.pi * 47.0, 1e-3, 1e-3 * 6.0 * CAPACITANCE / 1e-6, CAPACITANCE)
_BINARY = (
    "+",
    "-",
    "*",
    "/",
    "%",
    "and",
    "or",
    "<",
    ">",
    "<=",
    ">=",
    "==",
    "!=",
    "min",
    "max",
    "pow",
    "pwr",
    "power",
)
_UNARY = ("negative", "not", "abs", "exp", "ln", "log10", "sqrt", "sin", "cos", "tan", "atan", "tanh", "sinh", "cosh",
          "u", "uramp", "sgn", "floor", "ceil", "int", "nint", "u2", "sqr", "asin", "acos", "asinh", "acosh", "atanh",
          "gt0", "lt0", "ge0", "le0", "eq0", "ne0")  # fmt: skip
_ALIASES = {"sign": "sgn"}
CONSTANT = 0
INPUT = 1
STATE = 2
CHOICE = 3
TABLE = 4
FIRST_BINARY, FIRST_UNARY = 10, 40


class NoMachineError(Exception):
    """An operation of a tree that the machine does not have."""


def read(path, terminals=None, resistor=None, parameters=None):
    """The compiled circuit of a netlist's file, not yet compiled; raises InputError where the package refuses it."""
    given = {} if terminals is None else {"terminals": terminals}
    if resistor is not None:
        given["resistor"] = resistor
    load = load_circuit(Load(netlist=str(path), parameters=parameters or {}, **given), CAPACITANCE)
    return CompiledCircuit(load, DEVICE)


def answered(path, terminals=None, resistor=None):
    """The package's answer to a netlist's file, or why it refuses it."""
    try:
        circuit = read(path, terminals, resistor)
    except InputError as error:
        return Answer(why=str(error) or type(error).__name__)
    return by_machine(circuit)


def code_of(tree, code, constants):
    """Write a tree as the code of the machine with a stack."""
    name = _ALIASES.get(tree.operation, tree.operation)
    if name == "constant":
        code += [CONSTANT, len(constants)]
        constants.append(tree.value)
    elif name in ("input", "state"):
        code += [INPUT if name == "input" else STATE, tree.index]
    elif name == "pwl":
        code_of(tree.arguments[0], code, constants)
        code += [TABLE, len(tree.arguments) // 2, len(constants)]
        constants += [point.value for point in tree.arguments[1:]]
    else:
        for argument in tree.arguments:
            code_of(argument, code, constants)
        if name == "?":
            code.append(CHOICE)
        elif name in _BINARY and len(tree.arguments) == 2:
            code.append(FIRST_BINARY + _BINARY.index(name))
        elif name in _UNARY and len(tree.arguments) == 1:
            code.append(FIRST_UNARY + _UNARY.index(name))
        else:
            raise NoMachineError(name)


def inputs_of(tree):
    """The numbers of the inputs that a tree has."""
    if tree.operation == "input":
        return {tree.index}
    return (
        set().union(*(inputs_of(argument) for argument in tree.arguments))
        if tree.arguments
        else set()
    )


def _machine(function):
    """Compile a part of the machine, kept on disk as long as the package's own kernels are."""
    with own_cache(function) as cached:
        return njit(cache=cached)(function)


@_machine
def value_at(code, first, last, constants, w, switches, stack):
    """The value of the code between two places."""
    top = 0
    at = first
    while at < last:
        what = code[at]
        at += 1
        if what == CONSTANT:
            stack[top] = constants[code[at]]
            top += 1
            at += 1
        elif what == INPUT:
            stack[top] = w[code[at]]
            top += 1
            at += 1
        elif what == STATE:
            stack[top] = switches[code[at]]
            top += 1
            at += 1
        elif what == TABLE:
            points = code[at]
            begin = code[at + 1]
            x = stack[top - 1]
            at += 2
            k = 0
            while k < points - 2 and x >= constants[begin + 2 * (k + 1)]:
                k += 1
            x0 = constants[begin + 2 * k]
            y0 = constants[begin + 2 * k + 1]
            x1, y1 = constants[begin + 2 * k + 2], constants[begin + 2 * k + 3]
            stack[top - 1] = y0 + (y1 - y0) / (x1 - x0) * (x - x0)
        elif what == CHOICE:
            stack[top - 3] = stack[top - 2] if stack[top - 3] != 0.0 else stack[top - 1]
            top -= 2
        elif what < FIRST_UNARY:
            stack[top - 2] = binary(what - FIRST_BINARY, stack[top - 2], stack[top - 1])
            top -= 1
        else:
            stack[top - 1] = unary(what - FIRST_UNARY, stack[top - 1])
    return stack[0]


@_machine
def binary(what, a, b):  # noqa: PLR0912 -- one operation a branch
    """An operation on two numbers, as ngspice's B sources have it."""
    if what == 0:
        return a + b
    if what == 1:
        return a - b
    if what == 2:
        return a * b
    if what == 3:
        return a / (b + math.copysign(1e-32, b))
    if what == 4:
        return a - b * np.trunc(a / b) if b != 0.0 else np.nan
    if what == 5:
        return 1.0 if a != 0.0 and b != 0.0 else 0.0
    if what == 6:
        return 1.0 if a != 0.0 or b != 0.0 else 0.0
    if what == 7:
        return 1.0 if a < b else 0.0
    if what == 8:
        return 1.0 if a > b else 0.0
    if what == 9:
        return 1.0 if a <= b else 0.0
    if what == 10:
        return 1.0 if a >= b else 0.0
    if what == 11:
        return 1.0 if a == b else 0.0
    if what == 12:
        return 1.0 if a != b else 0.0
    if what == 13:
        return min(a, b)
    if what == 14:
        return max(a, b)
    size = abs(a)
    if size == 0.0 and b < 0.0:
        return 1e99
    if what == 15:
        return size**b
    if what == 16:
        return math.copysign(size**b, a)
    return a**b if a >= 0.0 or b == np.floor(b) else np.nan


@_machine
def unary(what, a):  # noqa: PLR0912 -- one operation a branch
    """An operation on one number, as ngspice's B sources have it."""
    if what == 0:
        return -a
    if what == 1:
        return 1.0 if a == 0.0 else 0.0
    if what == 2:
        return abs(a)
    if what == 3:
        return math.exp(a) if a < 227.9559242 else 1e99
    if what == 4:
        return math.log(a) if a > 0.0 else -1e99
    if what == 5:
        return math.log10(a) if a > 0.0 else -1e99
    if what == 6:
        return math.sqrt(a) if a > 0.0 else 0.0
    if what == 7:
        return math.sin(a)
    if what == 8:
        return math.cos(a)
    if what == 9:
        return math.tan(a)
    if what == 10:
        return math.atan(a)
    if what == 11:
        return math.tanh(a)
    if what == 12:
        return math.sinh(a)
    if what == 13:
        return math.cosh(a)
    if what == 14:
        return 1.0 if a > 0.0 else 0.5 if a == 0.0 else 0.0
    if what == 15:
        return max(a, 0.0)
    if what == 16:
        return 1.0 if a > 0.0 else -1.0 if a < 0.0 else 0.0
    if what == 17:
        return np.floor(a)
    if what == 18:
        return np.ceil(a)
    if what == 19:
        return np.trunc(a)
    if what == 20:
        return np.rint(a)
    if what == 21:
        return min(max(a, 0.0), 1.0)
    if what == 22:
        return a * a
    if what == 23:
        return math.asin(min(max(a, -1.0), 1.0))
    if what == 24:
        return math.acos(min(max(a, -1.0), 1.0))
    if what == 25:
        return math.asinh(a)
    if what == 26:
        return math.acosh(max(a, 1.0))
    if what == 27:
        return math.atanh(min(max(a, -1.0 + 1e-15), 1.0 - 1e-15))
    if what == 28:
        return 1.0 if a > 0.0 else 0.0
    if what == 29:
        return 1.0 if a < 0.0 else 0.0
    if what == 30:
        return 1.0 if a >= 0.0 else 0.0
    if what == 31:
        return 1.0 if a <= 0.0 else 0.0
    return (1.0 if a == 0.0 else 0.0) if what == 32 else (1.0 if a != 0.0 else 0.0)


class Machine(NamedTuple):
    """A circuit's equations as arrays.

    P, Z, G, A, W, s and b are as of `harvester.circuits.system`, ``read_out`` has the rows of what is reported and
    ``control`` those of the switches.  ``functions`` has for each function where its code begins and ends, and where
    the numbers of its inputs do in ``needs``; ``junctions`` how each input is limited, ``steps`` the differences of
    the derivatives, ``volts`` what 1 of each charge is, ``voltages`` which unknowns are voltages.
    """

    P: Any
    Z: Any
    G: Any
    A: Any
    W: Any
    s: Any
    b: Any
    read_out: Any
    control: Any
    thresholds: Any
    diodes: Any
    arguments: Any
    functions: Any
    codes: Any
    needs: Any
    constants: Any
    junctions: Any
    steps: Any
    volts: Any
    voltages: Any


@_machine
def diode_at(p, v):
    """A diode of the arguments p at a voltage: current, conductance, charge and capacitance."""
    return diode(v, p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8])


@_machine
def add_diodes(c, w, tau, J, r, q1):
    """Add the diodes' tangents to the equations, and note their charges."""
    for k in range(len(c.diodes)):
        index = c.diodes[k]
        i, g, x, capacitance = diode_at(c.arguments[k], w[index])
        q1[k] = x
        now, slope = i + x / tau, g + capacitance / tau
        r -= c.A[:, k] * (now - slope * w[index])
        J += np.outer(c.A[:, k], c.W[index]) * slope


@_machine
def add_functions(c, w, switches, J, r):
    """Add the functions' tangents to the equations, their derivatives by differences."""
    stack = np.empty(400)
    slopes = np.zeros(len(w))
    for k in range(len(c.functions)):
        first, last = c.functions[k, 0], c.functions[k, 1]
        tangent = value_at(c.codes, first, last, c.constants, w, switches, stack)
        slopes[:] = 0.0
        for m in range(c.functions[k, 2], c.functions[k, 3]):
            index = c.needs[m]
            kept = w[index]
            h = 1e-6 * max(abs(kept), c.steps[index])
            w[index] = kept + h
            above = value_at(c.codes, first, last, c.constants, w, switches, stack)
            w[index] = kept - h
            below = value_at(c.codes, first, last, c.constants, w, switches, stack)
            w[index] = kept
            slopes[index] = (above - below) / (2.0 * h)
            tangent -= slopes[index] * kept
        column = c.A[:, len(c.diodes) + k]
        r -= column * tangent
        J += np.outer(column, slopes @ c.W)


@_machine
def solved(J, r):
    """Solve the equations, each divided by its largest coefficient; whether there is a solution, which r holds."""
    n = len(r)
    for i in range(n):
        largest = np.max(np.abs(J[i]))
        if largest > 0.0:
            J[i] /= largest
            r[i] /= largest
    return solve_dense(J, r, n) and np.all(np.isfinite(r))


@_machine
def stage(c, tau, z, q, u, y, switches, z1, q1):
    """One implicit stage from the charges z and q: whether Newton's iterations end; y, z1 and q1 are at its end."""
    w = c.W @ y
    linear = c.P @ c.Z / tau + c.G
    right = c.P @ z / tau + c.s + c.b * u
    for k in range(len(c.diodes)):
        right += c.A[:, k] * (q[k] / tau)
    for iteration in range(80):
        J, r = linear.copy(), right.copy()
        add_diodes(c, w, tau, J, r, q1)
        add_functions(c, w, switches, J, r)
        if not solved(J, r):
            return False
        away = 0.0
        for i in range(len(y)):
            away = max(
                away, abs(r[i] - y[i]) / (1e-7 * abs(r[i]) + (1e-8 if c.voltages[i] else 1e-13))
            )
        after = c.W @ r
        near = True
        for k in range(len(w)):
            n, knee, breakdown, reverse, reverse_knee = c.junctions[k]
            if n > 0.0:
                bound = limited(after[k], w[k], n, knee, breakdown, reverse, reverse_knee)
                near &= abs(bound - after[k]) < 1e-9
                after[k] = bound
        if iteration > 15 and iteration % 4 != 0:
            after = w + 0.3 * (after - w)
            near = False
        y[:] = r
        w = after
        if near and away < 1.0 and iteration > 0:
            for k in range(len(c.diodes)):
                q1[k] = diode_at(c.arguments[k], w[c.diodes[k]])[2]
            z1[:] = c.Z @ y
            return True
    return False


@_machine
def given_at(waves, t):
    """The current of the sines at a time."""
    u = 0.0
    for k in range(len(waves)):
        u += waves[k, 0] * math.sin(2.0 * math.pi * waves[k, 1] * t + waves[k, 2])
    return u


@_machine
def crossed(c, switches, now):
    """Whether a switch would change."""
    for k in range(len(switches)):
        if (now[k] < c.thresholds[1, k]) if switches[k] != 0.0 else (now[k] > c.thresholds[0, k]):
            return True
    return False


@_machine
def error_of(c, z, z1, z2, sizes, tolerance):
    """The difference of the two orders of a step, over the largest that it may have."""
    error = 0.0
    for k in range(len(z)):
        off = abs(z2[k] - z[k] - (z1[k] - z[k]) / GAMMA) * c.volts[k]
        error = max(error, off / (tolerance * max(sizes[k] * c.volts[k], LEAST)))
    return error


@_machine
def followed(c, waves, longest, end, tolerance, z, switches):
    """From rest to the end: integrals of the squared voltages of load and piezo, steps, and 0, or what failed."""
    y = np.zeros(len(c.b))
    q = np.zeros(len(c.diodes))
    zero = np.zeros(len(c.W))
    for k in range(len(q)):
        q[k] = diode_at(c.arguments[k], zero[c.diodes[k]])[2]
    z1 = z.copy()
    z2 = z.copy()
    q1 = q.copy()
    q2 = q.copy()
    sizes = np.abs(z)
    t = 0.0
    h = longest * 1e-3
    load = 0.0
    piezo = 0.0
    count = 0
    while t < end * (1.0 - 1e-12):
        h = min(h, longest, end - t)
        count += 1
        if count > MOST_STEPS:
            return load, piezo, count, 2
        trial = y.copy()
        error = 1e300
        before = np.zeros(len(c.read_out))
        ok = stage(c, GAMMA * h, z, q, given_at(waves, t + GAMMA * h), trial, switches, z1, q1)
        if ok:
            before = c.read_out @ trial
            zm, qm = z + (1.0 - GAMMA) / GAMMA * (z1 - z), q + (1.0 - GAMMA) / GAMMA * (q1 - q)
            ok = stage(c, GAMMA * h, zm, qm, given_at(waves, t + h), trial, switches, z2, q2)
        if ok:
            error = error_of(c, z, z1, z2, sizes, tolerance)
        if (not ok or error > 4.0) and h > end * SHORTEST:
            h *= 0.25 if not ok else 0.5
            continue
        if not ok:
            return load, piezo, count, 1
        now, told = c.control @ trial, c.read_out @ trial
        crossing = crossed(c, switches, now)
        if crossing and h > longest * 1e-3:
            h *= 0.25
            continue
        z[:] = z2
        q[:] = q2
        y[:] = trial
        t += h
        sizes = np.maximum(sizes * (1.0 - 2e-3 * h / longest), np.abs(z))
        for k in range(len(switches)):
            if now[k] > c.thresholds[0, k]:
                switches[k] = 1.0
            elif now[k] < c.thresholds[1, k]:
                switches[k] = 0.0
        load += h * ((1.0 - GAMMA) * before[2] * before[2] + GAMMA * told[2] * told[2])
        piezo += h * ((1.0 - GAMMA) * before[0] * before[0] + GAMMA * told[0] * told[0])
        h *= 0.1 if crossing else min(2.0, max(0.5, 0.8 / math.sqrt(max(error, 1e-4))))
    return load, piezo, count, 0


def by_machine(circuit, tolerance=TOLERANCE, longest=LONGEST_STEP * 4.0):
    """The answer of a circuit's equations, with the oracle's current and the leak next to them.

    A step is of at most ``longest`` seconds, and its two orders differ by ``tolerance`` of a charge
    at most.
    """
    reduction, system = circuit.reduction, circuit.system
    constants = []
    codes = []
    functions = []
    needs = []
    for function in system.functions:
        first, begin = len(codes), len(needs)
        code_of(function.tree, codes, constants)
        needs += sorted(inputs_of(function.tree))
        functions.append((first, len(codes), begin, len(needs)))
    G = reduction.G + np.outer(reduction.b, system.vectors([{system.unknowns["p"]: 1.0}])[0]) / LEAK
    voltages = np.array([k not in system.owners for k in range(system.size)])
    impedance = 1.0 / (2.0 * math.pi * 470.0 * CAPACITANCE)
    junctions = np.zeros((len(system.inputs), 5))
    steps = np.zeros(len(system.inputs))
    for k, (row, junction) in enumerate(system.inputs):
        steps[k] = 1e-8 if any(i in system.owners for i in row) else 1e-3
        if junction is not None:
            knees = [
                _knee(of, junction.saturation, impedance)
                for of in (junction.thermal, junction.reverse)
            ]
            junctions[k] = (
                junction.thermal,
                knees[0],
                min(junction.breakdown, 1e30),
                junction.reverse,
                knees[1],
            )
    switches = np.array([float(switch.closed) for switch in system.switches])
    thresholds = np.array(
        [[one.on for one in system.switches], [one.off for one in system.switches]]
    ).reshape(2, -1)
    arguments = np.array([one.arguments for one in system.diodes]).reshape(-1, 9)
    n = system.size
    given = (reduction.P, reduction.Z, G, reduction.A, reduction.W, reduction.s, reduction.b)
    given = [_whole(matrix, n) for matrix in (*given, reduction.read, reduction.control)]
    machine = Machine(
        *given[:3],
        given[3] if given[3].size else np.zeros((n, 0)),
        *given[4:],
        thresholds,
        np.array([one.input for one in system.diodes], dtype=np.int64),
        arguments,
        np.array(functions, dtype=np.int64).reshape(-1, 4),
        np.array(codes, dtype=np.int64),
        np.array(needs, dtype=np.int64),
        np.array(constants, dtype=float),
        junctions,
        steps,
        np.array([volts for *_, volts in system.charges]),
        voltages,
    )
    starts = np.array(system.starts, dtype=float)
    waves = np.array(amplitudes())
    load, piezo, _, failed = followed(machine, waves, longest, SECONDS, tolerance, starts, switches)
    if failed:
        return Answer(
            why="MACHINE " + ("a step did not converge" if failed == 1 else "too many steps")
        )
    return Answer(float(load / SECONDS / circuit.resistance), math.sqrt(piezo / SECONDS))


def _whole(matrix, n):
    """A matrix as kernels expect it, also one without rows."""
    return np.ascontiguousarray(matrix, dtype=np.float64) if matrix.size else np.zeros((0, n))


def _knee(thermal, saturation, impedance):
    """The voltage of a junction whose resistance is the impedance of what it is connected to."""
    return (
        max(thermal * math.log(thermal / (impedance * saturation)), 0.0)
        if saturation > 0.0
        else 0.0
    )


@kernel
def _advanced(circuit, state, room, charges, unit, leak, out):
    """The integrals of the squared voltages of load and piezo, and failed steps, of a compiled circuit."""
    last = len(state) - DID
    at = circuit.voltages_at
    for k in range(len(charges)):
        lost = state[at] * leak
        given = (charges[k] - lost) / unit
        before = state[at]
        advance(circuit.address, circuit.record, state, room, 0.0, given, given, 1.0, 1.0, FINEST)
        out[0] += state[last]
        out[1] += (before * before + before * state[at] + state[at] * state[at]) / 3.0
        out[2] += state[last + 2]


def by_compiled_circuit(circuit, step=LONGEST_STEP / 4.0):
    """The answer of the compiled circuit, which takes a compilation for each topology; the leak is a step late."""
    count = round(SECONDS / step)
    edges = np.linspace(0.0, SECONDS, count + 1)
    integral = np.zeros(count + 1)
    for amplitude, f, phase in amplitudes():
        integral -= (
            amplitude
            / (2.0 * math.pi * f)
            * (np.cos(2.0 * math.pi * f * edges + phase) - math.cos(phase))
        )
    h = step * circuit.scales.frequency
    kernels = circuit.for_kernels(h)
    state = circuit.rest.copy()
    out = np.zeros(3)
    room = np.zeros((7, circuit.room))
    unit = circuit.scales.capacitance * circuit.scales.volts
    charges = np.diff(integral)
    for first in range(0, count, PIECE):
        piece = charges[first : first + PIECE]
        _advanced(kernels, state, room, piece, unit, step / LEAK, out)
        if out[2] > 0:
            return Answer(why=f"{int(out[2])} steps failed")
    return Answer(float(out[0] / SECONDS / circuit.resistance), math.sqrt(out[1] / count))
