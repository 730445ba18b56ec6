"""An engine's answer: values with their errors, what it took, and what to beware of."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

from harvester import figures
from harvester.answers.probes import ProbeMeans
from harvester.answers.responses import SteadyResponse
from harvester.arrays import Floats
from harvester.equations.repeated_shaking import Events
from harvester.errors import names_arguments
from harvester.presentation.diagnostic import Diagnostic, has
from harvester.presentation.result import Result
from harvester.uncertainty.value import Value

# Details of a steady response: the RMS displacement about its mean, and phases to the base in degrees.
DISPLACEMENT, PHASES = "displacement_rms", ("displacement_phase", "voltage_phase")
# Of an answer that is none for the scene yet: it had not settled, or its runs were cut off.
UNSETTLED = ("burn_in_stopped", "mean_while_settling", "ngspice_left_out")


@names_arguments
@dataclass(frozen=True, repr=False)
class Estimate(Result):
    """What an engine found for a scene: mean square voltage and mean power with their errors.

    Both are in `unit_names` (V^2 and W; nondimensional for a nondimensional scene); ``nondimensional`` holds both and
    beta and mu without units.  ``steps`` are trajectory-steps (ensemble) or accepted ngspice steps (spice);
    ``seconds`` is the computation without compilation; ``probes`` are other quantities of the circuit that were asked
    for.  ``diagnostics`` are its warnings, and notes: why there is no sampling error, or what is known of the model's.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> answer.engine, answer.effects
    ('averaged', ('linear_damping', 'external_noise', 'back_coupling', 'resistive_load'))
    """

    SHORT: ClassVar[tuple[str, ...]] = ("engine", "mean_power", "mean_square_voltage")
    DERIVED: ClassVar[tuple[str, ...]] = ("event_rate", "energy_per_event")
    NOT_SHOWN: ClassVar[frozenset[str]] = frozenset({"nondimensional", "event_rate"})
    OPTIONAL: ClassVar[frozenset[str]] = frozenset({"event_rate", "energy_per_event", "responses", "probes"})
    INTERNAL: ClassVar[frozenset[str]] = frozenset({"samples", "power_samples", "events"})

    engine: str
    physical: bool
    mean_power: Value
    mean_square_voltage: Value
    nondimensional: dict[str, float | None]
    effects: tuple[str, ...]
    seconds: float
    steps: int
    diagnostics: tuple[Diagnostic, ...] = ()
    details: dict[str, float] = field(default_factory=dict)
    probes: dict[str, ProbeMeans] = field(default_factory=dict)
    samples: Floats | None = None  # of nondimensional V^2, one a trajectory or batch
    # Of the mean power, one a trajectory; None where it is no plain mean of them.  No part of what the answer says.
    power_samples: Floats | None = field(default=None, compare=False)
    responses: tuple[SteadyResponse, ...] = ()  # to the same steady drive, from other starts: what a search found
    events: Events | None = None  # the shocks or steps, where the shaking is made of such

    @property
    def is_sound(self) -> bool:
        """Whether it may stand beside others: it has settled, was not cut off, and some error of it is known."""
        power = self.mean_power
        return not has(self.diagnostics, *UNSETTLED) and (power.error95 is not None or power.known_error95 > 0.0)

    @property
    def energy_per_event(self) -> Value | None:
        """The mean energy that the load takes of one shock or step, E[P] over their rate; None without events."""
        if self.events is None:
            return None
        energy = self.mean_power.scaled(1.0 / self.events.rate)
        if not self.events.memory:
            return energy
        return replace(energy, model=(energy.model or 0.0) + self.events.memory * abs(energy.value))

    @property
    def event_rate(self) -> float | None:
        """Shocks or steps a second; None without events."""
        return None if self.events is None else self.events.rate

    @property
    def reason(self) -> str:
        """Its notes in one line."""
        return "; ".join(map(str, self.notes))

    def plot(self, title: str | None = "") -> "figures.Plot":
        """Draw the parts of the error, and the energy ledger where there is one, as a matplotlib figure."""
        return figures.estimate(self, title)
