"""What a profile is: a shaking that a scene calls by its name, with its source and the keys that go with it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Profile:
    """A shaking by name: ``what`` it is in a line, the ``source`` of its numbers, and its keys of [excitation].

    Those of ``needs`` must be given, those of ``takes`` may be; all others must be left out.  ``random`` profiles are
    noise of a density, the others a record that repeats itself.
    """

    name: str
    what: str
    source: str
    needs: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()
    random: bool = False
