"""The solution of all modes: from the lowest to the highest, again and again if the voltage acts on the mass.

Some modes that follow each other are solved directly: the x-elements are a chain, coupled to their
neighbours by the flux between them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import LinearOperator, gmres

from harvester.arrays import Floats
from harvester.density.weak_form import WeakForm

# unknowns of an element up to which its inverse is quicker than its factors, for many sweeps
SMALL = 400


class Chain:
    """The operator A - shift M of modes that follow each other, factorised; M: the mass matrix.

    Without a shift mode 0 alone is singular: its solutions are the stationary densities of any
    mass.  ``pin`` is the element whose mass is added there to its own equations, so that the
    solution of A p = (that element's integrals) has the mass 1 in it; None if the equations are not
    singular.
    """

    def __init__(
        self,
        form: WeakForm,
        modes: range,
        blocks: list[Floats],
        pin: int | None,
        shift: complex = 0.0,
    ):
        self.form = form
        self.count = len(modes)
        self.factors = []
        self.inverses = list[Any]()
        self.reached = list[Any]()
        nx, nv = self.nodes = form.shape[2:]
        up, down = form.v_up, form.v_down
        ends = self.count, nx, nv
        # of the element to the left: density at its right end
        before = np.zeros((self.count, nv) * 2)
        size = self.count * nx * nv
        unit = np.zeros((*ends, self.count, nv))
        for k in range(self.count):
            unit[k, -1, :, k] = np.eye(nv)
        for e, diagonal in enumerate(blocks):
            block: Any = form.joint_block(e, diagonal, modes, shift)
            if e == pin and not modes[0]:
                integrals = self.integrals(e)
                block[0, :, :, 0] += integrals[:, :, None, None] * integrals
            block[:, 0, :, :, 0, :] += np.einsum(
                "ab,kblc,cd->kald", up, before, down, optimize=True
            )
            factor = lu_factor(block.reshape(size, size), overwrite_a=True, check_finite=False)
            self.factors.append(factor)
            if form.back_coupled and size <= SMALL:
                self.inverses.append(lu_solve(factor, np.eye(size), check_finite=False))
            if e < len(blocks) - 1:
                self.reached.append(lu_solve(factor, unit.reshape(size, -1), check_finite=False))
                before = self.reached[-1].reshape(*ends, self.count, nv)[:, -1]

    def integrals(self, element: int) -> Floats:
        """The integral of each shape function of an element."""
        return np.outer(self.form.x_mass[element].sum(axis=0), self.form.over_v(self.form.v_mass))

    def _of(self, element: int, right: Any, transposed: int = 0) -> Any:
        """The solution of one element for a right side (modes, nodes in x, nodes in v)."""
        if self.inverses:
            inverse = self.inverses[element]
            solution = (inverse.T if transposed else inverse) @ right.ravel()
        else:
            solution = lu_solve(
                self.factors[element], right.ravel(), trans=transposed, check_finite=False
            )
        return solution.reshape(self.count, *self.nodes)

    def solve(self, right: Any) -> Any:
        """The density of A p = right, both (modes, x-elements, nodes in x, nodes in v)."""
        p = np.empty_like(right)
        y = right.copy()
        count = right.shape[1]
        for e in range(count):
            p[:, e] = self._of(e, y[:, e])
            if e + 1 < count:
                y[:, e + 1, 0] -= p[:, e, -1] @ self.form.v_up.T
        for e in range(count - 2, -1, -1):
            from_right = (p[:, e + 1, 0] @ self.form.v_down.T).ravel()
            p[:, e] += (self.reached[e] @ from_right).reshape(self.count, *self.nodes)
        return p

    def solve_transposed(self, right: Any) -> Any:
        """The same with the transpose of A."""
        p = np.empty_like(right)
        y = right.copy()
        count = right.shape[1]
        for e in range(count):
            p[:, e] = self._of(e, y[:, e], 1)
            if e + 1 < count:
                y[:, e + 1, 0] += p[:, e, -1] @ self.form.v_down
        for e in range(count - 2, -1, -1):
            y[:, e, -1] -= p[:, e + 1, 0] @ self.form.v_up
            p[:, e] = self._of(e, y[:, e], 1)
        return p


SWEEPS, FEW_SWEEPS = 200, 120  # most iterations, and most where all modes can be solved at once
JOINT_MEMORY = 2e9  # bytes of the factors of all modes at once, at most
RESIDUAL = 1e-12  # of the equations, against the flux that normalises them
REFINEMENTS = 3


@dataclass
class Factors:
    """The factors of every mode, that solve the form for any right side.

    ``pin`` is the element in which the density has its mass while the equations are solved; None if they are not
    singular.  With a ``shift`` the form is less shift times the mass matrix, and right sides are complex if it is.
    """

    form: WeakForm
    pin: int | None
    shift: complex = 0.0

    def __post_init__(self) -> None:
        self.sweeps = 0
        modes = self.form.modes
        most = JOINT_MEMORY / self.form.modes
        self._factorise([range(k, k + 1) for k in range(modes)])
        self.can_join = (
            self.form.back_coupled
            and self.form.v_colour is None
            and self.form.mesh.memory(modes) < most
        )

    def _factorise(self, groups: list[range]) -> None:
        blocks = [self.form.diagonal_block(e) for e in range(self.form.shape[1])]
        self.chains = [(k, Chain(self.form, k, blocks, self.pin, self.shift)) for k in groups]

    @property
    def is_joint(self) -> bool:
        """Whether all modes are solved at once, so that nothing is left to iterate."""
        return len(self.chains) == 1

    def without_higher(self, right: Any) -> Any:
        """The solution in which no mode acts on a lower one of another chain."""
        p = np.zeros_like(right)
        y = right.copy()
        for group, chain in self.chains:
            k = group[0]
            if k:
                y[k] -= self.form.from_lower(p, k)
            p[k : group[-1] + 1] = chain.solve(y[k : group[-1] + 1])
        return p

    def solve(self, right: Any) -> Any:
        """The solution of (form + pin) p = right.

        If many sweeps over the modes do not end, all of them are factorised at once, if memory
        allows it.
        """
        if not self.form.back_coupled:
            return self.without_higher(right)

        def preconditioned(q: Any) -> Any:
            p = self.without_higher(q.reshape(self.form.shape))
            self.sweeps += 1
            return q + self.form.from_higher(p).ravel()

        n = right.size
        operator = LinearOperator((n, n), matvec=preconditioned, dtype=right.dtype)
        p = np.zeros_like(right)
        left = right
        target = RESIDUAL * np.abs(right).max()
        for turn in range(REFINEMENTS):  # of what rounding left of the equations
            if self.is_joint:
                p += self.without_higher(left)
            else:
                most = FEW_SWEEPS if self.can_join else SWEEPS
                before = self.sweeps
                q, _ = gmres(
                    operator, left.ravel(), rtol=RESIDUAL, atol=target, restart=most, maxiter=1
                )
                if self.sweeps - before >= most and self.can_join and not turn:
                    self._factorise([range(self.form.modes)])
                    continue
                p += self.without_higher(q.reshape(self.form.shape))
            left = right - self.applied(p)
            if np.abs(left).max() <= target:
                break
        return p

    def applied(self, p: Any) -> Any:
        """The equations' left side, with the mass of the pinned element."""
        made: Any = self.form.apply(p)
        if self.shift:
            made = made - self.shift * self.form.mass(p)
        if self.pin is None:
            return made
        share = self.chains[0][1].integrals(self.pin)
        made[0, self.pin] += share * np.vdot(share, p[0, self.pin])
        return made


def stationary(factors: Factors) -> Floats:
    """The stationary density of mass 1."""
    form = factors.form
    assert factors.pin is not None, "the equations of a stationary density are singular"
    right = np.zeros(form.shape)
    right[0, factors.pin] = factors.chains[0][1].integrals(factors.pin)
    p = factors.solve(right)
    return np.asarray(p / float(np.einsum("eij,eij->", p[0], integrals(form))))


def integrals(form: WeakForm) -> Floats:
    """The integral of each shape function: shape (x-elements, nodes in x, nodes in v)."""
    return np.asarray(form.x_mass.sum(axis=1)[:, :, None] * form.over_v(form.v_mass))


def pinned(form: WeakForm, x: float) -> int:
    """The element around a place where the density is large."""
    return int(np.clip(np.searchsorted(form.mesh.x_breaks, x + 1e-9) - 1, 0, form.shape[1] - 1))
