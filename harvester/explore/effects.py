"""The effects that can be switched on and off as a whole on the page, with the keys of the scene that it has."""

from dataclasses import dataclass
from functools import cache

from harvester.scene.keys import keys


@dataclass(frozen=True)
class EffectCard:
    """An effect of a scene: present with all of its keys, or absent.

    ``table`` is the card of the page that it is in, ``keys`` are whole names such as ``stop.gap``.
    For the effects with the same ``choice`` one is present at most.  One that ``needs`` another, by
    its label or its choice, is absent if that is.  A ``fixed`` one cannot be switched off.
    """

    table: str
    label: str
    keys: tuple[str, ...]
    choice: str = ""
    needs: str = ""
    fixed: bool = False


BY_NAME = "excitation by name"
PHYSICAL = (
    EffectCard("oscillator", "mass", ("oscillator.mass",), fixed=True),
    EffectCard("oscillator", "spring, as a stiffness", ("oscillator.stiffness",), "spring"),
    EffectCard(
        "oscillator", "spring, as a resonance frequency", ("oscillator.frequency",), "spring"
    ),
    EffectCard("oscillator", "damping, as a ratio", ("oscillator.damping_ratio",), "damping"),
    EffectCard("oscillator", "damping, as a quality factor", ("oscillator.q",), "damping"),
    EffectCard("oscillator", "damping, as a coefficient", ("oscillator.damping",), "damping"),
    EffectCard("oscillator", "quadratic spring", ("oscillator.quadratic_stiffness",)),
    EffectCard("oscillator", "cubic spring", ("oscillator.cubic_stiffness",)),
    EffectCard("oscillator", "softening of the ceramic", ("oscillator.ceramic_softening",)),
    EffectCard("oscillator", "mass of X^2", ("oscillator.inertia_x2",)),
    EffectCard("oscillator", "damping of X^2", ("oscillator.damping_x2",)),
    EffectCard("oscillator", "damping of X^4", ("oscillator.damping_x4",)),
    EffectCard("oscillator", "quadratic damping", ("oscillator.damping_v",)),
    EffectCard("piezo", "clamped capacitance", ("piezo.capacitance",), fixed=True),
    EffectCard("piezo", "coupling, as a force per volt", ("piezo.coupling",), "coupling"),
    EffectCard(
        "piezo",
        "coupling, as a frequency in open circuit",
        ("piezo.open_circuit_frequency",),
        "coupling",
    ),
    EffectCard("piezo", "coupling of X^2", ("piezo.coupling_x2",)),
    EffectCard("piezo", "dielectric loss", ("piezo.loss_tangent",)),
    EffectCard("piezo", "strain, for limits and lifetimes", ("piezo.strain_per_displacement",)),
    EffectCard("stop", "rigid stop", ("stop.restitution",), "stop"),
    EffectCard("stop", "compliant stop", ("stop.stiffness",), "stop"),
    EffectCard("stop", "damping of the compliant stop", ("stop.damping",), needs="compliant stop"),
    EffectCard("stop", "at a distance from rest", ("stop.gap",), needs="stop"),
    EffectCard(
        "stop",
        "second stop opposite",
        ("opposite_stop.restitution", "opposite_stop.gap"),
        needs="rigid stop",
    ),
    EffectCard("excitation", "white noise", ("excitation.acceleration_psd",), "noise"),
    EffectCard(
        "excitation",
        "harmonic",
        ("excitation.acceleration_amplitude", "excitation.frequency"),
        "shaking",
    ),
    EffectCard(
        "excitation", "coloured noise", ("excitation.correlation_time",), "shaking", needs="noise"
    ),
    EffectCard(
        "excitation",
        "band-limited noise",
        ("excitation.centre_frequency", "excitation.bandwidth"),
        "shaking",
        needs="noise",
    ),
    EffectCard("excitation", "recorded acceleration", ("excitation.acceleration_file",), "shaking"),
    EffectCard("excitation", "tabulated PSD", ("excitation.acceleration_psd_file",), "shaking"),
    EffectCard("excitation", BY_NAME, ("excitation.profile",), "shaking"),
    EffectCard("excitation", "level of it", ("excitation.level",), needs=BY_NAME),
    EffectCard(
        "excitation",
        "peak acceleration of it",
        ("excitation.acceleration_amplitude",),
        needs=BY_NAME,
    ),
    EffectCard("excitation", "its frequency", ("excitation.frequency",), needs=BY_NAME),
    EffectCard("excitation", "harmonics of a machine", ("excitation.harmonics",), needs=BY_NAME),
    EffectCard("excitation", "duration of a shock", ("excitation.pulse_duration",), needs=BY_NAME),
    EffectCard("excitation", "shocks again and again", ("excitation.event_rate",), needs=BY_NAME),
    EffectCard("excitation", "noise on the stiffness", ("excitation.stiffness_noise",)),
)


def _card(table: str, label: str, *names: str, choice: str = "", needs: str = "") -> EffectCard:
    return EffectCard(
        table, label, tuple(f"nondimensional.{name}" for name in names), choice, needs
    )


NONDIMENSIONAL = (
    _card("oscillator", "linear damping", "c1"),
    _card("oscillator", "damping of x^2", "c2"),
    _card("oscillator", "damping of x^4", "c3"),
    _card("oscillator", "cubic spring", "alpha"),
    _card("oscillator", "quadratic spring", "alpha2"),
    _card("oscillator", "softening of the ceramic", "softening"),
    _card("oscillator", "mass of x^2", "inertia"),
    _card("oscillator", "sign of the linear spring", "linear"),
    _card("piezo", "coupling", "beta"),
    _card("piezo", "coupling of x^2", "gamma"),
    _card("piezo", "dielectric loss", "loss_tangent"),
    _card("stop", "rigid stop", "restitution", choice="stop"),
    _card("stop", "compliant stop", "stop_stiffness", choice="stop"),
    _card("stop", "damping of the compliant stop", "stop_damping", needs="compliant stop"),
    _card("stop", "at a distance from rest", "gap", needs="stop"),
    _card(
        "stop", "second stop opposite", "opposite_restitution", "opposite_gap", needs="rigid stop"
    ),
    _card("excitation", "external noise", "D11", choice="noise"),
    _card("excitation", "size of the external noise", "eps1", needs="noise"),
    _card("excitation", "parametric noise", "D22", choice="parametric"),
    _card("excitation", "size of the parametric noise", "eps2", needs="parametric"),
    _card("excitation", "correlation of the two noises", "D12", needs="parametric"),
    _card("excitation", "harmonic", "drive", "drive_frequency", choice="shaking"),
    _card("excitation", "coloured noise", "correlation_time", choice="shaking", needs="noise"),
    _card(
        "excitation",
        "band-limited noise",
        "centre_frequency",
        "bandwidth",
        choice="shaking",
        needs="noise",
    ),
    _card("load", "load resistance", "mu"),
)


# tables that are no effects of the page
AWAY = ("load", "storage", "node", "chip", "mode", "magnifier", "ball")


@cache
def effects(physical: bool) -> tuple[EffectCard, ...]:
    """All effects of a physical or of a nondimensional scene, in the order of the page.

    A key that is not listed above is an effect of its own, under the words by which the key itself
    states that it is.
    """
    listed = PHYSICAL if physical else NONDIMENSIONAL
    known = {key for effect in listed for key in effect.keys}
    others = [
        key
        for key in keys()
        if (key.table == "nondimensional") != physical and key.table not in AWAY
    ]
    cards = {"nondimensional": "oscillator", "opposite_stop": "stop"}
    named = {f"{key.table}.{key.name}": key for key in others}
    rest = [
        EffectCard(cards.get(key.table, key.table), key.meaning, (name,))
        for name, key in named.items()
        if name not in known
    ]
    return (*listed, *rest)


def present(effect: EffectCard, on: set[EffectCard]) -> bool:
    """Whether an effect that is among those switched ``on`` counts: those that it needs must also be on."""
    return effect in on and possible(effect, on)


def possible(effect: EffectCard, on: set[EffectCard]) -> bool:
    """Whether an effect could be present with those switched ``on``: those that it needs are among them."""
    return not effect.needs or any(effect.needs in (other.label, other.choice) for other in on)
