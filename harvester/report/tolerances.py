"""The report of `tolerance`."""

from harvester.equations.problem import Problem
from harvester.report.page import Page
from harvester.report.result import of_result
from harvester.scene.scene import Scene
from harvester.studies.tolerance.answer import ToleranceResult


def of_tolerance(scene: Scene | Problem, answer: ToleranceResult, seed: int) -> Page:
    """The page of how power scatters over devices: quantiles, yield, the keys' bars and shares, and the error."""
    caption = (
        "Left: powers of the samples. Then the power with one key alone at the 5 % and 95 % points of its spread, and "
        "the share of the variance that each key brings."
    )
    kind, count = f"tolerance, engine {answer.engine}", len(answer.power)
    return of_result(scene, kind, answer, answer.plot(None), caption, seed=seed, samples=count)
