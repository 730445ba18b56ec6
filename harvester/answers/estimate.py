"""An engine's answer: values with their errors, its cost, and warnings.

Some answers hold more: the value of each probe of the circuit, and the responses that one steady
excitation may have, if the mass is not linear.
"""

from dataclasses import field, replace
from typing import TYPE_CHECKING

from harvester.arrays import Floats
from harvester.equations.power_bound import PowerBound
from harvester.equations.repeated_shaking import Events
from harvester.presentation import drawing
from harvester.presentation.diagnostic import Diagnostic, has
from harvester.presentation.result import Result
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class SteadyResponse(Result):
    """A response to a steady excitation: its mean power in the answer's unit, and the fraction of starts that reach it.

    It comes back after so many ``periods`` of the excitation, or after none (None): then it is
    ``chaotic``, or quasi-periodic.  The mean is that of ``engine``; ``note`` states the result of
    another engine there.
    """

    SHORT = ("mean_power", "periods", "share_of_starts")

    mean_power: Value
    share_of_starts: float
    periods: int | None
    chaotic: bool
    engine: str
    note: str = ""


class ProbeMeans(Result):
    """A quantity of the circuit in its ``unit`` (V, A or W; "" for a nondimensional scene).

    ``mean`` and ``rms`` are over time; ``least`` and ``largest`` are the extremes in a time of
    ``window`` (s, or 1/w0), on average over the runs: in a longer time they are farther apart.
    """

    NOT_SHOWN = frozenset({"unit"})
    SHORT = ("mean", "rms")

    unit: str
    window: float
    mean: Value
    rms: Value
    least: Value
    largest: Value


# Details of a steady response: the RMS displacement about its mean, and phases to the base in
# degrees.
DISPLACEMENT = "displacement_rms"
PHASES = ("displacement_phase", "voltage_phase")
PEAKS = "displacement_amplitude", "voltage_amplitude"  # of the response to a harmonic excitation
# Of an answer that is none for the scene yet: it had not settled, or its runs were cut off.
UNSETTLED = ("burn_in_stopped", "mean_while_settling", "ngspice_left_out", "storage_not_settled")


class Estimate(Result):
    """An engine's answer for a scene: mean square voltage and mean power with their errors.

    Attributes
    ----------
    engine : str
        the name of the engine that computed it.
    physical : bool
        whether its numbers are in SI units, rather than nondimensional.
    mean_power : Value
        a `Value`: the mean load power over time (W; nondimensional scene: without a
        unit).
    mean_square_voltage : Value
        a `Value`: the mean over time of the square of the piezo's voltage (V^2).
    nondimensional : dict
        the same two numbers without units, and the scene's beta and mu.
    effects : tuple of str
        names of the effects that the scene calls for, and that were computed.
    seconds : float
        the time of computing, without compilation (s).
    steps : int
        trajectory-steps of an engine that samples, or steps that ngspice accepted.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).
    details : dict
        further numbers of the computation by name, such as its step, burn-in and number of
        trajectories.
    probes : dict
        other quantities of the circuit that were asked for, by name: mean, rms, least and largest.
    responses : tuple of SteadyResponse
        to the same periodic excitation, from other starts, found by a search for several responses.
    events : Events or None
        the shocks or steps, if the excitation is made of such; else None.
    bound : PowerBound or None
        the upper bound for any device of this mass (W), and its reason; None if no
        bound applies.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> answer = hv.Averaged().run(scene)
    >>> answer.engine, answer.effects
    ('averaged', ('linear_damping', 'external_noise', 'back_coupling', 'resistive_load'))
    """

    SHORT = ("engine", "mean_power", "mean_square_voltage")
    DERIVED = ("event_rate", "energy_per_event", "share_of_possible")
    NOT_SHOWN = frozenset({"nondimensional", "event_rate", "bound"})
    OPTIONAL = frozenset(
        {"event_rate", "energy_per_event", "responses", "probes", "bound", "share_of_possible"}
    )
    INTERNAL = frozenset({"samples", "power_samples", "events"})

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
    # of nondimensional V^2, one a trajectory or batch
    samples: Floats | None = field(default=None, compare=False)
    # Of the mean power, one a trajectory; None if it is not a plain mean of them.  No part of what
    # the answer says.
    power_samples: Floats | None = field(default=None, compare=False)
    # to the same steady excitation, from other starts: what a search found
    responses: tuple[SteadyResponse, ...] = ()
    events: Events | None = None  # the shocks or steps, where the excitation is made of such
    # the most that any device of this mass could take of the excitation
    bound: PowerBound | None = None

    @property
    def is_sound(self) -> bool:
        """True if the estimate can be compared with others.

        It must have settled, must not have been cut off by the budget, and at least one error part
        must be known.
        """
        power = self.mean_power
        return self.has_settled and (power.error95 is not None or power.known_error95 > 0.0)

    @property
    def has_settled(self) -> bool:
        """Whether it is of a response that has settled, and that was not cut off."""
        return not has(self.diagnostics, *UNSETTLED)

    @property
    def energy_per_event(self) -> Value | None:
        """The mean energy that the load receives from one shock or step, E[P] over their rate.

        None without events.
        """
        if self.events is None:
            return None
        energy = self.mean_power.scaled(1.0 / self.events.rate, self.unit_names.energy)
        if not self.events.memory:
            return energy
        return replace(energy, model=(energy.model or 0.0) + self.events.memory * abs(energy.value))

    @property
    def event_rate(self) -> float | None:
        """Shocks or steps per second; None without events."""
        return None if self.events is None else self.events.rate

    @property
    def share_of_possible(self) -> float | None:
        """The mean power over the upper bound for any device of this mass.

        None if no bound is known.
        """
        return None if self.bound is None else self.mean_power.value / self.bound.value

    @property
    def share_of_possible_value(self) -> Value | None:
        """The same, with the errors of the numerator; the bound has none."""
        return None if self.bound is None else self.mean_power.scaled(1.0 / self.bound.value)

    @property
    def reason(self) -> str:
        """Its notes in one line."""
        return "; ".join(map(str, self.notes))

    def plot(self, title: str | None = "", ax: "Axes | None" = None) -> "Figure":
        """Draw the parts of the error, and the energy balance if there is one, as a matplotlib figure."""
        return drawing.draw(self, title, ax)
