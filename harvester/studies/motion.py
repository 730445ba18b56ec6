"""One trajectory of a scene: displacement, velocity, voltage and any probe over time, not averaged.

By the exact update of a load resistor (`harvester.mechanics.trace`), or by ngspice in
lock-step.  A path has no sampling error, as it is not a mean; that of its step is of second order
(with noise: for the trajectory of these kicks).

Long because the trajectory and its function explain their arrays and arguments to users.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from harvester.arrays import Floats
from harvester.engines import Compiled, Ensemble, Spice
from harvester.engines.options import check_time, number
from harvester.engines.protocol import AnyScene, served
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, names_arguments, unknown
from harvester.machine.execution import DEFAULT, Execution
from harvester.netlists.probes import Probe, read_probes
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.studies.motion_in_ngspice import Expected, path_in_ngspice
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.smaller_step import at_smaller_steps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# what is shown by default, in 2 pi/w0, and how many times that goes before it
PERIODS, LEAD = 40, 4
ENGINES = {engine.NAME: engine for engine in (Ensemble, Compiled, Spice)}
MOST_STEPS = 5_000_000


class Motion(TableResult):
    """One trajectory of a scene over time, in its units: arrays of shape (n,), one entry for each reading.

    Attributes
    ----------
    time : ndarray
        s (nondimensional scene: 1/w0).
    displacement, velocity : ndarray
        of the mass relative to the base, shape (n,) (m, m/s).
    voltage : ndarray
        of the piezo, shape (n,) (V).
    acceleration : ndarray or None
        of the base, shape (n,) (m/s^2); None under white noise alone, which has no value at a time.
    impacts : ndarray
        a row (time, speed) for each impact, shape (m, 2); the speed is negative at the opposite
        stop.
    stops : tuple of float
        places of the displacement's stops (m): none of a ball, nor of a sum of modes, which
        meets its own.
    shown : float
        the length of the last part, which a plot shows.
    step : float
        the step of the computation.
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    engine : str
        the name of the engine that computed it.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).
    probes, probe_units : dict
        further quantities of the circuit by name, shape (n,), and their units.
    hides_noise : bool
        whether white noise acts together with the acceleration, which leaves it out.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> path = hv.motion(scene, duration=50.0)
    >>> path.time.shape == path.voltage.shape, len(path.impacts)
    (True, 0)
    """

    DERIVED = ("duration", "number_of_impacts", "ranges")
    NOT_SHOWN = frozenset({"stops", "shown", "hides_noise", "probes", "probe_units", "ranges"})
    NOT_IN_JSON = frozenset({"ranges"})
    SHORT = ("engine", "duration", "step", "number_of_impacts")

    time: Floats
    displacement: Floats
    velocity: Floats
    voltage: Floats
    acceleration: Floats | None
    impacts: Floats
    stops: tuple[float, ...]
    shown: float
    step: float
    physical: bool
    engine: str
    diagnostics: tuple[Diagnostic, ...] = ()
    probes: dict[str, Floats] = field(default_factory=dict)
    probe_units: dict[str, str] = field(default_factory=dict)
    hides_noise: bool = False

    @property
    def duration(self) -> float:
        """How long it is."""
        return float(self.time[-1])

    @property
    def number_of_impacts(self) -> int | None:
        """How many impacts it has; None without a stop or a ball."""
        return len(self.impacts) if self.stops or len(self.impacts) else None

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The trajectory as a matplotlib figure."""
        return drawing.draw(self, title, ax)

    @property
    def table(self) -> Table:
        """Time, displacement, velocity, voltage, the base's acceleration and the probes."""
        units = self.unit_names
        columns = [
            Column("time", self.time, units.time, "time"),
            Column("displacement", self.displacement, units.length),
        ]
        columns += [
            Column("velocity", self.velocity, units.speed),
            Column("voltage", self.voltage, units.voltage),
        ]
        if self.acceleration is not None:
            columns.append(Column("base_acceleration", self.acceleration, units.acceleration))
        columns += [
            Column(name, values, self.probe_units[name]) for name, values in self.probes.items()
        ]
        return Table(tuple(columns), index=("time",))

    @property
    def ranges(self) -> Table:
        """The ends between which each of its quantities varies."""
        ends = [
            Column(c.name, [min(c.cells), max(c.cells)], c.unit) for c in self.table.columns[1:]
        ]
        return Table(
            (Column("end", ["least", "largest"]), *ends), "On this path, from its beginning"
        )


@names_arguments
def motion(
    scene: AnyScene,
    engine: str = "ensemble",
    duration: float | str | None = None,
    seed: int = 0,
    from_rest: bool = False,
    probe: Sequence[str] = (),
    expected: Expected | None = None,
    execution: Execution = DEFAULT,
) -> Motion:
    """Compute one trajectory from rest, of which a plot shows the last part.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    engine : str, default "ensemble"
        "ensemble"; or "spice" or "compiled", which have the circuit.
    duration : float or str, optional
        of the part that is shown, in seconds or as a text such as "2 s" (nondimensional scene: a
        number in 1/w0); four times as long precedes it, in which the response settles.
    seed : int, default 0
        the same seed, the same noise.
    from_rest : bool, default False
        show the beginning, and compute nothing before it.
    probe : list of str, optional
        further quantities of the circuit, such as "store" or "v(a,b)", for the engines
        with a circuit.
    expected : callable, optional
        is called with the seconds for a long trajectory by ngspice, measured on a short one.
    execution : Execution, optional
        has the folder for motion.csv, motion.npz, motion.png and provenance.json; ``out`` and
        ``formats`` alone.

    Returns
    -------
    Motion
        arrays over time, in SI units (nondimensional scene: without units).

    Raises
    ------
    InputError
        for an engine without paths, an invalid duration or too long, a folder that cannot be
        written, and the options that `Execution` has for other studies.
    CannotServeError
        for a netlist with engine "ensemble", and an effect that the engine lacks.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, restitution=0.9, D11=0.01))
    >>> path = hv.motion(scene, duration=50.0, seed=1)
    >>> bool(path.displacement.min() >= 0.0), path.shown  # the stop is at x = 0
    (True, 50.0)
    """
    execution.only("motion", "out", "formats")
    folder = OutputFolder.of(execution)
    if engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    problem = served(ENGINES[engine], scene)
    span = number(Ensemble(duration=duration).duration) if isinstance(duration, str) else duration
    check_time("duration", span, problem.physical)
    h = _step(problem)
    unit = problem.units.frequency
    shown = 2.0 * math.pi * PERIODS if span is None else span * unit
    parts = 1 if from_rest else 1 + LEAD
    if not h < shown < MOST_STEPS * h / parts:
        raise invalid(
            "`duration`", f"be between {h / unit:.3g} and {MOST_STEPS * h / unit / parts:.3g}", span
        )
    probes = _probes([probe] if isinstance(probe, str) else probe, problem, engine)

    def computed(h: float, shunt: float) -> tuple[Any, Floats, int]:
        return _computed(
            problem, engine, parts * shown, seed, probes=probes, expected=expected, h=h, shunt=shunt
        )

    (path, probe_values, stride), h, notes = at_smaller_steps(problem, h, computed)
    a = None if path.shaking is None else path.shaking[stride::stride][: len(path.t)]
    s = problem.units
    speed = problem.units.length * unit
    # the mass feels the opposite
    base = a if a is None or not problem.physical else -a * speed * unit
    result = Motion(
        time=path.t / unit,
        displacement=path.x * s.length,
        velocity=path.v * speed,
        voltage=path.V * s.volts,
        acceleration=base,
        impacts=path.impacts * [1.0 / unit, speed],
        stops=tuple(stop * s.length for stop in _stops(problem.equations)),
        shown=shown / unit,
        step=h / unit,
        physical=problem.physical,
        engine=engine,
        diagnostics=(
            *problem.value_warnings,
            *notes,
            *_not_drawn(problem.equations),
            note("one_path"),
        ),
        probes={
            p.name: values / problem.in_circuit(p.unit)
            for p, values in zip(probes, probe_values, strict=True)
        },
        probe_units={p.name: p.unit if problem.physical else "" for p in probes},
        hides_noise=base is not None and problem.equations.n1 is not None,
    )
    _write(
        result,
        problem,
        folder,
        {"engine": engine, "seed": seed, "from_rest": from_rest, "probe": list(probe)},
    )
    return result


def _write(
    result: Motion, problem: Problem, folder: OutputFolder | None, options: dict[str, Any]
) -> None:
    """Write the files of a trajectory with its ``options`` in their provenance.

    None without a folder.
    """
    if folder is None:
        return
    about = provenance(problem, **options, duration=result.shown, step=result.step)
    folder.packed("motion", result.table.npz())
    folder.save("motion", result.table.csv(), result.plot(problem.scene.name), about)


def _computed(
    problem: Problem,
    engine: str,
    duration: float,
    seed: int,
    probes: tuple[Probe, ...],
    expected: Expected | None,
    h: float,
    shunt: float = 0.0,
) -> tuple[Any, Floats, int]:
    """The trajectory of so long a nondimensional duration at a step h, its probes, and the steps between readings."""
    from harvester.mechanics.kernels.forcing import forcing
    from harvester.mechanics.kernels.noise import gaussian_grid
    from harvester.mechanics.trace import at_rest, trace

    sequence = np.random.SeedSequence([seed, 7])
    noise = gaussian_grid(sequence, math.ceil(duration / h))
    shaking = forcing(problem.equations, h, len(noise), np.random.default_rng(sequence.spawn(1)[0]))
    stride = max(1, min(round(0.05 / h), math.ceil(duration / h) // 2))  # also for a short one
    if ENGINES[engine].runs_ngspice:
        return *path_in_ngspice(
            problem,
            noise,
            h=h,
            stride=stride,
            shaking=shaking,
            probes=probes,
            expected=expected,
            shunt=shunt,
        ), stride
    if ENGINES[engine].needs_netlist:
        from harvester.circuits.compiled_circuit import compiled_circuit
        from harvester.circuits.probed_path import probed

        circuit = compiled_circuit(problem.load_circuit, problem.scales)
        start = at_rest(problem.equations)[:-1]
        path = circuit.trace(
            problem.equations, noise, h, stride, start, shaking=shaking, keep=bool(probes)
        )
        return path, probed(circuit, path, probes), stride
    plain = trace(problem.equations, noise, h, stride, shaking=shaking)
    return plain, np.empty((0, 0)), stride


def _stops(eqs: Equations) -> tuple[float, ...]:
    """The places of the stops that the displacement alone meets."""
    if not eqs.modal.meets_stops:
        return ()
    return tuple(stop for stop in eqs.stops if math.isfinite(stop))


def _not_drawn(eqs: Equations) -> Iterator[Diagnostic]:
    """A note if the mass has stops, but the displacement alone does not meet them."""
    if eqs.has_stop and not _stops(eqs):
        yield note("ball_not_drawn" if eqs.has_ball else "stop_not_drawn")


def _probes(texts: Sequence[str], problem: Problem, engine: str) -> tuple[Probe, ...]:
    """The probes that texts name."""
    if not texts:
        return ()
    if not ENGINES[engine].takes_netlists or problem.circuit is None:
        raise InputError(
            f"`probe` must be used with engine 'spice', which has the circuit, but the engine is {engine!r}"
        )
    return read_probes(texts, problem.circuit)


def _step(problem: Problem) -> float:
    from harvester.equations.bounds import check_bounded
    from harvester.mechanics.kernels.step_size import step_from_rest

    check_bounded(problem.equations, driven=not problem.load.is_in_equations)
    return step_from_rest(problem.equations, 0.5)
