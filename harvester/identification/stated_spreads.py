"""The intervals that `harvester identify` wrote into a scene file as comments, as spreads for a study of tolerances.

An interval of 95 % is a normal spread about its middle.  Stiffness and coupling go with the mass,
for the resonance f and q = theta^2/M are known far better than each of them: with the relative
deviations s, of K/M = (2 pi f)^2 and of q,

    corr(M, K) = (s_K^2 + s_M^2 - 4 s_f^2)/(2 s_K s_M),   corr(M, theta) = (4 s_theta^2 + s_M^2 - s_q^2)/(4 s_theta s_M)

and corr(K, theta) is the product of both, as f and q come from different parts of the measurement.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from harvester.scene.keys import SEVERAL, TABLES, kind_of
from harvester.scene.scene import Scene
from harvester.scene.table import key_names
from harvester.studies.tolerance.spreads import CUT
from harvester.uncertainty.value import stderr_of95

_TABLE = re.compile(r"\[\[?(\w+)\]\]?\s*(?:#.*)?")
_KEY = re.compile(r"(\w+)\s*=.*#.*\b95 %: (\S+) to (\S+)")
_DERIVED = re.compile(
    r"#\s+(short_circuit_frequency|coupling_squared_per_mass)\s*=.*\b95 %: (\S+) to (\S+)\)"
)
MOST = 1.0 - 1e-7  # of a correlation


@dataclass(frozen=True)
class ScenesSpreads:
    """Spreads by key as `harvester.tolerance` takes them, correlations, and keys whose value left its interval."""

    vary: dict[str, str]
    correlate: dict[tuple[str, str], float]
    left_out: tuple[str, ...]

    def __str__(self) -> str:
        sentence = "spreads: the 95 % intervals that the scene file states for its values, as identify wrote them"
        if not self.left_out:
            return sentence
        return f"{sentence}; without {', '.join(self.left_out)}, whose value is no longer in its interval"


def spreads_of(text: str, scene: Scene) -> ScenesSpreads:
    """The spreads that the text of a scene file states; empty if it states none."""
    intervals, derived = _intervals(text)
    vary = dict[str, str]()
    deviations = dict[str, float]()
    left_out = list[str]()
    for key, (low, high) in intervals.items():
        table, _, name = key.partition(".")
        value = scene.tables().get(table, {}).get(name)
        if not isinstance(value, float) or not low <= value <= high:
            left_out.append(key)
            continue
        middle = 0.5 * (low + high)
        deviation = stderr_of95(0.5 * (high - low))
        kind = kind_of(key)
        far = CUT * deviation
        inside = (
            middle - far > kind.above and middle - far >= kind.least and middle + far <= kind.most
        )
        vary[key] = f"normal:{middle!r}:{deviation!r}" if inside else f"{low!r}:{high!r}"
        if inside and middle:
            deviations[key] = deviation / abs(middle)
    deviations |= {
        name: stderr_of95((high - low) / (high + low)) for name, (low, high) in derived.items()
    }
    return ScenesSpreads(vary, _correlations(deviations), tuple(left_out))


def _intervals(text: str) -> tuple[dict[str, tuple[float, float]], dict[str, tuple[float, float]]]:
    """The intervals in the comments of a scene file: by the keys that they are behind, and of derived numbers."""
    stated = dict[str, tuple[float, float]]()
    derived = dict[str, tuple[float, float]]()
    table = ""
    for line in (row.strip() for row in text.splitlines()):
        if (head := _TABLE.fullmatch(line)) is not None:
            table = head[1]
        elif (
            (match := _DERIVED.fullmatch(line)) is not None
            and (ends := _ends(match)) is not None
            and ends[0] > 0.0
        ):
            derived[match[1]] = ends
        elif (match := _KEY.fullmatch(line)) is not None and (ends := _ends(match)) is not None:
            names = key_names(TABLES[table]) if table in TABLES and table not in SEVERAL else []
            stated |= {f"{table}.{match[1]}": ends} if match[1] in names else {}
    return stated, derived


def _ends(match: "re.Match[str]") -> tuple[float, float] | None:
    """The ends of an interval; None if they are none."""
    try:
        low, high = float(match[2]), float(match[3])
    except ValueError:
        return None
    return (low, high) if math.isfinite(high - low) and low < high else None


def _correlations(s: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """The correlations of stiffness and coupling with the mass, from the relative deviations by key."""
    mass = "oscillator.mass"
    stiffness = "oscillator.stiffness"
    coupling = "piezo.coupling"
    if mass not in s:
        return {}
    correlations = {}
    for key, name, share in (
        (stiffness, "short_circuit_frequency", 1.0),
        (coupling, "coupling_squared_per_mass", 0.5),
    ):
        if key in s and name in s:
            s_key = s[key] / share
            s_mass = s[mass]
            s_ratio = s[name] * (2.0 if key == stiffness else 1.0)
            correlation = (s_key**2 + s_mass**2 - s_ratio**2) / (2.0 * s_key * s_mass)
            correlations[mass, key] = max(min(correlation, MOST), -MOST)
    if len(correlations) == 2:
        correlations[stiffness, coupling] = (
            correlations[mass, stiffness] * correlations[mass, coupling]
        )
    return correlations
