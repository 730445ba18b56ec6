"""The predictions of benchmarks/unseen.py of films: two beams of steel (D6), and one with a MOSFET bridge (D7)."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import unseen_scenes as tools

G, TURN = 9.80665, 2.0 * math.pi


def d6(drawn: Any, row: Any, sigma: Mapping[str, float]) -> Iterator[Any]:
    """Two beams of steel with a film, Sensors 2021, 21, 4747.  The mass is that of the stiffness and the resonance.

    k^2 is read as per cent, since the constants of the film allow no more than 1 % of the whole.
    """
    films = {"pzt": (10.0e-6, 90.75e9, 17.8e-12, 9.8e-9, 72.8, 0.10e-2, 101.6, 150e3),
             "pmn": (10.1e-6, 86.47e9, 26.9e-12, 20.5e-9, 147.4, 0.11e-2, 98.0, 82e3)}  # fmt: skip
    widths = {
        "coupling": sigma["coupling, film"],
        "stiffness": 0.15,
        "damping": 0.25,
        "capacitance": sigma["capacitance, measured"],
    }
    steel, width, length = 200e9, 6e-3, 9e-3
    for name, (film, young, d31, capacitance, q, k2, frequency, load) in films.items():
        of = drawn(widths)
        middle = 0.5 * (60e-6 + film)
        axis = young * film * middle / (steel * 60e-6 + young * film)
        bending = steel * (60e-6**3 / 12.0 + 60e-6 * axis**2) + young * (
            film**3 / 12.0 + film * (middle - axis) ** 2
        )
        stiffness = 3.0 * bending * width / length**3
        by_constants = d31 * young * width * (middle - axis) * 1.5 / length
        by_factor = math.sqrt(k2 * stiffness * capacitance)
        theta = math.sqrt(by_constants * by_factor)
        scenes = []
        for at in range(len(of["model"])):
            k = stiffness * of["stiffness"][at]
            mass, c = k / (TURN * frequency) ** 2, capacitance * of["capacitance"][at]
            coupling = theta * of["coupling"][at] * math.sqrt(of["stiffness"][at])
            scenes.append(tools.linear(mass, frequency, 0.5 / q * of["damping"][at], coupling, c))
        for what, ohm in (("v_open", 1e9), ("v_load", load)):
            # The best frequency at that load lies between the resonances in short and in open circuit.
            best = np.max(
                [
                    tools.amplitudes(
                        [
                            tools.shaken(scene, 0.5 * G, frequency * (1.0 + d), ohm)
                            for scene in scenes
                        ]
                    )
                    for d in (0.0, 5e-4, 1e-3, 2e-3)
                ],
                axis=0,
            )
            v = best * of["model"]
            yield row(f"D6.{name}_{what}", "V peak to peak", 2.0 * v)
            if what == "v_load":
                yield row(f"D6.{name}_p", "uW", 1e6 * 0.5 * v**2 / ohm)


def through_bridge(
    current: float, capacitance: float, inside: float, frequency: float, load: float
) -> float:
    """Voltage (V) of a smoothed load behind an ideal bridge on a current amplitude beside a capacitance and a resistor.

    The mean rectified current falls with the voltage, and the load takes V/R: the crossing, by halving.
    """
    w, steps = TURN * frequency, 400
    phases = (np.arange(steps) + 0.5) / steps * math.pi

    def surplus(voltage: float) -> float:
        v, through = -voltage, 0.0
        for (
            phase
        ) in phases:  # half a period from the current's zero, at which the bridge has just stopped
            dv = (current * math.sin(phase) - v / inside) / capacitance * (math.pi / (steps * w))
            v += dv
            if v > voltage:
                through += (v - voltage) * capacitance
                v = voltage
        return through * 2.0 * frequency - voltage / load

    low, high = 0.0, current * min(inside, 10.0 / (w * capacitance))
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surplus(middle) > 0.0 else (low, middle)
    return low


def d7(drawn: Any, row: Any) -> Iterator[Any]:
    """Aluminium nitride with a MOSFET bridge, doi 10.7567/JJAP.56.04CC03.

    Open: whether the internal resistance is beside the capacitance (half of the draws), and the drop of the transistors
    (0.05 to 0.35 V in all).
    """
    of = drawn({"current": 0.08, "capacitance": 0.10, "level": 0.05})
    few = slice(0, 48)
    power, voltage, empty = [], [], []
    for at, (i, c, level, u, model) in enumerate(
        zip(of["current"][few], of["capacitance"][few], of["level"][few], of["uniform"][few], of["model"][few],
            strict=True)
    ):  # fmt: skip
        inside, drop, cap = (4.1e6 if at % 2 else 1e9), 0.05 + 0.3 * u, 0.66e-9 * c
        v = max(through_bridge(3.1e-6 * i, cap, inside, 98.8, 12e6) * model - drop, 0.0)
        power.append(1e6 * v**2 / 12e6)
        admittance = math.hypot(1.0 / 10e6 + 1.0 / inside, TURN * 46.5 * cap)
        current = 3.2 * level * admittance
        voltage.append(max(through_bridge(current, cap, inside, 46.6, 12e6) * model - drop, 0.0))
        empty.append(through_bridge(current, cap, inside, 46.6, 1e12) * model - drop)
    yield row("D7.p_dc_12M", "uW", np.array(power))
    yield row("D7.v_dc_12M", "V", np.array(voltage))
    yield row("D7.v_rectified_open", "V", np.array(empty))
