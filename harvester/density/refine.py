"""The stationary density with the error of its means: of the mesh, of the modes and of the box, each by a comparison.

A mesh is compared with the next coarser one, K modes with K - 2, and the box with one that is a fifth larger; the last
is done on the coarser mesh.  So every part is that of a coarser solution than the one that is answered.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.density.box import Setting, settled
from harvester.density.functionals import NAMES, functionals
from harvester.density.mesh import RESOLUTIONS, Mesh, mesh
from harvester.density.solve import Factors, pinned, stationary
from harvester.density.weak_form import WeakForm
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError

WIDER = 0.2  # the share by which a box is made larger to see what it leaves out
TAILS = (20.0, 26.0, 32.0, 40.0)  # energies of the box's ends, in those of the motion
MODES = (6, 8, 10, 12, 16, 20, 26)
COSTLIER = 4.0  # times the last attempt that the next one takes
ROUNDING = 1e-11  # relative, of the solution of so many equations
UNSOLVED = 1e-8  # relative residual above which an answer is refused


@dataclass(frozen=True)
class Solution:
    """A density on one mesh, with its means."""

    form: WeakForm
    factors: Factors
    p: Floats
    means: Floats

    @property
    def residual(self) -> float:
        """How far the equations are from solved: the largest residual beside the largest of their terms."""
        left = float(np.abs(self.form.apply(self.p)).max())
        return left / float(np.abs(self.form.x_slope @ self.p[:1] @ (self.form.v_up + self.form.v_down).T).max())


@dataclass(frozen=True)
class Effort:
    """How hard an answer is tried: places in `RESOLUTIONS`, `MODES` and `TAILS`."""

    mesh: int = 1
    modes: int = 0
    tail: int = 0

    def raised(self, mesh: bool, modes: bool, tail: bool) -> "Effort | None":
        """The next effort in what is asked for; None where one of those is the last already."""
        after = Effort(self.mesh + mesh, self.modes + modes, self.tail + tail)
        ends = (after.mesh, RESOLUTIONS), (after.modes, MODES), (after.tail, TAILS)
        return after if all(place < len(values) for place, values in ends) else None


@dataclass(frozen=True)
class Answer:
    """The means of `NAMES` with the three parts of their errors, all of the shape (names,)."""

    means: Floats
    mesh_error: Floats
    modes_error: Floats
    box_error: Floats
    solution: Solution
    setting: Setting
    effort: Effort

    @property
    def error(self) -> Floats:
        """The whole error of each mean, with that of rounding."""
        return self.mesh_error + self.modes_error + self.box_error + ROUNDING * np.abs(self.means)

    def share(self) -> float:
        """The error of E[V^2] relative to it."""
        place = NAMES.index("voltage_squared")
        return float(self.error[place] / abs(self.means[place]))


def solution(eqs: Equations, setting: Setting, on: Mesh, modes: int) -> Solution:
    """The density on a mesh."""
    form = WeakForm(eqs, on, setting.frame, modes)
    factors = Factors(form, pinned(form, setting.peak))
    p = stationary(factors)
    return Solution(form, factors, p, functionals(eqs, form) @ p.ravel())


def modes_of(eqs: Equations, place: int) -> int:
    """The number of modes: one without a load, three where the voltage does not act on the mass, which is exact."""
    if eqs.mu is None:
        return 1
    return MODES[place] if eqs.beta else 3


def attempt(eqs: Equations, effort: Effort) -> Answer:
    """The means and their errors with one effort."""
    setting = settled(eqs, TAILS[effort.tail])
    modes = modes_of(eqs, effort.modes)
    fine_mesh, coarse_mesh = (mesh(eqs, setting.box, RESOLUTIONS[effort.mesh - step]) for step in (0, 1))
    wide_mesh = coarse_mesh.widened(eqs, setting.box.reach, WIDER)
    fine = solution(eqs, setting, fine_mesh, modes)
    coarse = solution(eqs, setting, coarse_mesh, modes)
    wide = solution(eqs, setting, wide_mesh, modes)
    fewer = coarse if modes < 4 else solution(eqs, setting, coarse_mesh, modes - 2)
    of_mesh, of_modes, of_box = (np.abs(coarse.means - other.means) for other in (fine, fewer, wide))
    return Answer(fine.means, of_mesh, of_modes, of_box, fine, setting, effort)


def refined(
    eqs: Equations, within: float, budget: float | None = None, progress: Callable[[float], None] | None = None
) -> Answer:
    """The means with an error of E[V^2] of ``within``, relative, or with the least that was reached.

    No further attempt begins that would not end within ``budget`` seconds.

    Raises SimulationError where the equations are not solved.
    """
    begin, effort, first = time.perf_counter(), Effort(), 0.0
    best: Answer | None = None
    while True:
        before = time.perf_counter()
        answer = attempt(eqs, effort)
        took = time.perf_counter() - before
        if answer.solution.residual > UNSOLVED:
            raise SimulationError("the equations of the density were not solved: use engine 'ensemble'")
        best = answer if best is None or answer.share() < best.share() else best
        first = first or best.share()
        if progress is not None:
            progress(min(max(math.log(first / best.share()), 0.1) / max(math.log(first / within), 0.1), 1.0))
        spent = time.perf_counter() - begin
        parts = [
            float(part[0]) > 0.25 * within * abs(float(answer.means[0]))
            for part in (answer.mesh_error, answer.modes_error, answer.box_error)
        ]
        after = effort.raised(*parts)
        late = budget is not None and spent + COSTLIER * took > budget
        if best.share() <= within or after is None or late:
            return best
        effort = after
