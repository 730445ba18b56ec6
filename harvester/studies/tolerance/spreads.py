"""How a scene key scatters from device to device: the spreads that a user may write, and their inverse distributions.

KEY=10%                 anywhere within 10 % of the scene's value (uniform)
KEY=2 Hz                anywhere within so much of the scene's value, also written +-2 Hz
KEY=0.94:0.98           anywhere between two values (uniform)
KEY=E24:5%              the value of the series E24 nearest to the scene's, anywhere within 5 % of it
KEY=normal:2%           normal about the scene's value, with a standard deviation of 2 % of it
KEY=normal:MEAN:SD      normal, with both given
KEY=lognormal:0.3       lognormal about the scene's value, 0.3 being that of the logarithm
KEY=lognormal:MEDIAN:SD lognormal, with the median and the standard deviation of the logarithm given
KEY=triangular:10%      most often the scene's value, never beyond 10 % of it
KEY=triangular:A:B:C    from A to C, most often B
KEY=A,B,C,...           a list of values that were measured, each as likely as another
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, named_once, reading
from harvester.netlists.load_circuit import load_circuit
from harvester.quantities.preferred_numbers import SERIES, nearest
from harvester.quantities.units import fraction, split_unit
from harvester.scene.keys import read_value, split_key, whole_key
from harvester.scene.scene import Scene

PARAMETERS = "load.parameters."  # before a name of the netlist
FORMS = (
    "10%, LOW:HIGH, 2 Hz, E24:5%, normal:2%, normal:MEAN:SD, lognormal:0.3, triangular:10%, "
    "triangular:LOW:MODE:HIGH or a list A,B,C"
)
_ABOUT = ("+-", "±")
CUT = 4.0  # standard deviations: a normal spread is cut there, beyond which 0.006 % of it lies


@dataclass(frozen=True)
class PartSpread:
    """A scene key and how its value scatters, in SI units.

    ``kind`` is "uniform" with ``values`` (low, high), "normal" (mean, standard deviation; cut at
    `CUT` of them), "lognormal" (median, standard deviation of the logarithm), "triangular" (low,
    most likely, high) or "measured" (the values, sorted);
    ``written`` is the text of the user.
    """

    key: str
    kind: str
    values: tuple[float, ...]
    written: str

    def at(self, u: Floats) -> Floats:
        """The values at places ``u`` from 0 to 1 of the distribution, of any shape: its inverse."""
        u = np.asarray(u, dtype=float)
        if self.kind == "uniform":
            low, high = self.values
            return low + u * (high - low)
        if self.kind in ("normal", "lognormal"):
            from scipy.special import ndtr, ndtri

            mean, deviation = self.values
            normal = deviation * ndtri(ndtr(-CUT) + u * (ndtr(CUT) - ndtr(-CUT)))
            return np.asarray(mean + normal if self.kind == "normal" else mean * np.exp(normal))
        if self.kind == "triangular":
            low, mode, high = self.values
            rising = low + np.sqrt(u * (high - low) * (mode - low))
            falling = high - np.sqrt((1.0 - u) * (high - low) * (high - mode))
            return np.asarray(np.where(u * (high - low) < mode - low, rising, falling))
        count = len(self.values)
        return np.asarray(np.asarray(self.values)[np.minimum((u * count).astype(int), count - 1)])

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value that it has."""
        low, high = self.at(np.array([0.0, 1.0]))
        return float(low), float(high)


def parse(text: str, scene: Scene, argument: str = "vary") -> PartSpread:
    """The spread that a text such as ``piezo.capacitance=10%`` describes about the values of a scene.

    Raises InputError for a key that no scene has, a text of another form, values that the key
    cannot have, ends or a deviation that leave nothing between them, and a spread about a value
    that the scene does not have.
    """
    key, equals, written = text.partition("=")
    if not equals:
        raise invalid(f"`{argument}`", f"be KEY=SPREAD with a SPREAD such as {FORMS}", text)
    return spread(key.strip(), written.strip(), scene)


def spread(key: str, written: str, scene: Scene) -> PartSpread:
    """The spread of one key; raises InputError as `parse`."""
    key = _whole_key(key, scene)
    _refuse_unknown(key, scene)
    parts = [part.strip() for part in written.split(":")]
    if "," in written:
        return PartSpread(
            key,
            "measured",
            tuple(sorted(read_value(key, part) for part in written.split(","))),
            written,
        )
    if parts[0] == "lognormal":
        return _lognormal(key, parts[1:], written, scene)
    if parts[0] in ("normal", "triangular"):
        return _named(key, parts[0], parts[1:], written, scene)
    if parts[0].upper() in SERIES and len(parts) == 2:
        return _of_series(key, parts[0], parts[1], written, scene)
    if len(parts) == 1 and written.endswith("%"):
        return _uniform(key, *_about(_nominal(key, scene), _share(key, written)), written)
    if len(parts) == 1 and _is_width(written):
        nominal = _nominal(key, scene)
        half = read_value(key, written.removeprefix("+-").removeprefix("±").strip())
        return _uniform(key, nominal - half, nominal + half, written)
    if len(parts) == 2:
        return _uniform(key, read_value(key, parts[0]), read_value(key, parts[1]), written)
    raise invalid(f"the spread of {key}", f"be {FORMS}", written)


def _whole_key(key: str, scene: Scene) -> str:
    """A key that may be given without its table; a bare frequency is that of the excitation, if there is one."""
    if key == "frequency" and scene.excitation is not None:
        key = (
            "oscillator.frequency" if scene.excitation.frequency is None else "excitation.frequency"
        )
    return whole_key(key, scene.tables())


def _refuse_unknown(key: str, scene: Scene) -> None:
    """InputError with the names that vary if the scene's netlist has neither a parameter nor an element of a key."""
    if not (key.startswith(PARAMETERS) and scene.load and scene.load.netlist):
        return
    problem = Problem.of(scene)
    load = scene.varied({key: 1.0}).load
    if load is not None and problem.load_circuit.value_of(key.removeprefix(PARAMETERS)) is None:
        load_circuit(load, problem.scales.capacitance)


def _is_width(written: str) -> bool:
    """Whether a text is a quantity with its unit, or begins with +-."""
    return written.startswith(_ABOUT) or bool((split_unit(written) or (0.0, ""))[1])


def _of_series(key: str, series: str, share: str, written: str, scene: Scene) -> PartSpread:
    """A spread about the value of a series that is nearest to the scene's."""
    nominal = _nominal(key, scene)
    if nominal <= 0.0:
        raise invalid(
            f"{key} in the scene", f"be above 0 to have a value of the series {series}", nominal
        )
    return _uniform(key, *_about(nearest(series.upper(), nominal), _share(key, share)), written)


def _lognormal(key: str, parts: Sequence[str], written: str, scene: Scene) -> PartSpread:
    """A lognormal spread about the scene's value, or about a median that is given."""
    if not 1 <= len(parts) <= 2:
        raise invalid(f"the spread of {key}", f"be {FORMS}", written)
    median = _nominal(key, scene) if len(parts) == 1 else read_value(key, parts[0])
    share = parts[-1]
    deviation = reading(f"the standard deviation of the logarithm of {key}", fraction, share)
    if median == 0.0:
        raise invalid(f"the median of {key}", "be other than 0", median)
    return PartSpread(key, "lognormal", (median, deviation), written)


def _named(key: str, kind: str, parts: Sequence[str], written: str, scene: Scene) -> PartSpread:
    """A normal or a triangular spread from the text after its name."""
    if len(parts) == 1 and parts[0].endswith("%"):
        middle = _nominal(key, scene)
        share = _share(key, parts[0])
        low, high = _about(middle, share)
        values: tuple[float, ...] = (
            (middle, abs(middle) * share) if kind == "normal" else (low, middle, high)
        )
    elif len(parts) == (2 if kind == "normal" else 3):
        values = tuple(read_value(key, part) for part in parts)
    else:
        raise invalid(f"the spread of {key}", f"be {FORMS}", written)
    if kind == "normal" and not values[1] > 0.0:
        raise invalid(f"the standard deviation of {key}", "be above 0", values[1])
    if kind == "triangular" and not (values[0] <= values[1] <= values[2] and values[0] < values[2]):
        raise invalid(
            f"the spread of {key}", "be triangular:LOW:MODE:HIGH with LOW <= MODE <= HIGH", written
        )
    return PartSpread(key, kind, values, written)


def _uniform(key: str, low: float, high: float, written: str) -> PartSpread:
    if not low < high:
        raise invalid(f"the spread of {key}", "be LOW:HIGH with LOW below HIGH", written)
    return PartSpread(key, "uniform", (low, high), written)


def _about(middle: float, share: float) -> tuple[float, float]:
    return middle - abs(middle) * share, middle + abs(middle) * share


def _share(key: str, text: str) -> float:
    if not text.endswith("%"):
        raise invalid(
            f"the spread of {key}", "be a percentage between 0 % and 100 %, such as 5%", text
        )
    return reading(f"the spread of {key}", fraction, text)


def _nominal(key: str, scene: Scene) -> float:
    """The scene's own value of a key, or its netlist's, of an element or a parameter."""
    table, name = split_key(key)
    value = scene.tables().get(table, {})
    for part in name.split("."):
        if isinstance(value, list):  # [[mode]]: the first is that of mode 2
            value = value[int(part) - 2] if int(part) - 2 < len(value) else None
        else:
            value = value.get(part) if isinstance(value, dict) else None
    if value is None and name.startswith("parameters."):
        if "netlist" not in scene.tables().get("load", {}):
            raise InputError(f"{key} must be of a netlist, but the scene has no load.netlist")
        if (circuit := Problem.of(scene).circuit) is not None:
            value = circuit.value_of(name.removeprefix("parameters."))
    if isinstance(value, str):  # a netlist's parameter, written with its unit
        value = read_value(key, value)
    if not isinstance(value, int | float) or value == 0.0:
        was = "missing" if value is None else "0"
        raise InputError(
            f"{key} must have a value in the scene to be spread about, but is {was}: give LOW:HIGH"
        )
    return float(value)


def spreads(
    given: Mapping[str, str] | Sequence[str], scene: Scene, argument: str = "vary"
) -> tuple[PartSpread, ...]:
    """The spreads of several keys, from texts KEY=SPREAD or a mapping of keys to spreads: the ``argument`` of a study.

    Raises InputError as `parse`, for a key that is named twice, and if absent.
    """
    if isinstance(given, Mapping):
        parts = tuple(spread(key, written, scene) for key, written in given.items())
    else:
        parts = tuple(
            parse(text, scene, argument) for text in ([given] if isinstance(given, str) else given)
        )
    if not parts:
        raise InputError(f"`{argument}` must be given for one key or more, but is left out")
    named_once([part.key for part in parts], f"`{argument}`")
    return parts
