"""The header of an FMU's C program: the tables of its variables and of the numbers of its compiled part."""

import math

from harvester.devices.fmu.parts import Part
from harvester.devices.fmu.variables import Variable
from harvester.mechanics.part.state import OUT, W

KINDS = ("PARAMETER", "TUNABLE", "INPUT", "OUTPUT", "TIME")
# Variables and numbers that the program knows by name; -1 where a device has them not
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
    "N_LOW": "walls.low",
    "N_HIGH": "walls.high",
    "N_LENGTH": "length",
    "N_SPEED": "speed",
    "N_ACCELERATION": "acceleration",
    "N_VOLTS": "volts",
    "N_AMPERES": "amperes",
}


def header(variables: list[Variable], part: Part, token: str, frequency: float) -> str:
    """The text of model.h; ``frequency`` is w0 (rad/s), whose inverse is the part's time."""
    lines = [f'#define TOKEN "{token}"', f"#define FREQUENCY {frequency!r}"]
    lines += [f"#define VARIABLES {len(variables)}", f"#define NUMBERS {len(part.values)}"]
    lines += [f"#define STATE_SIZE {int(W.SIZE)}", f"#define OUT_SIZE {int(OUT.SIZE)}"]
    lines += [f"#define LOCATED {int(part.plan.located)}"]
    for place in ("X", "SPEED", "VOLTAGE", "STORE", "FOLLOWER", "TIME", "NOW", "PENDING"):
        lines.append(f"#define W_{place} {int(W[place])}")
    lines += [f"#define OUT_{place} {int(OUT[place])}" for place in ("IMPACTS", "IMPACT_TIME")]
    names = [variable.name for variable in variables]
    lines += [f"#define {key} {_place(names, name)}" for key, name in NAMED.items()]
    lines += [f"#define {key} {_place(part.names, name)}" for key, name in NUMBERS.items()]
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
    return "\n".join([*lines, *terms, "    {0, 0, 0.0},", "};", ""])


def _row(variable: Variable, part: Part) -> str:
    """A variable as C writes it."""
    unit = part.names.index(variable.of_part) if variable.of_part else -1
    kind = "INTEGER" if variable.integer else "FLOAT"
    numbers = ", ".join(map(_c, (variable.start, variable.least, variable.most)))
    return f'{{"{variable.name}", {KINDS[variable.kind]}, {kind}, {numbers}, {variable.output}, {unit}}}'


def _place(names: list[str], name: str) -> int:
    return names.index(name) if name in names else -1


def _c(value: float) -> str:
    """A number as C writes it, to the last digit."""
    assert math.isfinite(value), value
    return float(value).hex()
