"""The effects that the equations may have, once each: the coefficient that brings it, and which theories know it.

A theory that simplifies the equations supports a scene only if it knows all of the scene's
effects.  A new effect is known to none until its entry here reports it, so that none leaves it out
in silence.  The full equations know every effect with a load resistance: engine `ensemble`.  In
lock-step with ngspice, and of a device with a netlist, they know all but `BEYOND_CIRCUITS`
(`harvester.scene.checks.check_together` refuses these with a netlist).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

LINEAR = "linear equations in closed form"
PUBLISHED = "the published averaging"
AVERAGED = "two-scale averaging"
DENSITY = "the stationary density"
REST = "stability of rest"
RULE = "ngspice's integration rule for a load resistor"
SWEPT = "frequency response"
PART = "part for circuit simulators"
UNIT = "an FMU"
HOPPING = "the rate of hopping between two wells"
THEORIES = (LINEAR, PUBLISHED, AVERAGED, DENSITY, REST, RULE, SWEPT, PART, UNIT, HOPPING)


@dataclass(frozen=True)
class Effect:
    """An effect: its name in answers, the coefficient that is not None if it is present, and the engines that know it.

    For two effects with one coefficient ``when`` decides which one the equations have.
    """

    name: str
    coefficient: str
    known_to: tuple[str, ...]
    when: Callable[[Any], bool] = lambda eqs: True

    def is_in(self, eqs: Any) -> bool:
        """Whether equations have it."""
        return getattr(eqs, self.coefficient) is not None and self.when(eqs)


# In the order of the equations.
EFFECTS = (
    Effect("negative_stiffness", "linear", (LINEAR, DENSITY, SWEPT, PART, UNIT, HOPPING)),
    Effect("quadratic_stiffness", "alpha2", (DENSITY, REST, SWEPT, PART, UNIT, HOPPING)),
    Effect("ceramic_softening", "softening", (DENSITY, SWEPT)),
    Effect("inertia_x2", "inertia", (SWEPT,)),
    Effect(
        "softening_stiffness",
        "alpha",
        (DENSITY, REST, RULE, SWEPT, PART, UNIT, HOPPING),
        lambda eqs: eqs.alpha < 0.0,
    ),
    Effect(
        "cubic_stiffness",
        "alpha",
        (PUBLISHED, AVERAGED, DENSITY, REST, RULE, SWEPT, PART, UNIT, HOPPING),
        lambda eqs: eqs.alpha >= 0.0,
    ),
    Effect("linear_damping", "c1", THEORIES),
    Effect("damping_x2", "c2", (PUBLISHED, AVERAGED, DENSITY, REST, RULE, SWEPT, PART, UNIT)),
    Effect("damping_x4", "c3", (PUBLISHED, AVERAGED, DENSITY, REST, RULE, SWEPT, PART, UNIT)),
    Effect("damping_v", "cv", (REST, SWEPT, UNIT)),
    Effect("impact", "restitution", (PUBLISHED, AVERAGED, DENSITY, REST, RULE, SWEPT, PART, UNIT)),
    Effect("compliant_stop", "stop_stiffness", (DENSITY, SWEPT, PART, UNIT)),
    Effect("gap", "gap", (AVERAGED, DENSITY, SWEPT, PART, UNIT)),
    Effect("opposite_stop", "opposite_restitution", (DENSITY, SWEPT, PART, UNIT)),
    Effect("external_noise", "n1", THEORIES),
    Effect(
        "parametric_noise", "n2", (LINEAR, PUBLISHED, AVERAGED, DENSITY, REST, RULE, SWEPT, UNIT)
    ),
    Effect(
        "correlated_noise", "n12", (LINEAR, PUBLISHED, AVERAGED, DENSITY, REST, RULE, SWEPT, UNIT)
    ),
    Effect("harmonic_drive", "drive", (LINEAR, REST, SWEPT, PART, UNIT)),
    Effect(
        "coloured_noise",
        "coloured",
        (LINEAR, DENSITY, REST, PART, UNIT),
        lambda eqs: eqs.bandwidth is None,
    ),
    Effect(
        "band_pass_noise",
        "coloured",
        (LINEAR, REST, PART, UNIT),
        lambda eqs: eqs.bandwidth is not None,
    ),
    Effect("recorded_acceleration", "record", (LINEAR, REST, PART, UNIT)),
    Effect("tabulated_noise", "density", (LINEAR, REST, PART, UNIT)),
    Effect(
        "further_modes",
        "modes",
        (LINEAR, SWEPT, PART),
        lambda eqs: eqs.modes.oscillator is None and eqs.modes.sprung > 1,
    ),
    Effect("magnifier", "modes", (LINEAR, SWEPT), lambda eqs: eqs.modes.oscillator is not None),
    Effect("ball", "modes", (), lambda eqs: eqs.modes.pull is not None),
    Effect(
        "dielectric_loss", "loss_tangent", (LINEAR, PUBLISHED, AVERAGED, DENSITY, SWEPT, HOPPING)
    ),
    Effect("coupling_x2", "gamma", (SWEPT,)),
    Effect("back_coupling", "beta", THEORIES),
    Effect("resistive_load", "mu", THEORIES),
)


# what an engine or study of one mode does not know
SEVERAL_MODES = frozenset(("further_modes", "magnifier", "ball"))
# what lock-step with ngspice and circuits in place of a load resistance do not know
BEYOND_CIRCUITS = frozenset(("inertia_x2", "dielectric_loss", "coupling_x2"))


def unknown_to(theory: str) -> frozenset[str]:
    """The names of the effects that a theory does not know.

    >>> sorted(unknown_to(UNIT))
    ['ball', 'ceramic_softening', 'coupling_x2', 'dielectric_loss', 'further_modes', 'inertia_x2', 'magnifier']
    """
    return frozenset(effect.name for effect in EFFECTS if theory not in effect.known_to)
