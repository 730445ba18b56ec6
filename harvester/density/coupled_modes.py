"""The solution of all modes: from the lowest to the highest, again and again if the voltage acts on the mass."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from harvester.arrays import Floats
from harvester.density.chain import Chain
from harvester.density.weak_form import WeakForm

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
