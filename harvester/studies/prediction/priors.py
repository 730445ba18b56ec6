"""The priors of a real device, read from the data file priors.toml of the package.

A prior is a spread about the number in a scene: lognormal with a ``sigma``, the standard
deviation of the logarithm, or uniform over a ``range``.  It follows from the class of the device
and from the origin of the number.
"""

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from harvester.engines.exact import Exact
from harvester.equations.effects import LINEAR, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import InputError, UnboundedResponseError, invalid, named_once, unknown
from harvester.linear.solve import solve
from harvester.scene.modal_parameters import modal_parameters
from harvester.scene.scene import Scene

FILE = Path(__file__).with_name("priors.toml")
DEFAULT_CLASS = "bulk"
# RMS displacements of the linear device within which a stop is reached: random excitation passes
# more once per 1e8 cycles, and devices nearer to the resonance have up to 4.2 times the amplitude.
REACH = 6.0
NO_SPREAD = frozenset({"given", "tuned"})
# Effects of a nonlinear spring, whose responses may coexist.
SPRINGS = frozenset(
    {
        "negative_stiffness",
        "quadratic_stiffness",
        "softening_stiffness",
        "cubic_stiffness",
        "ceramic_softening",
        "inertia_x2",
        "coupling_x2",
    }
)
# The scene key of each quantity, and the exponent of the quantity in it.
KEYS = {
    "frequency": ("oscillator.stiffness", 2.0),
    "damping": ("oscillator.damping", 1.0),
    "coupling": ("piezo.coupling", 1.0),
    "capacitance": ("piezo.capacitance", 1.0),
    "gap": ("stop.gap", 1.0),
    "restitution": ("stop.restitution", 1.0),
}


@dataclass(frozen=True)
class Prior:
    """A spread of a quantity of a real device about its number in a scene.

    ``sigma`` is the standard deviation of its logarithm, or None if ``between`` has the ends of a
    uniform spread.  ``median`` is that of the class, for a number that no scene has, or None.
    """

    quantity: str
    origin: str
    sigma: float | None
    between: tuple[float, float] | None
    source: str
    median: float | None = None

    @property
    def key(self) -> str:
        """The scene key that scatters."""
        return KEYS[self.quantity][0]

    @property
    def key_sigma(self) -> float | None:
        """The standard deviation of the logarithm of the scene key."""
        return None if self.sigma is None else KEYS[self.quantity][1] * self.sigma

    @property
    def written(self) -> str:
        """The spread of the scene key as `harvester.tolerance` accepts it."""
        if self.between is not None:
            return f"{self.between[0]!r}:{self.between[1]!r}"
        return f"lognormal:{self.key_sigma or 0.0:.10g}"


@cache
def data() -> Mapping[str, Any]:
    """The tables of the data file: classes, origins, defaults, model and prior."""
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def prior_of(quantity: str, origin: str, device_class: str) -> Prior | None:
    """The prior of a quantity whose number has an origin; None if the file has none for it."""
    rows = [
        row
        for row in data()["prior"]
        if row["quantity"] == quantity
        and row["origin"] == origin
        and row["class"] in (device_class, "any")
    ]
    if not rows:
        return None
    row = min(rows, key=lambda entry: entry["class"] == "any")
    between = row.get("range")
    return Prior(
        quantity,
        origin,
        row.get("sigma"),
        None if between is None else tuple(between),
        row["source"],
        row.get("median"),
    )


def check_class(name: str, argument: str = "prior") -> str:
    """The name of a class of devices; InputError with the nearest match for another."""
    if not isinstance(name, str):
        raise invalid(f"`{argument}`", f"be one of {', '.join(data()['classes'])}", name)
    if name not in data()["classes"]:
        raise unknown(f"class of devices of `{argument}`", name, data()["classes"])
    return name


def unknown_quality(device_class: str) -> tuple[float, float]:
    """The quality factor of a device of a class whose damping is unknown, and its spread.

    The first is the median 1/(2 zeta), the second the standard deviation of the logarithm.
    Raises InputError for a class that is not known.
    """
    prior = prior_of("damping", "unknown", check_class(device_class))
    assert prior is not None and prior.median and prior.sigma, "the data file has it for any class"
    return 0.5 / prior.median, prior.sigma


def origins_of(known: Mapping[str, str], argument: str = "known") -> dict[str, str]:
    """The origin of every quantity: the defaults, and those in ``known``.

    Raises InputError for a quantity or an origin that is not known, and an origin that the
    quantity cannot have.
    """
    named_once(list(known), f"`{argument}`")
    origins = dict(data()["defaults"])
    for quantity, origin in known.items():
        if quantity not in KEYS:
            raise unknown(f"quantity of `{argument}`", quantity, KEYS)
        if origin not in data()["origins"]:
            raise unknown(f"origin of {quantity} in `{argument}`", origin, data()["origins"])
        possible = _possible(quantity)
        if origin not in possible:
            raise InputError(
                f"`{argument}` must give {quantity} one of the origins "
                f"{', '.join(possible)}, but gives {origin}"
            )
        origins[quantity] = origin
    return origins


def _possible(quantity: str) -> list[str]:
    """The origins that a quantity can have."""
    rows = {row["origin"] for row in data()["prior"] if row["quantity"] == quantity}
    more = {"given", "tuned"} if quantity == "frequency" else {"given"}
    return [origin for origin in data()["origins"] if origin in rows | more]


@dataclass(frozen=True)
class ModelError:
    """The model error in power: median of real over computed, and its standard deviation (log)."""

    factor: float
    sigma: float


def model_error(problem: Problem) -> ModelError:
    """The model error of a scene, by its kind: linear, with a stop, or with a nonlinear spring.

    A stop that the mass does not reach makes no kind (`without_unreached_stops`).
    """
    model = data()["model"]
    equations = without_unreached_stops(problem).equations
    if equations.has_stop and SPRINGS.isdisjoint(equations.effects):
        return ModelError(float(model["stop_factor"]), float(model["stop"]))
    linear = unknown_to(LINEAR).isdisjoint(equations.effects) and equations.linear is None
    return ModelError(1.0, float(model["linear" if linear else "nonlinear"]))


def without_unreached_stops(problem: Problem) -> Problem:
    """The problem without stops beyond REACH times the RMS displacement of the linear device.

    Else as it is.

    Only a linear device that is shaken steadily, with a load resistance or none, has that
    displacement in closed form; any other keeps its stops.
    """
    low, high = problem.equations.stops
    gap = min(-low, high)
    if not 0.0 < gap < math.inf or problem.scene.stop is None or problem.events is not None:
        return problem
    free = Problem(problem.plain.scene.replace(stop=None, opposite_stop=None))
    if Exact.refusal(free) is not None or free.equations.linear is not None:
        return problem
    try:
        rms = math.sqrt(solve(free.equations).x2) * free.units.length
    except UnboundedResponseError:
        return problem
    return free if gap * problem.units.length >= REACH * rms else problem


def in_modal_keys(scene: Scene) -> Scene:
    """The scene with stiffness, damping and coupling in place of the keys that represent them.

    Raises InputError for a scene without units, whose keys do not scatter one by one.
    """
    if scene.oscillator is None or scene.piezo is None:
        raise InputError(
            "a prediction needs a scene with units, but the scene is nondimensional: "
            "give [oscillator] and [piezo]"
        )
    modal = modal_parameters(scene.oscillator, scene.piezo)
    oscillator = dataclasses.replace(
        scene.oscillator,
        stiffness=modal.stiffness,
        frequency=None,
        damping=modal.damping,
        damping_ratio=None,
        q=None,
    )
    piezo = dataclasses.replace(scene.piezo, coupling=modal.coupling, open_circuit_frequency=None)
    return dataclasses.replace(scene, oscillator=oscillator, piezo=piezo)


def priors_of(scene: Scene, device_class: str, known: Mapping[str, str]) -> tuple[Prior, ...]:
    """The priors of the quantities that a scene has, as `in_modal_keys` writes it."""
    check_class(device_class)
    tables = scene.tables()
    priors = []
    for quantity, origin in origins_of(known).items():
        table, _, name = KEYS[quantity][0].partition(".")
        if origin in NO_SPREAD or not tables.get(table, {}).get(name):
            continue
        prior = prior_of(quantity, origin, device_class)
        assert prior is not None, "origins_of lets no other through"
        priors.append(prior)
    return tuple(priors)
