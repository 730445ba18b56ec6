"""The gradient of a mean with respect to all coefficients at once, from one more solution: the adjoint.

Let A(c) p = 0 be the discrete equations with coefficients c, w p = 1 the mass and J = j p a mean.
With the solution of

    A^T q = j - J w

a small change of the coefficients changes the mean by

    dJ = dj p - q dA p - J dw p

in which p, q, the frame and, but for the stops, the mesh are constant.  The changes of A, j and w
are differences of the discrete equations themselves, at next to no cost: these are polynomials of
low degree in nearly all coefficients.
"""

from dataclasses import fields, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from harvester.arrays import Floats
from harvester.density.box import Setting
from harvester.density.coupled_modes import RESIDUAL, SWEEPS, Factors, integrals
from harvester.density.functionals import functionals
from harvester.density.mesh import Mesh
from harvester.density.refine import Solution
from harvester.density.weak_form import WeakForm
from harvester.equations.coefficients import Equations
from harvester.machine.cores import one_blas_thread

# of a coefficient, or of the box for a distance: differences of second order, and once extrapolated
STEP = 1e-3


def adjoint(factors: Factors, right: Floats) -> Floats:
    """The solution q of A^T q = right, where right is orthogonal to the density."""
    form = factors.form

    def from_above(z: Floats) -> Floats:
        q = np.zeros(z.shape)
        for group, chain in reversed(factors.chains):
            here = slice(group[0], group[-1] + 1)
            k = group[-1]
            remainder = z[here].copy()
            remainder[-1] -= form.to_lower(q, k)
            q[here] = chain.solve_transposed(remainder)
        return q

    if factors.is_joint or not form.back_coupled:
        return from_above(right)

    def preconditioned(z: Floats) -> Floats:
        return z + form.to_higher(from_above(z.reshape(form.shape))).ravel()

    n = right.size
    operator = LinearOperator((n, n), matvec=preconditioned, dtype=np.float64)
    z, _ = gmres(operator, right.ravel(), rtol=RESIDUAL, restart=SWEEPS, maxiter=1)
    return from_above(z.reshape(form.shape))


@one_blas_thread
def gradient(
    eqs: Equations, solution: Solution, setting: Setting, index: int = 0
) -> dict[str, float]:
    """The derivative of a mean (by its ``index`` in `functionals.NAMES`) with respect to each coefficient present.

    ``solution`` is the density in a setting; the error of a gradient is seen by that on another
    mesh.
    """
    form = solution.form
    p = solution.p
    mean = float(solution.means[index])
    masses = np.zeros(form.shape)
    masses[0] = integrals(form)
    q = adjoint(solution.factors, functionals(eqs, form)[index].reshape(form.shape) - mean * masses)

    def changed(name: str, step: float) -> float:
        other = replace(eqs, **{name: getattr(eqs, name) + step})
        moved = WeakForm(other, _moved(form.mesh, eqs, other), form.frame, form.modes)
        moved_weights = functionals(other, moved)[index].reshape(form.shape) - mean * _masses(moved)
        return float(np.vdot(moved_weights, p) - np.vdot(q, moved.apply(p)))

    result = {}
    for name in (
        field.name for field in fields(eqs) if isinstance(getattr(eqs, field.name), float)
    ):
        size = (
            setting.box.reach if name in ("gap", "opposite_gap") else abs(getattr(eqs, name))
        ) or 1.0
        wide, narrow = (
            (changed(name, h) - changed(name, -h)) / (2.0 * h)
            for h in (STEP * size, 0.5 * STEP * size)
        )
        result[name] = (4.0 * narrow - wide) / 3.0
    return result


def _masses(form: WeakForm) -> Floats:
    masses = np.zeros(form.shape)
    masses[0] = integrals(form)
    return masses


def _moved(mesh: Mesh, before: Equations, after: Equations) -> Mesh:
    """The mesh that follows the stops: it is moved with one, and stretched between two."""
    low, high = before.stops
    new_low, new_high = after.stops
    if np.isinf(low):
        return mesh
    stretch = (new_high - new_low) / (high - low) if np.isfinite(high) else 1.0
    return replace(mesh, x_breaks=new_low + stretch * (mesh.x_breaks - low))
