"""Whether an earlier run in a folder was the same study, and by which versions: the part that `resume` may use."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harvester.errors import InputError

# of which last digits may depend
VERSIONS = ("harvester", "numpy", "scipy", "numba", "PySpice", "ngspice")


@dataclass(frozen=True)
class JournalKind:
    """The identity of a study: its ``name``, and the part of its provenance that makes it the same study.

    ``remedy`` is the result of removing a damaged journal.
    """

    name: str
    same: tuple[str, ...]
    remedy: str = "to begin anew"

    @property
    def file(self) -> str:
        """The name of its journal."""
        return f"{self.name}.journal"


SWEEP = JournalKind(
    "sweep",
    ("scene_digest", "netlist", "points", "vary", "engines", "noise"),
    "to continue from sweep.csv",
)


def identity(about: Mapping[str, Any], kind: JournalKind = SWEEP) -> dict[str, str]:
    """A hash of each thing in a study's provenance that makes it the same study, and the versions that compute it."""
    about = {
        "points": "grid",
        "noise": "common",
        **about,
    }  # which the files of earlier versions do not say
    made_by = about.get("versions")
    known = made_by if isinstance(made_by, dict) else {}
    versions = ", ".join(f"{name} {known[name]}" for name in VERSIONS if name in known)
    return {key: short_hash(json.dumps(about.get(key), default=str)) for key in kind.same} | {
        "versions": versions
    }


def short_hash(text: str) -> str:
    """A hash that distinguishes texts."""
    return hashlib.sha256(text.encode(errors="surrogatepass")).hexdigest()[:16]


def check_same(
    out: Path, before: object, now: Mapping[str, str], kind: JournalKind = SWEEP
) -> None:
    """Raise InputError, with the difference, if the identity of the earlier study in a folder is not that of now."""
    for key in kind.same:
        if not isinstance(before, dict) or before.get(key) != now[key]:
            raise InputError(
                f"`resume` must continue the same {kind.name}, but {key} in {str(out)!r} is another: use another `out`"
            )
