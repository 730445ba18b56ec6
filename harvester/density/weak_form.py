"""The stationary Fokker-Planck equation of mass, stop and resistor in weak form, on a mesh in x and v and modes in y.

With y = x - V the equations of motion are

    x' = v,   v' = F(x, y) - c(x) v + noise of intensity N(x),   y' = mu (x - y)

so that y neither jumps at an impact nor feels the noise.  A density p is stationary if for every
test function g

    int p [v g_x + (F - c v) g_v + mu (x - y) g_y] - N p_v g_v + impacts = 0

The impacts at a stop at x = s carry the flux of speed w from -w to r w, as a density of its own:

    int_{w > 0} w p(s, -w) [g(s, r w) - g(s, -w)] dw

In y the density is a sum of modes, with z = (y - a x - m)/s of the frame,

    p(x, v, y) = sum_k p_k(x, v) He_k(z)/sqrt(k!) exp(-z^2/2)/sqrt(2 pi),   tested by He_j(z)/sqrt(j!)

With z' = -mu z + b, b = (mu (1 - a) x - mu m - a v)/s, the test function f(x, v) of mode j gives

    A_j p_j + sqrt(j) int b p_{j-1} f - mu sqrt(j (j - 1)) int p_{j-2} f
        + beta s int [sqrt(j) p_{j-1} + sqrt(j + 1) p_{j+1}] f_v = 0

where A_j is the operator of (x, v) at z = 0, less mu j.

In x elements are joined by the upwind flux of v, in v they are continuous.  With g = 1 mass is
conserved to rounding, with the lowest polynomials E[x V] = E[V^2], E[x' V] = mu E[V^2] and the
balance of power hold on every mesh.

Coloured noise a of the correlation time tau is one more quantity, that acts on v: a = (D/tau)^(1/2)
q, where q is Gaussian.  Each p_j is a sum of p_jk He_k(q)/sqrt(k!) exp(-q^2/2)/sqrt(2 pi) in turn,
with the equations

    A_j p_jk - k/tau int p_jk f + (D/tau)^(1/2) int [sqrt(k) p_{j,k-1} + sqrt(k + 1) p_{j,k+1}] f_v
    = 0

Long because all of these equations and the matrices that represent them are read together.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.density.elements import evaluated, products, quadrature
from harvester.density.forces import force, friction, noise
from harvester.density.mesh import Mesh
from harvester.equations.coefficients import Equations


def impact_flux(breaks: Floats, degree: int, restitution: float, way: float) -> Floats:
    """The matrix of int_{w > 0} w p(way w) f(-way r w) dw, with a row for each f and a column for each p.

    ``way`` is the sign of the velocity with which the mass meets the stop.  Both p and f are
    polynomials between the breaks of either, so that Gauss points between all of them integrate the
    flux exactly; nothing is assumed to be smooth across a break.
    """
    before = way * breaks[way * breaks >= 0.0]
    after = -way * breaks[-way * breaks >= 0.0]
    top = before.max()
    ends = before if restitution == 0.0 else np.concatenate([before, after / restitution])
    ends = np.unique(ends[ends <= top])
    ends = ends[np.concatenate([[True], np.diff(ends) > 1e-13 * top])]
    on_unit, weights = np.polynomial.legendre.leggauss(degree + 2)
    half = 0.5 * np.diff(ends)
    w = (ends[:-1, None] + half[:, None] * (1.0 + on_unit)).ravel()
    weight = (half[:, None] * weights).ravel() * w
    hit = evaluated(breaks, degree, way * w)
    return np.asarray(evaluated(breaks, degree, -way * restitution * w).T @ (weight[:, None] * hit))


@dataclass(frozen=True)
class ModeFrame:
    """The change of variable y = a x + m + s z of the modes, and how many coloured noise has."""

    slope: float
    offset: float
    scale: float
    noise_modes: int = 1


class WeakForm:
    """The bilinear form on densities of the shape (modes, x-elements, nodes in x, nodes in v).

    The ``v_nodes`` nodes in v come again for each further mode of coloured noise.
    ``back_coupled``: whether mode j + 1 acts on mode j.  The flux that leaves the mesh at an end
    that is ``lost`` does not come back: a first passage.
    """

    def __init__(
        self,
        eqs: Equations,
        mesh: Mesh,
        frame: ModeFrame,
        modes: int,
        lost: tuple[bool, bool] = (False, False),
    ) -> None:
        self.lost = lost
        self.mesh = mesh
        self.frame = frame
        self.modes = modes
        self.mu = eqs.mu or 0.0
        beta = 0.0 if eqs.mu is None else eqs.beta or 0.0
        self.lift = beta * frame.scale
        self.back_coupled = self.lift != 0.0 and modes > 1
        in_x = mesh.in_x
        x, values = in_x.points, in_x.values
        mean_force = force(eqs, x) - beta * ((1.0 - frame.slope) * x - frame.offset)
        weights = in_x.weights
        self.x_mass = products(weights, values, values)
        self.x_slope = products(weights, in_x.slopes, values[None])
        self.x_force = products(weights * mean_force, values, values)
        self.x_friction = products(weights * friction(eqs, x), values, values)
        self.x_noise = products(weights * noise(eqs, x), values, values)
        drift = self.mu * ((1.0 - frame.slope) * x - frame.offset) / frame.scale
        self.x_drift = products(weights * drift, values, values)
        self.tilt = frame.slope / frame.scale
        self._across(eqs)

    def _across(self, eqs: Equations) -> None:
        mesh = self.mesh
        across = quadrature(mesh.v_breaks, mesh.degree, mesh.degree + 2)
        v = across.points
        w = across.weights
        values = across.values
        up = joined(products(w * np.maximum(v, 0.0), values, values))
        down = joined(products(w * np.minimum(v, 0.0), values, values))
        self.v_mass = joined(products(w, values, values))
        self.v_up, self.v_down = up, down
        self.v_slope = joined(products(w, across.slopes, values[None]))
        self.v_friction = joined(products(w * v, across.slopes, values[None]))
        self.v_noise = joined(products(w, across.slopes, across.slopes))
        self.v_nodes = len(self.v_mass)
        at_low = 1.0 if eqs.restitution is None else eqs.restitution
        at_high = 1.0 if eqs.opposite_restitution is None else eqs.opposite_restitution
        # The end of a box where no stop is gives back what leaves it, with the speed turned round.
        self.low_end = down
        self.high_end = -up
        if not self.lost[0]:
            self.low_end = down + impact_flux(mesh.v_breaks, mesh.degree, at_low, -1.0)
        if not self.lost[1]:
            self.high_end = -up + impact_flux(mesh.v_breaks, mesh.degree, at_high, 1.0)
        self.v_colour = None if eqs.coloured is None else self._repeated(eqs)

    def _repeated(self, eqs: Equations) -> Floats:
        """The effect of coloured noise on the nodes in v, which are repeated for each of its modes."""
        assert eqs.coloured is not None and eqs.correlation_time is not None
        k = np.arange(self.frame.noise_modes)
        beside = np.diag(np.sqrt(k[1:]), 1) + np.diag(np.sqrt(k[1:]), -1)
        colour: Floats = np.kron(beside, self.v_slope) * math.sqrt(
            eqs.coloured / eqs.correlation_time
        )
        colour -= np.kron(np.diag(k), self.v_mass) / eqs.correlation_time
        for name in (
            "v_mass",
            "v_up",
            "v_down",
            "v_slope",
            "v_friction",
            "v_noise",
            "low_end",
            "high_end",
        ):
            setattr(self, name, np.kron(np.eye(len(k)), getattr(self, name)))
        return colour

    def over_v(self, matrix: Floats) -> Floats:
        """The weights of the integral over v, and over coloured noise, of a density times a matrix."""
        return np.asarray(matrix[: self.v_nodes].sum(axis=0))

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """The shape of a density."""
        return (self.modes, *self.x_mass.shape[:2], len(self.v_mass))

    @property
    def memory(self) -> float:
        """The bytes that the factors of all modes need, each by itself."""
        return self.mesh.memory(self.modes * self.frame.noise_modes**2)

    def diagonal_block(self, element: int) -> Floats:
        """The matrix of one x-element of mode 0, with its own part of the fluxes: rows are test functions."""
        up_down = self.v_up + self.v_down
        nx, nv = self.shape[2:]
        block = np.einsum("ab,ij->aibj", self.x_slope[element], up_down)
        for of_x, of_v, sign in (
            (self.x_force, self.v_slope, 1.0),
            (self.x_friction, self.v_friction, -1.0),
            (self.x_noise, self.v_noise, -1.0),
        ):
            block += np.einsum("ab,ij->aibj", sign * of_x[element], of_v)
        if self.v_colour is not None:
            block += np.einsum("ab,ij->aibj", self.x_mass[element], self.v_colour)
        block[0, :, 0, :] += self.low_end if element == 0 else self.v_down
        block[-1, :, -1, :] += self.high_end if element == self.shape[1] - 1 else -self.v_up
        return np.asarray(block.reshape(nx * nv, nx * nv))

    def mass_block(self, element: int) -> Floats:
        """The integrals of products of shape functions of one x-element."""
        return np.kron(self.x_mass[element], self.v_mass)

    def joint_block(
        self, element: int, diagonal: Floats, modes: range, shift: complex = 0.0
    ) -> Any:
        """The matrix of one x-element and some modes, less a shift times the mass matrix.

        ``diagonal`` is its `diagonal_block`; the shape is (modes, nodes in x, nodes in v) twice,
        test functions first.
        """
        mass = self.mass_block(element)
        nodes = self.shape[2:]
        block = np.zeros((len(modes), *nodes) * 2, complex if isinstance(shift, complex) else float)
        lift = self.lift * np.kron(self.x_mass[element], self.v_slope)
        drift = np.kron(self.x_drift[element], self.v_mass)
        drift += lift - self.tilt * np.kron(self.x_mass[element], self.v_up + self.v_down)
        for row, j in enumerate(modes):
            parts = {
                0: diagonal - (self.mu * j + shift) * mass,
                -1: math.sqrt(j) * drift,
                1: math.sqrt(j + 1.0) * lift,
            }
            parts[-2] = -self.mu * math.sqrt(j * (j - 1.0)) * mass
            for step, part in parts.items():
                if 0 <= row + step < len(modes):
                    block[row, :, :, row + step] = part.reshape(*nodes, *nodes)
        return block

    def loss(self) -> Floats:
        """The weights, on the first mode, of the mass that is lost in a unit of time."""
        weights = np.zeros(self.shape[1:])
        weights[0, 0] -= self.lost[0] * self.over_v(self.v_down)
        weights[-1, -1] += self.lost[1] * self.over_v(self.v_up)
        return weights

    def mass(self, p: Any) -> Any:
        """The integrals of a density with every test function."""
        return self.x_mass @ p @ self.v_mass.T

    def apply(self, p: Floats) -> Floats:
        """The form with every test function, for a density."""
        k = np.arange(self.modes)[:, None, None, None]
        total = self.x_slope @ p @ (self.v_up + self.v_down).T
        total += self.x_force @ p @ self.v_slope.T
        total -= self.x_friction @ p @ self.v_friction.T
        total -= self.x_noise @ p @ self.v_noise.T
        if self.v_colour is not None:
            total += self.x_mass @ p @ self.v_colour.T
        total[:, 0, 0] += p[:, 0, 0] @ self.low_end.T
        total[:, 1:, 0] += p[:, 1:, 0] @ self.v_down.T + p[:, :-1, -1] @ self.v_up.T
        total[:, -1, -1] += p[:, -1, -1] @ self.high_end.T
        total[:, :-1, -1] -= p[:, :-1, -1] @ self.v_up.T + p[:, 1:, 0] @ self.v_down.T
        if self.modes > 1:
            total -= self.mu * k * self.mass(p)
            total += self.from_higher(p)
            for j in range(1, self.modes):
                total[j] += self.from_lower(p, j)
        return total

    def from_lower(self, p: Floats, j: int) -> Floats:
        """The contribution of the lower modes to mode j."""
        root = np.sqrt(j)
        before = p[j - 1]
        made: Floats = root * (self.x_drift @ before @ self.v_mass.T)
        made -= root * self.tilt * (self.x_mass @ before @ (self.v_up + self.v_down).T)
        if self.lift:
            made += root * self.lift * (self.x_mass @ before @ self.v_slope.T)
        if j > 1:
            made -= self.mu * np.sqrt(j * (j - 1.0)) * (self.x_mass @ p[j - 2] @ self.v_mass.T)
        return made

    def from_higher(self, p: Floats) -> Floats:
        """The contribution of the next higher mode to each mode: the voltage's force on the mass."""
        made = np.zeros_like(p)
        if self.back_coupled:
            root = np.sqrt(np.arange(1.0, self.modes))[:, None, None, None]
            made[:-1] = self.lift * root * (self.x_mass @ p[1:] @ self.v_slope.T)
        return made

    def to_lower(self, q: Floats, j: int) -> Floats:
        """The transpose of `from_lower`: the contribution to mode j from those above, in the adjoint equations."""
        received = np.zeros(q.shape[1:])
        if j + 1 < self.modes:
            above = q[j + 1]
            root = np.sqrt(j + 1.0)
            received += root * (self.x_drift @ above @ self.v_mass)
            received -= root * self.tilt * (self.x_mass @ above @ (self.v_up + self.v_down))
            if self.lift:
                received += root * self.lift * (self.x_mass @ above @ self.v_slope)
        if j + 2 < self.modes:
            received -= (
                self.mu * np.sqrt((j + 2.0) * (j + 1.0)) * (self.x_mass @ q[j + 2] @ self.v_mass)
            )
        return received

    def to_higher(self, q: Floats) -> Floats:
        """The transpose of `from_higher`."""
        received = np.zeros(q.shape)
        root = np.sqrt(np.arange(1.0, self.modes))[:, None, None, None]
        received[1:] = self.lift * root * (self.x_mass @ q[:-1] @ self.v_slope)
        return received


def joined(blocks: Floats) -> Floats:
    """The matrix of a continuous line from those of its elements, which share the nodes at the breaks."""
    count, size = blocks.shape[:2]
    whole = np.zeros((count * (size - 1) + 1,) * 2)
    for e, block in enumerate(blocks):
        here = slice(e * (size - 1), e * (size - 1) + size)
        whole[here, here] += block
    return whole
