"""Checks of keys that depend on each other, which physical and nondimensional scenes share.

Each raises InputError.
"""

import itertools
from collections.abc import Callable

from harvester.errors import InputError, invalid
from harvester.scene.table import SceneTable

# room between two stops, as a part of their distance from rest: rounding leaves no less
NARROWEST = 1e-9


def check_shaking(table: SceneTable, amplitude: str, frequency: str, noise: str) -> None:
    """Refuse a key without the key that it needs, and several kinds of excitation that cannot be combined.

    White noise can be combined with all of them, and a sinusoid also with coloured noise.
    ``amplitude``, ``frequency`` and ``noise`` are the names of the table's keys.
    """
    # which says by itself what goes with an amplitude
    profile = getattr(table, "profile", None) is not None
    pairs = [] if profile else [(amplitude, frequency), (frequency, amplitude)]
    pairs += [("centre_frequency", "bandwidth")]
    pairs += [("bandwidth", "centre_frequency"), ("correlation_time", noise), ("bandwidth", noise)]
    for key, other in pairs:
        if getattr(table, key) is not None and getattr(table, other) is None:
            raise InputError(f"{table.TABLE}.{other} must be given with {key}, but is left out")
    noises = ["correlation_time", "centre_frequency"]
    names = [
        "profile" if profile else amplitude,
        *noises,
        "acceleration_file",
        "acceleration_psd_file",
    ]
    present = [key for key in names if getattr(table, key, None) is not None]
    sinusoid_in_noise = len(present) == 2 and present[0] == amplitude and present[1] in noises
    if len(present) > 1 and not sinusoid_in_noise:
        raise InputError(
            f"{table.TABLE}.{present[1]} must be left out if {present[0]} is given, but both are given"
        )


# keys that equations have with one mode, without a stop, or with a load resistance only
ONE_MODE = ("oscillator.inertia_x2", "piezo.coupling_x2")
NO_STOP = ("piezo.coupling_x2",)
# with a compliant stop, or two, the contact is computed for a mass that stays
ONE_RIGID_STOP = ("oscillator.inertia_x2",)
RESISTANCE_ONLY = (*ONE_MODE, "piezo.loss_tangent")


def check_together(given: Callable[[str], bool]) -> None:
    """Refuse keys next to tables with which no equations have them.

    ``given``: whether a scene has a key or a table.
    """
    modes = ("mode", "magnifier", "ball")
    for keys, others, remedy in (
        (ONE_MODE, modes, ""),
        (NO_STOP, ("stop", "opposite_stop"), ""),
        (ONE_RIGID_STOP, ("stop.stiffness", "opposite_stop"), ""),
        (
            RESISTANCE_ONLY,
            ("load.netlist",),
            ": give a load.resistance, or a loss as a resistor in the netlist",
        ),
    ):
        for key, other in itertools.product(keys, others):
            if given(key) and given(other):
                raise InputError(
                    f"{key} must be left out if {other} is given, but both are given{remedy}"
                )


def check_same(table: SceneTable) -> None:
    """Refuse several of the keys that mean the same in different ways, and none of them if one is needed."""
    for names, needed in table.SAME.items():
        given = [name for name in names if getattr(table, name) is not None]
        if len(given) > 1:
            key = f"{table.TABLE}.{given[1]}"
            raise InputError(f"{key} must be left out if {given[0]} is given, but both are given")
        if needed and not given:
            others = " or ".join(f"{table.TABLE}.{name}" for name in names[1:])
            raise InputError(
                f"{table.TABLE}.{names[0]} must be given, but is missing (or {others})"
            )


def check_rigid_or_compliant(
    table: str,
    prefix: str,
    restitution: float | None,
    stiffness: float | None,
    damping: float | None,
) -> None:
    """Refuse a stop that has neither or both of a restitution coefficient and a stiffness, or a damping alone."""
    compliant = f"{table}.{prefix}stiffness"
    if restitution is not None and stiffness:
        raise InputError(
            f"{compliant} must be left out if {table}.restitution is given, but both are given"
        )
    if not stiffness and damping:
        raise InputError(f"{compliant} must be given with {table}.{prefix}damping, but is left out")
    if restitution is None and not stiffness:
        raise InputError(
            f"{table}.restitution must be given, but is missing (or {compliant}, for a compliant stop)"
        )


def check_stop_damping(
    key: str, damping: float | None, stiffness: float | None, mass: float
) -> None:
    """Refuse a compliant stop with critical damping or more, off which the mass would not come by itself."""
    if damping and stiffness and damping >= (critical := 2.0 * (stiffness * mass) ** 0.5):
        raise invalid(key, f"be below the critical damping of the contact, {critical:.6g}", damping)


def check_opposite_stop(
    prefix: str, rigid: bool, gap: float | None, opposite_gap: float | None
) -> None:
    """Refuse an opposite stop without a rigid stop opposite to it, or without room between them."""
    if not rigid:
        raise InputError(
            f"{prefix}restitution must be used with a rigid stop, but there is none: turn the axis round"
        )
    low = 0.0 - (gap or 0.0)
    high = opposite_gap or 0.0
    if not high - low > NARROWEST * max(abs(high), abs(low)):
        raise invalid(f"{prefix}gap", f"be above {low:.12g}, so that the stops leave room", high)
