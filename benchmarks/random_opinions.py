"""Random scenes, products of shaking, spring, stop and circuit, by a code written apart from the package.

    python benchmarks/random_opinions.py [--scenes 24] [--seed 1] [--within 2%] [--only 3,7]

Each scene is answered by what `harvester run --within` chooses.  The other code knows nothing of
the package but the meaning of a scene's keys: Heun's rule with 800 steps a period, sixteen times as
many near a stop and up to 64 times where diodes conduct, Gaussian increments, diodes by Shockley's
law with the smoothing capacitor.  One line a scene: both powers, the stated error at 95 %, the
difference beyond it in standard errors of the other code.  The exit status tells whether one lies
outside by more than three of them.  Some half a minute of processor time a scene.
"""

import argparse
import math
import time

import numba
import numpy as np
from common import report

import harvester as hv
from harvester.errors import HarvesterError

G = 9.80665
# of the packaged netlists' 1N4148, N k T/q at 27 C
DIODE_VOLTAGE = 1.752 * 1.380649e-23 * 300.15 / 1.602176634e-19
SATURATION = 2.52e-9
# steps a period; how many times more near a stop, and at most where diodes conduct
STEPS = 800
NEAR = 16
MOST = 64
RESISTOR = 0
BRIDGE = 1
DOUBLER = 2
CIRCUITS = {"resistor": RESISTOR, "bridge": BRIDGE, "doubler": DOUBLER}
# What the other code itself is off by: its step, and what it leaves out of a diode (.57 ohm, 4 pF).
OWN = 2e-3


@numba.njit(nogil=True)
def slopes(m, k, k2, k3, c, theta, cp, kind, load, store, low, contact, damper, x, v, V, D, a):
    """x'', V' and D': acceleration of the mass, of the piezo's voltage V and of the smoothing capacitor's D."""
    force = -k * x - k2 * x * x - k3 * x * x * x - c * v - theta * V - m * a
    if contact > 0.0 and x < low:
        force -= contact * (x - low) + damper * v
    if kind == RESISTOR:
        return force / m, (theta * v - V / load) / cp, 0.0
    if (
        kind == BRIDGE
    ):  # two diodes in series; by symmetry the common mode of the load is the piezo's
        forward = math.exp((V - D) / (2.0 * DIODE_VOLTAGE))
        backward = math.exp(-(V + D) / (2.0 * DIODE_VOLTAGE))
        given = SATURATION * (forward + backward - 2.0)
        taken = SATURATION * (forward - backward)
    else:  # D1 from n to p, D2 from p to the capacitor
        pump = SATURATION * (math.exp(-V / DIODE_VOLTAGE) - 1.0)
        given = SATURATION * (math.exp((V - D) / DIODE_VOLTAGE) - 1.0)
        taken = given - pump
    return force / m, (theta * v - taken) / cp, (given - D / load) / store


@numba.njit(nogil=True)
def powers(seed, count, h, burn, steps, device, rigid, stops, shaking):  # noqa: PLR0912 -- one loop, as it is read
    """Mean power of the load of each of ``count`` trajectories (W), over ``steps`` steps after ``burn``."""
    np.random.seed(seed)
    m, k, k2, k3, c, theta, cp, kind, load, store, contact, damper = device
    low, high, r_low, r_high = stops
    density, tau, centre, band, peak, omega = shaking
    found = np.zeros(count)
    reach = 0.0
    for edge in (low, high):
        if rigid and abs(edge) < math.inf:
            reach = max(reach, 0.02 * abs(edge))
    for one in range(count):
        x = 0.0
        v = 0.0
        V = 0.0
        D = 0.0
        y = 0.0
        z = 0.0
        if rigid and low > 0.0:
            x = low  # pressed on the mass
        phase = 2.0 * math.pi * np.random.random()
        total = 0.0
        t = 0.0
        for n in range(burn + steps):
            fast = abs(v) * h + 0.5 * h * h * abs(k / m) * abs(x) + reach
            parts = NEAR if (rigid and (x - low < 2.0 * fast or high - x < 2.0 * fast)) else 1
            if kind != RESISTOR:  # the rule is stable while the diodes' conductance moves Cp slowly
                ahead = abs(V) + abs(theta * v * h / cp) - D
                if kind == DOUBLER:  # its pump conducts below zero
                    ahead = max(ahead - abs(V) + V, abs(theta * v * h / cp) - V)
                current = SATURATION * math.exp(
                    min(ahead / DIODE_VOLTAGE / (2.0 if kind == BRIDGE else 1.0), 30.0)
                )
                parts = max(parts, min(MOST, math.ceil(h * current / (DIODE_VOLTAGE * cp))))
            dt = h / parts
            for _ in range(parts):
                a = peak * math.cos(omega * t + phase) if peak > 0.0 else 0.0
                b = peak * math.cos(omega * (t + dt) + phase) if peak > 0.0 else 0.0
                kick = 0.0
                if density > 0.0:
                    white = math.sqrt(0.5 * density * dt) * np.random.normal()
                    if tau > 0.0:
                        fresh = y + (white - dt * y) / tau
                        a += y
                        b += fresh
                        y = fresh
                    elif band > 0.0:
                        fresh = y + band * (white - dt * y) - dt * centre * centre * z
                        z += dt * fresh
                        a += y
                        b += fresh
                        y = fresh
                    else:
                        kick = white
                v -= 0.5 * kick
                f0, g0, d0 = slopes(
                    m,
                    k,
                    k2,
                    k3,
                    c,
                    theta,
                    cp,
                    kind,
                    load,
                    store,
                    low,
                    contact,
                    damper,
                    x,
                    v,
                    V,
                    D,
                    a,
                )
                x1 = x + dt * v
                v1 = v + dt * f0
                V1 = V + dt * g0
                D1 = D + dt * d0
                f1, g1, d1 = slopes(
                    m,
                    k,
                    k2,
                    k3,
                    c,
                    theta,
                    cp,
                    kind,
                    load,
                    store,
                    low,
                    contact,
                    damper,
                    x1,
                    v1,
                    V1,
                    D1,
                    b,
                )
                x += 0.5 * dt * (v + v1)
                v += 0.5 * dt * (f0 + f1) - 0.5 * kick
                V += 0.5 * dt * (g0 + g1)
                D += 0.5 * dt * (d0 + d1)
                if rigid:
                    if x < low and v < 0.0:
                        # it follows the place, which is thrown back
                        V += theta * (1.0 + r_low) * (low - x) / cp
                        x = low + r_low * (low - x)
                        v = -r_low * v
                    elif x > high and v > 0.0:
                        V -= theta * (1.0 + r_high) * (x - high) / cp
                        x = high - r_high * (x - high)
                        v = -r_high * v
                t += dt
                if n >= burn:
                    total += dt * (V * V if kind == RESISTOR else D * D) / load
        found[one] = total / (steps * h)
    return found


def number(value):
    """Five digits, so that the scene file says what the other code computes."""
    return float(f"{value:.5g}")


def between(rng, low, high):
    """A number whose logarithm is uniform."""
    return number(math.exp(rng.uniform(math.log(low), math.log(high))))


def drawn(rng):
    """Tables of a random scene, and the words that name it."""
    mass = between(rng, 5e-4, 0.05)
    f = between(rng, 8.0, 200.0)
    q = between(rng, 8.0, 80.0)
    w = 2.0 * math.pi * f
    cp = between(rng, 1e-8, 2e-7)
    share = between(rng, 0.005, 0.3)
    k = number(mass * w * w)
    oscillator = {"mass": mass, "stiffness": k, "damping": number(mass * w / q)}
    piezo = {"coupling": number(math.sqrt(share * k * cp)), "capacitance": cp}
    # displacement that gives so many volts in open circuit
    rms = between(rng, 3.0, 20.0) * cp / piezo["coupling"]
    level = 4.0 * rms**2 * w**3 / q  # the one-sided density that moves a linear mass so far
    shaking = str(rng.choice(["white", "white", "coloured", "band", "sinusoid and white"]))
    excitation = {"acceleration_psd": number(level)}
    if shaking == "coloured":
        tau = between(rng, 0.1, 2.0) / w
        excitation = {
            "acceleration_psd": number(level * (1.0 + (w * tau) ** 2)),
            "correlation_time": number(tau),
        }
    if shaking == "band":
        excitation |= {
            "centre_frequency": number(f * rng.uniform(0.9, 1.1)),
            "bandwidth": between(rng, 0.1, 1.0) * f,
        }
        excitation["bandwidth"] = number(excitation["bandwidth"])
    if shaking == "sinusoid and white":
        excitation["acceleration_amplitude"] = number(rms * w * w / q * rng.uniform(0.3, 2.0))
        excitation["frequency"] = number(f * rng.uniform(0.95, 1.1))
    spring = str(rng.choice(["linear", "linear", "hardening", "asymmetric"]))
    if spring != "linear":
        oscillator["cubic_stiffness"] = number(k / rms**2 * rng.uniform(0.05, 0.5))
    if spring == "asymmetric":
        oscillator["quadratic_stiffness"] = number(k / rms * rng.uniform(0.05, 0.3))
    tables = {"oscillator": oscillator, "piezo": piezo, "excitation": excitation}
    stop = str(
        rng.choice(["no stop", "gap", "gap", "at rest", "preload", "two stops", "compliant"])
    )
    if stop in ("gap", "at rest", "preload", "two stops"):
        gap = {"at rest": 0.0, "preload": -0.3 * rms * rng.random()}.get(
            stop, rms * rng.uniform(0.3, 2.0)
        )
        tables["stop"] = {"restitution": number(rng.uniform(0.3, 0.95)), "gap": number(gap)}
    if stop == "two stops":
        tables["opposite_stop"] = {
            "restitution": number(rng.uniform(0.3, 0.95)),
            "gap": number(rms * rng.uniform(0.3, 2.0)),
        }
    if stop == "compliant":
        tables["stop"] = {
            "stiffness": number(k * between(rng, 3.0, 100.0)),
            "gap": number(rms * rng.uniform(0.2, 1.5)),
        }
        tables["stop"]["damping"] = number(rng.uniform(0.0, 0.3) * mass * w)
    name = str(rng.choice(list(CIRCUITS)))
    matched = {"resistor": 1.0, "bridge": math.pi / 2.0, "doubler": 2.0 * math.pi}[name] / (w * cp)
    resistance = number(matched * between(rng, 0.2, 5.0))
    if name == "resistor":
        tables["load"] = {"resistance": resistance}
    else:
        store = number(between(rng, 8.0, 40.0) / f / resistance)
        tables["load"] = {"netlist": name, "parameters": {"R": resistance, "C": store}}
    return f"{shaking}, {spring}, {stop}, {name}", tables


def other(tables, seed, count, periods):
    """Mean power by the code above, W, and its standard error."""
    o, p, e, load = (tables[key] for key in ("oscillator", "piezo", "excitation", "load"))
    stop, opposite = tables.get("stop", {}), tables.get("opposite_stop", {})
    kind = CIRCUITS[load.get("netlist", "resistor")]
    resistance = load.get("resistance") or load["parameters"]["R"]
    store = 1.0 if kind == RESISTOR else load["parameters"]["C"]
    device = (
        o["mass"], o["stiffness"], o.get("quadratic_stiffness", 0.0), o.get("cubic_stiffness", 0.0), o["damping"],
        p["coupling"], p["capacitance"], kind, resistance, store, stop.get("stiffness", 0.0), stop.get("damping", 0.0),
    )  # fmt: skip
    stops = (
        -stop["gap"] if stop else -math.inf, opposite.get("gap", math.inf),
        stop.get("restitution", 0.0), opposite.get("restitution", 0.0),
    )  # fmt: skip
    shaking = (
        e["acceleration_psd"], e.get("correlation_time", 0.0), 2.0 * math.pi * e.get("centre_frequency", 0.0),
        2.0 * math.pi * e.get("bandwidth", 0.0), e.get("acceleration_amplitude", 0.0),
        2.0 * math.pi * e.get("frequency", 0.0),
    )  # fmt: skip
    w = math.sqrt(o["stiffness"] / o["mass"])
    period = 2.0 * math.pi / w
    ring = 8.0 * o["mass"] / o["damping"]
    settled = ring + (10.0 * resistance * store if kind != RESISTOR else 0.0)
    fastest = max(w, shaking[2], math.sqrt((o["stiffness"] + device[10]) / o["mass"]))
    h = 2.0 * math.pi / fastest / STEPS
    burn = math.ceil(settled / h)
    steps = math.ceil(periods * period / h)
    found = powers(seed, count, h, burn, steps, device, "restitution" in stop, stops, shaking)
    return float(found.mean()), float(found.std(ddof=1) / math.sqrt(count))


def scene_of(tables):
    """The scene of these tables."""
    lines = []
    for table, keys in tables.items():
        lines.append(f"[{table}]")
        for key, value in keys.items():
            inner = isinstance(value, dict) and ", ".join(
                f"{name} = {one!r}" for name, one in value.items()
            )
            lines.append(f"{key} = {{ {inner} }}" if inner else f"{key} = {value!r}")
    return hv.loads("\n".join(lines) + "\n")


def judged(name, tables, seed, within, effort):
    """A row: both answers, and how far the difference goes beyond what is stated, in errors of the other code."""
    row = {"scene": name, "tables": tables}
    begin = time.process_time()
    try:
        answer = hv.run(scene_of(tables), within=within)
    except HarvesterError as error:
        return row | {"refused": str(error)[:160]}
    power = answer.mean_power
    seconds = time.process_time() - begin
    true, spread = other(tables, seed, *effort)
    beyond = max(abs(power.value - true) - power.known_error95 - OWN * true, 0.0)
    return row | {
        "engine": answer.engine, "ours": power.value, "error95": power.known_error95,
        "whole": power.error95 is not None, "other": true, "stderr": spread, "z": beyond / spread, "seconds": seconds,
    }  # fmt: skip


def line(number, row):
    """What a row says on the terminal."""
    if "refused" in row:
        return f"{number:3d} refused: {row['refused']} ({row['scene']})"
    ours, other = row["ours"], row["other"]
    parts = f"{row['error95'] / ours:.1%}{'' if row['whole'] else ' and more'}"
    return (
        f"{number:3d} {row['engine']:8s} {ours:.4g} +- {parts}, other {other:.4g} +- {row['stderr'] / other:.1%}, "
        f"off {ours / other - 1.0:+.2%}, z {row['z']:.1f}, {row['seconds']:.0f} s: {row['scene']}"
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--within", default="2%")
    parser.add_argument("--only", default="", help="numbers of the scenes, such as 3,7")
    parser.add_argument("--trajectories", type=int, default=512)
    parser.add_argument("--periods", type=int, default=400)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    scenes = [drawn(rng) for _ in range(options.scenes)]
    chosen = [int(one) for one in options.only.split(",") if one] or range(len(scenes))
    rows = []
    for k in chosen:
        rows.append(
            judged(*scenes[k], 1000 + k, options.within, (options.trajectories, options.periods))
        )
        print(line(k, rows[-1]), flush=True)
    if not options.only:
        report("random_opinions", rows)
    return any(row.get("z", 0.0) > 3.0 for row in rows)


if __name__ == "__main__":
    raise SystemExit(main())
