"""All profiles by name, the further keys that each needs, and the list that `harvester keys profile` prints."""

from collections.abc import Mapping

from harvester.errors import InputError, invalid, unknown
from harvester.records.profiles.lines_and_shocks import LINES, SHOCKS
from harvester.records.profiles.standard_curves import CURVES, Profile

PROFILES: dict[str, Profile] = {**CURVES, **LINES, **SHOCKS}
# keys that only go with a profile
PROFILE_KEYS = ("level", "pulse_duration", "event_rate", "harmonics")
SHARED = ("acceleration_amplitude", "frequency")  # keys that a harmonic motion has too


def check_profile(keys: Mapping[str, object]) -> None:
    """Refuse a profile that is unknown, or without a key that it needs, or with one that it would ignore.

    ``keys`` are all of [excitation], None if left out.  Raises InputError.
    """
    name = keys.get("profile")
    if name is None:
        for key in PROFILE_KEYS:
            if keys.get(key) is not None:
                raise InputError(f"excitation.profile must be given with {key}, but is left out")
        return
    if name not in PROFILES:
        raise unknown("profile", str(name), PROFILES)
    profile = PROFILES[str(name)]
    for key in (*SHARED, *PROFILE_KEYS):
        if key in profile.needs and keys.get(key) is None:
            raise InputError(
                f"excitation.{key} must be given with profile {name!r}, but is left out"
            )
        if key not in (*profile.needs, *profile.takes) and keys.get(key) is not None:
            raise InputError(
                f"excitation.{key} must be left out with profile {name!r}, but is given"
            )
    level = keys.get("level")
    if level == 0.0 or (profile.random and isinstance(level, float) and level < 0.0):
        must = "be above 0" if profile.random else "be other than 0"
        raise invalid(f"excitation.level of profile {name!r}", must, level)


def listed() -> list[dict[str, object]]:
    """Every profile with its keys, as ``--json`` prints it."""
    keys = "name", "what", "source", "needs", "takes"
    return [{key: getattr(profile, key) for key in keys} for profile in PROFILES.values()]


def text() -> str:
    """Every profile: its description, its keys and its source."""
    lines = []
    for profile in PROFILES.values():
        keys = [*profile.needs, *(f"{key} (optional)" for key in profile.takes)]
        lines += [
            profile.name,
            f"  {profile.what}",
            f"  keys: {', '.join(keys)}",
            f"  source: {profile.source}",
            "",
        ]
    return "\n".join(lines[:-1])
