"""A driven oscillator against a stop by Siconos, for `second_opinion.py`; runs with the Python that has it.

    /usr/bin/python3 benchmarks/siconos_steady.py SCENE
    with SCENE = {"c": 0.2, "mu": 0.5, "r": 0.6, "gap": 0.2, "drive": 0.5, "frequency": 2.0}, in quotes

Debian has it as python3-siconos.  x'' + c x' + x = drive cos(w t), x >= -gap, Newton's law of impact, by Moreau's and
Jean's time stepping; the drive is the motion of a second, free mass, so that the whole is one linear system with one
unilateral constraint.  V' + mu V = x' is integrated afterwards, exactly for the steps of x.  Prints the mean of V^2
over the last `PERIODS` periods for a number of steps a period and for twice as many.
"""

import json
import math
import sys

import numpy as np
import siconos.kernel as sk

BURN_IN = 60
PERIODS = 20
STEPS = 4000


def mean_square_voltage(
    c: float, mu: float, r: float, gap: float, drive: float, frequency: float, steps: int
) -> float:
    """The mean of V^2 with so many steps a period."""
    h = 2.0 * math.pi / frequency / steps
    count = (BURN_IN + PERIODS) * steps
    mass = np.eye(2)
    damping = np.array([[c, 0.0], [0.0, 0.0]])
    stiffness = np.array([[1.0, -drive], [0.0, frequency**2]])
    system = sk.LagrangianLinearTIDS([0.0, 1.0], [0.0, 0.0], mass, stiffness, damping)
    stop = sk.Interaction(sk.NewtonImpactNSL(r), sk.LagrangianLinearTIR([[1.0, 0.0]], [gap]))
    model = sk.NonSmoothDynamicalSystem(0.0, (count + 1) * h)
    model.insertDynamicalSystem(system)
    model.link(stop, system)
    simulation = sk.TimeStepping(
        model, sk.TimeDiscretisation(0.0, h), sk.MoreauJeanOSI(0.5), sk.LCP()
    )
    x = np.zeros(count + 1)
    q = system.q()
    for n in range(1, count + 1):
        simulation.computeOneStep()
        x[n] = q[0]
        simulation.nextStep()
    kept = math.exp(-mu * h)
    V = 0.0
    total = 0.0
    gain = (1.0 - kept) / (mu * h)  # of an x' that is constant over the step
    for n, change in enumerate(np.diff(x)):
        V = V * kept + change * gain
        if n >= BURN_IN * steps:
            total += V * V
    return total / (PERIODS * steps)


if __name__ == "__main__":
    scene = json.loads(sys.argv[1])
    steps = scene.pop("steps", STEPS)
    print(json.dumps([mean_square_voltage(**scene, steps=n) for n in (steps, 2 * steps)]))
