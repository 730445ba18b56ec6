"""A user's model and an ngspice circuit that act on each other inside the step, and the answer.

Long because the function and its answer explain their arguments and arrays to users.
"""

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from harvester.answers.open_balance import open_balance
from harvester.arrays import Floats
from harvester.cosimulation.mean_over_paths import MOST_REFINED, MeanOverPaths
from harvester.cosimulation.model_protocol import can_be_compiled, check_model
from harvester.cosimulation.model_runs import ModelJob, ModelRun, packed, run_model
from harvester.cosimulation.ngspice.locate_libngspice import find_library
from harvester.cosimulation.ports import Coil, Piezo, Port
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.errors import InputError, UnknownArgumentError, invalid, unknown
from harvester.machine.automatic import reporting
from harvester.machine.progress import ProgressCallback
from harvester.netlists.load_circuit import LoadCircuit, load_circuit
from harvester.netlists.probes import read_probes
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.presentation.glossary import LEDGER
from harvester.presentation.messages.unknown_parts import STEP_AND_TOLERANCE
from harvester.presentation.result import TableResult
from harvester.presentation.table import Column, Table
from harvester.quantities.units import fraction, time
from harvester.scene.load import Load
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_STEPS, MOST_READINGS = 100_000_000, 5_000_000
COLUMNS = ("time", "voltage", "current", "load_power")  # columns of every answer


class Cosimulation(TableResult):
    """One trajectory of a user's model, and of its circuit: arrays of shape (n,), one entry for each reading.

    Attributes
    ----------
    time : ndarray
        s.
    state : dict
        the numbers of the model's state by name, shape (n,), in the middle of the kick at that
        time.
    voltage, current, load_power : ndarray
        at the circuit's terminals, out of the port, and of Rload: shape (n,) (V, A, W).
    probes, probe_units : dict
        further quantities of the circuit by name, shape (n,), and their units.
    events : ndarray
        the times of the model's events, shape (m,) (s).
    mean_power : Value
        of Rload, over the whole trajectory (W); with ``within`` over several trajectories, with its
        total error.
    ledger : dict
        mean powers (W) over the whole trajectory: ``ledger_input`` is the work of the model against
        the port's reaction, ``ledger_load`` flows into Rload, ``ledger_circuit`` is lost in the
        rest of the circuit, and ``ledger_stored`` is the growth of the energy in Cp and Csmooth.
    ledger_residual : float
        the part of the largest of them that does not add up: a check, which shrinks as the square
        of the step.
    step : float
        the model's step (s).
    steps : int
        those that ngspice accepted.
    seconds, compilation_seconds : float
        of the run, and of compiling the model.
    compiled : bool
        whether the model was compiled, rather than run in plain Python.
    physical : bool
        whether its numbers are in SI units: always.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> sorted(hv.Cosimulation.DERIVED)
    ['duration', 'number_of_events', 'ranges']
    """

    DERIVED = ("duration", "number_of_events", "ranges")
    NOT_SHOWN = frozenset(
        {
            "time",
            "state",
            "voltage",
            "current",
            "load_power",
            "probes",
            "probe_units",
            "events",
            "compilation_seconds",
        }
    )
    NOT_IN_JSON = frozenset({"ranges"})
    SHORT = ("duration", "step", "mean_power", "ledger_residual", "number_of_events")

    time: Floats
    state: dict[str, Floats]
    voltage: Floats
    current: Floats
    load_power: Floats
    events: Floats
    mean_power: Value
    ledger: dict[str, float]
    ledger_residual: float
    step: float
    steps: int
    seconds: float
    compilation_seconds: float
    compiled: bool
    probes: dict[str, Floats] = field(default_factory=dict)
    probe_units: dict[str, str] = field(default_factory=dict)
    physical: bool = True
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def duration(self) -> float:
        """How long it is (s)."""
        return float(self.time[-1])

    @property
    def number_of_events(self) -> int:
        """How many events it has."""
        return len(self.events)

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """The trajectory as a matplotlib figure."""
        return drawing.draw(self, title, ax)

    @property
    def table(self) -> Table:
        """Time, the model's state, voltage, current, the load's power, and the probes."""
        columns = [
            Column("time", self.time, "s", "time"),
            *(Column(name, cells) for name, cells in self.state.items()),
        ]
        columns += [Column("voltage", self.voltage, "V"), Column("current", self.current, "A")]
        columns += [Column("load_power", self.load_power, "W")]
        columns += [
            Column(name, values, self.probe_units[name]) for name, values in self.probes.items()
        ]
        return Table(tuple(columns), index=("time",))

    @property
    def ranges(self) -> Table:
        """The ends between which each of its quantities varies."""
        columns = self.table.columns[1:]
        ends = [
            Column(column.name, [min(column.cells), max(column.cells)], column.unit)
            for column in columns
        ]
        return Table((Column("end", ["least", "largest"]), *ends), "On this path")


class PathOptions(TypedDict, total=False):
    """The options of `cosimulate`, by keyword."""

    seed: int
    probe: Sequence[str]
    every: int
    tolerance: float
    volts: float
    compiled: bool | None
    within: float | str | None
    progress: ProgressCallback | bool | None


@dataclass(frozen=True, kw_only=True)
class ChosenOptions:
    """The values of `PathOptions`, with the defaults of those that are not given."""

    seed: int = 0
    probe: Sequence[str] = ()
    every: int = 1
    tolerance: float = 1e-4
    volts: float = 1.0
    compiled: bool | None = None
    within: float | str | None = None
    progress: ProgressCallback | bool | None = None


def cosimulate(
    model: Any,
    circuit: Load | str,
    port: Port,
    start: Any,
    duration: float | str,
    step: float | str,
    **options: Unpack[PathOptions],
) -> Cosimulation:
    """Run a model of the user's own and an ngspice circuit in lock-step: each acts on the other inside the step.

    Parameters
    ----------
    model : object
        an object with the functions drift, kick and source (``Model`` of harvester.cosimulation
        states their names), and event and jump if there are events; a NamedTuple of numbers is
        compiled.
    circuit : Load or str
        the load on the port: a name of the package's netlists such as "bridge", the path of a file,
        the text of a netlist, or a `harvester.Load` with values of its parameters.
    port : Piezo or Coil
        a `harvester.Piezo` (coupling and capacitance) or a `harvester.Coil`.
    start : object
        the model's state at time 0, a NamedTuple of numbers; the circuit begins without voltages
        and currents.
    duration, step : float or str
        in seconds, or as texts such as "2 s" and "1 ms".
    options
        By keyword; listed below.

    Other Parameters
    ----------------
    seed : int, default 0
        of the noise: the same seed, the same trajectory at the same step and ``within``.
    probe : list of str, optional
        further quantities of the circuit, such as "store", "v(a,b)" or "p(d1)".
    every : int, default 1
        how many steps a reading comes.
    tolerance : float, default 0.0001
        ngspice's relative tolerance of its own steps between those of the model.
    volts : float, default 1.0
        the size of the voltages, to which its absolute tolerances are relative: 1e-3 if they are of
        some millivolts.
    compiled : bool, optional
        True: numba compiles the model; False: it runs in plain Python; None: compiled if it is a
        NamedTuple of numbers.
    within : float or str, optional
        Target relative error (95 %) of the mean power, 0.01 or "1%". ``step`` and ``tolerance`` are
        made smaller on the same noise, and the mean is over trajectories with further noise, until
        its total error is within it. The arrays are those of one trajectory.
    progress : function or bool, optional
        Called with the fraction of the trajectories so far known to be needed that are done; it
        falls if more are needed. False: no progress is shown; default: a bar on a terminal.

    Returns
    -------
    Cosimulation
        arrays over time, in SI units, and the energy balance.

    Raises
    ------
    InputError
        for a model without one of its functions, or one that returns a wrong value; a start that
        is not a NamedTuple of numbers; and a netlist that cannot be used.
    SimulationError
        if ngspice does not come to the end.
    MissingProgramError
        without ngspice.

    Examples
    --------
    >>> from typing import NamedTuple
    >>> from harvester.cosimulation import cosimulate, Coil
    >>> class State(NamedTuple):
    ...     x: float
    ...     v: float
    >>> class Oscillator(NamedTuple):
    ...     m: float
    ...     k: float
    ...     def drift(self, s, h):
    ...         return State(s.x + h * s.v, s.v)
    ...     def kick(self, s, h, reaction, noise):
    ...         return State(s.x, s.v - h * (self.k * s.x + reaction) / self.m)
    >>> cosimulate(Oscillator(0.02, 300.0), "bridge", Coil(coupling=10.0), State(1e-3, 0.0), "1 s", "1 ms")
    Traceback (most recent call last):
    harvester.errors.InputError: `model` must have the functions drift, kick, source, but 'Oscillator' has no source
    """
    given = _read_options(options)
    span, h = time_above_0("duration", duration), time_above_0("step", step)
    within = None if given.within is None else _share("within", given.within)
    steps = max(math.ceil(span / h * (1.0 - 1e-9)), 1)
    _check_options(span, steps, given)
    check_port(port)
    check_model(model, start, h)
    for name in start._fields:
        if name in COLUMNS:
            raise invalid(
                "`start`",
                f"have no number of the name {', '.join(COLUMNS)}, which are columns",
                name,
            )
    if given.compiled and not can_be_compiled(model):
        raise invalid("`model`", "be a NamedTuple of numbers for `compiled`=True", model)
    load = circuit_of_port(circuit, port)
    texts = [given.probe] if isinstance(given.probe, str) else list(given.probe)
    probes = read_probes(texts, load)
    find_library()
    whole = can_be_compiled(model) if given.compiled is None else given.compiled
    job = ModelJob(
        model=model,
        start=start,
        load=load,
        port=port,
        h=h,
        steps=steps,
        stride=given.every,
        seed=given.seed,
        tolerances=(given.tolerance, given.volts),
        probes=probes,
        compiled=whole,
    )
    try:
        with reporting(given.progress, "cosimulate") as report:
            job, run, power, about_error = _run(job, within, report)
    except Exception as error:  # without the worker's own traceback: a note has the model's line
        raise error.with_traceback(None) from None
    state = {name: run.samples[:, k] for k, name in enumerate(start._fields)}
    remark = open_balance(Value(run.ledger.residual))
    ledger = {
        LEDGER + name: getattr(run.ledger, name) for name in ("input", "circuit", "load", "stored")
    }
    return Cosimulation(
        time=job.h * job.stride * np.arange(len(run.samples), dtype=np.float64),
        state=state,
        voltage=run.samples[:, -3],
        current=run.samples[:, -2],
        load_power=run.samples[:, -1],
        events=run.events,
        mean_power=power,
        ledger=ledger,
        ledger_residual=run.ledger.residual,
        step=job.h,
        steps=run.steps,
        seconds=run.seconds,
        compilation_seconds=run.compilation,
        compiled=whole,
        probes={probe.name: values for probe, values in zip(probes, run.probed, strict=True)},
        probe_units={probe.name: probe.unit for probe in probes},
        diagnostics=tuple(said for said in (remark, about_error) if said is not None),
    )


def _run(
    job: ModelJob, within: float | None, report: ProgressCallback | None
) -> tuple[ModelJob, ModelRun, Value, Diagnostic | None]:
    """The job at its last step, its path, the mean power (W), and a remark on its error."""
    if within is None:
        run = next(map_in_workers(run_model, [(packed(job),)]))
        if report is not None:
            report(1.0)
        return job, run, Value(run.ledger.load, unknown=STEP_AND_TOLERANCE), note("model_path")
    paths = MeanOverPaths(job, report=report)
    power, reached = paths.to(within)
    assert paths.first is not None, "the first path has the seed of the job"
    error = power.known_error95 / abs(power.value) if power.value else None
    missed = None if reached else warning("paths_missed", within=within, error=error)
    return paths.finest(), paths.first, power, missed


def _read_options(options: PathOptions) -> ChosenOptions:
    """The options with their defaults; InputError for an unknown one, with the nearest match."""
    for name in options:
        if name not in PathOptions.__annotations__:
            known = ["model", "circuit", "port", "start", "duration", "step"]
            known += PathOptions.__annotations__
            raise unknown("argument of cosimulate", name, known, UnknownArgumentError)
    return ChosenOptions(**options)


def _share(name: str, value: float | str) -> float:
    """A relative error between 0 and 1."""
    try:
        share = fraction(value if isinstance(value, str) else repr(float(value)))
    except (TypeError, ValueError):
        share = math.nan
    if not 0.0 < share < 1.0:
        raise invalid(f"`{name}`", "be a relative error between 0 and 1, such as 0.01", value)
    return share


def time_above_0(name: str, value: float | str) -> float:
    """A time above 0 in seconds."""
    try:
        return float(time(value if isinstance(value, str) else repr(float(value))))
    except (TypeError, ValueError):
        raise invalid(f"`{name}`", "be a time above 0, such as 0.001 or '1 ms'", value) from None


def _check_options(span: float, steps: int, given: ChosenOptions) -> None:
    """Refuse values that are not numbers, or out of range."""
    _check_integer("every", given.every, 1, steps)
    _check_integer("seed", given.seed, 0, 2**63)
    if steps > MOST_STEPS or steps // given.every > MOST_READINGS:
        must = (
            f"have at most {MOST_STEPS} steps of `step`, and {MOST_READINGS} readings (see `every`)"
        )
        raise invalid("`duration`", must, span)
    if given.within is not None and 2 * steps > MOST_REFINED:
        must = f"have at most {MOST_REFINED // 2} steps of `step` with `within`, which halves them"
        raise invalid("`duration`", must, span)
    if not 1e-9 <= given.tolerance <= 1e-2:
        raise invalid("`tolerance`", "be between 1e-9 and 1e-2", given.tolerance)
    if not 1e-9 <= given.volts <= 1e9:
        raise invalid("`volts`", "be between 1e-9 and 1e9", given.volts)


def check_port(port: Any) -> None:
    """Refuse anything but a port."""
    if not isinstance(port, Piezo | Coil):
        raise invalid("`port`", "be a Piezo or a Coil", port)
    if isinstance(port, Piezo) and port.coupling is None:
        raise InputError(
            "piezo.coupling must be given for a `port`, but only open_circuit_frequency is"
        )


def _check_integer(name: str, value: int, least: int, most: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise invalid(f"`{name}`", f"be a whole number from {least} to {most}", value)


def circuit_of_port(circuit: Load | str, port: Port) -> LoadCircuit:
    """The load circuit of a table, a name, a path or a text."""
    capacitance = None if isinstance(port, Coil) else port.capacitance
    if isinstance(circuit, Load):
        return load_circuit(circuit, capacitance)
    if not isinstance(circuit, str):
        raise invalid(
            "`circuit`", "be the name of a netlist, a path, the text of one, or a Load", circuit
        )
    if "\n" not in circuit.strip():
        return load_circuit(Load(netlist=circuit.strip()), capacitance)
    with tempfile.TemporaryDirectory(prefix="harvester-") as folder:
        path = Path(folder) / "circuit.cir"
        path.write_text(f".title of a text\n{circuit.strip()}\n", encoding="utf-8")
        return load_circuit(Load(netlist=str(path)), capacitance)
