"""What the numbers of a scene mean: nondimensional numbers, coupling, best load, stop, engines."""

import math
import textwrap
from dataclasses import dataclass
from typing import Any

from harvester.devices.best_load import NEAR, best_load
from harvester.devices.drive_frequency import off_resonance
from harvester.devices.stop_hits import stop_hits
from harvester.engines import Averaged, Published
from harvester.engines.cheapest import formula
from harvester.engines.selection import serving
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.presentation.columns import columns
from harvester.quantities.kinds import RESISTANCE
from harvester.scene.plausibility import unusual, unusual_values
from harvester.uncertainty.value import Value

WEAK = 0.2  # of the power that white noise gives, at the best load
SOURCE = (
    "strong from beta = 2/Q + 1/Q^2 on: solve the linear equations on a harmonic base for the load and frequency of "
    "most power; from there on a resistor damps as much as the mechanics do and takes the most that any load can, "
    "(mass acceleration)^2/(8 damping), with the acceleration's peak"
)


@dataclass(frozen=True)
class Meaning:
    """What the numbers of a scene mean, for people and for programs.

    ``numbers`` are rows of name, value, unit and what it is.  ``words`` are the sentences on each topic: values that no
    device has, a drive that misses the resonance, coupling, load (none where only a search would find the best load),
    stop, engines.
    ``facts`` say the same to a program.
    """

    numbers: tuple[tuple[str, float, str, str], ...]
    words: dict[str, list[str]]
    facts: dict[str, Any]

    def table(self) -> list[str]:
        """The numbers as lines of text."""
        rows = [(f"{name:<11}", Value(value).format(unit), what) for name, value, unit, what in self.numbers]
        return columns(rows, "  ")


def meaning(problem: Problem) -> Meaning:
    """What the numbers of a physical scene mean."""
    topics: dict[str, tuple[list[str], dict[str, Any]]] = {
        "values": ([f"warning: {doubt}" for doubt in unusual_values(problem.scene)], {}),
        "drive": off_resonance(problem),
        "coupling": _coupling(problem.equations),
        "load": _load(problem),
        "stop": stop_hits(problem),
        "engines": _engines(problem),
    }
    words = {topic: sentences for topic, (sentences, _) in topics.items()}
    facts = {name: fact for _, found in topics.values() for name, fact in found.items()}
    return Meaning(_numbers(problem), words, facts)


def _numbers(problem: Problem) -> tuple[tuple[str, float, str, str], ...]:
    """The scales and nondimensional numbers that the scene has."""
    s, eqs = problem.scales, problem.equations
    beta, c = eqs.beta or 0.0, -(eqs.c1 or 0.0)
    rows: list[tuple[str, float | None, str, str]] = [
        ("f0", s.frequency / (2.0 * math.pi), "Hz", "resonance in short circuit"),
        ("w0", s.frequency, "rad/s", "2 pi f0; 1/w0 is the unit of time"),
        ("f_oc", s.frequency * math.sqrt(1.0 + beta) / (2.0 * math.pi), "Hz", "resonance in open circuit"),
        ("zeta", 0.5 * c, "", "mechanical damping ratio (c1 = -2 zeta)"),
        ("Q", 1.0 / c if c else None, "", "quality factor, 1/(2 zeta)"),
        ("beta", beta, "", "coupling, theta^2/(K Cp) = (f_oc/f0)^2 - 1, here also k^2"),
        ("k^2 Q", beta / c if c > 0.0 else None, "", "figure of merit, beta/(2 zeta)"),
        ("mu", eqs.mu, "", "1/(R Cp w0), the load"),
        ("restitution", eqs.restitution, "", "of the stop"),
        ("gap", None if eqs.restitution is None else eqs.gap or 0.0, "", "over the length l"),
        ("D11", eqs.n1, "", "noise intensity at the length l, which is chosen to make it 1"),
        ("drive", eqs.drive, "", "harmonic acceleration over l w0^2, at the l that makes it 1"),
        ("w/w0", eqs.drive_frequency, "", "frequency of the drive over f0"),
        ("l", s.length, "m", "length scale"),
    ]
    return tuple((name, value, unit, what) for name, value, unit, what in rows if value is not None)


def _coupling(eqs: Equations) -> tuple[list[str], dict[str, Any]]:
    """Sentences on how strongly the circuit acts back on the mass, with the reason."""
    c, beta = -(eqs.c1 or 0.0), eqs.beta or 0.0
    if not c > 0.0:
        return ["coupling: k^2 Q has no meaning without damping: damping_ratio must be above 0"], {}
    merit = beta / c
    exact = 2.0 * c + c * c
    share = noise_share(beta, c)
    how = "strong" if beta >= exact else "medium" if share >= WEAK else "weak"
    means = {
        "strong": "the load damps the mass and shifts its resonance",
        "medium": "the mass feels the load",
        "weak": "the mass hardly feels the load; circuits like SSHI or SECE may bring more",
    }[how]
    verdict = f"coupling: {how}, k^2 Q = {merit:.3g} (strong from {exact / c:.3g}): {means}"
    taken = (
        f"linear and under white noise, the best resistor takes {share:.0%} of what the shaking gives; weak: below 20%)"
    )
    reasons = textwrap.wrap(f"{SOURCE}; {taken}", 100, initial_indent="  (", subsequent_indent="  ")
    facts = {"figure_of_merit": merit, "coupling": how, "strong_from": exact / c, "noise_share": share}
    return [verdict, *reasons], facts


def noise_share(beta: float, c: float) -> float:
    """Of N1, the power that white noise gives a linear device without a stop, what the best resistor takes.

    beta mu S/N1 of the Lyapunov equation (see `harvester.linear.response`) at mu = sqrt(1 + beta).
    """
    return beta / (beta + 2.0 * c * math.sqrt(1.0 + beta) + c * c)


def _load(problem: Problem) -> tuple[list[str], dict[str, Any]]:
    """Sentences on the load and the best one, which is searched for with a formula where one serves."""
    if problem.netlist is not None:
        return [], {"best_load": None}
    kind, shaken = formula(problem), problem.equations.is_shaken
    if not shaken or kind.refusal(problem) or (kind is Averaged and "external_noise" not in problem.effects):
        why = [] if shaken else ["best load: not looked for, as nothing shakes the base"]
        return why, {"best_load": None}
    scene = problem.scene
    try:
        found = best_load(problem)
    except HarvesterError as error:
        return [f"best load: not found: {error}"], {"best_load": None}
    power = found.power
    stated = f"engine {kind.NAME!r}, which states an error of {power.known_error95 / (power.value or 1.0):.1%} in power"
    fact: dict[str, Any] = {
        "resistance": found.resistance,
        "near_from": found.low,
        "near_to": found.high,
        "mean_power": power.value,
        "mean_power_model_bias": power.model,
    }
    best = f"the best mean power, {Value(power.value).format('W')}, at about {_ohm(found.resistance)}"
    best += f" ({NEAR:.0%} of it from {_ohm(found.low)} to {_ohm(found.high)})"
    if found.at_end:
        best += ", the end of what was looked at"
    doubt = unusual("the best load", found.resistance, RESISTANCE)
    notes = [f"  ({stated})"] + ([f"warning: {doubt}: are mass, frequency and capacitance right?"] if doubt else [])
    if scene.load is None or scene.load.resistance is None:
        return [f"load: none yet; {best}", *notes], {"best_load": fact}
    own = min(kind().run(problem).mean_power.value / power.value, 1.0)
    fact["share"] = own
    how = "near the best" if own >= NEAR else "far from the best"
    verdict = f"load: {how}: your {_ohm(scene.load.resistance)} gives {own:.0%} of {best}"
    return [verdict, *notes], {"best_load": fact}


def _engines(problem: Problem) -> tuple[list[str], dict[str, Any]]:
    """A sentence on the engines that serve the scene."""
    names = engines(problem)
    listed = ", ".join(names) if names else "none yet: a power needs shaking and a load"
    return [f"engines that serve it: {listed}"], {"engines": names}


def engines(problem: Problem) -> list[str]:
    """Names of the engines that give a problem a mean power; none without shaking or load."""
    if problem.scene.load is None or not problem.equations.is_shaken:
        return []
    formulas = () if "external_noise" in problem.effects else (Published.NAME, Averaged.NAME)
    return [name for name in serving(problem) if name not in formulas]


def _ohm(value: float) -> str:
    """A resistance as a text of three digits."""
    return Value(float(f"{value:.3g}")).format("ohm")
