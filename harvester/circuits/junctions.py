"""The equations of ngspice's semiconductor models, at 27 degrees Celsius.

A diode's current, with n = N k T/e (ngspice's dioload.c):

    v >= -3 n         Is (exp(v/n) - 1)
    down to -B        -Is (1 - (3 n/(v e))^3)                 the reverse leakage
    below -B          -Is exp(-(v + B)/nb)                    breakdown; B such that v = -Bv carries Ibv

and its charge, with that of the junction below Fc Vj and straight on above:

    q = Tt i + Cjo Vj/(1 - M) (1 - (1 - v/Vj)^(1 - M))

Left out: temperatures other than 27 degrees, currents of the side wall, of recombination and of
tunnelling, and noise.
"""

import math

from harvester.mechanics.kernels.compiled import inlined

THERMAL = 1.380649e-23 * 300.15 / 1.602176634e-19  # k T/e, V
EULER = math.e


@inlined
def diode(v, saturation, n, breakdown, reverse, capacitance, built_in, grading, forward, transit):
    """The current of a diode at the voltage v of its junction, its conductance, its charge, and its capacitance."""
    if v >= -3.0 * n:
        grown = math.exp(min(v / n, 500.0))
        i = saturation * (grown - 1.0)
        g = saturation * grown / n
    elif v >= -breakdown:
        part = 3.0 * n / (v * EULER)
        part *= part * part
        i = -saturation * (1.0 + part)
        g = 3.0 * saturation * part / v
    else:
        grown = saturation * math.exp(min(-(v + breakdown) / reverse, 500.0))
        i = -grown
        g = grown / reverse
    q, c = transit * i, transit * g
    if capacitance != 0.0:
        stored, c_stored = depletion(v, capacitance, built_in, grading, forward)
        q += stored
        c += c_stored
    return i, g, q, c


@inlined
def depletion(v, capacitance, built_in, grading, forward):
    """The charge of a junction's depletion layer, and its capacitance."""
    knee = forward * built_in
    if v < knee:
        left = 1.0 - v / built_in
        c = capacitance * math.exp(-grading * math.log(left))
        return (capacitance * built_in - c * left * built_in) / (1.0 - grading), c
    left = 1.0 - forward
    c = capacitance * math.exp(-grading * math.log(left))
    q = (capacitance * built_in - c * left * built_in) / (1.0 - grading)
    slope = c * grading / (built_in * left)
    return q + (v - knee) * (c + 0.5 * slope * (v - knee)), c + slope * (v - knee)


def breakdown_voltage(
    saturation: float, thermal: float, bv: float, ibv: float, tolerance: float = 1e-6
) -> float:
    """The voltage B beyond which the current is Is exp((v - B)/n), such that Bv carries Ibv (ngspice's diotemp.c).

    Where Ibv is so small that Is leaks more, it is Bv itself.
    """
    current = max(ibv, 0.0)
    if current < saturation * bv / THERMAL:
        return bv
    voltage = bv - thermal * math.log(1.0 + current / saturation)
    for _ in range(25):
        voltage = bv - thermal * math.log(current / saturation + 1.0 - voltage / THERMAL)
        reached = saturation * (math.exp((bv - voltage) / thermal) - 1.0 + voltage / THERMAL)
        if abs(reached - current) <= tolerance * current:
            break
    return voltage
