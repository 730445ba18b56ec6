"""Normalised sensitivities of the mean power in every key of the scene, from the adjoint of the density.

A scene whose power is a formula has differences of it (`harvester.studies.power_differences`), a
netlist with a storage capacitor or a chip behind the rectifier those of its slow circuit, and for
another netlist they come from its compiled circuit
(`harvester.studies.circuit_sensitivity`).
"""

import math
import time
from collections.abc import Callable, Sequence
from typing import ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.compiled import Compiled
from harvester.engines.density import Density
from harvester.engines.exact import Exact
from harvester.engines.options import Request, number
from harvester.engines.power_slopes import quantities, value_of
from harvester.engines.protocol import AnyScene, Engine, served
from harvester.engines.slow import Slow
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.machine.automatic import reporting
from harvester.machine.progress import listening, stage
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.scene.keys import unit_of
from harvester.studies.power_differences import LARGE, PowerDifferences, by_differences, is_within
from harvester.uncertainty.value import Value

DEFAULT_WITHIN = 1e-6  # the relative error of E[V^2] that is aimed at
BY_FORMULA = 1e-5  # first relative change of a key whose power is a formula, far within a resonance
OF_POWER = 0.15  # fraction of the time: the power itself
JUDGED = 0.5  # fraction of a budget: for a circuit's power with its error
WITHIN = 0.01  # relative power error of a compiled circuit that is sought


class Sensitivity(TableResult):
    """The mean power and its normalised sensitivity d ln P/d ln key in each key of the scene, largest first.

    A normalised sensitivity of 2 states that one percent more of a key gives two percent more
    power.  Keys of 0 and keys that are not quantities have none.

    Attributes
    ----------
    engine : str
        the name of the engine that computed it.
    mean_power : Value
        a `Value` (W).
    keys, values, units : tuple of str or tuple of float
        the scene keys, their values in SI units and these units.
    elasticities : tuple of Value
        a `Value` without a unit for each key.
    seconds : float
        the time of computing, without compilation (s).
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.sensitivity(scene, within=1e-3).table["key"][0]
    'nondimensional.D11'
    """

    DERIVED = ("table",)
    NOT_SHOWN = frozenset({"keys", "units", "values", "elasticities"})
    NOT_IN_JSON = frozenset({"keys", "units", "values", "elasticities"})
    JSON_NAMES: ClassVar[dict[str, str]] = {"table": "sensitivity"}

    engine: str
    mean_power: Value
    keys: tuple[str, ...]
    values: tuple[float, ...]
    units: tuple[str, ...]
    elasticities: tuple[Value, ...]
    seconds: float
    physical: bool
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def table(self) -> Table:
        """A row for each key: its value and the normalised sensitivity of the power in it."""
        units = ["" if unit == "1" else unit for unit in self.units]
        value = Column("value", self.values, units=units, label="value")
        return Table(
            (Column("key", self.keys, label="key"), value, Column("elasticity", self.elasticities))
        )


@names_arguments
def sensitivity(
    scene: AnyScene,
    *,
    within: float | str | None = None,
    budget: float | str | None = None,
    progress: Callable[[float], None] | bool | None = None,
) -> Sensitivity:
    """The normalised sensitivity of the mean power in every key of the scene that is a quantity other than 0.

    For a linear scene they are differences of engine `Exact`, otherwise all come from one solution
    for the density and one of its adjoint equations.  With a netlist they include its elements:
    with a storage capacitor or a chip behind the rectifier by engine `Slow`, otherwise by the
    compiled circuit: under a sinusoid from its periodic responses, under noise from two ensembles
    per key on the same noise, until the sampling error (95 %) is 0.01 or for eight times the
    burn-in.  Their model error is unknown.

    Parameters
    ----------
    scene : Scene or path
        a `Scene` that engine `Exact` or `Density` supports, `Slow` or `Compiled` if it has a
        netlist; or the path of a scene file.
    within : float or str, optional
        the relative power error that is aimed at, such as 0.01 or "1%"; None: 1e-6, of coloured
        noise 1e-3.  Not with a netlist; engine `Exact` needs none.
    budget : float or str, optional
        seconds of computing, such as 30 or "30s"; engine `Exact` needs none.  With a netlist, the
        keys that are left then are named in a warning.
    progress : callable or bool, optional
        is called with the fraction done; by default a bar on a terminal or in a notebook, False:
        none.

    Returns
    -------
    Sensitivity
        normalised sensitivities without a unit, the largest first.

    Raises
    ------
    InputError
        for a scene that neither engine supports, or whose load draws no power.
    SimulationError
        if the response grows without bound, or the density cannot be resolved.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01, restitution=0.9))
    >>> result = hv.sensitivity(scene, within=1e-4)
    >>> result.keys[0], round(result.elasticities[result.keys.index("nondimensional.D11")].value, 3)
    ('nondimensional.restitution', 1.0)
    """
    problem = Problem.of(scene)
    options = Request(within=within, budget=budget)
    with reporting(progress, "sensitivity") as report:
        return _computed(problem, number(options.within), number(options.budget), report)


def _computed(
    problem: Problem,
    within: float | None,
    budget: float | None,
    progress: Callable[[float], None] | None,
) -> Sensitivity:
    """The normalised sensitivities by the engine that supports a scene."""
    begin = time.perf_counter()
    if problem.netlist is not None:
        if within is not None:
            raise InputError(
                "`within` must be left out with a netlist, whose ensembles are of one size"
            )
        return _of_circuit(problem, begin, progress, budget)
    if Exact.refusal(problem) is None:
        if not (problem.equations.beta and problem.equations.load):
            raise InputError(
                "`scene` must have a coupling and a load resistance, since the sensitivity is that of its power"
            )
        return _by_formula(problem, begin, progress or _silent)
    target = within or (DEFAULT_WITHIN if problem.equations.coloured is None else None)
    answer, slopes = Density(within=target, budget=budget).run_with_slopes(
        served(Density, problem), progress
    )
    by_key = {
        key: (value_of(problem.scene, key), slopes.with_error(key))
        for key in quantities(problem.scene)
    }
    return _result(problem, answer, by_key, begin)


def _of_circuit(
    problem: Problem, begin: float, progress: Callable[[float], None] | None, budget: float | None
) -> Sensitivity:
    """The normalised sensitivities in the keys of a scene with a netlist, and in its elements."""
    from harvester.studies.circuit_sensitivity import by_ensembles, keys_with_elements

    part = None if budget is None else JUDGED * budget
    is_sampled = False
    quick: Engine
    with listening(progress), stage(0.0, OF_POWER):
        if Slow.refusal(problem) is None:
            answer = Slow(budget=part).run(problem)
            quick = Slow(judged=False)
        else:
            answer = Compiled(within=WITHIN, budget=part).run(served(Compiled, problem))
            quick = Compiled(judged=False)
            is_sampled = not problem.equations.is_steady
    deadline = math.inf
    if budget is not None:  # with the time that the power left of its part
        rest = max(budget - answer.seconds, (1.0 - JUDGED) * budget)
        deadline = time.monotonic() + rest

    def report(share: float) -> None:
        if progress is not None:
            progress(OF_POWER + (1.0 - OF_POWER) * share)

    if is_sampled:
        done = by_ensembles(problem, answer.mean_power, report, deadline)
    else:
        values = dict(keys_with_elements(problem))
        done = by_differences(problem, quick, values, report, deadline)
    return _of_differences(problem, answer, done, begin, budget)


def _by_formula(problem: Problem, begin: float, report: Callable[[float], None]) -> Sensitivity:
    """The normalised sensitivities in the keys of a scene whose power is a formula."""
    values = {key: value_of(problem.scene, key) for key in quantities(problem.scene)}
    answer = Exact().run(problem)
    done = by_differences(problem, Exact(), values, report, most=BY_FORMULA)
    return _of_differences(problem, answer, done, begin, None)


def _silent(_: float) -> None:
    """Report nothing."""


def _of_differences(
    problem: Problem, answer: Estimate, done: PowerDifferences, begin: float, budget: float | None
) -> Sensitivity:
    """The result of differences, with warnings of the keys that have none."""
    remarks = []
    if done.left:
        keys = ", ".join(done.left)
        remarks = [warning("keys_left_out", keys=keys, budget=budget, further=done.seconds)]
    if done.failed:
        first = str(next(iter(done.failed.values())))
        remarks.append(warning("keys_failed", keys=", ".join(done.failed), first=first))
    unsettled = [key for key, (_, value) in done.by_key.items() if not is_within(LARGE, value)]
    if unsettled:
        remarks.append(warning("keys_unsettled", keys=", ".join(unsettled), percent=100.0 * LARGE))
    return _result(problem, answer, done.by_key, begin, remarks)


def _result(
    problem: Problem,
    answer: Estimate,
    by_key: dict[str, tuple[float, Value]],
    begin: float,
    remarks: Sequence[Diagnostic] = (),
) -> Sensitivity:
    """The result of normalised sensitivities by key, the largest first, with the warnings of the power."""
    warnings = [remark for remark in answer.diagnostics if remark.severity == "warning"]
    keys = sorted(by_key, key=lambda key: -abs(by_key[key][1].value))
    return Sensitivity(
        engine=answer.engine,
        mean_power=answer.mean_power,
        keys=tuple(keys),
        values=tuple(by_key[key][0] for key in keys),
        units=tuple(unit_of(key) for key in keys),
        elasticities=tuple(by_key[key][1] for key in keys),
        seconds=time.perf_counter() - begin,
        physical=problem.physical,
        diagnostics=(note("elasticity_explained"), *warnings, *remarks),
    )
