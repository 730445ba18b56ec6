"""The effects in words, so that a page can say which are present and which are absent from the computation."""

from harvester.equations.problem import Problem

WORDS = {
    "negative_stiffness": "negative stiffness: two wells",
    "quadratic_stiffness": "quadratic stiffness",
    "softening_stiffness": "cubic stiffness that softens",
    "cubic_stiffness": "cubic stiffness",
    "linear_damping": "linear damping",
    "damping_x2": "damping that grows with x²",
    "damping_x4": "damping that grows with x⁴",
    "impact": "rigid stop: impacts with a restitution coefficient",
    "compliant_stop": "compliant stop: a spring and a damper in contact",
    "gap": "stop at a distance, or with preload",
    "opposite_stop": "opposite stop",
    "external_noise": "white noise of the base",
    "parametric_noise": "white noise on the stiffness",
    "correlated_noise": "correlation of both noises",
    "harmonic_drive": "harmonic motion of the base",
    "coloured_noise": "coloured noise of the base (Ornstein and Uhlenbeck)",
    "band_pass_noise": "noise of the base in a band",
    "recorded_acceleration": "recorded acceleration of the base",
    "tabulated_noise": "noise of the base with a tabulated density",
    "back_coupling": "back-coupling: the voltage's force on the mass",
    "resistive_load": "load resistance",
    "netlist": "circuit from a netlist",
}


def present(problem: Problem) -> list[str]:
    """The names of the effects that a scene calls for."""
    return [*problem.effects, *([] if problem.netlist is None else ["netlist"])]


def absent(problem: Problem) -> list[str]:
    """The names of the effects that a scene leaves out, which are not computed."""
    here = present(problem)
    return [name for name in WORDS if name not in here]
