"""An engine's answer: values with their errors, what it took, and what to beware of."""

from dataclasses import dataclass, field, replace
from typing import Any

from harvester import figures
from harvester.answers.details import rows
from harvester.answers.probes import ProbeMeans
from harvester.answers.responses import SteadyResponse
from harvester.arrays import Floats
from harvester.equations.repeated_shaking import Events
from harvester.errors import names_arguments
from harvester.presentation.answer_units import AnswerUnits
from harvester.uncertainty.value import Value, number


@names_arguments
@dataclass(frozen=True, repr=False)
class Estimate:
    """What an engine found for a scene: mean square voltage and mean power with their errors.

    Both are in `unit_names` (V^2 and W; nondimensional for a nondimensional scene); ``nondimensional`` holds both and
    beta and mu without units.  ``steps`` are trajectory-steps (ensemble) or accepted ngspice steps (spice);
    ``seconds`` is the computation without compilation; ``probes`` are other quantities of the circuit that were asked
    for.  ``reason`` says why there is no sampling error, or what is
    known of the model's own.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> answer.engine, answer.effects
    ('averaged', ('linear_damping', 'external_noise', 'back_coupling', 'resistive_load'))
    """

    engine: str
    physical: bool
    mean_square_voltage: Value
    mean_power: Value
    nondimensional: dict[str, float | None]
    effects: tuple[str, ...]
    seconds: float
    steps: int
    reason: str = ""
    warnings: tuple[str, ...] = ()
    details: dict[str, float] = field(default_factory=dict)
    probes: dict[str, ProbeMeans] = field(default_factory=dict)
    samples: Floats | None = None  # of nondimensional V^2, one a trajectory or batch
    # Of the mean power, one a trajectory; None where it is no plain mean of them.  No part of what the answer says.
    power_samples: Floats | None = field(default=None, compare=False)
    responses: tuple[SteadyResponse, ...] = ()  # to the same steady drive, from other starts: what a search found
    events: Events | None = None  # the shocks or steps, where the shaking is made of such

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
    def unit_names(self) -> AnswerUnits:
        """The units of the answer's values."""
        return AnswerUnits.of(self.physical)

    def plot(self, title: str | None = "") -> "figures.Plot":
        """Draw the parts of the error, and the energy ledger where there is one, as a matplotlib figure."""
        return figures.estimate(self, title)

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints."""
        return (
            {
                "engine": self.engine,
                "mean_square_voltage": number(self.mean_square_voltage),
                "mean_power": number(self.mean_power),
                "nondimensional": self.nondimensional,
                "effects": list(self.effects),
                "seconds": self.seconds,
                "steps": self.steps,
                "reason": self.reason,
                "warnings": list(self.warnings),
                "details": self.details,
            }
            | self._events_as_json()
            | ({"responses": [one.as_json() for one in self.responses]} if self.responses else {})
            | ({"probes": {name: one.as_json() for name, one in self.probes.items()}} if self.probes else {})
        )

    def _events_as_json(self) -> dict[str, Any]:
        """The rate of events and the energy of one, where there are any."""
        if self.events is None or self.energy_per_event is None:
            return {}
        return {"event_rate": self.events.rate, "energy_per_event": number(self.energy_per_event)}

    def __str__(self) -> str:
        took = f"{self.seconds:.2g} s" + (f", {self.steps:.3g} steps" if self.steps else "")
        energy = self.energy_per_event
        named = [
            ("mean power", self.mean_power.format(self.unit_names.power)),
            ("mean square voltage", self.mean_square_voltage.format(self.unit_names.mean_square_voltage)),
            *([] if energy is None else [("energy per event", energy.format(self.unit_names.energy))]),
            ("effects", ", ".join(self.effects)),
            *rows(self.details, self.unit_names),
        ]
        width = max([20, *(len(name) for name, _ in named)])
        lines = [f"{self.engine}: {took}", *(f"  {name:<{width}} {text}" for name, text in named)]
        of = len(self.responses)
        lines += [
            f"  {f'response {k} of {of}':<{width}} {one.text(self.unit_names.power)}"
            for k, one in enumerate(self.responses, 1)
        ]
        lines += [line for name, one in self.probes.items() for line in one.lines(name)]
        lines += [f"  note: {self.reason}"] if self.reason else []
        return "\n".join(lines + [f"  warning: {w}" for w in self.warnings])

    __repr__ = __str__  # what Python shows is what a command prints

    def _repr_html_(self) -> str:
        from harvester.presentation import html

        energy = self.energy_per_event
        shown = [
            ("mean power", self.mean_power.format(self.unit_names.power)),
            *([] if energy is None else [("energy per event", energy.format(self.unit_names.energy))]),
            ("mean square voltage", self.mean_square_voltage.format(self.unit_names.mean_square_voltage)),
            ("effects", ", ".join(self.effects)),
            ("seconds", f"{self.seconds:.2g}"),
        ]
        notes = ([f"note: {self.reason}"] if self.reason else []) + html.warnings(self.warnings)
        return html.table(self.engine, (), shown, notes)
