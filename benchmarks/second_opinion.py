"""A second opinion: twelve scenes by means written apart from the package, beside its answers, with z-scores.

    .venv/bin/python benchmarks/second_opinion.py              # all, two minutes
    .venv/bin/python benchmarks/second_opinion.py stop bridge  # some

Only the package's reader of scenes is used here, and the engines that are judged.  Noise:
Heun's rule with a small step, Gaussian increments from NumPy's generator, both noises drawn on
their own, and impacts found on the path's cubic. Circuits: the whole device as one netlist, run by
`ngspice -b`, the mass as a coil, the spring as a capacitor. Impacts under a steady drive: Siconos
(Moreau's and Jean's time stepping), where Debian's python3-siconos is installed.
"""

import json
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from whole_device import mean_power

import harvester as hv

ROOT = Path(__file__).parents[1]
STEP = 0.02
BURN_IN = 200.0
DURATION = 600.0
TRAJECTORIES = 1024
# so near a stop, the step is so many times smaller: noise hides impacts from a long one
NEAR = 0.03
PARTS = 16
G = 9.80665
PAPER = {
    "alpha": 0.5,
    "beta": 0.05,
    "mu": 0.05,
    "c1": 0.01,
    "c2": 0.05,
    "c3": 0.1,
    "D11": 0.01,
    "D22": 0.01,
}
DAMPED = {"beta": 0.3, "mu": 0.5, "c1": -0.05, "D11": 0.01}
SCENES = {
    "stop": PAPER | {"restitution": 0.96},
    "strong impacts": PAPER | {"restitution": 0.5},
    "gap": PAPER | {"restitution": 0.9, "gap": 0.4},
    "preload": PAPER | {"restitution": 0.9, "gap": -0.1},
    "two stops": PAPER
    | {"restitution": 0.9, "gap": 0.3, "opposite_restitution": 0.8, "opposite_gap": 0.5},
    "coloured": DAMPED | {"restitution": 0.9, "correlation_time": 0.7},
    "bistable": DAMPED | {"linear": -1.0, "alpha": 1.0, "D11": 0.02},
    "correlated noises": PAPER | {"restitution": 0.9, "D12": 0.008},
}
# Scene and ngspice's tolerance; the whole device with SSHI gets stuck ("timestep too small") at a
# smaller one.
CIRCUITS = {
    "bridge": ("shu_lien_2006.toml", 1e-6),
    "parallel SSHI": ("shu_lien_wu_2007.toml", 1e-4),
}

SICONOS = "/usr/bin/python3"  # Debian's own, which sees Debian's package
IMPACTS = {
    "periodic impacts": {
        "c": 0.2,
        "mu": 0.5,
        "r": 0.6,
        "gap": 0.2,
        "drive": 0.5,
        "frequency": 2.0,
        "steps": 4000,
    },
    "chatter": {
        "c": 0.2,
        "mu": 0.5,
        "r": 0.8,
        "gap": 0.0,
        "drive": 0.5,
        "frequency": 1.5,
        "steps": 8000,
    },
}


@numba.njit(nogil=True)
def paths(
    seed,
    count,
    longest,
    burn,
    steps,
    linear,
    alpha,
    beta,
    mu,
    c1,
    c2,
    c3,
    r,
    low,
    r2,
    high,
    n1,
    n2,
    share,
    tau,
):
    """Time averages of V^2, one a trajectory, shape (count,).

    x'' = -f(x) x' - linear x - alpha x^3 - beta V + noise, low < x < high; U = V - x does not jump at an impact and
    follows U' = -mu V.  ``share`` is the correlation of the two noises, ``tau`` the memory of the first (0: white).
    The step is ``longest``, and a part of it near a stop.
    """
    np.random.seed(seed)
    found = np.zeros(count)
    rest = math.sqrt(1.0 - share * share)
    for k in range(count):
        x = max(low, 0.0) + 0.1
        v = 0.0
        a = 0.0
        u = -x
        for n in range(burn + steps):
            near = min(x - low, high - x) < NEAR + 3.0 * longest * abs(v)
            parts = PARTS if near else 1
            h = longest / parts
            for _ in range(parts):
                g1 = math.sqrt(h) * np.random.standard_normal()
                g2 = share * g1 + rest * math.sqrt(h) * np.random.standard_normal()
                d1, e1 = 0.0, 0.0  # noise of the first kind, on v itself or on its filter
                if tau > 0.0:
                    e1 = math.sqrt(2.0 * n1) / tau * g1
                else:
                    d1 = math.sqrt(2.0 * n1) * g1
                d2 = math.sqrt(2.0 * n2) * g2
                f0 = (
                    a
                    - (c3 * x**4 - c2 * x * x - c1) * v
                    - linear * x
                    - alpha * x**3
                    - beta * (u + x)
                )
                xp = x + h * v
                vp = v + h * f0 + d1 + x * d2
                up = u - h * mu * (u + x)
                ap = a - h * a / tau + e1 if tau > 0.0 else 0.0
                f1 = (
                    ap
                    - (c3 * xp**4 - c2 * xp * xp - c1) * vp
                    - linear * xp
                    - alpha * xp**3
                    - beta * (up + xp)
                )
                xn = x + 0.5 * h * (v + vp)
                vn = v + 0.5 * h * (f0 + f1) + d1 + 0.5 * (x + xp) * d2
                an = a - 0.5 * h * (a + ap) / tau + e1 if tau > 0.0 else 0.0
                for wall, back in ((low, r), (high, r2)):
                    side = 1.0 if wall == low else -1.0
                    if side * (xn - wall) < 0.0:
                        s0, s1 = 0.0, 1.0  # where the cubic through both ends meets the wall
                        for _iteration in range(30):
                            s = 0.5 * (s0 + s1)
                            p = (
                                x
                                + (xn - x) * s * s * (3.0 - 2.0 * s)
                                + h * s * (1.0 - s) * ((1.0 - s) * v - s * vn)
                            )
                            if side * (p - wall) > 0.0:
                                s0 = s
                            else:
                                s1 = s
                        hit = v + s1 * (vn - v)
                        after = side * abs(back * hit)
                        xn = wall + (1.0 - s1) * h * (after + 0.5 * (vn - hit))
                        vn = after + (vn - hit)
                        if side * (xn - wall) < 0.0:  # thrown back within the step
                            xn = wall
                            vn = side * abs(back * vn)
                un = u - 0.5 * h * mu * (u + x + up + xn)
                if n >= burn:
                    found[k] += 0.5 * h * ((u + x) ** 2 + (un + xn) ** 2)
                x = xn
                v = vn
                u = un
                a = an
        found[k] /= steps * longest
    return found


def by_heun(
    scene: hv.Scene, seed: int, count: int, duration: float, burn_in: float = BURN_IN
) -> tuple[float, float]:
    """E[V^2] of a nondimensional scene and its standard error, from its keys as they stand in the file."""
    t = scene.nondimensional
    n1 = t.D11 or 0.0
    n2 = t.D22 or 0.0
    n12 = t.D12 or 0.0
    low = -math.inf if t.restitution is None else -(t.gap or 0.0)
    high = math.inf if t.opposite_restitution is None else t.opposite_gap or 0.0
    share = n12 / math.sqrt(n1 * n2) if n12 else 0.0
    tau = t.correlation_time or 0.0
    linear = 1.0 if t.linear is None else t.linear
    values = paths(
        seed, count, STEP, round(burn_in / STEP), round(duration / STEP), linear, t.alpha or 0.0,
        t.beta or 0.0, t.mu or 0.0, t.c1 or 0.0, t.c2 or 0.0, t.c3 or 0.0, t.restitution or 0.0, low,
        t.opposite_restitution or 0.0, high, n1, n2, share, tau,
    )  # fmt: skip
    return float(values.mean()), float(values.std(ddof=1) / math.sqrt(count))


def by_ngspice(scene: hv.Scene, steps: int, reltol: float, settled: float = 6.0) -> float:
    """Mean power (W) of the load by ngspice alone, after ``settled`` time constants of load and smoothing capacitor."""
    o = scene.oscillator
    p = scene.piezo
    e = scene.excitation
    load = scene.load
    text = (ROOT / "netlists" / f"{load.netlist}.cir").read_text()
    period = 1.0 / e.frequency
    wait = math.ceil(settled * load.parameters["R"] * load.parameters["C"] / period) + 20
    device = {
        "M": o.mass, "k": o.stiffness, "c": 2.0 * o.damping_ratio * math.sqrt(o.mass * o.stiffness),
        "theta": p.coupling, "Cp": p.capacitance, "force": o.mass * e.acceleration_amplitude, "f": e.frequency,
    }  # fmt: skip
    subcircuit = re.search(r"^\.subckt.*?^\.ends[^\n]*", text, re.DOTALL | re.MULTILINE)[0]
    given = " ".join(f"{key}={value!r}" for key, value in load.parameters.items())
    return mean_power(
        device, f"Xload p 0 {load.netlist} {given}\n{subcircuit}", wait, reltol, steps
    )


@dataclass(frozen=True)
class Opinion:
    """One scene: the package's number and standard error, the other's, and how many of both lie between them."""

    name: str
    ours: float
    our_error: float
    theirs: float
    their_error: float

    @property
    def z(self) -> float:
        """The difference in standard errors of both."""
        return (self.ours - self.theirs) / math.hypot(self.our_error, self.their_error)

    def __str__(self) -> str:
        numbers = f"{self.ours:<10.5g} +- {self.our_error:<9.2g} {self.theirs:<10.5g} +- {self.their_error:<9.2g}"
        return f"{self.name:<18} {numbers} {100.0 * (self.ours / self.theirs - 1.0):+.2f} %  z = {self.z:+.2f}"


def noisy(
    name: str,
    trajectories: int = TRAJECTORIES,
    duration: float = DURATION,
    burn_in: float = BURN_IN,
    within: float = 3e-3,
) -> Opinion:
    """Engine `ensemble` and Heun's rule; the errors stand for sampling and, of ours, the step."""
    keys = "\n".join(f"{key} = {value}" for key, value in SCENES[name].items())
    scene = hv.loads(f"[nondimensional]\n{keys}\n")
    ours = hv.Ensemble(within=within, seed=1).run(scene).mean_square_voltage
    error = math.hypot(ours.stderr, ours.bias)
    return Opinion(name, ours.value, error, *by_heun(scene, 2, trajectories, duration, burn_in))


def circuit(name: str, steps: int = 1024) -> Opinion:
    """Engine `spice` (half its 95 % error) and ngspice alone (half of what half the step changes)."""
    file, reltol = CIRCUITS[name]
    scene = hv.load(ROOT / "examples" / "published" / file)
    # A small capacitor settles soon in the plain run; 1N4148 diodes are those of the packaged
    # netlist.
    given = {
        key: value for key, value in scene.load.parameters.items() if key not in ("N", "Is")
    } | {"C": 1e-6}
    scene = scene.with_load(netlist=scene.load.netlist, parameters=given)
    ours = hv.Spice(budget="60s").run(scene).mean_power
    rough = by_ngspice(scene, steps // 2, reltol)
    fine = by_ngspice(scene, steps, reltol)
    return Opinion(name, ours.value, 0.5 * ours.known_error95, fine, 0.5 * abs(fine - rough))


def impacts(name: str) -> Opinion:
    """Engine `ensemble` (half its 95 % error) and Siconos, extrapolated from two steps (half of what that changes)."""
    keys = IMPACTS[name]
    known = {
        "c1": -keys["c"],
        "mu": keys["mu"],
        "restitution": keys["r"],
        "gap": keys["gap"],
        "drive": keys["drive"],
    }
    scene = hv.Scene(nondimensional=hv.Nondimensional(**known, drive_frequency=keys["frequency"]))
    ours = hv.Ensemble(trajectories=256, dt=0.01).run(scene).mean_square_voltage
    line = [SICONOS, str(Path(__file__).parent / "siconos_steady.py"), json.dumps(keys)]
    rough, fine = json.loads(
        subprocess.run(line, capture_output=True, text=True, check=True).stdout
    )
    theirs = 2.0 * fine - rough  # of first order
    return Opinion(name, ours.value, 0.5 * ours.known_error95, theirs, 0.5 * abs(theirs - fine))


def there_is_siconos() -> bool:
    """Whether Debian's Python has Siconos."""
    line = [SICONOS, "-c", "import siconos.kernel"]
    return (
        Path(SICONOS).exists()
        and not subprocess.run(line, capture_output=True, check=False).returncode
    )


def opinions(names: list[str]) -> Iterator[Opinion]:
    """One after the other; all without names."""
    for name in names or [*SCENES, *CIRCUITS, *(IMPACTS if there_is_siconos() else [])]:
        yield (circuit if name in CIRCUITS else impacts if name in IMPACTS else noisy)(name)
    if not names and not there_is_siconos():
        print(f"without {', '.join(IMPACTS)}: they need Siconos, Debian's package python3-siconos")


def main() -> None:
    print(f"{'':<18} {'ours':<23} {'second opinion':<23}")
    worst = 0.0
    for one in opinions(sys.argv[1:]):
        print(one, flush=True)
        worst = max(worst, abs(one.z))
    print(f"largest |z| {worst:.2f}")


if __name__ == "__main__":
    main()
