"""Direct solution of some modes: the x-elements are a chain, coupled to their neighbours by the flux between them."""

from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from harvester.arrays import Floats
from harvester.density.weak_form import WeakForm

# unknowns of an element up to which its inverse is quicker than its factors, for many sweeps
SMALL = 400


class Chain:
    """The operator A - shift M of some modes that follow each other, factorised, with the mass matrix M.

    Without a shift mode 0 alone is singular: its solutions are the stationary densities of any mass.  ``pin`` is the
    element whose mass is added there to its own equations, so that the solution of A p = (that element's integrals) has
    the mass 1 in it; None if the equations are not singular.
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
        """The solution of one element for a right side of the shape (modes, nodes in x, nodes in v)."""
        if self.inverses:
            inverse = self.inverses[element]
            solution = (inverse.T if transposed else inverse) @ right.ravel()
        else:
            solution = lu_solve(
                self.factors[element], right.ravel(), trans=transposed, check_finite=False
            )
        return solution.reshape(self.count, *self.nodes)

    def solve(self, right: Any) -> Any:
        """The density of A p = right, both of the shape (modes, x-elements, nodes in x, nodes in v)."""
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
