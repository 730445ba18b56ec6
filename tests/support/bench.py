"""Measurements as a bench gives them, made of equations that the fit does not use: matrices, and SciPy's integrator.

Each kind is a function of a random generator and a folder: it writes CSV files with the noise of
instruments and returns their names, as `harvester identify` accepts them, and the true value of each
parameter.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

G = 9.80665


@dataclass(frozen=True)
class Truth:
    """A device: modal mass (kg), f0 (Hz), quality, theta^2/(K C), clamped capacitance (F), loss."""

    mass: float
    f0: float
    q: float
    beta: float
    c: float
    loss: float = 0.0

    @property
    def stiffness(self):
        return self.mass * (2 * math.pi * self.f0) ** 2

    @property
    def theta(self):
        return math.sqrt(self.beta * self.stiffness * self.c)

    @property
    def damping(self):
        return math.sqrt(self.stiffness * self.mass) / self.q

    def parameters(self, *keys):
        """The true values by the keys of the answer."""
        every = {
            "short_circuit_frequency": self.f0,
            "quality_factor": self.q,
            "oscillator.damping_ratio": 0.5 / self.q,
            "open_circuit_frequency": self.f0 * math.sqrt(1 + self.beta),
            "coupling_coefficient": self.beta,
            "coupling_squared_per_mass": self.theta**2 / self.mass,
            "dielectric_loss": self.loss,
            "piezo.capacitance": self.c,
            "oscillator.mass": self.mass,
            "oscillator.stiffness": self.stiffness,
            "piezo.coupling": self.theta,
        }
        return {key: every[key] for key in keys}

    def states(self, load):
        """The matrix of (x, x', v) in open circuit or over a load; without v in short circuit."""
        k = self.stiffness
        d = self.damping
        m = self.mass
        if load == 0.0:
            return np.array([[0, 1], [-k / m, -d / m]])
        leak = 0.0 if load == math.inf else 1.0 / (load * self.c)
        return np.array(
            [[0, 1, 0], [-k / m, -d / m, -self.theta / m], [0, self.theta / self.c, -leak]]
        )


MECHANICAL = ("short_circuit_frequency", "quality_factor", "oscillator.damping_ratio")
ELECTRICAL = (*MECHANICAL, "coupling_coefficient", "coupling_squared_per_mass", "piezo.capacitance")
WHOLE = (*ELECTRICAL, "oscillator.mass", "oscillator.stiffness", "piezo.coupling")


def device(rng, loss=0.0):
    """A device of sizes that a bench has."""
    low, high = np.log([[5e-3, 20.0, 12.0, 0.02, 1e-8], [5e-2, 200.0, 80.0, 0.3, 1e-7]])
    return Truth(*np.exp(rng.uniform(low, high)), loss)


def impedance_of(truth, f, clamped=False):
    """Z in ohm: force and current balance, solved as two equations at each frequency."""
    out = []
    for w in 2 * np.pi * f:
        lossy = 1j * w * truth.c * (1 - 1j * truth.loss)
        mechanical = truth.stiffness - w * w * truth.mass + 1j * w * truth.damping
        if clamped:
            out.append(1 / lossy)
        else:  # K x = theta v, i = j w (theta x) + C j w v
            x = np.linalg.solve([[mechanical]], [truth.theta])[0]
            out.append(1 / (lossy + 1j * w * truth.theta * x))
    return np.array(out)


def response_of(truth, f, load):
    """X/a and V/a under a base acceleration, from the state matrix, shape (2, n)."""
    a = truth.states(load)
    drive = np.zeros(len(a))
    drive[1] = -1.0
    found = np.array([np.linalg.solve(1j * w * np.eye(len(a)) - a, drive) for w in 2 * np.pi * f])
    return found[:, 0], found[:, -1]


def decay_of(truth, t, load, x0):
    """The states of a ring-down from a displacement, shape (n, states), by the matrix's exponential."""
    a = truth.states(load)
    start = np.zeros(len(a))
    start[0] = x0
    if len(a) == 3:
        start[2] = truth.theta / truth.c * x0 * (0.0 if load != math.inf else 1.0)
    values, vectors = np.linalg.eig(a)
    weights = np.linalg.solve(vectors, start)
    return ((vectors * weights) @ np.exp(np.outer(values, t))).real.T


def bouncing(truth, r, gap, x0, t):
    """The displacement of a ring-down against a stop at x = -gap, by DOP853 from one turning point to the next.

    Where the mass turns beyond the stop it has met it on the way; a mere event would pass over one
    that only grazes.
    """
    a = truth.states(0.0)
    state = np.array([x0, 0.0])
    at = 0.0
    out = np.full(len(t), -gap)
    turn = lambda _, y: y[1]  # noqa: E731
    turn.terminal = True
    turn.direction = 1
    fast = x0 * 2 * math.pi * truth.f0
    while at < t[-1]:
        span = (at, at + 1.5 / truth.f0)
        run = solve_ivp(
            lambda _, y: a @ y,
            span,
            state,
            "DOP853",
            events=turn,
            rtol=1e-10,
            atol=1e-14,
            dense_output=True,
        )
        end = run.t[-1]
        after = np.array([run.y[0, -1], 1e-12 * fast])
        if run.y[0, -1] < -gap:
            falls = np.linspace(at, end, 2000)
            last = falls[np.flatnonzero(run.sol(falls)[0] > -gap)[-1]]
            end = brentq(lambda s, sol=run.sol: sol(s)[0] + gap, last, run.t[-1], xtol=1e-15)
            after = np.array([-gap + 1e-12 * x0, -r * run.sol(end)[1]])
            if after[1] < 1e-6 * fast and gap <= 0.0:
                break  # it rests
        here = (t >= at) & (t < end)
        out[here] = run.sol(t[here])[0] if here.any() else 0.0
        at, state = end, after
    return out


def write(path, heads, *columns):
    path.write_text(
        heads
        + "\n"
        + "\n".join(",".join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True))
    )
    return str(path)


def outliers(rng, values, share, size):
    """A share of values far off, as where a contact is loose."""
    bad = rng.uniform(size=len(values)) < share
    return np.where(bad, values * (1 + size * rng.choice([-1, 1], len(values))), values)


def _sweep(truth, count):
    return np.linspace(0.6, 1.6, count) * truth.f0


def impedance(rng, folder, form="polar"):
    """Size within 0.3 %, phase within 0.2 degrees, one point in a hundred far off."""
    truth = device(rng, loss=rng.uniform(0.005, 0.03))
    f = _sweep(truth, 201)
    z = impedance_of(truth, f)
    size = outliers(rng, np.abs(z) * (1 + 3e-3 * rng.standard_normal(len(f))), 0.01, 0.2)
    phase = np.degrees(np.angle(z)) + 0.2 * rng.standard_normal(len(f))
    z = size * np.exp(1j * np.radians(phase))
    if form == "polar":
        path = write(folder / "z.csv", "Frequency (Hz),|Z| (ohm),Phase (deg)", f, size, phase)
    elif form == "rx":
        path = write(folder / "z.csv", "f [Hz],R [kOhm],X [kOhm]", f, z.real / 1e3, z.imag / 1e3)
    else:
        path = write(
            folder / "z.csv", "freq (Hz),G (uS),B (uS)", f, (1 / z).real * 1e6, (1 / z).imag * 1e6
        )
    return [path], truth.parameters(*ELECTRICAL, "dielectric_loss", "open_circuit_frequency")


def voltage(rng, folder):
    """V/g over four loads, within 1 %, and its phase within half a degree."""
    truth = device(rng)
    f = _sweep(truth, 121)
    names = []
    for n, ratio in enumerate((0.1, 0.6, 2.5, 15.0)):
        load = ratio / (2 * math.pi * truth.f0 * truth.c)
        v = response_of(truth, f, load)[1] * G
        size = outliers(rng, np.abs(v) * (1 + 0.01 * rng.standard_normal(len(f))), 0.01, 0.5)
        phase = np.degrees(np.angle(v)) + 0.5 * rng.standard_normal(len(f))
        path = write(
            folder / f"v{n}.csv", "Frequency (Hz),Voltage (V/g),Phase (deg)", f, size, phase
        )
        names.append(f"{path}@{load:.12g}")
    return names, truth.parameters(*WHOLE)


def displacement(rng, folder):
    """The tip in short circuit, within 1 %, without a phase."""
    truth = device(rng)
    f = _sweep(truth, 161)
    size = (
        np.abs(response_of(truth, f, 0.0)[0]) * G * 1e3 * (1 + 0.01 * rng.standard_normal(len(f)))
    )
    return [
        write(folder / "x.csv", "Frequency (Hz),Displacement (mm/g)", f, size) + "@short"
    ], truth.parameters(*MECHANICAL)


def ring_downs(rng, folder):
    """Displacement in short and open circuit and voltage over a load, noise of 0.3 % of the first swing."""
    truth = device(rng)
    names = []
    t = np.linspace(0.0, 2.5 * truth.q / truth.f0 / math.pi, 1500)
    load = 1 / (2 * math.pi * truth.f0 * truth.c)
    for name, at, column in (("s", 0.0, 0), ("o", math.inf, 0), ("v", load, 2)):
        y = decay_of(truth, t, at, 1e-3)[:, column]
        y = y + 3e-3 * np.abs(y).max() * rng.standard_normal(len(t))
        if column == 0:
            path = write(folder / f"{name}.csv", "Time (s),Displacement (mm)", t, y * 1e3)
            names.append(path + ("@short" if at == 0.0 else "@open"))
        else:
            names.append(
                write(folder / f"{name}.csv", "t [ms],U [V]", t * 1e3, y) + f"@{load:.12g}"
            )
    return names, truth.parameters(*ELECTRICAL)


def weak(rng, folder):
    """As `joint`, with a coupling that vanishes in the noise: k^2 = 1e-5."""
    return joint(rng, folder, beta=1e-5)


def joint(rng, folder, beta=None):
    """An impedance and a voltage over one load: with the mass."""
    truth = device(rng, loss=0.015)
    truth = truth if beta is None else replace(truth, beta=beta)
    f = _sweep(truth, 151)
    z = impedance_of(truth, f)
    size = np.abs(z) * (1 + 3e-3 * rng.standard_normal(len(f)))
    phase = np.degrees(np.angle(z)) + 0.2 * rng.standard_normal(len(f))
    first = write(folder / "z.csv", "Frequency (Hz),|Z| (ohm),Phase (deg)", f, size, phase)
    load = 0.5 / (2 * math.pi * truth.f0 * truth.c)
    f = _sweep(truth, 101)
    w = 2 * np.pi * f
    h = 1j * w * truth.c / (1j * w * truth.c * (1 - 1j * truth.loss) + 1 / load)
    k = truth.stiffness * (1 + truth.beta * h) - w * w * truth.mass + 1j * w * truth.damping
    v = (
        np.abs(truth.mass / k * truth.theta / truth.c * h)
        * G
        * (1 + 0.01 * rng.standard_normal(len(f)))
    )
    second = write(folder / "v.csv", f"Frequency (Hz),Voltage at {load:.12g} ohm (V/g)", f, v)
    return [first, second], truth.parameters(*WHOLE, "dielectric_loss")


def displacement_file(folder, t, y, truth, r, gap):
    """The file of a ring-down against a stop, with the laser's offset, and the true parameters."""
    path = write(folder / "b.csv", "Time (s),Displacement (mm)", t, (y + 2e-4) * 1e3)
    stop = {"stop.restitution": r, "stop.gap": gap}
    return [path + "@short"], {**truth.parameters(*MECHANICAL), **stop}


def bounce(rng, folder):
    """A ring-down against a stop at a distance: a laser's displacement, noise of 0.3 % of the first swing."""
    truth = device(rng)
    r = rng.uniform(0.5, 0.95)
    x0 = 1e-3
    gap = rng.uniform(0.1, 0.4) * x0
    t = np.linspace(0.0, 12.0 / truth.f0, 2400)
    y = bouncing(truth, r, gap, x0, t) + 3e-3 * x0 * rng.standard_normal(len(t))
    return displacement_file(folder, t, y, truth, r, gap)


def bounces(rng, folder):
    """As `bounce`, of many kinds: r from 0.3, gaps from 0, qualities to 300, few and many swings, samples and noise."""
    truth = device(rng)
    truth = Truth(
        truth.mass,
        truth.f0,
        math.exp(rng.uniform(math.log(15.0), math.log(300.0))),
        truth.beta,
        truth.c,
    )
    r = rng.uniform(0.3, 0.97)
    x0 = 1e-3
    gap = rng.uniform(0.0, 0.5) * 1e-3
    swings = rng.uniform(8.0, 40.0)
    count = int(rng.uniform(25.0, 100.0) * 25.0)
    t = np.linspace(0.0, swings / truth.f0, max(count, int(30 * swings)))
    noise = math.exp(rng.uniform(math.log(1e-3), math.log(1e-2)))
    y = bouncing(truth, r, gap, x0, t) + noise * x0 * rng.standard_normal(len(t))
    return displacement_file(folder, t, y, truth, r, gap)


def several_modes(rng, folder, *modes):
    """An impedance with modes beside the first at (ratio of the frequency, share of the coupling) each; all modes."""
    truth = device(rng, loss=0.015)
    others = [replace(truth, f0=ratio * truth.f0, q=1.3 * truth.q, beta=share**2 * truth.beta / ratio**2)
              for ratio, share in modes]  # fmt: skip
    f = np.geomspace(0.6, max(1.6, 1.6 * modes[-1][0]), 301) * truth.f0
    z = 1 / sum(
        (1 / impedance_of(one, f) - 1 / impedance_of(one, f, clamped=True) for one in others),
        1 / impedance_of(truth, f),
    )
    size = np.abs(z) * (1 + 3e-3 * rng.standard_normal(len(f)))
    phase = np.degrees(np.angle(z)) + 0.2 * rng.standard_normal(len(f))
    return [write(folder / "z.csv", "Frequency (Hz),|Z| (ohm),Phase (deg)", f, size, phase)], (
        truth,
        *others,
    )


def impedance_rx(rng, folder):
    return impedance(rng, folder, "rx")


def impedance_gb(rng, folder):
    return impedance(rng, folder, "gb")


KINDS = {
    one.__name__: one
    for one in (
        impedance,
        impedance_rx,
        impedance_gb,
        voltage,
        displacement,
        ring_downs,
        joint,
        bounce,
        bounces,
    )
}
