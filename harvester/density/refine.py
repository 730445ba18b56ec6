"""The stationary density with the error of its means: mesh, modes and box, each by a comparison.

The number of modes and the box are chosen first, on a coarse mesh, if both cost little: K modes are
compared with K - 2, and the box with one that is a fifth larger.  Then the mesh is refined, and
compared with the one before.  So each part is the error of a coarser solution than the one that is
answered.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.density.box import Setting, settled
from harvester.density.coupled_modes import Factors, pinned, stationary
from harvester.density.functionals import functionals
from harvester.density.mesh import RESOLUTIONS, Mesh, mesh
from harvester.density.pace import Pace
from harvester.density.weak_form import WeakForm
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from harvester.machine.cores import one_blas_thread
from harvester.presentation.diagnostic import refusal

# exponent of a power tail that is light, and more than it makes of the box's error
LIGHTEST, SAFETY = 12.0, 1.3
WIDER = 0.2  # the share by which a box is made larger to see what it leaves out
TAILS = (20.0, 25.0, 30.0, 36.0)  # energies of the box's ends, in those of the motion
MODES = (6, 8, 10, 12, 16, 20, 26)
NOISE_MODES = (5, 7, 9, 11, 13)
# share of an error that a larger box leaves, at most; place of the finest mesh
NO_BETTER = 0.3
FINEST_PROBE = 2
MOST_MEMORY = 2e9  # bytes of the factors of all modes, of which two meshes are held at once
MORE = 2.5  # bytes of the next mesh, or of more modes, in those of the last solution, at least
HALF_WAY = 0.4  # of the time, roughly, when box and modes of coloured noise are known
FINE = (1e-5, 1e-7)  # errors below which modes and box are chosen on finer meshes
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
        """How far the equations are from solved: the largest residual relative to the largest of their terms."""
        left = float(np.abs(self.form.apply(self.p)).max())
        return left / float(
            np.abs(self.form.x_slope @ self.p[:1] @ (self.form.v_up + self.form.v_down).T).max()
        )


@dataclass(frozen=True)
class Probed:
    """A box, a frame and a number of modes, with the errors that they leave of each mean, and a coarse solution."""

    setting: Setting
    modes: int
    modes_error: Floats
    box_error: Floats
    coarse: Solution


@dataclass(frozen=True)
class Answer:
    """The means of `NAMES` with the three parts of their errors, all of the shape (names,)."""

    means: Floats
    mesh_error: Floats
    modes_error: Floats
    box_error: Floats
    solution: Solution
    coarser: Solution
    setting: Setting

    @property
    def error(self) -> Floats:
        """The total error of each mean, with that of rounding."""
        return self.mesh_error + self.modes_error + self.box_error + ROUNDING * np.abs(self.means)

    @property
    def share(self) -> float:
        """The error of E[V^2] relative to it."""
        return float(self.error[0] / abs(self.means[0]))

    @property
    def parts(self) -> dict[str, float]:
        """The parts of the error of E[V^2], relative to it."""
        whole = abs(float(self.means[0]))
        errors = {"mesh": self.mesh_error, "modes": self.modes_error, "box": self.box_error}
        return {name: float(error[0]) / whole for name, error in errors.items()}


def solution(
    eqs: Equations, setting: Setting, on: Mesh, modes: int, pace: Pace | None = None
) -> Solution:
    """The density on a mesh.

    Raises SimulationError if the equations are not solved.
    """
    form = WeakForm(eqs, on, setting.frame, modes)
    with (pace or Pace()).solving(form.memory):
        factors = Factors(form, pinned(form, setting.peak))
        solved = Solution(form, factors, stationary(factors), np.empty(0))
    if not solved.residual <= UNSOLVED:
        raise SimulationError(refusal("density_not_solved"))
    return replace(solved, means=functionals(eqs, form) @ solved.p.ravel())


def probed(eqs: Equations, within: float, resolution: int, pace: Pace) -> Probed:
    """The smallest box and the fewest modes that leave a quarter of the error each, as found on a coarse mesh.

    ``resolution`` is the coarse mesh's index of `RESOLUTIONS`; if a larger box brings nothing, a
    finer one is used. The error of a box is computed once, not again with more modes.
    """
    # so few are exact where the voltage does not act on the mass
    few = 1 if eqs.mu is None else 0 if eqs.beta else 3
    tails = iter(TAILS)
    counts = iter([few] if few else MODES)
    setting = settled(eqs, next(tails), pace)
    modes = next(counts)
    box_error = math.inf
    fewer = None
    off = None
    while True:
        on = mesh(eqs, setting.box, RESOLUTIONS[resolution])
        base = solution(eqs, setting, on, modes, pace)
        if fewer is None:
            fewer = _with_fewer(eqs, setting, base, few)
        if off is None:
            wider = solution(eqs, setting, on.widened(eqs, setting.box.reach, WIDER), modes, pace)
            off = np.abs(base.means - wider.means)
        probe = Probed(setting, modes, np.abs(base.means - fewer.means), off, base)
        room = 0.25 * within * abs(float(base.means[0]))
        more = modes
        tail = None
        if probe.modes_error[0] > room:
            more = next(counts, modes)
        if off[0] > room:
            tail = next(tails, None)
            resolution += off[0] > NO_BETTER * box_error and resolution < FINEST_PROBE
            box_error = off[0]
        too_many = base.form.memory * more / modes > MOST_MEMORY
        if (more == modes and tail is None) or too_many or pace.is_late(MORE * base.form.memory):
            return probe
        fewer, off = _still_valid(base, more, off, room)
        modes = more
        setting = setting if tail is None else settled(eqs, tail)


def _coloured(eqs: Equations, probe: Probed, within: float, pace: Pace) -> Answer:
    """The means under coloured noise: the mesh is chosen with few modes of it, then their number on that mesh.

    So no solution has both the finer mesh, which determines the error, and many modes.
    """
    base = probe.coarse
    off = np.empty(0)
    for resolution in RESOLUTIONS[1:]:
        finer = solution(
            eqs, probe.setting, mesh(eqs, probe.setting.box, resolution), probe.modes, pace
        )
        mesh_error = np.abs(finer.means - base.means)
        room = 0.25 * within * abs(float(base.means[0]))
        if (
            mesh_error[0] <= room
            or pace.is_late(MORE * finer.form.memory)
            or MORE * finer.form.memory > MOST_MEMORY
        ):
            break
        base = finer
    setting = probe.setting
    best = base
    for count in NOISE_MODES:
        memory = base.form.memory * (count / setting.frame.noise_modes) ** 2
        if best is not base and (off[0] <= room or memory > MOST_MEMORY or pace.is_late(memory)):
            break
        setting = replace(setting, frame=replace(setting.frame, noise_modes=count))
        before = best
        best = solution(eqs, setting, base.form.mesh, probe.modes, pace)
        off = np.abs(best.means - before.means)
    return Answer(
        means=best.means,
        mesh_error=mesh_error,
        modes_error=probe.modes_error + off,
        box_error=probe.box_error,
        solution=best,
        coarser=finer,
        setting=setting,
    )


def _with_fewer(eqs: Equations, setting: Setting, base: Solution, few: int) -> Solution:
    """The solution with two modes fewer; the same if ``few`` modes are exact."""
    return base if few else solution(eqs, setting, base.form.mesh, base.form.modes - 2)


def _still_valid(
    base: Solution, more: int, off: Floats, room: float
) -> tuple[Solution | None, Floats | None]:
    """The state for the next round: the solution with two modes fewer, and the box's error, if the box stays."""
    if off[0] > room:
        return None, None
    return (base if more == base.form.modes + 2 else None), off


@one_blas_thread
def refined(
    eqs: Equations,
    within: float,
    budget: float | None = None,
    progress: Callable[[float], None] | None = None,
    tail: float = LIGHTEST,
) -> Answer:
    """The means with an error of E[V^2] of ``within``, relative, or with the least that was reached.

    No further mesh begins that would not end within ``budget`` seconds.  Noise of the stiffness leaves amplitudes A as
    likely as A^-(1 + tail), of which a box that is a fifth wider misses less by 1.2^-(tail - 2): so much is added.

    Raises SimulationError if the equations are not solved, and soon if no answer would come in
    the budget.
    """
    pace, report = Pace(budget), progress or (lambda _: None)
    beyond = SAFETY / (1.0 - (1.0 + WIDER) ** (2.0 - max(tail, 2.1))) if eqs.n2 else 1.0
    probe = probed(eqs, within, 0 if budget else sum(within < fine for fine in FINE), pace)
    probe = replace(probe, box_error=beyond * probe.box_error)
    if eqs.coloured is not None:
        report(HALF_WAY)
        answer = _coloured(eqs, probe, within, pace)
        report(1.0)
        return answer
    coarse = probe.coarse
    if (
        coarse.form.mesh.degree != RESOLUTIONS[0].degree
    ):  # modes and box were chosen on a finer mesh
        coarse = solution(
            eqs, probe.setting, mesh(eqs, probe.setting.box, RESOLUTIONS[0]), probe.modes
        )
    best = None
    first = 0.0
    for resolution in range(1, len(RESOLUTIONS)):
        on = mesh(eqs, probe.setting.box, RESOLUTIONS[resolution])
        if best is not None and (
            on.memory(probe.modes) > MOST_MEMORY or pace.is_late(on.memory(probe.modes))
        ):
            break
        finer = solution(eqs, probe.setting, on, probe.modes, pace)
        off = np.abs(finer.means - coarse.means)
        best = Answer(
            means=finer.means,
            mesh_error=off,
            modes_error=probe.modes_error,
            box_error=probe.box_error,
            solution=finer,
            coarser=coarse,
            setting=probe.setting,
        )
        coarse = finer
        first = first or best.share
        report(
            min(max(math.log(first / best.share), 0.1) / max(math.log(first / within), 0.1), 1.0)
        )
        mesh_matters = best.parts["mesh"] > 0.2 * (best.parts["modes"] + best.parts["box"])
        if best.share <= within or not mesh_matters:
            break
    assert best is not None, "there are several resolutions"
    return best
