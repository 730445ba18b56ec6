"""The coefficients of the equations and the effects of a scene, in words.

For one that is not here a report states the text of its scene key, or its name.
"""

COEFFICIENTS = {
    "linear": "linear stiffness (1 if it is not given)",
    "alpha2": "quadratic stiffness α2",
    "alpha": "cubic stiffness α",
    "softening": "softening of the ceramic, -x|x|",
    "inertia": "mass that grows with x²",
    "gamma": "coupling that grows with x²",
    "loss_tangent": "dielectric loss tangent",
    "c1": "damping c1 (negative: it damps)",
    "c2": "damping c2 of x²",
    "c3": "damping c3 of x⁴",
    "cv": "quadratic damping cv of |x'|",
    "beta": "electromechanical coupling β",
    "mu": "time-constant ratio μ = 1/(R Cp ω0)",
    "restitution": "restitution coefficient r",
    "gap": "distance of the stop",
    "opposite_restitution": "restitution coefficient of the opposite stop",
    "opposite_gap": "distance of the opposite stop",
    "stop_stiffness": "stiffness of the stop",
    "stop_damping": "damping of the stop",
    "n1": "intensity of the external noise N1 = ε1² D11",
    "n2": "intensity of the parametric noise N2 = ε2² D22",
    "n12": "correlation of both noises",
    "drive": "amplitude of the harmonic excitation",
    "drive_frequency": "frequency Ω of the harmonic excitation",
    "coloured": "intensity of the filtered noise",
    "correlation_time": "correlation time",
    "centre": "centre frequency of the noise",
    "bandwidth": "bandwidth of the noise",
    "record": "recorded acceleration",
    "density": "tabulated power spectral density",
}
EFFECTS = {
    "negative_stiffness": "negative stiffness: bistable",
    "quadratic_stiffness": "quadratic stiffness",
    "softening_stiffness": "cubic stiffness that softens",
    "cubic_stiffness": "cubic stiffness",
    "ceramic_softening": "softening of the strained ceramic",
    "inertia_x2": "mass that grows with x²",
    "dielectric_loss": "dielectric loss of the piezo",
    "coupling_x2": "coupling that grows with x²",
    "linear_damping": "linear damping",
    "damping_x2": "damping that grows with x²",
    "damping_x4": "damping that grows with x⁴",
    "damping_v": "quadratic damping: it grows with the speed",
    "impact": "rigid stop: impacts with a restitution coefficient",
    "compliant_stop": "compliant stop: a spring and a damper in contact",
    "gap": "stop at a distance, or with preload",
    "opposite_stop": "opposite stop",
    "external_noise": "white-noise excitation",
    "parametric_noise": "parametric noise: white noise on the stiffness",
    "correlated_noise": "correlation of both noises",
    "harmonic_drive": "harmonic excitation",
    "coloured_noise": "coloured-noise excitation: Ornstein and Uhlenbeck",
    "band_pass_noise": "band-limited noise excitation",
    "recorded_acceleration": "recorded excitation",
    "tabulated_noise": "noise excitation with a tabulated PSD",
    "further_modes": "further modes of vibration",
    "magnifier": "a mass on a spring under the device",
    "ball": "a free ball in a box on the mass",
    "back_coupling": "back-coupling: the voltage's force on the mass",
    "resistive_load": "load resistance",
    "netlist": "circuit from a netlist",
}


def in_words(effect: str) -> str:
    """The name of an effect in words, without the explanation after the colon."""
    return EFFECTS.get(effect, effect.replace("_", " ")).partition(":")[0]
