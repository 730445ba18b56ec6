"""The report of `tolerance`."""

from harvester.equations.problem import Problem
from harvester.report.numbers import amount, signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import scene_page
from harvester.scene.keys import unit_of
from harvester.scene.scene import Scene
from harvester.studies.output_folder import provenance
from harvester.studies.tolerance.answer import ToleranceResult


def of_tolerance(scene: Scene | Problem, answer: ToleranceResult, seed: int) -> Page:
    """The page of how power scatters over devices: quantiles, yield, the keys' bars and shares, and the error."""
    problem = Problem.of(scene)
    unit = answer.unit_names.power
    rows = [[signs(name), signs(value)] for name, value in answer.rows()]
    spread = "; ".join(f"{bar.key} brings {amount(bar.swing, unit)}" for bar in answer.tornado)
    figure = drawing(
        answer.plot(None),
        f"Histogram of the mean power of {len(answer.power)} samples by {answer.engine}. {spread}.",
        "Left: powers of the samples. Then the power with one key alone at the 5 % and 95 % points of its spread, and "
        "the share of the variance that each key brings.",
    )
    error = "is not known" if answer.off is None else f"is {answer.off:.2%} of it"
    found = Section(
        "Many devices",
        texts=[f"The error of a sample's power {error}: {signs(answer.check)}."],
        drawings=[figure],
        tables=[TextTable("Distribution of the mean power, and yield", ["what", "value"], rows, (1,)), _keys(answer)],
        warnings=[signs(one) for one in answer.warnings],
    )
    lead = [f"{name}: {value}" for name, value in rows if "limits" in name or name.startswith("50%")]
    about = provenance(problem)
    kind = f"tolerance, engine {answer.engine}"
    return scene_page(problem, kind, lead, found, about, seed=seed, samples=len(answer.power))


def _keys(answer: ToleranceResult) -> TextTable:
    """The table of each key's spread, its bar, and its shares of the variance."""
    unit, written = answer.unit_names.power, {one.key: one.written for one in answer.spreads}
    rows = []
    for bar in answer.tornado:
        one = answer.sensitivity.get(bar.key)
        shares = ["-", "-"] if one is None else [f"{one.first:.3f}", f"{one.total:.3f}"]
        ends = [amount(end, unit_of(bar.key)) for end in bar.ends]
        rows.append([bar.key, written[bar.key], *ends, *(amount(power, unit) for power in bar.powers), *shares])
    heads = ["key", "spread", "5 % point", "95 % point", "power there", "and there", "share alone", "with others"]
    note = f"No shares: {answer.why}." if answer.why else "Shares of the variance of the power."
    return TextTable("Which tolerance matters", heads, rows, range(2, 8), note)
