"""The report of `tolerance`."""

from harvester.equations.problem import Problem
from harvester.report.numbers import amount
from harvester.report.page import Page
from harvester.report.result import of_result
from harvester.scene.scene import Scene
from harvester.studies.tolerance.tolerance_result import ToleranceResult


def of_tolerance(scene: Scene | Problem, answer: ToleranceResult, seed: int) -> Page:
    """The page of how power scatters over devices: quantiles, yield, the keys' bars and shares, and the error."""
    caption = (
        "How many devices have which power. Below, where 5 to 95 % of them are with one key alone, and that key's "
        "share of the variance."
    )
    kind, count, unit = f"tolerance, engine {answer.engine}", len(answer.power), answer.unit
    low, middle, high = (amount(answer.quantiles[share].value, unit) for share in (0.05, 0.5, 0.95))
    answers = [f"Median mean power: {middle}; 90 % of devices have {low} to {high}"]
    if answer.met is not None:
        answers.append(f"Devices that meet all limits: {100.0 * answer.met.value:.4g} %")
    return of_result(scene, kind, answer, answer.plot(None), caption, (), answers, seed=seed, samples=count)
