"""A remark of a computation on its result: a code, its severity, its subject, and its numbers.

Engines and studies make diagnostics; nobody below the terminal, the page or the notebook makes a
sentence of them. Code that must know whether something happened asks for the code, never for a word
of its sentence.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from harvester.presentation.messages import sentence

Severity = Literal["warning", "note", "refusal"]
Number = float | int | str | bool | None


@dataclass(frozen=True)
class Diagnostic:
    """One remark on a result.

    ``code`` is a key of `harvester.presentation.messages.catalogue`; ``about`` names its
    subject (an engine, a scene key, ...), empty for the whole result; ``numbers`` are those of its
    sentence.  A "warning" doubts the result, a "note" explains it, a "refusal" states the
    reason why it is missing.  ``str()`` of it is its sentence.

    >>> from harvester.presentation.diagnostic import note
    >>> str(note("open_circuit")), note("open_circuit").severity
    ('open circuit: V keeps its initial offset, and the load power is zero', 'note')
    """

    code: str
    severity: Severity
    about: str = ""
    numbers: Mapping[str, Number] = field(default_factory=dict, hash=False)

    def __str__(self) -> str:
        return sentence(self.code, self.numbers)

    def as_json(self) -> dict[str, Any]:
        """The diagnostic as data, with its sentence."""
        facts = {"code": self.code, "severity": self.severity, "about": self.about}
        return facts | {"numbers": dict(self.numbers), "message": str(self)}

    @property
    def line(self) -> str:
        """Its sentence, after its subject if that is not the whole result."""
        return f"{self.about}: {self}" if self.about else str(self)

    def of(self, about: str) -> "Diagnostic":
        """The same remark, about something else."""
        return replace(self, about=about)


def warning(code: str, about: str = "", /, **numbers: Number) -> Diagnostic:
    """A remark that doubts a result."""
    return Diagnostic(code, "warning", about, numbers)


def note(code: str, about: str = "", /, **numbers: Number) -> Diagnostic:
    """A remark that explains a result."""
    return Diagnostic(code, "note", about, numbers)


def refusal(code: str, about: str = "", /, **numbers: Number) -> Diagnostic:
    """The reason for the lack of a result."""
    return Diagnostic(code, "refusal", about, numbers)


def without_repeats(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Each remark once, in the order of the first of each."""
    unique: list[Diagnostic] = []
    for diagnostic in diagnostics:
        if diagnostic not in unique:
            unique.append(diagnostic)
    return unique


def has(diagnostics: Iterable[Diagnostic], *codes: str) -> bool:
    """Whether one of the codes is among them."""
    return any(diagnostic.code in codes for diagnostic in diagnostics)
