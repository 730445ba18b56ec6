"""What engines answered, as a page shows it: values, each error or why there is none, seconds, warnings, refusals."""

from collections.abc import Sequence

from harvester.answers.estimate import Estimate
from harvester.presentation.sheet import mapping_rows
from harvester.report.numbers import NONE, amount, share, signs, with_errors
from harvester.report.page import TextTable
from harvester.uncertainty.value import Value, two_digits


def lead(estimate: Estimate) -> list[str]:
    """The answer in lines: mean power, mean square voltage and, of shocks or steps, the energy of one."""
    units = estimate.unit_names
    word = "" if units.power else " (nondimensional)"
    energy, possible = estimate.energy_per_event, estimate.share_of_possible
    of = "" if possible is None else f", {share(possible, 1.0)} of the upper bound"
    return [
        f"Mean power {with_errors(estimate.mean_power, units.power)}{word}{of}",
        f"Mean square voltage {with_errors(estimate.mean_square_voltage, units.mean_square_voltage)}{word}",
        *([] if energy is None else [f"Energy per event {with_errors(energy, units.energy)}"]),
    ]


def table(estimates: Sequence[Estimate]) -> TextTable:
    """The table of each engine's mean power, its errors in percent of it, and its cost."""
    heads = ["engine", "mean power", "sampling, 95 %", "step", "model", "together"]
    heads += ["mean square voltage", "seconds", "steps"]
    rows = []
    for estimate in estimates:
        power = estimate.mean_power
        errors = (power.bias, power.model)
        rows.append(
            [
                estimate.engine,
                first(power, estimate.unit_names.power),
                "none" if power.stderr is None else share(power.sampling95, power.value),
                *(share(error, power.value) for error in (*errors, power.error95)),
                first(estimate.mean_square_voltage, estimate.unit_names.mean_square_voltage),
                two_digits(estimate.seconds),
                signs(f"{estimate.steps:.3g}") if estimate.steps else "-",
            ]
        )
    note = (
        "Errors are in percent of the engine's mean power. -: there is no such error, or it is not known; the reasons"
        " below say which."
    )
    return TextTable("Engines", heads, rows, range(1, len(heads)), note)


def reasons(estimates: Sequence[Estimate]) -> TextTable:
    """The table of what each engine says of its errors: why one is missing, or how that of its model is known."""
    rows = [
        [estimate.engine, signs(estimate.reason) or _known_parts(estimate)]
        for estimate in estimates
    ]
    return TextTable("What the errors are, or why there is none", ["engine", "reason"], rows)


def refusals(refused: dict[str, str]) -> list[TextTable]:
    """The table of the engines that did not run, if there are any."""
    rows = [[name, signs(why)] for name, why in refused.items()]
    return [TextTable("Engines that did not run", ["engine", "reason"], rows)] if rows else []


def details(estimate: Estimate) -> list[TextTable]:
    """The table of an answer's details, such as step and trajectories, if there are any."""
    rows = [
        [name, signs(text)] for name, text in mapping_rows(estimate.details, estimate.unit_names)
    ]
    rows += [
        [f"nondimensional {n.replace('_', ' ')}", NONE if v is None else signs(f"{v:.5g}")]
        for n, v in estimate.nondimensional.items()
    ]
    return [TextTable("Details", ["what", "value"], rows, (1,))] if rows else []


def warnings(estimates: Sequence[Estimate]) -> list[str]:
    """The warnings of all answers, each with its engine's name."""
    return [
        f"{estimate.engine}: {signs(str(word))}"
        for estimate in estimates
        for word in estimate.warnings
    ]


def first(value: Value, unit: str) -> str:
    """The value with the digits that its error leaves, without the errors."""
    number, _, rest = with_errors(value, unit).partition(" ± ")
    if not rest:
        return amount(value.value, unit)
    return f"{number} {rest.rpartition(') ')[2]}".strip() if unit else number


def _known_parts(estimate: Estimate) -> str:
    power = estimate.mean_power
    has = [
        name
        for name, error in (("sampling", power.stderr), ("step", power.bias))
        if error is not None
    ]
    if not has:
        return NONE
    measured = f"errors of {' and '.join(has)} are measured in this run"
    return f"{measured}; the coupled equations themselves are solved, without a model's error"
