"""The header of an FMU's C program: tables of its variables and of its part's numbers."""

import json
import math
from collections.abc import Iterator

from harvester.circuits.circuit_part import CircuitTables
from harvester.circuits.substeps import AT, COUNTS, LEVELS, ROOMS
from harvester.devices.fmu.fixed_scales import Units
from harvester.devices.fmu.parts import IN_REPORT, AnyPart
from harvester.devices.fmu.variables import Variable
from harvester.mechanics.part.part_state import W

KINDS = ("PARAMETER", "TUNABLE", "INPUT", "OUTPUT", "TIME")
# Variables and numbers that the program knows by name; -1 if a device lacks them
NAMED = {
    "V_BASE": "base_acceleration",
    "V_CURRENT": "current",
    "V_DISPLACEMENT": "initial.displacement",
    "V_VELOCITY": "initial.velocity",
    "V_VOLTAGE": "initial.voltage",
    "V_STORE": "initial.store_voltage",
    "V_SEED": "seed",
}
NUMBERS = {
    "N_A": "outside.a",
    "N_SLOPE": "outside.slope",
    "N_SINCE": "outside.since",
    "N_CURRENT": "outside.current",
    "N_LINEAR": "c.linear",
    "N_BETA": "c.beta",
    "N_DRIVE_FREQUENCY": "outside.drive_frequency",
    "N_LOW": "low.x",
    "N_HIGH": "high.x",
    "N_CHARGE": "circuit.charge",
} | {f"N_{unit.upper()}": unit for unit in Units._fields}


# Places of the state that the program knows by name
USED = (
    *("X", "SPEED", "VOLTAGE", "STORE", "FOLLOWER", "TIME", "NOW", "PENDING"),
    *("STEPS", "BEGUN", "HITS"),
)


def header(variables: list[Variable], part: AnyPart, token: str, frequency: float) -> str:
    """The text of model.h; ``frequency`` is w0 (rad/s), whose inverse is the part's time."""
    lines = [f'#define TOKEN "{token}"', f"#define FREQUENCY {frequency!r}"]
    lines.append(f"#define INNER_STEP {part.step!r}")
    lines.append(f"#define FASTEST {part.fastest!r}")
    lines += [f"#define {name} {value}" for name, value in part.model.items()]
    lines += [f"#define VARIABLES {len(variables)}", f"#define NUMBERS {len(part.values)}"]
    length = 0 if part.tables is None else len(part.tables.rest)
    size = int(W.SIZE) + length + part.model["MODEL_SIZE"]
    lines += [f"#define STATE_SIZE {size}"]
    lines += [f"#define LOCATED {int(part.located)}"]
    for name in USED:
        lines.append(f"#define W_{name} {int(W[name])}")
    lines += [f"#define OUT_{name} {part.report_places[name]}" for name in IN_REPORT]
    names = [variable.name for variable in variables]
    lines += [f"#define {key} {_index(names, name)}" for key, name in NAMED.items()]
    lines += [f"#define {key} {_index(part.names, name)}" for key, name in NUMBERS.items()]
    lines.append("static const double BASE[NUMBERS] = {")
    lines += [
        f"    {_c(value)}, /* {name} */"
        for name, value in zip(part.names, part.values, strict=True)
    ]
    lines += ["};", "static const Variable VARIABLE[VARIABLES] = {"]
    lines += [f"    {_row(variable, part)}," for variable in variables]
    lines.append("};")
    terms = [
        f"    {{{number}, {k}, {_c(power)}}},"
        for k, variable in enumerate(variables)
        for number, power in variable.powers.items()
    ]
    lines += [f"#define TERMS_COUNT {len(terms)}", "static const Term TERMS[TERMS_COUNT + 1] = {"]
    lines += [*terms, "    {0, 0, 0.0},", "};"]
    return "\n".join([*lines, *_tables(part.tables), ""])


def _tables(tables: CircuitTables | None) -> Iterator[str]:
    """The record of a netlist, and the arrays to which it points."""
    yield f"#define NETLIST {int(tables is not None)}"
    if tables is None:
        return
    numbers = tables.numbers
    yield f"#define NETLIST_AT {int(W.SIZE)}"
    yield f"#define NETLIST_SIZE {numbers.length}"
    yield f"#define ROOM_SIZE {numbers.width * ROOMS}"
    yield f"#define W_COUNTS {int(W.COUNTS)}"
    for name, charge in (("PIEZO", "piezo"), ("CSMOOTH", "csmooth")):
        index, volts = tables.volts.get(charge, (-1, 1.0))
        yield f"#define {name}_AT {index}"
        yield f"#define {name}_VOLTS {_c(volts)}"
        yield f"#define LOAD_AT_{name} {_c(tables.load.get(charge, 0.0))}"
    yield f"#define VOLTAGES_AT {numbers.voltages_at}"
    yield f"#define SWITCHES_AT {int(tables.record['ns'] + tables.record['n'])}"
    yield f"#define SWITCHES {int(tables.record['switches'])}"
    yield f"#define LEVELS {LEVELS}"
    for name, array in (*tables.arrays.items(), ("rest", tables.rest)):
        rows = ",\n    ".join(map(_c, [*array.ravel(), 0.0]))
        yield f"static const double of_{name}[] = {{\n    {rows}}};"
    names = ", ".join(json.dumps(name) for name in tables.elements)
    yield f"#define FUNCTIONS {len(tables.elements)}"
    yield f"static const char *const ELEMENT[] = {{{names or '0'}}};"
    addresses = {name: f"(intptr_t)of_{name}" if name in tables.arrays else "0" for name in AT} | {
        "solver_at": "(intptr_t)harvester_solve"
    }
    values = {name: str(int(tables.record[name])) for name in COUNTS}
    values |= {
        name: _c(tables.record[name]) for name in ("least", "tolerance", "charge", "seconds")
    }
    yield "typedef struct {"
    yield from (f"    int64_t {name};" for name in (*AT, *COUNTS))
    yield "    double least, tolerance, charge, seconds;"
    yield "} Circuit;"
    yield "long long harvester_solve(void), harvester_follow(void);"
    yield "#define CIRCUIT_RECORD {" + ", ".join((addresses | values).values()) + "}"


def _row(variable: Variable, part: AnyPart) -> str:
    """A variable as C writes it."""
    unit = part.names.index(variable.of_part) if variable.of_part else -1
    kind = "INTEGER" if variable.integer else "FLOAT"
    numbers = ", ".join(map(_c, (variable.start, variable.least, variable.most)))
    kinds = f"{KINDS[variable.kind]}, {kind}"
    return f'{{"{variable.name}", {kinds}, {numbers}, {variable.output}, {unit}}}'


def _index(names: list[str], name: str) -> int:
    return names.index(name) if name in names else -1


def _c(value: float) -> str:
    """A number as C writes it, to the last digit; infinite ones are limits of a netlist."""
    assert not math.isnan(value), value
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    return float(value).hex()
