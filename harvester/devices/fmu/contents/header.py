"""The header of an FMU's C program: tables of its variables and of its part's numbers."""

import math

from harvester.devices.fmu.fixed_scales import Units
from harvester.devices.fmu.parts import CompiledPart
from harvester.devices.fmu.variables import Variable
from harvester.mechanics.part import gridded, located
from harvester.mechanics.part.part_state import OUT, W

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
} | {f"N_{unit.upper()}": unit for unit in Units._fields}


def header(variables: list[Variable], part: CompiledPart, token: str, frequency: float) -> str:
    """The text of model.h; ``frequency`` is w0 (rad/s), whose inverse is the part's time."""
    lines = [f'#define TOKEN "{token}"', f"#define FREQUENCY {frequency!r}"]
    lines.append(f"#define INNER_STEP {part.plan.h!r}")
    resolved = located.RESOLVED if part.plan.located else gridded.RESOLVED
    fastest = max(resolved / part.plan.h, part.plan.outside.drive_frequency or 0.0)
    lines.append(f"#define FASTEST {fastest!r}")
    lines += [f"#define VARIABLES {len(variables)}", f"#define NUMBERS {len(part.values)}"]
    lines += [f"#define STATE_SIZE {int(W.SIZE)}", f"#define OUT_SIZE {int(OUT.SIZE)}"]
    lines += [f"#define LOCATED {int(part.plan.located)}"]
    for name in ("X", "SPEED", "VOLTAGE", "STORE", "FOLLOWER", "TIME", "NOW", "PENDING"):
        lines.append(f"#define W_{name} {int(W[name])}")
    lines += [f"#define OUT_{name} {int(OUT[name])}" for name in ("IMPACTS", "IMPACT_TIME")]
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
    return "\n".join([*lines, *terms, "    {0, 0, 0.0},", "};", ""])


def _row(variable: Variable, part: CompiledPart) -> str:
    """A variable as C writes it."""
    unit = part.names.index(variable.of_part) if variable.of_part else -1
    kind = "INTEGER" if variable.integer else "FLOAT"
    numbers = ", ".join(map(_c, (variable.start, variable.least, variable.most)))
    kinds = f"{KINDS[variable.kind]}, {kind}"
    return f'{{"{variable.name}", {kinds}, {numbers}, {variable.output}, {unit}}}'


def _index(names: list[str], name: str) -> int:
    return names.index(name) if name in names else -1


def _c(value: float) -> str:
    """A number as C writes it, to the last digit."""
    assert math.isfinite(value), value
    return float(value).hex()
