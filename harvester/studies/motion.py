"""One path of a scene: displacement, velocity, voltage and any probe over time, to look at rather than to average.

By the exact update of a load resistor (`harvester.mechanics.kernels.path`), or by ngspice in lock-step.  A path has no
error of sampling, as it is no mean; that of its step is of second order (with noise: for the path of these kicks).
"""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path as File
from typing import Any

import numpy as np

from harvester import figures
from harvester.arrays import Floats
from harvester.engines import Ensemble, Spice
from harvester.engines.options import check_time
from harvester.engines.protocol import AnyScene, served
from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, names_arguments, unknown
from harvester.netlists.probes import Probe, read_probes
from harvester.presentation.answer_units import AnswerUnits
from harvester.scene.plausibility import unusual_values
from harvester.studies.motion_in_ngspice import Expected, path_in_ngspice
from harvester.studies.output_folder import OutputFolder, csv_text, named, provenance
from harvester.studies.smaller_step import at_smaller_steps

PERIODS, LEAD = 40, 4  # what is shown by default, in 2 pi/w0, and how many times that goes before it
ENGINES = {engine.NAME: engine for engine in (Ensemble, Spice)}
MOST_STEPS = 5_000_000


@names_arguments
@dataclass(frozen=True)
class Motion:
    """One path of a scene, in its units: arrays of shape (n,), one entry for each reading.

    ``text()`` is the CSV file, ``packed()`` the NPZ file.  ``shown`` is the length of its last part, which a plot
    shows; ``probes`` are further quantities of the circuit by name, ``probe_units`` their units;
    ``hides_noise`` says that white noise goes beside the ``acceleration``, which leaves it out;
    ``impacts`` has a row (time, speed) each, negative at the opposite stop; ``acceleration`` of the base is None under
    white noise alone.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> path = hv.motion(scene, duration=50.0)
    >>> path.t.shape == path.voltage.shape, len(path.impacts)
    (True, 0)
    """

    t: Floats
    x: Floats
    v: Floats
    voltage: Floats
    acceleration: Floats | None
    impacts: Floats
    stops: tuple[float, ...]
    shown: float
    step: float
    physical: bool
    engine: str
    warnings: tuple[str, ...] = ()
    probes: dict[str, Floats] = field(default_factory=dict)
    probe_units: dict[str, str] = field(default_factory=dict)
    note: str = ""
    hides_noise: bool = False

    @property
    def unit_names(self) -> AnswerUnits:
        """The units of its numbers."""
        return AnswerUnits.of(self.physical)

    def plot(self, title: str | None = "") -> "figures.Plot":
        """The path as a matplotlib figure."""
        return figures.motion(self, title)

    def columns(self) -> dict[str, tuple[str, Floats]]:
        """Every column of the files by name: its unit, and its values of shape (n,)."""
        of = self.unit_names
        found = {"time": (of.time, self.t), "displacement": (of.length, self.x), "velocity": (of.speed, self.v)}
        found["voltage"] = of.voltage, self.voltage
        if self.acceleration is not None:
            found["base_acceleration"] = of.acceleration, self.acceleration
        return found | {name: (self.probe_units[name], values) for name, values in self.probes.items()}

    def text(self) -> str:
        """The CSV file."""
        columns = self.columns()
        heads = [named(name, unit) for name, (unit, _) in columns.items()]
        return csv_text(heads, zip(*(values for _, values in columns.values()), strict=True))

    def packed(self) -> bytes:
        """The NPZ file (numpy.load): an array for each column, and ``units``, names and units of shape (columns, 2)."""
        columns = self.columns()
        units = np.array([[name, unit] for name, (unit, _) in columns.items()])
        out = io.BytesIO()
        arrays: dict[str, Any] = {name: values for name, (_, values) in columns.items()}
        np.savez_compressed(out, units=units, **arrays)
        return out.getvalue()

    def __str__(self) -> str:
        unit = f" {self.unit_names.time}".rstrip()
        lines = [f"one path by {self.engine}: {self.t[-1]:.4g}{unit}, step {self.step:.4g}{unit}"]
        if self.stops:
            lines.append(f"impacts: {len(self.impacts)}")
        if self.note:
            lines.append(f"note: {self.note}")
        lines.append("note: one path is no mean: for the power and its error, harvester run")
        return "\n".join([*lines, *(f"warning: {word}" for word in self.warnings)])


@names_arguments
def motion(
    scene: AnyScene,
    engine: str = "ensemble",
    duration: float | None = None,
    seed: int = 0,
    from_rest: bool = False,
    probe: Sequence[str] = (),
    expected: Expected | None = None,
) -> Motion:
    """Compute one path from rest; a plot shows its last ``duration``, in seconds (nondimensional scene: 1/w0).

    Four times as long goes before that, in which the response settles; ``from_rest`` leaves it out, and shows the
    beginning.  ``probe`` names further quantities of the circuit, such as "store" or "v(a,b)"
    (`harvester.netlists.probes`), for engine `spice`.  ``expected`` is called with the seconds that a long path by
    ngspice will take, measured on a short one.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, restitution=0.9, D11=0.01))
    >>> path = hv.motion(scene, duration=50.0, seed=1)
    >>> bool(path.x.min() >= 0.0), path.shown  # the stop is at x = 0
    (True, 50.0)

    Raises
    ------
    InputError
        for an engine without paths, and a duration that is none or too long.
    CannotServeError
        for a netlist without engine `spice`, and what that does not know.
    """
    from harvester.mechanics.kernels.noise import gaussian_grid
    from harvester.mechanics.kernels.path import trace
    from harvester.mechanics.kernels.shaking import forcing

    if engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    problem = served(ENGINES[engine], scene)
    check_time("duration", duration, problem.physical)
    eqs, s = problem.equations, problem.units
    unit = s.frequency
    shown = 2.0 * math.pi * PERIODS if duration is None else duration * unit
    h = _step(problem)
    lead = 0 if from_rest else LEAD
    if not h < shown < MOST_STEPS * h / (1 + lead):
        raise invalid("`duration`", f"be between {h / unit:.3g} and {MOST_STEPS * h / unit / (1 + lead):.3g}", duration)
    probes = _probes([probe] if isinstance(probe, str) else probe, problem, engine)

    def at_step(h: float) -> tuple[Any, Floats, int]:
        sequence = np.random.SeedSequence([seed, 7])
        noise = gaussian_grid(sequence, math.ceil((1 + lead) * shown / h))
        shaking = forcing(eqs, h, len(noise), np.random.default_rng(sequence.spawn(1)[0]))
        stride = max(1, round(0.05 / h))
        if engine == "ensemble":
            return trace(eqs, noise, h, stride, shaking=shaking), np.empty((0, 0)), stride
        return *path_in_ngspice(problem, noise, h, stride, shaking, probes, expected), stride

    (path, seen, stride), h, note = at_smaller_steps(problem, h, at_step)
    a = None if path.shaking is None else path.shaking[stride::stride][: len(path.t)]
    low, high = eqs.gap or 0.0, eqs.opposite_gap
    has_stop = eqs.restitution is not None or eqs.stop_stiffness is not None
    stops = ((-low,) if has_stop else ()) + ((high,) if high is not None else ())
    speed = s.length * s.frequency
    base = a if a is None or not problem.physical else -a * speed * s.frequency  # the mass feels the opposite
    return Motion(
        path.t / unit,
        path.x * s.length,
        path.v * speed,
        path.V * s.volts,
        base,
        path.impacts * [1.0 / unit, speed],
        tuple(stop * s.length for stop in stops),
        shown / unit,
        h / unit,
        problem.physical,
        engine,
        tuple(unusual_values(problem.scene)),
        {one.name: values / problem.in_circuit(one.unit) for one, values in zip(probes, seen, strict=True)},
        {one.name: one.unit if problem.physical else "" for one in probes},
        note,
        hides_noise=base is not None and eqs.n1 is not None,
    )


def _probes(texts: Sequence[str], problem: Problem, engine: str) -> tuple[Probe, ...]:
    """The probes that texts name."""
    if not texts:
        return ()
    if engine != Spice.NAME or problem.circuit is None:
        raise InputError(f"`probe` must go with engine 'spice', which has the circuit, but the engine is {engine!r}")
    return read_probes(texts, problem.circuit)


def _step(problem: Problem) -> float:
    from harvester.equations.bounds import check_bounded
    from harvester.mechanics.kernels.step_size import step_from_rest

    check_bounded(problem.equations, driven=problem.netlist is not None)
    return step_from_rest(problem.equations, 0.5)


def draw(
    scene: AnyScene,
    out: str | File,
    engine: str = "ensemble",
    duration: float | None = None,
    seed: int = 0,
    vector: Sequence[str] = (),
    from_rest: bool = False,
    probe: Sequence[str] = (),
    expected: Expected | None = None,
) -> Motion:
    """Compute a `motion`, and write its files.

    These are motion.csv, motion.npz, motion.png, its ``vector`` forms (svg, pdf) and provenance.json.
    """
    folder = OutputFolder(out, vector)
    problem = Problem.of(scene)
    found = motion(problem, engine, duration, seed, from_rest, probe, expected)
    asked = {"engine": engine, "seed": seed, "from_rest": from_rest, "probe": list(probe)}
    about = provenance(problem, **asked, duration=found.shown, step=found.step)
    folder.packed("motion", found.packed())
    folder.save("motion", found.text(), figures.motion(found, problem.scene.title), about)
    return found
