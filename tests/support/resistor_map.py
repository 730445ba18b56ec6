"""The map of a period of a linear mass with a resistor: a load of one's own."""

import math
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from harvester.mechanics.period_map import PeriodMap
from harvester.mechanics.periodic import comes_back_after


class ResistorMap(PeriodMap):
    """A linear mass with a resistor: x'' = -x - c x' - beta V + a, V' = x' - mu V, with a as the step has it."""

    repeats = 1
    coordinates_and_speeds = 2
    slow = np.eye(3)

    def __init__(self, problem, h):
        super().__init__(problem.equations, problem.scales, h, 0.0)
        eqs = problem.equations
        flow = np.array([[0, 1, 0], [-1, eqs.c1, -eqs.beta], [0, 1, -eqs.mu]])
        self.step = expm(flow * h)
        self.push = np.linalg.solve(flow, (self.step - np.eye(3)) @ [0.0, 1.0, 0.0])
        self.present = np.zeros(3)
        self.wandered = 0

    @property
    def y(self):
        return self.present

    def turn(self, y, turns):
        squares = []
        a = self.shaking(0, turns * self.size)
        for before, after in pairwise(a):
            y = self.step @ y + self.push * 0.5 * (before + after)
            squares.append([y[2] ** 2, y[0] ** 2 + y[1] ** 2])
        square, moved = np.mean(squares, axis=0)
        square *= self.scales.volts**2
        return y, np.array([square / 1e6, square, moved])

    def wander(self, periods):
        sections = []
        for _ in range(periods):
            self.present, means = self.turn(self.present, 1)
            sections.append(self.present[:2])
        self.wandered += 1
        return comes_back_after(np.array(sections), math.sqrt(means[2]))
