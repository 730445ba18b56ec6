"""The box and the frame of a density, from solutions on coarse meshes that are repeated until both are constant."""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gamma

from harvester.arrays import Floats
from harvester.density.coupled_modes import Factors, integrals, pinned, stationary
from harvester.density.forces import force, friction, heat
from harvester.density.mesh import RESOLUTIONS, Box, mesh
from harvester.density.moment_weights import MomentWeights, value
from harvester.density.pace import Pace
from harvester.density.weak_form import ModeFrame, WeakForm
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import refusal

ROUNDS = 25  # most coarse solutions
STILL = 0.1  # relative change of the box and of the frame that counts as none
MOMENT = 3  # degree of the moment of energy by which a tail is measured
MODES, NOISE_MODES = 4, 3


@dataclass(frozen=True)
class Setting:
    """The domain of a density: its box, its frame, and an x near which it has much of its mass."""

    box: Box
    frame: ModeFrame
    peak: float


def potential(eqs: Equations, frame: ModeFrame, x: Floats) -> Floats:
    """The energy of the mean force on the mass, 0 at its lowest on a grid of x in ascending order."""
    beta = 0.0 if eqs.mu is None else eqs.beta or 0.0
    pull = force(eqs, x) - beta * ((1.0 - frame.slope) * x - frame.offset)
    energy = np.concatenate([[0.0], -np.cumsum(0.5 * np.diff(x) * (pull[1:] + pull[:-1]))])
    return np.asarray(energy - energy.min())


def extent(
    eqs: Equations, frame: ModeFrame, tail: float, below: float, above: float, warmth: float
) -> Box:
    """The box between the stops on which no energy is more than ``tail`` times that of the motion.

    The latter is ``below`` on the left, ``above`` on the right, and ``warmth`` of the velocity.

    Raises SimulationError if absent.
    """
    low, high = eqs.rigid_stops
    below, above = tail * below, tail * above
    scale = math.sqrt(max(below, above))
    for _ in range(200):
        x = (
            np.linspace(max(low, -scale), min(high, scale), 4001)
            if max(low, -scale) < min(high, scale)
            else None
        )
        scale *= 1.3
        if x is None:  # the mass is pressed on a stop further away
            continue
        energy = potential(eqs, frame, x)
        first = int(np.argmax(energy <= below))
        last = len(x) - 1 - int(np.argmax(energy[::-1] <= above))
        if (first == 0 and x[0] > low) or (last == len(x) - 1 and x[-1] < high):
            continue
        padded = np.concatenate([[np.inf], energy, [np.inf]])
        rests = np.flatnonzero((energy <= padded[:-2]) & (energy < padded[2:]))
        rests = rests[(first <= rests) & (rests <= last)]
        reach = max(x[rests[0]] - x[first], x[last] - x[rests[-1]])
        if not reach > 0.0:  # one point alone is below: the warmth has all but vanished
            continue
        return Box(
            float(x[first]), float(x[last]), math.sqrt(2.0 * tail * warmth), float(reach), tail
        )
    raise SimulationError(refusal("density_without_box"))


def first_guess(eqs: Equations, tail: float) -> Setting:
    """A box and a frame from the balance of power of a mass that moves harmonically, without impacts."""
    beta = eqs.beta or 0.0
    mu = eqs.mu
    n1 = heat(eqs)
    n2 = eqs.n2 or 0.0
    electrical = 0.0 if mu is None else beta * mu / (1.0 + mu**2)
    warmth = math.sqrt(n1)
    stiff = max(abs(eqs.spring[0]), 1e-3)
    for _ in range(200):
        loss = float(friction(eqs, np.array([math.sqrt(warmth / stiff)]))[0]) + electrical
        target = (n1 + n2 * warmth / stiff) / max(
            loss, 0.02 * math.sqrt(n1 / warmth) if n1 else 0.02
        )
        warmth = warmth**0.7 * target**0.3
    frame = (
        ModeFrame(0.0, 0.0, 1.0)
        if mu is None
        else ModeFrame(mu**2 / (1.0 + mu**2), 0.0, math.sqrt(warmth) / (1.0 + mu))
    )
    box = extent(eqs, frame, tail, warmth, warmth, warmth)
    if eqs.coloured is not None:
        frame = replace(frame, noise_modes=NOISE_MODES)
    return Setting(box, frame, 0.5 * (box.low + box.high))


def settled(eqs: Equations, tail: float, pace: Pace | None = None) -> Setting:
    """Find the computational domain and the voltage frame for the stationary density.

    The marginal densities are less than exp(-tail) at the edge of the box. The box is resized on a
    coarse mesh until it stops changing.

    Raises
    ------
    SimulationError
        The box does not converge, or the budget is too short.
    """
    setting = first_guess(eqs, tail)
    pace = pace or Pace()
    modes = 1 if eqs.mu is None else MODES
    for _ in range(ROUNDS):
        form = WeakForm(eqs, mesh(eqs, setting.box, RESOLUTIONS[0]), setting.frame, modes)
        with pace.solving(form.memory):
            p = stationary(Factors(form, pinned(form, setting.peak)))
        pace.check(form.memory)
        after = Setting(_box(eqs, form, p, tail), regression(form, p), _peak(form, p))
        if _alike(setting, after):
            return after
        setting = replace(after, box=_eased(setting.box, after.box))
    raise SimulationError(refusal("density_without_box"))


def regression(form: WeakForm, p: Floats) -> ModeFrame:
    """The frame in which z has no mean, no correlation with x, and the variance 1."""
    if form.modes == 1:
        return form.frame
    moments = MomentWeights(form)
    x, y, xx, xy, yy = (
        value(moments.mean(i, 0, j), p) for i, j in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    )
    slope = (xy - x * y) / (xx - x * x)
    left = yy - y * y - slope**2 * (xx - x * x)
    scale = math.sqrt(left) if left > 0.0 else 0.5 * form.frame.scale
    return replace(form.frame, slope=slope, offset=y - slope * x, scale=scale)


def _box(eqs: Equations, form: WeakForm, p: Floats, tail: float) -> Box:
    """The box at which the marginals, continued as exp(-energy/warmth) from moments of the energy, reach exp(-tail).

    MomentWeights are most accurate on a coarse mesh: with exp(-U/T), E[U^n] = T^n Gamma(n +
    1/2)/Gamma(1/2).
    """
    mesh = form.mesh
    in_x = mesh.in_x
    in_v = mesh.in_v
    of_x = in_x.weights * ((p[0] @ form.over_v(form.v_mass)) @ in_x.values.T)
    line = np.einsum("eij,ei->j", p[0, ..., : form.v_nodes], form.x_mass.sum(axis=1))
    of_v = in_v.weights * (_by_element(line, mesh.degree) @ in_v.values.T)
    energy = potential(eqs, form.frame, in_x.points.ravel()).reshape(in_x.points.shape)
    rest = in_x.points.ravel()[np.argmin(energy)]
    sides = (in_x.points <= rest, in_x.points >= rest)
    speeds = _warmth(0.5 * in_v.points**2, of_v, form.mesh.v_breaks[-1] ** 2 / (8.0 * tail))
    whole = _warmth(energy, of_x, speeds)
    below, above = (
        _warmth(energy[side], of_x[side], whole)
        if math.isinf(stop) and of_x[side].sum() > 0.1
        else whole
        for side, stop in zip(sides, eqs.rigid_stops, strict=True)
    )
    below = max(below, speeds) if eqs.stop_stiffness is not None else below
    return extent(eqs, form.frame, tail, below, above, speeds)


def _peak(form: WeakForm, p: Floats) -> float:
    """The middle of the element that has the most mass."""
    most = int(np.argmax(np.einsum("eij,eij->e", p[0], integrals(form))))
    return float(form.mesh.x_breaks[most : most + 2].mean())


def _by_element(line: Floats, degree: int) -> Floats:
    """The values of a continuous line at the nodes of each of its elements."""
    return np.lib.stride_tricks.sliding_window_view(line, degree + 1)[::degree]


def _warmth(energy: Floats, density: Floats, otherwise: float) -> float:
    """The T of exp(-energy/T) that has the moment of degree `MOMENT` of the energy under a density.

    ``otherwise`` if a density that a far too coarse mesh makes negative has no such moment.
    """
    for n in range(MOMENT, 0, -1):
        moment = float((energy**n * density).sum() / density.sum())
        if moment > 0.0:
            return float((moment * gamma(0.5) / gamma(n + 0.5)) ** (1.0 / n))
    return otherwise


def _eased(before: Box, after: Box) -> Box:
    """The box after, but no less than half of that before: moments determine little of one that was far too large."""
    middle = 0.5 * (after.low + after.high)
    return replace(
        after,
        low=min(after.low, 0.5 * (before.low + middle)),
        high=max(after.high, 0.5 * (before.high + middle)),
        speed=max(after.speed, 0.5 * before.speed),
        reach=max(after.reach, 0.5 * before.reach),
    )


def _alike(before: Setting, after: Setting) -> bool:
    old, new = before.box, after.box
    ends = abs(old.low - new.low) + abs(old.high - new.high) < STILL * (new.high - new.low)
    scale = after.frame.scale
    frame = abs(math.log(before.frame.scale / scale)) < STILL
    tilt = (
        abs(before.frame.slope - after.frame.slope) * math.sqrt(new.speed**2 / 50.0) < STILL * scale
    )
    shift = abs(before.frame.offset - after.frame.offset) < 3.0 * STILL * scale
    return ends and abs(old.speed / new.speed - 1.0) < STILL and frame and tilt and shift
