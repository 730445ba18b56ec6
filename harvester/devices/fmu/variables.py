"""The variables of an FMU: parameters, inputs and outputs, each with its unit and range."""

import math
from dataclasses import dataclass, field

from harvester.devices.fmu import parts
from harvester.devices.fmu.parts import CompiledPart
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.mechanics.part.part_state import OUT
from harvester.scene.keys import key_kind, unit_of

PARAMETER, TUNABLE, INPUT, OUTPUT, TIME = range(5)
LARGEST = 1e30
SMALLER = (0.9, 0.8)  # times a parameter, at which the powers of it are measured
SURE = 1e-6  # of a power
MOST_SEED = 2**31 - 1
# Outputs: name, index in the part's report, unit of the part, SI unit, meaning
OUTPUTS = (
    ("displacement", OUT.DISPLACEMENT, "length", "m", "displacement of the mass from the base"),
    ("velocity", OUT.VELOCITY, "speed", "m/s", "velocity of the mass from the base"),
    ("voltage", OUT.VOLTAGE, "volts", "V", "voltage of the piezo"),
    ("power", OUT.POWER, "watts", "W", "power in the load resistance"),
    ("load_current", OUT.CURRENT, "amperes", "A", "current through the load resistance"),
    ("impacts", OUT.IMPACTS, "", "1", "number of impacts so far"),
    ("impact_time", OUT.IMPACT_TIME, "seconds", "s", "time of the last impact"),
    (
        "impact_speed",
        OUT.IMPACT_SPEED,
        "speed",
        "m/s",
        "speed before the last impact; negative at the opposite stop",
    ),
    ("base_force", OUT.FORCE, "newtons", "N", "force on the base, without impacts"),
    (
        "base_impulse",
        OUT.IMPULSE,
        "impulse",
        "N.s",
        "impulse of all impacts on the mass; minus that on the base",
    ),
    (
        "input_energy",
        OUT.WORK,
        "joules",
        "J",
        "energy from the excitation so far, in the frame of the base",
    ),
    ("load_energy", OUT.LOAD, "joules", "J", "energy out of the piezo through its load so far"),
    ("damping_energy", OUT.DAMPING, "joules", "J", "energy lost in the damping so far"),
    ("impact_energy", OUT.LOST, "joules", "J", "energy lost in impacts so far"),
    (
        "stored_energy",
        OUT.STORED,
        "joules",
        "J",
        "energy in mass, springs and the piezo's capacitance",
    ),
    (
        "delivered_energy",
        OUT.DELIVERED,
        "joules",
        "J",
        "energy in the circuit's load resistance so far",
    ),
    (
        "circuit_energy",
        OUT.DRAINED,
        "joules",
        "J",
        "energy lost in the ideal circuit's diodes and inductor so far, a part of load_energy",
    ),
    ("store_voltage", OUT.STORE, "volts", "V", "voltage across the circuit's capacitor"),
)
OF_STOPS = ("impacts", "impact_time", "impact_speed", "base_impulse", "impact_energy")


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU; ``powers`` are its exponents in the part's numbers, by index."""

    name: str
    kind: int
    unit: str
    meaning: str
    start: float = 0.0
    least: float = -LARGEST
    most: float = LARGEST
    output: int = -1
    of_part: str = ""
    integer: bool = False
    powers: dict[int, float] = field(default_factory=dict)


def variables(problem: Problem, part: CompiledPart) -> list[Variable]:
    """All variables of a part; a variable's index is its value reference."""
    eqs = problem.equations
    listed = [Variable("time", TIME, "s", "simulated time")]
    listed.append(
        Variable(
            "base_acceleration",
            INPUT,
            "m/s2",
            "acceleration of the base, in addition to the scene's excitation",
        )
    )
    if part.plan.outside.current is not None:
        listed += _electrodes(problem, part)
    listed += [*_parameters(problem, part), *_starts(problem, part)]
    if eqs.has_new_noise:
        listed.append(
            Variable(
                "seed", PARAMETER, "1", "seed of the noise", least=0.0, most=MOST_SEED, integer=True
            )
        )
    for name, index, unit, si, meaning in OUTPUTS:
        absent = (
            (name in OF_STOPS and not eqs.has_stop)
            or (name == "store_voltage" and not has_store(part))
            or (name == "delivered_energy" and not part.plan.circuit)
            or (name == "circuit_energy" and (part.tables or not part.plan.circuit))
        )
        if absent:
            continue
        listed.append(
            Variable(
                name,
                OUTPUT,
                si,
                meaning,
                output=int(index),
                of_part=unit,
                integer=name == "impacts",
            )
        )
    return listed


def _electrodes(problem: Problem, part: CompiledPart) -> list[Variable]:
    """The inputs of an electrical port."""
    start = parts.OPEN_LOAD
    if problem.scene.load is not None and problem.scene.load.resistance:
        start = problem.scene.load.resistance
    powers = {k: -1.0 for k, name in enumerate(part.names) if name in ("c.mu", "quiet.mu")}
    return [
        Variable("current", INPUT, "A", "current out of the piezo's electrode p"),
        Variable(
            "load_resistance",
            INPUT,
            "Ohm",
            "resistance across the electrodes, parallel to the current",
            start=start,
            least=1e-3,
            most=1e15,
            powers=powers,
        ),
    ]


def _starts(problem: Problem, part: CompiledPart) -> list[Variable]:
    """The parameters of the first state."""
    rest = problem.equations.resting_places
    start = rest[0] * problem.scales.length if rest else 0.0
    starts = [
        Variable("initial.displacement", PARAMETER, "m", "initial displacement", start),
        Variable("initial.velocity", PARAMETER, "m/s", "initial velocity"),
        Variable(
            "initial.voltage",
            PARAMETER,
            "V",
            "initial voltage of the piezo",
            start=first_voltage(part, "piezo"),
        ),
    ]
    if has_store(part):
        starts.append(
            Variable(
                "initial.store_voltage",
                PARAMETER,
                "V",
                "initial voltage across the circuit's capacitor",
                start=first_voltage(part, "csmooth"),
                least=-LARGEST if part.tables else 0.0,
            )
        )
    return starts


def has_store(part: CompiledPart) -> bool:
    """Whether the circuit of a part has a storage capacitor."""
    if part.tables is not None:
        return "csmooth" in part.tables.volts
    return bool(part.plan.circuit)


def first_voltage(part: parts.AnyPart, charge: str) -> float:
    """The voltage that the netlist gives a capacitor at first (V)."""
    if part.tables is None:
        return 0.0
    index, volts = part.tables.volts[charge]
    return float(part.tables.rest[index] * volts)


def _parameters(problem: Problem, part: CompiledPart) -> list[Variable]:
    """The scene's keys of which all numbers of the part are powers; the others are fixed in it.

    The powers are measured on the package's own conversion of a scene, at two smaller values.
    """
    parameters = []
    has_port = part.plan.outside.current is not None
    for table, name, value in problem.scene.values():
        keys = [(name, value)]
        if name == "parameters":
            keys = [(f"parameters.{inner}", number) for inner, number in value.items()]
        for key, number in keys:
            of_load = table == "load"
            if not isinstance(number, float) or number == 0.0 or (of_load and has_port):
                continue
            powers = _powers(problem, part, f"{table}.{key}", number)
            if not powers:
                continue
            kind = key_kind(table, key) if not key.startswith("parameters.") else None
            tunable = f"{table}.{key}" in ("load.resistance", "load.parameters.R")
            parameters.append(_parameter(f"{table}.{key}", number, kind, powers, tunable))
    return parameters


def _parameter(
    key: str, start: float, kind: object, powers: dict[int, float], tunable: bool
) -> Variable:
    """A key as a parameter, which keeps its sign: each number is a power of it."""
    small = abs(start) * 1e-6
    least, most = (small, abs(start) * 1e6) if start > 0.0 else (-abs(start) * 1e6, -small)
    if (bound := getattr(kind, "most", math.inf)) < most:
        most = bound
    if (bound := getattr(kind, "least", -math.inf)) > least:
        least = bound
    unit = (
        unit_of(key).replace("ohm", "Ohm").replace("^", "").replace("*", ".").replace(" ", ".")
        or "1"
    )
    return Variable(
        key,
        TUNABLE if tunable else PARAMETER,
        unit,
        "scene key",
        start=start,
        least=least,
        most=most,
        powers=powers,
    )


def _powers(
    problem: Problem, part: CompiledPart, key: str, value: float
) -> dict[int, float] | None:
    """The powers of a key in the numbers of a part; None without any, or for another law."""
    measured = []
    for factor in SMALLER:
        try:
            changed = Problem(problem.scene.varied({key: value * factor}))
            numbers = parts.numbers_at(changed, problem, part)
        except HarvesterError:
            return None
        if numbers is None:
            return None
        measured.append([_power(a, b, factor) for a, b in zip(numbers, part.values, strict=True)])
    powers = {}
    for k, (first, second) in enumerate(zip(*measured, strict=True)):
        if first is None or second is None or abs(first - second) > SURE:
            return None
        exact = round(2.0 * first) / 2.0
        if abs(exact - first) > SURE:
            return None
        if exact != 0.0:
            powers[k] = exact
    return powers or None


def _power(number: float, before: float, factor: float) -> float | None:
    """The exponent of a factor in a changed number; None for another law."""
    if before == number:
        return 0.0
    if before == 0.0 or number / before <= 0.0:
        return None
    return math.log(number / before) / math.log(factor)
