"""Values that no such device has: most are right in number and wrong in unit."""

import math

from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.quantities.kinds import Kind
from harvester.scene.keys import key_kind
from harvester.scene.physical import Excitation, Oscillator
from harvester.scene.scene import Scene

OVERDAMPED = 0.5  # damping ratio from which nothing resonates
FAR = 50.0  # times the resonance, or a part of it: no harvester is driven there


def unusual_values(scene: Scene) -> list[Diagnostic]:
    """A warning with the likely unit for each number of a scene that is far outside the usual range of such devices."""
    warnings = list[Diagnostic]()
    for table, name, value in scene.values():
        kind = key_kind(table, name)
        if kind is not None:
            warnings += unusual(
                f"{table}.{name}", value, kind, kind.example.strip("'").partition(" ")[2]
            )
    if scene.node is not None:
        warnings.append(note("node_left_out"))
    if scene.oscillator is not None:
        warnings += _resonance_warnings(scene.oscillator, scene.modal.frequency, scene.excitation)
    # by which the netlist times its switches
    farads = None if scene.load is None else scene.load.parameters.get("Cp")
    if farads is not None and scene.piezo is not None:
        piezo = scene.piezo.capacitance
        if not math.isclose(float(farads), piezo, rel_tol=1e-3):
            warnings.append(
                warning("other_capacitance", own=1e9 * float(farads), piezo=1e9 * piezo)
            )
    return warnings


def _resonance_warnings(
    oscillator: Oscillator, w0: float, shaking: Excitation | None
) -> list[Diagnostic]:
    """Warnings of values unusual only in combination with others: damping, and a frequency far off resonance."""
    warnings = list[Diagnostic]()
    ratio = 0.5 / oscillator.q if oscillator.q else oscillator.damping_ratio
    if ratio is not None and ratio >= OVERDAMPED:
        warnings.append(warning("overdamped", damping_ratio=ratio))
    resonance = w0 / (2.0 * math.pi)
    drive = None if shaking is None or shaking.acceleration_amplitude is None else shaking.frequency
    if drive is not None and resonance > 0.0 and not 1.0 / FAR <= drive / resonance <= FAR:
        numbers = {"frequency": drive, "ratio": drive / resonance, "resonance": resonance}
        warnings.append(warning("far_from_resonance", **numbers))
    return warnings


def unusual(what: str, value: float, kind: Kind, prefixed: str = "") -> list[Diagnostic]:
    """A warning that a value in SI units is far outside the range of such devices (`Kind.typical`), or none.

    ``prefixed`` is the unit, with a prefix, in which such values are mostly given.
    """
    low, high = kind.typical
    if value == 0.0 or low <= abs(value) <= high:
        return []
    likely = f"{value / 1000.0 ** (math.log10(abs(value)) // 3):.4g} {prefixed}"
    likely = likely if prefixed not in ("", kind.unit) else ""
    return [
        warning(
            "unusual_value",
            key=what,
            value=value,
            unit=kind.unit,
            low=low,
            high=high,
            likely=likely,
        )
    ]
