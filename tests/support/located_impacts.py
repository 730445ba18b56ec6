"""A linear device with stops under a harmonic drive, by exact flow between impacts that are located to rounding.

It shares nothing with the package: in physical coordinates the state (q, q', v, cos, sin, 1) obeys
a linear equation between events, whose solution is a sum of exponentials; a sign change of the
distance to a stop is looked for on a fine grid of times and then bisected.  An impact changes q'
along M^-1 phi, a compliant stop changes the matrix.
"""

import numpy as np


class Flow:
    """The solution of z' = A z by its eigenvectors."""

    def __init__(self, matrix):
        self.values, self.vectors = np.linalg.eig(matrix)
        self.inverse = np.linalg.inv(self.vectors)

    def at(self, z, times):
        """States at times, shape (len(times), size)."""
        weights = self.inverse @ z
        return ((np.exp(np.outer(times, self.values)) * weights) @ self.vectors.T).real


class Device:
    """M q'' + C q' + K q + theta v = -load A cos(W t), Cp v' + v/R = theta.q', and stops on phi.q."""

    def __init__(
        self,
        mass,
        damping,
        stiffness,
        theta,
        load,
        phi,
        *,
        capacitance,
        resistance,
        amplitude,
        frequency,
    ):
        self.n = n = len(mass)
        # what an impulse of 1 along phi does to q'
        self.phi = phi
        self.step = np.linalg.solve(mass, phi)
        self.free = np.zeros((2 * n + 4, 2 * n + 4))
        self.free[:n, n : 2 * n] = np.eye(n)
        for columns, matrix in ((slice(0, n), stiffness), (slice(n, 2 * n), damping)):
            self.free[n : 2 * n, columns] = -np.linalg.solve(mass, matrix)
        self.free[n : 2 * n, 2 * n] = -np.linalg.solve(mass, theta)
        self.free[n : 2 * n, 2 * n + 1] = -amplitude * np.linalg.solve(mass, load)
        self.free[2 * n, n : 2 * n] = theta / capacitance
        self.free[2 * n, 2 * n] = -1.0 / (resistance * capacitance)
        self.free[2 * n + 1, 2 * n + 2] = -frequency
        self.free[2 * n + 2, 2 * n + 1] = frequency
        self.period = 2.0 * np.pi / frequency
        self.grid = 0.05 / np.abs(np.linalg.eigvals(self.free)).max()

    def in_contact(self, stiffness, damping, gap):
        """The matrix while the compliant stop pushes: -stiffness (phi.q + gap) - damping phi.q' along phi."""
        n = self.n
        found = self.free.copy()
        found[n : 2 * n, :n] -= stiffness * np.outer(self.step, self.phi)
        found[n : 2 * n, n : 2 * n] -= damping * np.outer(self.step, self.phi)
        found[n : 2 * n, -1] -= stiffness * gap * self.step
        return found

    def mean_square_voltage(self, stops, periods, settle, compliant=None):
        """The mean of v^2 over periods of the drive after ``settle`` of them, from rest.

        ``stops`` are (side, place, restitution): phi.q must stay above the place (side 1) or below
        it (-1). ``compliant`` is (stiffness, damping, gap) of a spring below -gap, which is among
        the stops as (1, -gap, None).
        """
        n = self.n
        free = Flow(self.free)
        touching = None if compliant is None else Flow(self.in_contact(*compliant))
        z = np.zeros(2 * n + 4)
        time = 0.0
        square = 0.0
        z[2 * n + 1] = z[-1] = 1.0
        ticks = np.arange(9) * self.grid
        inside = False
        begin = settle * self.period
        end = (settle + periods) * self.period
        while time < end:
            flow = touching if inside else free
            path = flow.at(z, ticks)
            hit = self._first(path, flow, z, ticks, stops, inside)
            last = ticks[-1] if hit is None else hit[0]
            if time >= begin:
                fine = np.linspace(0.0, last, 17)
                square += np.trapezoid(flow.at(z, fine)[:, 2 * n] ** 2, fine)
            z = flow.at(z, np.array([last]))[0]
            time = time + last
            if hit is not None and hit[1] is None:
                inside = not inside
            elif hit is not None:
                speed = self.phi @ z[n : 2 * n]
                z[n : 2 * n] -= (1.0 + hit[1]) * speed / (self.phi @ self.step) * self.step
        return square / (time - begin)

    def _first(self, path, flow, z, ticks, stops, inside):
        """The time of the first contact on the path, and its restitution; None if there is none."""
        found = None
        for side, place, restitution in stops:
            way = -side if inside else side
            far = way * (path[:, : self.n] @ self.phi - place)
            for k in range(1, len(ticks)):
                if far[k] < 0.0 and (
                    far[k - 1] > 0.0 or way * (path[k - 1, self.n : 2 * self.n] @ self.phi) < 0.0
                ):
                    low = ticks[k - 1]
                    high = ticks[k]
                    for _ in range(50):
                        middle = 0.5 * (low + high)
                        there = way * (
                            flow.at(z, np.array([middle]))[0, : self.n] @ self.phi - place
                        )
                        low, high = (low, middle) if there < 0.0 else (middle, high)
                    if found is None or low < found[0]:
                        found = low, restitution
                    break
        return found
