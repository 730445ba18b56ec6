"""Values that no such device has: most are right in number and wrong in unit."""

import math

from harvester.quantities.kinds import Kind
from harvester.scene.keys import TABLES, key_kind
from harvester.scene.physical import Excitation, Oscillator
from harvester.scene.scene import Scene

OVERDAMPED = 0.5  # damping ratio from which nothing resonates
FAR = 50.0  # times the resonance, or a part of it: no harvester is driven there


def unusual_values(scene: Scene) -> list[str]:
    """A warning with the likely unit for each number of a scene that is far outside of what such devices have."""
    found = []
    for table, keys in scene.tables().items():
        for name, value in keys.items() if table in TABLES else ():
            kind = key_kind(table, name)
            if kind is not None and (doubt := unusual(f"{table}.{name}", value, kind)):
                unit = kind.example.strip("'").partition(" ")[2]
                likely = f"{value / 1000.0 ** (math.log10(abs(value)) // 3):.4g} {unit}"
                found.append(doubt + (f": is {likely} meant?" if unit not in ("", kind.unit) else ""))
    if scene.oscillator is not None:
        found += _doubts_of_resonance(scene.oscillator, scene.excitation)
    own = None if scene.load is None else scene.load.parameters.get("Cp")  # by which the netlist times its switches
    if own is not None and scene.piezo is not None:
        piezo = scene.piezo.capacitance
        if not math.isclose(float(own), piezo, rel_tol=1e-3):
            found.append(
                f"load.parameters.Cp is {float(own) * 1e9:.4g} nF, but piezo.capacitance is {piezo * 1e9:.4g} nF: left "
                "out, it is the piezo's"
            )
    return found


def _doubts_of_resonance(oscillator: Oscillator, shaking: Excitation | None) -> list[str]:
    """Warnings of values that are out of the usual only beside others: damping, and a frequency far off resonance."""
    found, ratio = list[str](), oscillator.damping_ratio
    if ratio is not None and ratio >= OVERDAMPED:
        found.append(
            f"oscillator.damping_ratio is {ratio:.4g}, which is Q = {0.5 / ratio:.2g}: such a mass does not resonate; "
            f"is {ratio:.4g}% meant?"
        )
    resonance = math.sqrt(abs(oscillator.stiffness) / oscillator.mass) / (2.0 * math.pi)
    drive = None if shaking is None or shaking.acceleration_amplitude is None else shaking.frequency
    if drive is not None and resonance > 0.0 and not 1.0 / FAR <= drive / resonance <= FAR:
        found.append(
            f"excitation.frequency is {drive:.4g} Hz, {drive / resonance:.3g} times the resonance of {resonance:.4g} Hz"
            ": is its unit right?"
        )
    return found


def unusual(what: str, value: float, kind: Kind) -> str:
    """A warning that a value in SI units is far outside of what such devices have (`Kind.usual`); empty where not."""
    low, high = kind.usual
    if value == 0.0 or low <= abs(value) <= high:
        return ""
    return f"{what} is {value:.4g} {kind.unit}, far outside of the {low:g} to {high:g} {kind.unit} of such devices"
