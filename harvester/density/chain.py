"""Direct solution of one mode: the x-elements are a chain, each coupled to its neighbours by the flux between them."""

from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from harvester.arrays import Floats
from harvester.density.weak_form import WeakForm


class Chain:
    """The operator A_k - shift M of a mode, factorised, with the mass matrix M.

    Without a shift mode 0 alone is singular: its solutions are the stationary densities of any mass.  ``pin`` is the
    element whose mass is added there to its own equations, so that the solution of A p = (that element's integrals) has
    the mass 1 in it; None where the equations are not singular.
    """

    def __init__(self, form: WeakForm, mode: int, blocks: list[Floats], pin: int | None, shift: complex = 0.0) -> None:
        self.form, self.size = form, form.shape[2:]
        self.factors = []
        up, down = form.v_up, form.v_down
        count, nv = form.shape[1], form.shape[3]
        before = np.zeros((nv, nv))  # of the element to the left: density at its right end, from a flux into it there
        unit = np.zeros((blocks[0].shape[0], nv))
        unit[-nv:] = np.eye(nv)
        for e in range(count):
            block: Any = blocks[e].copy()
            if loss := form.mu * mode + shift:
                block = block - loss * form.mass_block(e)
            if e == pin and not mode:
                integrals = self.integrals(e).ravel()
                block += np.outer(integrals, integrals)
            block[:nv, :nv] += up @ before @ down
            factor = lu_factor(block, overwrite_a=True, check_finite=False)
            self.factors.append(factor)
            if e < count - 1:
                before = lu_solve(factor, unit, check_finite=False)[-nv:]

    def integrals(self, element: int) -> Floats:
        """The integral of each shape function of an element."""
        return np.outer(self.form.x_mass[element].sum(axis=0), self.form.v_mass.sum(axis=0))

    def solve(self, right: Any) -> Any:
        """The density of A p = right, both of the shape (x-elements, nodes in x, nodes in v)."""
        p, y = np.empty_like(right), right.copy()
        for e, factor in enumerate(self.factors):
            p[e] = lu_solve(factor, y[e].ravel(), check_finite=False).reshape(self.size)
            if e + 1 < len(p):
                y[e + 1, 0] -= self.form.v_up @ p[e, -1]
        for e in range(len(p) - 2, -1, -1):
            y[e, -1] += self.form.v_down @ p[e + 1, 0]
            p[e] = lu_solve(self.factors[e], y[e].ravel(), check_finite=False).reshape(self.size)
        return p

    def solve_transposed(self, right: Any) -> Any:
        """The same with the transpose of A."""
        p, y = np.empty_like(right), right.copy()
        for e, factor in enumerate(self.factors):
            p[e] = lu_solve(factor, y[e].ravel(), trans=1, check_finite=False).reshape(self.size)
            if e + 1 < len(p):
                y[e + 1, 0] += self.form.v_down.T @ p[e, -1]
        for e in range(len(p) - 2, -1, -1):
            y[e, -1] -= self.form.v_up.T @ p[e + 1, 0]
            p[e] = lu_solve(self.factors[e], y[e].ravel(), trans=1, check_finite=False).reshape(self.size)
        return p
