"""The power of a real device: devices from the priors, model error, next measurement.

The power of a device is P = F(parameters) exp(m), with the parameters from the priors of
`priors.toml`, F by an engine (`harvester.tolerance`), and a normal m for the model error.  ln F
is a polynomial in the logarithms of the parameters, through the devices that the engine computed;
thus a measurement of one parameter, which leaves it a smaller spread, needs no further device.

Long because the devices, their likelihood and the widths that follow are of one design.
"""

import math
import time
from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named, default_engine
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.linear.single_points import DataSheetPoint
from harvester.machine.automatic import called
from harvester.machine.execution import DEFAULT, Execution
from harvester.presentation.diagnostic import Diagnostic, note
from harvester.scene.scene import Scene
from harvester.studies.prediction.evidence import effective_number, evidence, read_points
from harvester.studies.prediction.prediction_result import Prediction, RealDevice, UncertainQuantity
from harvester.studies.prediction.priors import (
    DEFAULT_CLASS,
    Prior,
    in_modal_keys,
    model_error,
    prior_of,
    priors_of,
)
from harvester.studies.tolerance.design import sobol_points
from harvester.studies.tolerance.surface import fit
from harvester.studies.tolerance.tolerance import tolerance
from harvester.studies.tolerance.tolerance_result import MISSES, ToleranceResult
from harvester.uncertainty.value import Value

LINEAR_KEYS = (
    "oscillator.mass",
    "oscillator.stiffness",
    "oscillator.damping",
    "piezo.coupling",
    "piezo.capacitance",
)
SAMPLES = 512
DRAWS = 8192
DRAWS_WITH_POINTS = 65_536  # as only a part of them counts
FEWEST = 200.0  # devices in effect, from which a width is stated: five beyond either end
ENDS = (0.025, 0.5, 0.975)
EXACT = 0.03  # how well a restitution coefficient is measured


@names_arguments
def predict(
    scene: AnyScene,
    *,
    prior: str = DEFAULT_CLASS,
    known: Mapping[str, str] | None = None,
    engine: Named | None = None,
    samples: int = SAMPLES,
    runs: int | str | None = None,
    seed: int = 0,
    points: Mapping[str, str] | None = None,
    computed: Value | None = None,
    execution: Execution = DEFAULT,
) -> Prediction:
    """Power and voltage of a real device, 95 % intervals, and the best next measurement.

    The error of the computation and the spread of a real device are two numbers: ``computed`` has
    the former for the scene as it is written, ``power`` and ``voltage`` the latter.

    Parameters
    ----------
    scene : Scene or path
        a `Scene` with units, or the path of a scene file.
    prior : str, default "bulk"
        the class of the device: "bulk", "composite", "film" or "polymer".
    known : mapping, optional
        the origin of the number of frequency, damping, coupling, capacitance, gap or restitution,
        such as ``{"damping": "measured"}``: "unknown", "datasheet", "geometry", "measured_low",
        "measured" or "given", of the frequency also "tuned".
    engine : Engine or str, optional
        an engine or its name for the devices, by default that of `tolerance`.
    samples, runs : int or str, optional
        the number of devices behind the polynomials, and the number of them that the engine
        computes, or for a netlist the time of all, such as "30s", as of `tolerance`.
    seed : int, default 0
        the same seed, the same devices.
    points : mapping, optional
        single points of the device's datasheet, such as ``{"open_circuit_voltage": "21 V at 0.25
        g", "power_at_load": "1.2 mW at 15 kohm and 0.25 g", "open_circuit_frequency": "62 Hz"}``:
        devices of the priors count by their likelihood.
    computed : Value, optional
        the mean power of the scene as it is written, if it is known already.
    execution : Execution, optional
        the workers, and the folder.

    Returns
    -------
    Prediction
        power and voltage, each with its median and 95 % limits, the priors, and the interval
        after each measurement.

    Raises
    ------
    InputError
        for a nondimensional scene, a class, a quantity, an origin or a point that does not exist,
        if nothing scatters, and for points that hardly any device of the priors has.
    HarvesterError
        if the engine fails at every device.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.load("examples/plate_harmonic.toml")
    >>> result = hv.predict(scene, known={"damping": "measured", "frequency": "tuned"}, samples=256)
    >>> result.next_measurement
    'coupling'
    """
    begin = time.perf_counter()
    problem = Problem.of(scene)
    spread_scene = in_modal_keys(problem.scene)
    priors = priors_of(spread_scene, prior, known or {})
    read = read_points(points or {})
    if not priors:
        raise InputError("`known` must leave a quantity with a spread, but gives all of them")
    if computed is None:
        computed = _computed(problem, engine, seed)
    is_time = isinstance(runs, str) and runs != "first-order" and not runs.strip().isdigit()
    effort: dict[str, Any] = {"budget": runs} if is_time else {"runs": runs}
    with called("predict"):
        spread = tolerance(
            spread_scene,
            vary={entry.key: entry.written for entry in priors},
            engine=engine,
            samples=samples,
            checks=0 if engine is not None and not isinstance(runs, str) else None,
            seed=seed,
            execution=execution,
            **effort,
        )
    devices = Devices(priors, spread, problem, seed, read)
    power, voltage = devices.intervals()
    quantities = [_quantity(entry, devices, prior) for entry in priors]
    return Prediction(
        engine=spread.engine,
        prior=prior,
        computed=computed,
        power=power,
        voltage=voltage,
        quantities=tuple(sorted(quantities, key=lambda entry: entry.width_after or math.inf)),
        impedance_curve=_after_impedance(devices, prior),
        model_sigma=devices.model.sigma,
        model_factor=devices.model.factor,
        samples=len(spread.power),
        physical=True,
        seconds=time.perf_counter() - begin,
        diagnostics=_remarks(devices, problem, spread),
    )


def _computed(problem: Problem, engine: Named | None, seed: int) -> Value:
    """The mean power of the scene as it is written."""
    if engine is None:
        engine = engine_of(default_engine(problem), seed=seed)
    return engine_of(engine).run(problem).mean_power


class Devices:
    """Many devices, by polynomials for the logarithms of power and voltage.

    The variables are the standardised logarithms of the keys, and a uniform key from -1 to 1.  The
    standard deviation of their leave-one-out errors is added as noise.
    """

    def __init__(
        self,
        priors: Sequence[Prior],
        spread: ToleranceResult,
        problem: Problem,
        seed: int,
        points: Mapping[str, DataSheetPoint | float] = MappingProxyType({}),
    ):
        self.priors = priors
        self.model = model_error(problem)
        scene = in_modal_keys(problem.scene)
        self.middles = [_value(scene, entry.key) for entry in priors]
        served = spread.power > 0.0
        self.without_power = 1.0 - float(served.mean())
        x = np.stack(
            [
                _standardised(entry, middle, spread.samples[served, k])
                for k, (entry, middle) in enumerate(zip(priors, self.middles, strict=True))
            ],
            axis=1,
        )
        self.power_law = fit(x, np.log(spread.power[served]))
        self.voltage_law = fit(x, np.log(spread.voltage[served]))
        keys = {key: np.full(len(x), _value(scene, key)) for key in LINEAR_KEYS}
        keys |= {entry.key: spread.samples[served, k] for k, entry in enumerate(priors)}
        self.evidence = evidence(points, keys, x) if points else None
        # Three more columns: the model error, and the noise of either polynomial.
        draws = DRAWS_WITH_POINTS if points else DRAWS
        self.u = sobol_points(draws, len(priors) + 3, seed)

    def intervals(self, measured: Sequence[Prior] = ()) -> tuple[RealDevice, RealDevice]:
        """Power and voltage, with the spreads that quantities have after they were ``measured``."""
        # With points a measurement is one more of them.
        power, voltage, model = (
            self.logarithms(measured) if self.evidence is None else self._logarithms
        )
        weights = self.weights(measured)
        return (
            interval(np.exp(power + model), self.without_power, "W", weights),
            interval(np.exp(voltage + 0.5 * model), self.without_power, "V", weights),
        )

    @cached_property
    def _drawn(self) -> tuple[Floats, Floats]:
        """The devices before a measurement."""
        return self.drawn()

    @cached_property
    def _logarithms(self) -> tuple[Floats, Floats, Floats]:
        """Their powers, voltages and model errors."""
        return self.logarithms()

    @cached_property
    def _weights(self) -> Floats | None:
        """Their likelihood; None without points."""
        return None if self.evidence is None else self.evidence.weights(self._drawn[0])

    def width_after(self, measured: Sequence[Prior]) -> float | None:
        """The ratio of the ends of the power's interval after measurements.

        None if too few devices are left.
        """
        weights = self.weights(measured)
        if weights is not None and effective_number(weights) < FEWEST:
            return None
        return self.intervals(measured)[0].ratio

    def weights(self, measured: Sequence[Prior] = ()) -> Floats | None:
        """The likelihood of the devices, shape (draws,); None without points.

        A quantity that was ``measured`` has its median after the points, within its new spread.
        """
        weights = self._weights
        if weights is None:
            return None
        x = self._drawn[0]
        for better in measured:
            for k, entry in enumerate(self.priors):
                if entry.quantity == better.quantity and entry.sigma and better.sigma:
                    logs = entry.sigma * x[:, k]
                    off = logs - np.average(logs, weights=weights)
                    weights = weights * np.exp(-0.5 * (off / better.sigma) ** 2)
        return weights

    def quantity(self, entry: Prior) -> tuple[float, float] | None:
        """Median factor and standard deviation of the logarithm of a quantity after the points.

        None for a range.
        """
        weights = self._weights
        if weights is None or entry.sigma is None:
            return None
        logs = self._drawn[0][:, self.priors.index(entry)] * entry.sigma
        middle = float(np.average(logs, weights=weights))
        square = float(np.average((logs - middle) ** 2, weights=weights))
        return math.exp(middle), math.sqrt(square)

    def logarithms(self, measured: Sequence[Prior] = ()) -> tuple[Floats, Floats, Floats]:
        """Logarithms of power and voltage of the devices, and of the factor of the model error.

        Shape (draws,).
        """
        x, normal = self.drawn(measured)
        power = self.power_law(x) + self.power_law.scatter * normal[:, -2]
        voltage = self.voltage_law(x) + self.voltage_law.scatter * normal[:, -1]
        return power, voltage, math.log(self.model.factor) + self.model.sigma * normal[:, -3]

    def drawn(self, measured: Sequence[Prior] = ()) -> tuple[Floats, Floats]:
        """The standardised keys of the devices, shape (draws, keys), and all their normal numbers."""
        from scipy.special import ndtri

        normal = ndtri(self.u)
        x = np.empty((len(normal), len(self.priors)))
        for k, (entry, middle) in enumerate(zip(self.priors, self.middles, strict=True)):
            better = next((new for new in measured if new.quantity == entry.quantity), None)
            if entry.key_sigma is not None:
                sigma = entry.key_sigma if better is None else better.key_sigma or 0.0
                x[:, k] = normal[:, k] * sigma / entry.key_sigma
            else:
                x[:, k] = 2.0 * self.u[:, k] - 1.0
                if better is not None and entry.between is not None:
                    low, high = entry.between
                    near = middle + EXACT * x[:, k]
                    x[:, k] = np.clip(2.0 * (near - low) / (high - low) - 1.0, -1.0, 1.0)
        return x, np.asarray(normal)


def _standardised(entry: Prior, middle: float, values: Floats) -> Floats:
    """Values of a key as the polynomials have them."""
    if entry.key_sigma is not None:
        return np.asarray(np.log(values / middle) / entry.key_sigma)
    assert entry.between is not None, "a prior has a sigma or a range"
    low, high = entry.between
    return 2.0 * (values - low) / (high - low) - 1.0


def _value(scene: Scene, key: str) -> float:
    table, _, name = key.partition(".")
    return float(scene.tables()[table][name])


def interval(values: Floats, zeros: float, unit: str, weights: Floats | None = None) -> RealDevice:
    """Median and 95 % interval of values with weights, and of zeros, which are a share of all."""
    shares = [(end - zeros) / (1.0 - zeros) if end > zeros else None for end in ENDS]
    known = [share for share in shares if share is not None]
    if weights is None:
        quantiles = iter(np.quantile(values, known))
    else:
        order = np.argsort(values)
        steps = np.cumsum(weights[order]) - 0.5 * weights[order]
        quantiles = iter(np.interp(known, steps / weights.sum(), values[order]))
    low, median, high = (0.0 if share is None else float(next(quantiles)) for share in shares)
    return RealDevice(median, low, high, unit)


def _quantity(entry: Prior, devices: Devices, device_class: str) -> UncertainQuantity:
    """A quantity, its spread, and the width of the power's interval after a measurement."""
    better = prior_of(entry.quantity, "measured", device_class)
    if better is None and entry.between is not None:
        better = entry
    if better is None or (entry.sigma is not None and (better.sigma or 0.0) >= entry.sigma):
        after = None
    else:
        after = devices.width_after([better])
    factor, left = devices.quantity(entry) or (None, None)
    return UncertainQuantity(
        quantity=entry.quantity,
        key=entry.key,
        origin=entry.origin,
        sigma=entry.sigma,
        width_after=after,
        source=entry.source,
        factor=factor,
        sigma_left=left,
    )


def _after_impedance(devices: Devices, device_class: str) -> float | None:
    """The width of the power's interval after an impedance curve.

    None if it narrows no quantity, or is unknown.
    """
    better = []
    for entry in devices.priors:
        measured = prior_of(entry.quantity, "measured_low", device_class)
        if measured is None or entry.sigma is None or (measured.sigma or 0.0) >= entry.sigma:
            continue
        better.append(measured)
    return devices.width_after(better) if better else None


def _remarks(devices: Devices, problem: Problem, spread: ToleranceResult) -> tuple[Diagnostic, ...]:
    """The notes on the priors, and the warnings of the study."""
    priors = devices.priors
    model = devices.model
    remarks = [note("predicted_from_priors", model=100.0 * model.sigma)]
    if model.factor != 1.0:
        remarks.append(note("predicted_stop", percent=100.0 * model.factor))
    if guessed := ", ".join(entry.quantity for entry in priors if entry.origin == "unknown"):
        remarks.append(note("predicted_guesses", quantities=guessed))
    scattered = any(entry.quantity == "frequency" for entry in priors)
    if scattered and problem.equations.drive is not None:
        remarks.append(note("predicted_detuned"))
    return (*remarks, *(entry for entry in spread.warnings if entry.code not in MISSES))
