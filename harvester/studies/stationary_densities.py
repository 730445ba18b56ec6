"""The distributions of displacement, velocity, voltage and impacts, without sampling, and their consequences.

Long because the result and its function explain their arrays and arguments to users.
"""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.arrays import Floats
from harvester.density.functionals import NAMES
from harvester.density.marginals import Marginals
from harvester.density.refine import Answer, solution
from harvester.engines.density import Density
from harvester.engines.protocol import AnyScene, served
from harvester.equations.impact_order import accumulation
from harvester.equations.problem import Problem
from harvester.errors import invalid, names_arguments
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.studies.counted_path import counted_passage, longer_path, voltage_plane
from harvester.studies.motion import Motion, motion
from harvester.studies.motion_in_time import (
    forgetting,
    hop_rate,
    passage_time,
    read_level,
    read_voltage,
    spectrum_of,
)
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 401  # of a curve
SOLVED, DRAWN = 0.45, 0.9  # of the time, until the means are known, and the curves
MOST_FREQUENCIES = 10_000
MODES = 12  # least number for the density of the voltage
SPAN = (0.2, 5.0)  # times the resonance: frequencies of a spectrum


class Densities(TableResult):
    """The stationary densities of a scene: arrays of shape (n,), whose integrals are 1, and their consequences.

    Attributes
    ----------
    engine : str
        the name of the engine that computed it.
    displacement_mean, displacement_rms, velocity_rms, voltage_rms : Value
        each a `Value` (m, m/s, V).
    impact_rate : Value or None
        a `Value`, impacts per second; None without a stop and if impacts accumulate.
    hop_rate : Value or None
        a `Value`: transitions per second from one well to the other, either way, without those that
        are reversed before mass and load have forgotten their origin; None without two wells
        that are apart.
    level, first_passage_time : float or Value or None
        a displacement (m) or voltage (V), and the mean time (s), a `Value`, until it is first
        passed on either side; that of a voltage is counted on a path.  None if no level was asked
        for.
    displacement, velocity, voltage : ndarray
        places (m, m/s, V).
    displacement_density, velocity_density, voltage_density : ndarray
        the densities there (1/m, s/m, 1/V).
    phase_plane : ndarray
        the density of displacement and velocity, shape (k, k), at every fourth of their places.
    plane_displacement, plane_voltage, voltage_plane, voltage_plane_stderr : ndarray or None
        the density of displacement and voltage, shape (n, n), counted on a path in bins with these
        centres, shape (n,), and its standard error; None without a load: the voltage is then the
        displacement.
    impact_speed, impact_density : ndarray or None
        speeds at the stop (m/s), and the impacts per second and unit of speed; None without a stop.
    largest_error : float
        the largest difference of a density over its peak, of the worst curve: by a coarser mesh,
        and of the voltage by half the terms of the series of Gram and Charlier that gives it.
    frequency, spectrum : ndarray or None
        frequencies (Hz; nondimensional scene: angular, in w0), and the one-sided voltage density
        (V^2/Hz); None if none was asked for.
    spectrum_error : float or None
        its relative change by a finer mesh, at the resonance.
    path : Motion
        a path of the scene, whose histogram is next to the densities in the picture.
    seconds : float
        the time of computing, without compilation (s).
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> import numpy as np
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01, restitution=0.9))
    >>> result = hv.densities(scene)
    >>> round(float(np.trapezoid(result.displacement_density, result.displacement)), 3)
    1.0
    """

    NOT_SHOWN = frozenset({"path", "level"})
    NOT_IN_JSON = frozenset(
        {
            "path",
            "phase_plane",
            "plane_displacement",
            "plane_voltage",
            "voltage_plane",
            "voltage_plane_stderr",
        }
    )
    SHORT = ("engine", "displacement_rms", "voltage_rms", "hop_rate", "first_passage_time")

    engine: str
    displacement_mean: Value
    displacement_rms: Value
    velocity_rms: Value
    voltage_rms: Value
    impact_rate: Value | None
    hop_rate: Value | None
    level: float | None
    first_passage_time: Value | None
    displacement: Floats
    displacement_density: Floats
    velocity: Floats
    velocity_density: Floats
    voltage: Floats
    voltage_density: Floats
    phase_plane: Floats
    impact_speed: Floats | None
    impact_density: Floats | None
    largest_error: float
    path: Motion
    seconds: float
    physical: bool
    diagnostics: tuple[Diagnostic, ...] = ()
    frequency: Floats | None = None
    spectrum: Floats | None = None
    spectrum_error: float | None = None
    plane_displacement: Floats | None = None
    plane_voltage: Floats | None = None
    voltage_plane: Floats | None = None
    voltage_plane_stderr: Floats | None = None

    @property
    def table(self) -> Table:
        """Places and densities side by side."""
        units = self.unit_names
        columns = []
        for name, unit in (
            ("displacement", units.length),
            ("velocity", units.speed),
            ("voltage", units.voltage),
        ):
            density = getattr(self, f"{name}_density")
            columns += [
                Column(name, getattr(self, name), unit),
                Column(f"{name}_density", density, _per(unit)),
            ]
        if self.impact_speed is not None and self.impact_density is not None:
            columns.append(Column("impact_speed", self.impact_speed, units.speed))
            columns.append(
                Column("impact_density", self.impact_density, "1/m" if self.physical else "")
            )
        return Table(tuple(columns))

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The densities as a matplotlib figure, with the histogram of a path behind them."""
        return drawing.draw(self, title, ax)


@names_arguments
def densities(
    scene: AnyScene,
    *,
    level: float | str | None = None,
    spectrum: int = 0,
    within: float | str | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Densities:
    """How displacement, velocity, voltage and impact speeds are distributed, without sampling.

    Parameters
    ----------
    scene : Scene or path
        a `Scene` that engine `Density` supports, or the path of a scene file.
    level : float or str, optional
        a displacement such as "2 mm" or a voltage such as "5 V", either side of 0, of which the
        mean time of the first passage is asked for.
    spectrum : int, default 0
        at how many frequencies, from a fifth of the resonance to five times it, the voltage's
        density is computed.
    within : float or str, optional
        the relative power error that is aimed at, such as 0.001; None: 1e-4.
    seed : int, default 0
        of the path in the picture.
    progress : callable, optional
        is called with the fraction done.

    Returns
    -------
    Densities
        in SI units (nondimensional scene: without units).

    Raises
    ------
    InputError
        for a scene that engine `Density` does not support, or an invalid level.
    SimulationError
        if the response grows without bound, or the density cannot be resolved.

    Examples
    --------
    >>> import harvester as hv
    >>> wells = hv.Nondimensional(c1=-0.5, D11=0.025, linear=-1.0, alpha=1.0)
    >>> f"{hv.densities(hv.Scene(nondimensional=wells)).hop_rate.value:.3g}"
    '0.00111'
    """
    problem = served(Density, scene)
    eqs = problem.equations
    volts = None if level is None else read_voltage(level, problem)
    displacement_level = None if level is None or volts is not None else read_level(level, problem)
    if not 0 <= spectrum <= MOST_FREQUENCIES:
        raise invalid(
            "`spectrum`", f"be a number of frequencies from 0 to {MOST_FREQUENCIES}", spectrum
        )
    begin = time.perf_counter()
    report = progress or (lambda _: None)
    exists, answer = Density(within=within).solve(problem, lambda done: report(SOLVED * done))
    curves = _curves(problem, answer)
    report(DRAWN)
    remarks = [exists.warning, accumulation(eqs), note("density_solved")]
    path = motion(problem, seed=seed)
    long = longer_path(path, problem, seed)
    passage = (
        None if displacement_level is None else passage_time(problem, answer, displacement_level)
    )
    if volts is not None:
        forgetting_time = 1.0 / (forgetting(problem, answer) * problem.units.frequency)
        passage = counted_passage(long.time, long.voltage, volts, forgetting_time)
        remarks.append(note("passages_counted", time=float(long.time[-1])))
    remarks.append(note("densities_explained", error=curves["largest_error"]))
    return Densities(
        engine=Density.NAME,
        **_means(problem, answer),
        **curves,
        hop_rate=hop_rate(problem, answer),
        level=volts if displacement_level is None else displacement_level * problem.units.length,
        first_passage_time=passage,
        **(spectrum_of(problem, answer, np.geomspace(*SPAN, spectrum)) if spectrum else {}),
        **({} if eqs.mu is None else _plane(long, curves)),
        path=path,
        seconds=time.perf_counter() - begin,
        physical=problem.physical,
        diagnostics=tuple(diagnostic for diagnostic in remarks if diagnostic is not None),
    )


def _plane(path: Motion, curves: dict[str, Any]) -> dict[str, Any]:
    """The density of displacement and voltage, counted on a path, between the ends of their own densities."""
    x, volts = (
        (float(curves[name][0]), float(curves[name][-1])) for name in ("displacement", "voltage")
    )
    names = "plane_displacement", "plane_voltage", "voltage_plane", "voltage_plane_stderr"
    return dict(zip(names, voltage_plane(path, x, volts), strict=True))


def _means(problem: Problem, answer: Answer) -> dict[str, Any]:
    """The means, in the scene's units."""
    u, eqs = problem.units, problem.equations
    counted = eqs.restitution is not None and accumulation(eqs) is None
    return {
        "displacement_mean": _mean(answer, "displacement").scaled(u.length),
        "displacement_rms": _root(answer, "displacement_squared").scaled(u.length),
        "velocity_rms": _root(answer, "velocity_squared").scaled(u.length * u.frequency),
        "voltage_rms": _root(answer, "voltage_squared").scaled(u.volts),
        "impact_rate": _mean(answer, "impact_rate").scaled(u.frequency) if counted else None,
    }


def _curves(problem: Problem, answer: Answer) -> dict[str, Any]:
    """The densities at their places, in the scene's units, and the largest error of one over its peak."""
    u = problem.units
    box = answer.setting.box
    speed = u.length * u.frequency
    most = 5.5 * math.sqrt(abs(float(answer.means[0])))
    x = np.linspace(box.low, box.high, POINTS)
    v = np.linspace(-box.speed, box.speed, POINTS)
    volts = np.linspace(-most, most, POINTS)
    w = np.linspace(0.0, box.speed, POINTS)
    stopped, loaded = problem.equations.restitution is not None, problem.equations.mu is not None
    modes = answer.solution.form.modes
    both = []
    for solved in (answer.solution, answer.coarser):
        marginals = Marginals(solved.form, solved.p)
        both.append(
            [
                marginals.displacement(x),
                marginals.velocity(v),
                *([marginals.impacts(w)] if stopped else []),
            ]
        )
    ours, coarse = both
    cheaper = min(
        (answer.coarser, answer.solution), key=lambda solved: solved.form.mesh.memory(1)
    ).form.mesh
    finer = solution(problem.equations, answer.setting, cheaper, max(modes, MODES) if loaded else 1)
    voltage = Marginals(finer.form, finer.p)
    of_volts = voltage.voltage(volts)
    half = voltage.voltage(volts, max(finer.form.modes // 2, 1))
    errors = [
        float(np.abs(a - b).max() / a.max())
        for a, b in zip([*ours, of_volts], [*coarse, half], strict=True)
    ]
    plane = Marginals(answer.solution.form, answer.solution.p).phase_plane(x[::4], v[::4])
    return {
        "displacement": x * u.length,
        "displacement_density": ours[0] / u.length,
        "velocity": v * speed,
        "velocity_density": ours[1] / speed,
        "voltage": volts * u.volts,
        "voltage_density": of_volts / u.volts,
        "phase_plane": plane / (u.length * speed),
        "impact_speed": w * speed if stopped else None,
        "impact_density": ours[2] * u.frequency / speed if stopped else None,
        "largest_error": max(errors),
    }


def _per(unit: str) -> str:
    return {"m": "1/m", "m/s": "s/m", "V": "1/V"}.get(unit, "")


def _mean(answer: Answer, name: str) -> Value:
    index = NAMES.index(name)
    return Value(float(answer.means[index]), bias=float(answer.error[index]))


def _root(answer: Answer, name: str) -> Value:
    square = _mean(answer, name)
    root = math.sqrt(square.value)
    return Value(root, bias=(square.bias or 0.0) / (2.0 * root))
