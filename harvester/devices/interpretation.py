"""The meaning of a scene's numbers: nondimensional numbers, coupling, best load, stop, engines."""

import math
from dataclasses import dataclass
from typing import Any

from harvester.devices.best_load import NEAR, NEARLY, best_load
from harvester.devices.linear_response import off_resonance, stop_hits
from harvester.engines.cheapest import formula
from harvester.engines.selection import ENGINES, serving
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.presentation.columns import columns
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.quantities.kinds import RESISTANCE
from harvester.scene.plausibility import unusual
from harvester.uncertainty.value import Value

Finding = tuple[list[Diagnostic], dict[str, Any]]  # remarks on a topic, and the facts behind them

WEAK = 0.2  # of the power that white noise gives, at the best load


@dataclass(frozen=True)
class Meaning:
    """The meaning of a scene's numbers, for people and for programs.

    ``numbers`` are rows of name, value, unit and meaning.  ``remarks`` are about values that no
    device has, a drive that misses the resonance, coupling, load (none if only a search would find
    the best load), stop and engines. ``facts`` are the same for a program.
    """

    numbers: tuple[tuple[str, float, str, str], ...]
    remarks: tuple[Diagnostic, ...]
    facts: dict[str, Any]

    def table(self) -> list[str]:
        """The numbers as lines of text."""
        rows = [
            (f"{name:<11}", Value(value).format(unit), what)
            for name, value, unit, what in self.numbers
        ]
        return columns(rows, "  ")


def meaning(problem: Problem) -> Meaning:
    """The meaning of the numbers of a physical scene."""
    unusual = [remark.of("values") for remark in problem.value_warnings]
    topics: list[Finding] = [
        (unusual, {}),
        off_resonance(problem),
        _coupling(problem.equations),
        _load(problem),
    ]
    topics += [stop_hits(problem), _engines(problem)]
    facts = {name: fact for _, topic_facts in topics for name, fact in topic_facts.items()}
    return Meaning(
        _numbers(problem), tuple(remark for remarks, _ in topics for remark in remarks), facts
    )


def _numbers(problem: Problem) -> tuple[tuple[str, float, str, str], ...]:
    """The scales and nondimensional numbers that the scene has."""
    s, eqs = problem.scales, problem.equations
    beta = eqs.beta or 0.0
    c = -(eqs.c1 or 0.0)
    rows: list[tuple[str, float | None, str, str]] = [
        ("f0", s.frequency / (2.0 * math.pi), "Hz", "resonance in short circuit"),
        ("w0", s.frequency, "rad/s", "2 pi f0; 1/w0 is the unit of time"),
        (
            "f_oc",
            s.frequency * math.sqrt(1.0 + beta) / (2.0 * math.pi),
            "Hz",
            "resonance in open circuit",
        ),
        ("zeta", 0.5 * c, "", "mechanical damping ratio (c1 = -2 zeta)"),
        ("Q", 1.0 / c if c else None, "", "quality factor, 1/(2 zeta)"),
        ("beta", beta, "", "coupling, theta^2/(K Cp) = (f_oc/f0)^2 - 1, here also k^2"),
        ("k^2 Q", beta / c if c > 0.0 else None, "", "figure of merit, beta/(2 zeta)"),
        ("mu", eqs.mu, "", "1/(R Cp w0), the load"),
        ("restitution", eqs.restitution, "", "restitution coefficient of the stop"),
        ("gap", None if eqs.restitution is None else eqs.gap or 0.0, "", "over the length l"),
        ("D11", eqs.n1, "", "scaled noise intensity (1 by definition)"),
        ("drive", eqs.drive, "", "scaled excitation (1 by definition)"),
        ("w/w0", eqs.drive_frequency, "", "excitation frequency over f0"),
        ("l", s.length, "m", "length scale"),
    ]
    return tuple((name, value, unit, what) for name, value, unit, what in rows if value is not None)


def _coupling(eqs: Equations) -> Finding:
    """How strongly the circuit acts back on the mass, with the reason.

    Strong is k^2 Q from beta = 2/Q + 1/Q^2 on: on a harmonic base a resistor then damps as much as
    the mechanics do and receives the most that any load can, (mass acceleration)^2/(8 damping),
    with the acceleration's peak.
    """
    c = -(eqs.c1 or 0.0)
    beta = eqs.beta or 0.0
    if not c > 0.0:
        return [note("coupling_needs_damping", "coupling")], {}
    merit = beta / c
    exact = 2.0 * c + c * c
    share = noise_share(beta, c)
    how = "strong" if beta >= exact else "medium" if share >= WEAK else "weak"
    facts = {
        "figure_of_merit": merit,
        "coupling": how,
        "strong_from": exact / c,
        "noise_share": share,
    }
    verdict = note("coupling", "coupling", how=how, merit=merit, strong_from=exact / c)
    return [verdict, note("coupling_explained", "coupling", share=share)], facts


def noise_share(beta: float, c: float) -> float:
    """The fraction of N1, the power of white noise for a linear device without a stop, that the best resistor receives.

    beta mu S/N1 of the Lyapunov equation (see `harvester.linear.transfer`) at mu = sqrt(1 + beta).
    """
    return beta / (beta + 2.0 * c * math.sqrt(1.0 + beta) + c * c)


def _load(problem: Problem) -> Finding:
    """The load and the best one, which is searched for with a formula if one supports the scene."""
    nothing: dict[str, Any] = {"best_load": None}
    if not problem.load.is_in_equations:
        return [], nothing
    kind = formula(problem)
    shaken = problem.equations.is_shaken
    if not shaken:
        return [note("load_not_sought", "best load")], nothing
    if kind.refusal(problem) or (not kind.is_exact and "external_noise" not in problem.effects):
        return [], nothing
    try:
        optimum = best_load(problem)
    except HarvesterError as error:
        return [note("best_load_not_found", "best load", why=str(error))], nothing
    power = optimum.power
    present_load = None if problem.scene.load is None else problem.scene.load.resistance
    fact: dict[str, Any] = {
        "resistance": optimum.resistance,
        "near_from": optimum.low,
        "near_to": optimum.high,
    }
    fact |= {"mean_power": power.value, "mean_power_model_bias": power.model}
    best: dict[str, Any] = {
        "power": power.value,
        "ohm": optimum.resistance,
        "low": optimum.low,
        "high": optimum.high,
    }
    best |= {"near": NEAR, "at_end": optimum.at_end}
    stated = note(
        "best_load_by", "load", engine=kind.NAME, error=power.known_error95 / (power.value or 1.0)
    )
    odd = unusual("the best load", optimum.resistance, RESISTANCE)
    rest = [stated, *(warning("unusual_best_load", "load", what=str(remark)) for remark in odd)]
    if present_load is None:
        return [note("no_load_yet", "load", **best), *rest], {"best_load": fact}
    fact["share"] = min(kind().run(problem).mean_power.value / power.value, 1.0)
    load_note = note(
        "own_load", "load", resistance=present_load, share=fact["share"], nearly=NEARLY, **best
    )
    return [load_note, *rest], {"best_load": fact}


def _engines(problem: Problem) -> Finding:
    """The engines that support the scene."""
    names = engines(problem)
    about = "engines that support it"
    served = (
        note("engines_that_serve", about, engines=", ".join(names))
        if names
        else note("no_engine_yet", about)
    )
    return [served], {"engines": names}


def engines(problem: Problem) -> list[str]:
    """Names of the engines that give a problem a mean power; none without excitation or load."""
    if problem.scene.load is None or not problem.equations.is_shaken:
        return []
    kinds = {name: ENGINES[name] for name in serving(problem)}
    # without it no theory has a power but the closed form
    noisy = "external_noise" in problem.effects
    return [name for name, kind in kinds.items() if noisy or kind.is_exact or not kind.is_formula]
