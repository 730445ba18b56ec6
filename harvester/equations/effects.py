"""The names of the effects that are present in a scene's equations: nothing else is computed."""

from harvester.equations.coefficients import Equations


def effects(eqs: Equations) -> tuple[str, ...]:
    """Names of the effects present, in the order of the equations; nothing else is computed."""
    names = {
        "linear": "negative_stiffness",
        "alpha2": "quadratic_stiffness",
        "alpha": "softening_stiffness" if (eqs.alpha or 0.0) < 0.0 else "cubic_stiffness",
        "c1": "linear_damping",
        "c2": "damping_x2",
        "c3": "damping_x4",
        "restitution": "impact",
        "stop_stiffness": "compliant_stop",
        "gap": "gap",
        "opposite_restitution": "opposite_stop",
        "n1": "external_noise",
        "n2": "parametric_noise",
        "n12": "correlated_noise",
        "drive": "harmonic_drive",
        "coloured": "coloured_noise" if eqs.bandwidth is None else "band_pass_noise",
        "record": "recorded_acceleration",
        "density": "tabulated_noise",
        "beta": "back_coupling",
        "mu": "resistive_load",
    }
    return tuple(name for field, name in names.items() if getattr(eqs, field) is not None)
