"""The study of tolerances: many devices whose parts scatter, by the cheapest engine that is good enough for it."""

import dataclasses
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.engines import Cheapest
from harvester.engines.options import Request, number
from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, SimulationError, invalid, names_arguments
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.sweep.cluster import dask_client
from harvester.studies.tolerance import design
from harvester.studies.tolerance import samples as sampled
from harvester.studies.tolerance.answer import ToleranceResult, TornadoBar
from harvester.studies.tolerance.distribution import QUANTILES, quantile, share_met
from harvester.studies.tolerance.limits import lifetime_of
from harvester.studies.tolerance.limits import parse as read_limit
from harvester.studies.tolerance.runs import Found, Study, Tick
from harvester.studies.tolerance.sensitivity import CORRELATED, indices
from harvester.studies.tolerance.spreads import PartSpread, spreads

SAMPLES = 10_000
UNEXPLAINED = 0.05  # of the variance: a surface that misses more brings a warning


@names_arguments
def tolerance(
    scene: AnyScene,
    vary: Mapping[str, str] | Sequence[str],
    limits: Sequence[str] = (),
    engine: Named | None = None,
    out: str | Path | None = None,
    *,
    correlate: Mapping[tuple[str, str], float] | Sequence[str] = (),
    samples: int | None = None,
    runs: int | None = None,
    checks: int | None = None,
    within: float | str | None = None,
    lifetime: float | str | None = None,
    seed: int = 0,
    resume: bool = False,
    tick: Tick | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    vector: Sequence[str] = (),
) -> ToleranceResult:
    """How mean power and voltage scatter over devices whose parts have tolerances, and which tolerance matters.

    ``vary`` maps keys to spreads such as "10%", ".94:.98", "E24:5%", "normal:2%", "triangular:10%" or a measured list
    "1.1,1.3,1.2" (`harvester.studies.tolerance.spreads`), or is a list of texts KEY=SPREAD.  ``limits`` are texts such
    as "mean_power > 5 uW" of mean_power, mean_square_voltage or voltage_rms, and of a scene under white noise
    peak_displacement, peak_voltage, peak_strain, peak_impact_speed, the level that 95 % of such devices stay below over
    a ``lifetime``, and impact_rate (`harvester.studies.tolerance.peaks`).  ``engine`` is by default the cheapest whose
    error is small against the spread.  ``checks`` samples (default: 8, by ngspice 4; 0: none) are computed again by a
    dearer engine, to the relative error ``within``; ``correlate`` maps pairs of keys to their correlation.
    Of ``samples`` devices (default: 10,000) the engine computes ``runs`` (default: 512 by a formula, else 24 for each
    key and 24 more), and a polynomial through them, and through the outer ends of each spread, stands for the others; a
    formula computes all where it is rough.
    ``out`` is a folder for tolerance.csv, tolerance.png, provenance.json and a folder for each sweep; ``resume``,
    ``workers``, ``scheduler`` and ``vector`` are those of `harvester.sweep`.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> found = hv.tolerance(scene, {"nondimensional.c1": "20%"}, ["mean_power > 0.0033"], samples=1024)
    >>> f"{found.met.value:.2f}"
    '0.42'

    Raises
    ------
    InputError
        for a key, spread, limit or correlation that cannot be, and a folder that cannot be written.
    HarvesterError
        where the engine fails at every sample, the last error.
    """
    begin, problem = time.perf_counter(), Problem.of(scene)
    scene = problem.scene
    spread = spreads(vary, scene)
    keys = [one.key for one in spread]
    matrix = design.correlation(correlate, keys)
    bounds = tuple(read_limit(text, scene.physical) for text in ([limits] if isinstance(limits, str) else limits))
    folder = None if out is None else OutputFolder(out, vector)
    if samples is not None and not design.LEAST <= samples <= design.MOST:
        raise invalid("`samples`", f"be between {design.LEAST} and {design.MOST}", samples)
    if runs is not None and not design.LEAST <= runs <= design.MOST:
        raise invalid("`runs`", f"be between {design.LEAST} and {design.MOST}", runs)
    if checks is not None and not (checks == 0 or 2 <= checks <= 1000):
        raise invalid("`checks`", "be 0, or between 2 and 1000", checks)
    years = lifetime_of(bounds, lifetime, problem)
    chosen = engine_of(sampled.cheapest(problem)(seed=seed) if engine is None else engine)
    if isinstance(chosen, Cheapest):
        raise InputError("`engine` must be one for all samples, such as 'averaged', but is 'cheapest'")
    if reason := chosen.refusal(problem):
        raise InputError(reason)
    wanted = number(Request(within=within).within)
    count = SAMPLES if samples is None else samples
    with nullcontext() if scheduler is None else dask_client(scheduler) as executor:
        study = Study(
            scene,
            folder,
            tick or (lambda done: None),
            {"resume": resume, "workers": workers, "executor": executor},
            spread,
            design.tied(design.places(count, len(spread), seed), matrix),
            design.outer(len(spread), matrix),
            seed,
            runs,
            years,
        )
        found = study.run(chosen, checks, wanted)
        if engine is None and not found.samples.small and (dearer := sampled.DEARER.get(type(chosen))) is not None:
            found = study.run(dearer(seed=seed, within=wanted), checks, wanted)
    answer = _answer(scene, found, spread, matrix, bounds, seed)
    answer = dataclasses.replace(answer, seconds=time.perf_counter() - begin)
    if folder is not None:
        asked = {
            "vary": {one.key: one.written for one in spread},
            "limits": [one.written for one in bounds],
            "correlate": None if matrix is None else matrix.tolist(),
        }
        about = provenance(scene, seed=seed, engine=found.samples.engine, **asked)
        folder.save("tolerance", answer.text(), figures.tolerance(answer, scene.title), about)
    return answer


def _answer(
    scene: Any, found: Found, spread: tuple[PartSpread, ...], matrix: Floats | None, bounds: Any, seed: int
) -> ToleranceResult:
    """The answer of a study's runs."""
    some = found.samples
    power, square = some.values["mean_power"], some.values["mean_square_voltage"]
    if len(power) < 2:
        raise SimulationError("fewer than two samples have an answer")
    off: dict[str, Any] = {name: value or 0.0 for name, value in some.off.items()}
    values = {"mean_power": power, "mean_square_voltage": square, "voltage_rms": np.sqrt(square)}
    values |= found.peaks
    off |= found.peaks_off
    off["voltage_rms"] = 0.5 * off["mean_square_voltage"]
    failed = found.failed
    warnings = list(found.warnings)
    if some.off["mean_power"] is None:
        warnings.append("the error of the engine is not known: intervals hold that of the samples alone")
    elif not some.small and np.ptp(power) > 0.0:
        warnings.append(
            f"the error of {some.engine!r} is not small against the spread of the powers: intervals are wide"
        )
    why = CORRELATED if matrix is not None else ""
    shares = {} if why else indices(found.surface, spread, found.surface.unexplained, seed)
    if not why and not shares:
        why = "the power does not change over the spreads"
    if found.surface.unexplained > UNEXPLAINED:
        warnings.append(
            f"the polynomial behind the sensitivity misses {found.surface.unexplained:.0%} of the variance: "
            "give more `samples`"
        )
    ends = design.values_at(spread, design.one_by_one(len(spread)))
    bars = [
        TornadoBar(
            one.key,
            (float(ends[1 + 2 * k, k]), float(ends[2 + 2 * k, k])),
            (float(found.alone[1 + 2 * k]), float(found.alone[2 + 2 * k])),
        )
        for k, one in enumerate(spread)
        if np.isfinite(found.alone[[1 + 2 * k, 2 + 2 * k]]).all()
    ]
    return ToleranceResult(
        engine=some.engine,
        spreads=spread,
        samples=found.x,
        power=power,
        voltage=values["voltage_rms"],
        off=some.off["mean_power"],
        check=some.check,
        quantiles={share: quantile(power, share, off["mean_power"]) for share in QUANTILES},
        voltages={share: quantile(values["voltage_rms"], share, off["voltage_rms"]) for share in QUANTILES},
        limits=bounds,
        met=share_met(bounds, values, off, failed) if bounds else None,
        met_each=tuple(share_met([one], values, off, failed) for one in bounds),
        sensitivity=shares,
        why=why,
        tornado=tuple(sorted(bars, key=lambda bar: -bar.swing)),
        nominal=float(found.alone[0]) if np.isfinite(found.alone[0]) else None,
        unexplained=found.surface.unexplained,
        failed=failed,
        physical=scene.physical,
        seconds=0.0,
        peaks_off={name: float(np.median(one)) for name, one in found.peaks_off.items()},
        warnings=tuple(dict.fromkeys(warnings)),
    )
