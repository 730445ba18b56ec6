"""What the numbers of a scene mean: nondimensional numbers, coupling, best load, stop, engines, what to type next."""

import math
import textwrap
from dataclasses import dataclass
from typing import Any

from harvester.devices.best_load import DECADES, NEAR, best_load
from harvester.devices.stop import stop
from harvester.engines import Averaged, Ideal, Published
from harvester.engines.selection import serving
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.printing.columns import columns
from harvester.scene.scene import Scene
from harvester.uncertainty.value import Value

WEAK = 0.2  # of the power that white noise gives, at the best load
SOURCE = (
    "strong from beta = 2/Q + 1/Q^2 on: solve the linear equations on a harmonic base for the load and frequency of "
    "most power; from there on a resistor damps as much as the mechanics do and takes the most that any load can, "
    "(mass acceleration)^2/(8 damping), with the acceleration's peak"
)


@dataclass(frozen=True)
class Meaning:
    """Numbers as (name, value, unit, what it is); words in sentences; the same for programs; the next commands."""

    numbers: tuple[tuple[str, float, str, str], ...]
    words: tuple[str, ...]
    facts: dict[str, Any]
    commands: tuple[str, ...]

    def __str__(self) -> str:
        shown = [(name, Value(value).text(unit), what) for name, value, unit, what in self.numbers]
        lines = columns([(f"{name:<11}", value, what) for name, value, what in shown], "  ")
        return "\n".join([*lines, "", *self.words, "", *(f"next: {line}" for line in self.commands)])

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints, less the file."""
        numbers = {name: value for name, value, _, _ in self.numbers}
        return {"numbers": numbers, **self.facts, "words": list(self.words), "next": list(self.commands)}


def meaning(scene: Scene, file: str) -> Meaning:
    """What a physical scene's numbers mean; ``file`` is what the next commands name."""
    problem = Problem(scene)
    eqs = problem.equations
    words: list[str] = []
    facts: dict[str, Any] = {}
    for told, fact in (_coupling(eqs), _load(problem, file), stop(problem), _engines(problem)):
        words += told
        facts |= fact
    return Meaning(_numbers(problem), tuple(words), facts, _commands(problem, file, facts))


def _numbers(problem: Problem) -> tuple[tuple[str, float, str, str], ...]:
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
    told = f"coupling: {how}, k^2 Q = {merit:.3g} (strong from {exact / c:.3g}): {means}"
    taken = (
        f"linear and under white noise, the best resistor takes {share:.0%} of what the shaking gives; weak: below 20%)"
    )
    reasons = textwrap.wrap(f"{SOURCE}; {taken}", 100, initial_indent="  (", subsequent_indent="  ")
    facts = {"figure_of_merit": merit, "coupling": how, "strong_from": exact / c, "noise_share": share}
    return [told, *reasons], facts


def noise_share(beta: float, c: float) -> float:
    """Of N1, the power that white noise gives a linear device without a stop, what the best resistor takes.

    beta mu S/N1 of the Lyapunov equation (see `harvester.devices.stop`) at mu = sqrt(1 + beta).
    """
    return beta / (beta + 2.0 * c * math.sqrt(1.0 + beta) + c * c)


def _load(problem: Problem, file: str) -> tuple[list[str], dict[str, Any]]:
    """The best load resistance, by a search with engine `averaged` where that serves."""
    scene = problem.scene
    if problem.netlist is not None:
        return [f"best load: a netlist's is found by: {_optimise(problem, file)}"], {"best_load": None}
    if "external_noise" not in problem.effects or Averaged.refusal(problem):
        if not problem.shaken:
            return ["best load: not looked for, as nothing shakes the base"], {"best_load": None}
        return [f"best load: found by: {_optimise(problem, file)}"], {"best_load": None}
    try:
        found = best_load(scene, _middle(problem))
    except HarvesterError as error:
        return [f"best load: not found: {error}"], {"best_load": None}
    power = found.power
    stated = f"engine 'averaged', which states an error of {(power.model or 0.0) / (power.value or 1.0):.1%} in power"
    fact: dict[str, Any] = {
        "resistance": found.resistance,
        "near_from": found.low,
        "near_to": found.high,
        "mean_power": power.value,
        "mean_power_model_bias": power.model,
    }
    best = f"the best mean power, {Value(power.value).text('W')}, at about {_ohm(found.resistance)}"
    best += f" ({NEAR:.0%} of it from {_ohm(found.low)} to {_ohm(found.high)})"
    if found.at_end:
        best += ", the end of what was looked at"
    if scene.load is None or scene.load.resistance is None:
        return [f"load: none yet; {best}", f"  ({stated})"], {"best_load": fact}
    own = min(Averaged().run(problem).mean_power.value / power.value, 1.0)
    fact["share"] = own
    how = "near the best" if own >= NEAR else "far from the best"
    told = f"load: {how}: your {_ohm(scene.load.resistance)} gives {own:.0%} of {best}"
    return [told, f"  ({stated})"], {"best_load": fact}


def _engines(problem: Problem) -> tuple[list[str], dict[str, Any]]:
    names = engines(problem)
    told = ", ".join(names) if names else "none yet: a power needs shaking and a load"
    return [f"engines that serve it: {told}"], {"engines": names}


def engines(problem: Problem) -> list[str]:
    """Names of the engines that give a problem a mean power; none without shaking or load."""
    if problem.scene.load is None or not problem.shaken:
        return []
    formulas = () if "external_noise" in problem.effects else (Published.NAME, Averaged.NAME)
    return [name for name in serving(problem) if name not in formulas]


def _commands(problem: Problem, file: str, facts: dict[str, Any]) -> tuple[str, ...]:
    scene, eqs = problem.scene, problem.equations
    if not problem.shaken:
        return ("harvester keys excitation   (what may shake the base: add one to the scene, or new --force)",)
    if scene.load is None:
        return (_optimise(problem, file),)
    if eqs.drive is not None and scene.load.netlist is None:
        f0 = problem.scales.frequency / (2.0 * math.pi)
        low, high = 0.7 * f0, 1.3 * f0 * math.sqrt(1.0 + (eqs.beta or 0.0))
        return (
            f"harvester run {file}",
            f"harvester response {file} --sweep {low:.3g}Hz:{high:.3g}Hz:61 --out response",
        )
    best = facts.get("best_load")
    if best is not None and best["share"] < NEAR:
        return (f"harvester run {file} --within 1%", _optimise(problem, file))
    low, high = _range(problem)
    vary = "parameters.R" if scene.load.netlist is not None else "resistance"
    grid = f"load.{vary}={_plain(low)}:{_plain(high)}:25"
    return (f"harvester run {file} --within 1%", f"harvester sweep {file} --vary {grid} --out sweep")


def _optimise(problem: Problem, file: str) -> str:
    low, high = _range(problem)
    key = "load.resistance" if problem.netlist is None else "load.parameters.R"
    engine = " --engine ideal" if Ideal.NAME in engines(problem) else ""
    return f"harvester optimise {file} --over {key}={_plain(low)}:{_plain(high)}{engine}"


def _middle(problem: Problem) -> float:
    """1/(Cp w0 sqrt(1 + beta)): the best load of a linear device under white noise."""
    s = problem.scales
    return 1.0 / (s.capacitance * s.frequency * math.sqrt(1.0 + (problem.equations.beta or 0.0)))


def _range(problem: Problem) -> tuple[float, float]:
    """Ends of the search, powers of ten."""
    decade = round(math.log10(_middle(problem)))
    return 10.0 ** (decade - DECADES), 10.0 ** (decade + DECADES - 1.0)


def _ohm(value: float) -> str:
    return Value(float(f"{value:.3g}")).text("ohm")


def _plain(value: float) -> str:
    """Such as 10k, as `--vary` and `--over` read it."""
    for power, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, "")):
        if value >= power:
            return f"{value / power:g}{prefix}"
    return f"{value:g}"
