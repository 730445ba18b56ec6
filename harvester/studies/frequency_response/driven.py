"""A scene with a harmonic excitation at one frequency after another, and its parts that a response cannot show."""

from collections.abc import Sequence
from dataclasses import dataclass

from harvester.engines.protocol import unknown_effects
from harvester.equations.effects import SWEPT, unknown_to
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.scene.plausibility import unusual_values
from harvester.scene.scene import Scene
from harvester.studies.frequency_response.point import GRAVITY


@dataclass(frozen=True)
class HarmonicDrive:
    """A scene whose drive's frequency is to be swept.

    Raises InputError for a scene without a harmonic excitation, and CannotServeError for excitation
    of other kinds.
    """

    problem: Problem

    def __post_init__(self) -> None:
        table, amplitude, _ = self._names
        if reason := unknown_effects(
            self.problem, unknown_to(SWEPT), "a frequency response", "engine 'ensemble'"
        ):
            raise CannotServeError(reason)
        if self.problem.equations.drive is None:
            given = getattr(getattr(self.problem.scene, table), amplitude, None)
            raise InputError(
                f"{table}.{amplitude} must be given, above 0, for a frequency response, but "
                f"{'is left out' if given is None else f'is {given:g}'}"
            )

    @property
    def _names(self) -> tuple[str, str, str]:
        if self.problem.physical:
            return "excitation", "acceleration_amplitude", "frequency"
        return "nondimensional", "drive", "drive_frequency"

    @property
    def frequency_key(self) -> str:
        """The scene key of the frequency."""
        table, _, frequency = self._names
        return f"{table}.{frequency}"

    @property
    def level(self) -> float | None:
        """The amplitude of the base's acceleration in g.

        None for a nondimensional scene, and for one of 0.
        """
        excitation = self.problem.scene.excitation
        if excitation is None or not excitation.acceleration_amplitude:
            return None
        return excitation.acceleration_amplitude / GRAVITY

    @property
    def is_random(self) -> bool:
        """Whether there is noise in addition to the excitation."""
        return self.problem.equations.is_random

    def at(self, frequency: float) -> Problem:
        """The problem at another frequency."""
        scene: Scene = self.problem.scene
        return Problem(scene.vary(self.frequency_key, frequency))

    def diagnostics(self, frequencies: Sequence[float]) -> list[Diagnostic]:
        """Warnings of the scene's unusual values, and of those that are so at the first or the last frequency alone."""
        scene: Scene = self.problem.scene
        unusual = unusual_values(scene)
        diagnostics = list(unusual)
        ends = dict.fromkeys((min(frequencies), max(frequencies))) if len(frequencies) else {}
        for frequency in ends:
            at_end = unusual_values(self.at(frequency).scene)
            diagnostics += [
                warning("unusual_at_an_end", what=str(word))
                for word in at_end
                if word not in unusual
            ]
        return diagnostics
