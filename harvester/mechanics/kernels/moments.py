"""Stationary moments: from the sums of many trajectories, or from a recorded path cut into batches."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import UnboundedResponseError
from harvester.mechanics.kernels.equation_of_motion import friction, withheld
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.path import Path
from harvester.mechanics.kernels.trajectory_batch import IDEAL_SUMS
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.value import mean_and_error

# times the energy: what no noise does to a stationary path, nor a record that begins quietly
GROWN = 1e9
FEWEST = 30  # samples of a trajectory that is long enough to grow


@dataclass(frozen=True)
class Moments:
    """Time averages of the motion, one entry a trajectory or batch, shape (n,) each.

    Nondimensional.

    V, V2, x, x2 and xV are means of the values at the kick and in mid-drift, whose errors of order
    h^2 have opposite signs.
    """

    V: Floats
    V2: Floats
    x: Floats
    x2: Floats
    v2: Floats
    xV: Floats  # noqa: N815 - the paper's symbols
    vV: Floats  # noqa: N815
    # f(x) x'^2, and the power of white noise that a mass 1 + inertia x^2 does not take up
    damped: Floats
    impacts: Floats  # impacts in a unit of time
    impact_loss: Floats  # energy that the stops took in a unit of time
    driven: Floats  # power that other excitation than white noise put in, a x'
    # power into the load over beta: mu V^2 of a resistance, mu U^2 of a circuit with a capacitor
    load: Floats
    # Sums of mean zero over the time, shape (n, columns)
    # (`harvester.mechanics.kernels.control_variates`); None: not asked for.
    controls: Floats | None = None

    def mean(self, name: str) -> tuple[float, float]:
        """Mean of one moment over the entries, and its standard error (infinite for one entry)."""
        return mean_and_error(getattr(self, name))

    def controlled(self, name: str, together: int = 1) -> Floats:
        """One moment's entries, less the part that their controls explain (`harvester.uncertainty.control_variate`).

        ``together`` consecutive ones come as their mean.

        Only for stationary trajectories: a control that is the change of a state has a mean of zero
        there.
        """
        return controlled_entries(getattr(self, name), self.controls, together)

    def agrees(self, other: "Moments", name: str) -> bool:
        """Whether one moment is the same in both, within two standard errors or 0.1 %."""
        (mine, my_error), (theirs, their_error) = self.mean(name), other.mean(name)
        return abs(mine - theirs) <= max(2.0 * math.hypot(my_error, their_error), 1e-3 * abs(mine))

    def __add__(self, other: "Moments") -> "Moments":
        """Moments that hold the entries of both, side by side."""
        return self._joined(other, lambda mine, theirs: np.concatenate([mine, theirs]))

    def mixed(self, other: "Moments", share: float) -> "Moments":
        """Moments over two windows of the same trajectories, of which the other makes the ``share`` of the time."""
        return self._joined(other, lambda mine, theirs: (1.0 - share) * mine + share * theirs)

    def averaged(self, together: int) -> "Moments":
        """Means of each ``together`` consecutive entries, such as the blocks of a trajectory, as one; no controls."""
        one_each = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "controls"}
        return Moments(
            **{name: values.reshape(-1, together).mean(axis=1) for name, values in one_each.items()}
        )

    def _joined(self, other: "Moments", join: Callable[[Floats, Floats], Floats]) -> "Moments":
        """Each moment of both joined, and the controls if both have them."""
        pairs = {f.name: (getattr(self, f.name), getattr(other, f.name)) for f in fields(self)}
        return Moments(
            **{
                name: join(mine, theirs)
                for name, (mine, theirs) in pairs.items()
                if mine is not None is not theirs
            }
        )

    def row(self, index: int) -> "Moments":
        """The entries of one scene, of moments of shape (scenes, n)."""
        one_each = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "controls"}
        return Moments(**{name: values[index] for name, values in one_each.items()})

    def balance(self, eqs: Equations) -> Floats:
        """Power in minus power out, over power in, entry by entry: zero within the errors.

        N1 + N2 E[x^2] + 2 N12 E[x] + E[a x'] = E[f x'^2] + beta mu E[V^2] + the power lost in the
        stops
        """
        power_in = (
            eqs.modal.shaken_mass * (eqs.n1 or 0.0)
            + (eqs.n2 or 0.0) * self.x2
            + 2.0 * (eqs.n12 or 0.0) * self.x
            + self.driven
        )
        out = self.damped + (eqs.beta or 0.0) * (eqs.mu or 0.0) * self.V2 + self.impact_loss
        return np.asarray((power_in - out) / power_in.mean())


# On arrays the uncompiled function does the same.
_friction = friction.py_func  # type: ignore[attr-defined]
_withheld = withheld.py_func  # type: ignore[attr-defined]


def correlation_time(means: Floats, values: Floats, length: float) -> float:
    """Integrated correlation time of a quantity from its means over windows of a length, and its values at one time.

    Var(mean) = 2 tau/length Var(value) for independent entries and length >> tau; from a window
    shorter than tau it comes out as length/2 at most.
    """
    spread = float(values.var())
    return 0.5 * length * float(means.var()) / spread if spread > 0.0 else 0.0


def from_sums(
    sums: Floats,
    samples: int | Floats,
    elapsed: float | Floats,
    loss: float | Floats,
    mu: float | Floats | None = None,
) -> Moments:
    """Moments of each trajectory, from its sums over ``samples`` in the time ``elapsed``.

    ``sums`` has the shape (blocks, rows, BATCH), the rows those of `IDEAL_SUMS`; for a resistance,
    whose sums lack the last one, the power is mu V^2.  ``loss`` is the unit of the impacts' losses.
    All of these are numbers, or have one entry a trajectory, shape (blocks BATCH,).
    """
    s = dict(
        zip(IDEAL_SUMS, np.moveaxis(sums, 1, 0).reshape(sums.shape[1], -1) / samples, strict=False)
    )
    rate = samples / elapsed
    v2 = 0.5 * (s["V2_kick"] + s["V2_mid"])
    return Moments(
        V=s["V"],
        V2=v2,
        x=s["x"],
        x2=0.5 * (s["x2_kick"] + s["x2_mid"]),
        v2=s["v2"],
        xV=s["xV"],
        vV=s["vV"],
        damped=s["fv2"],
        impacts=rate * s["impacts"],
        impact_loss=loss * rate * s["impact_loss"],
        driven=rate * s["driven"],
        load=s.get("load", (0.0 if mu is None else mu) * v2),
    )


def check_stationary(samples: Floats) -> None:
    """Raise UnboundedResponseError if samples (n, 3) of x, x' and V grew `GROWN` times over a long trajectory."""
    if len(samples) < FEWEST:
        return
    with np.errstate(over="ignore"):
        early, _, late = (float(np.mean(third**2)) for third in np.array_split(samples, 3))
    grown = min(late / max(early, 1e-99), 1e99)
    if late > GROWN * early:
        raise UnboundedResponseError(
            f"the response grows without bound: its energy grew {grown:.1e} times from the "
            "first to the last third of a run; look for its source: a negative damping, or in the netlist a "
            "negative capacitor or resistor, or a controlled source"
        )


def from_path(
    eqs: Equations,
    path: Path,
    discard: float,
    batches: int = 1,
    circuit: IdealCircuit | None = None,
) -> Moments:
    """Moments of a path after the time ``discard``, cut into ``batches`` equal parts.

    For rigid stops only.

    The load's power is that of a resistance, or of the ``circuit`` that the trajectory was made
    with.

    Raises UnboundedResponseError if x^2 + x'^2 + V^2 grew `GROWN` times from the first to the last
    third of them.
    """
    first = math.ceil(discard / (path.h * path.stride) - 1e-6)
    rows = (len(path.samples) - first) // batches
    part = path.samples[first : first + rows * batches].reshape(batches, rows, -1)
    check_stationary(path.samples[first:, 2:])
    xk, Vk, x, v, V = np.moveaxis(part, 2, 0)
    length = rows * path.stride * path.h
    edges = first * path.stride * path.h + length * np.arange(batches + 1)
    times, speeds = path.impacts.T if len(path.impacts) else np.empty((2, 0))
    r, r_high = eqs.restitution or 0.0, eqs.opposite_restitution or 0.0
    a: Floats | float = 0.0
    if path.shaking is not None:  # at the samples, in mid-drift
        indices = np.arange(first + 1, first + 1 + rows * batches) * path.stride
        after = np.minimum(indices + 1, len(path.shaking) - 1)
        a = 0.5 * (path.shaking[indices] + path.shaking[after]).reshape(batches, rows)
    lost = 0.5 * (1.0 - np.where(speeds > 0.0, r, r_high) ** 2) * speeds**2

    def mean(values: Floats) -> Floats:
        return np.asarray(values.mean(axis=1))

    v2 = mean(0.5 * (Vk**2 + V**2))
    load = (eqs.load or 0.0) * v2
    if circuit is not None and path.U is not None:
        power = circuit.mu * path.U[first : first + rows * batches] ** 2
        load = power.reshape(batches, -1).mean(axis=1)
    return Moments(
        V=mean(0.5 * (Vk + V)),
        V2=v2,
        x=mean(0.5 * (xk + x)),
        x2=mean(0.5 * (xk**2 + x**2)),
        v2=mean(v**2),
        xV=mean(0.5 * (xk * Vk + x * V)),
        vV=mean(v * V),
        damped=mean(_friction(x, v, eqs) * v**2 + _withheld(x, eqs)),
        impacts=np.histogram(times, edges)[0] / length,
        impact_loss=np.histogram(times, edges, weights=lost)[0] / length,
        driven=mean(a * v),
        load=load,
    )
