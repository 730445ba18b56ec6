"""Devices that others published: each number that a source gives or lets one compute, beside ours with its error.

    .venv/bin/python benchmarks/published.py                # all tables of docs/formulas.md, a minute
    .venv/bin/python benchmarks/published.py erturk_inman   # one of them

Every source is named in full in docs/formulas.md.  Powers are means; a source's peak power is halved.  The
column "published" is computed apart from the package, but for the paper's own theory.  Long because each source has its
formulas.  tests/project/test_validation.py compares the page with these rows.
"""

import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, minimize_scalar

import harvester as hv
from harvester.studies import paper

SCENES = Path(__file__).parents[1] / "examples" / "published"
G = 9.80665
IDEAL = {"N": 0.05, "Is": 1e-12}  # diodes that drop 25 mV, for closed forms that take ideal ones


@dataclass(frozen=True)
class Row:
    """One number: what it is, published, ours, and our 95 % error (None where a part of it is not known)."""

    what: str
    published: float
    ours: float
    error: float | None
    unit: str

    @property
    def deviation(self) -> float:
        """Ours over published, less one."""
        return self.ours / self.published - 1.0

    def __str__(self) -> str:
        error = "rounding" if self.error == 0.0 else f"{self.error:.2g}"
        if self.error is None:
            error = "not known"
        cells = (
            self.what,
            f"{self.published:.4g} {self.unit}",
            f"{self.ours:.5g} {self.unit}",
            f"{100.0 * self.deviation:+.2f} %",
            error,
        )
        return f"| {' | '.join(cell.strip() for cell in cells)} |"


def row(what: str, published: float, value: hv.Value, unit: str, size: float = 1.0) -> Row:
    """A row of a `Value` in SI, which ``size`` brings to ``unit``."""
    error = value.error95
    return Row(
        what,
        published,
        size * value.value,
        None if error is None else size * error if error > 1e-9 * value.value else 0.0,
        unit,
    )


def device(scene: hv.Scene) -> tuple[float, float, float, float, float]:
    """Mass, stiffness, damping ratio, coupling and capacitance of a scene, in SI."""
    o, p = scene.oscillator, scene.piezo
    return o.mass, o.stiffness, o.damping_ratio, p.coupling, p.capacitance


def shaken(scene: hv.Scene, frequency: float, **load: object) -> hv.Scene:
    """The scene at another frequency (Hz) and with another load."""
    return scene.vary("excitation.frequency", frequency).with_load(**load)


# --- Erturk and Inman 2009: a measured bimorph ------------------------------------------------------------------------


def first_mode() -> dict[str, float]:
    """Mass, stiffness, coupling and capacitance of the source's beam in its first mode, from its dimensions.

    Euler and Bernoulli's beam, clamped, with a mass at its tip: phi'''' = lambda^4 phi, mass-normalised.  With sigma =
    m int phi + Mt phi(L): mass sigma^2, stiffness w^2 sigma^2, coupling vartheta phi'(L) sigma.  SI units.
    """
    length = 50.8e-3
    width = 31.8e-3
    hp = 0.26e-3
    hs = 0.14e-3
    tip = 12e-3
    yp = 66e9
    ys = 105e9
    d31 = -190e-12
    eps = 1500.0 * 8.8541878e-12
    m = width * (7800.0 * 2.0 * hp + 9000.0 * hs)
    bending = 2.0 * width / 3.0 * (ys * hs**3 / 8.0 + yp * ((hp + hs / 2.0) ** 3 - hs**3 / 8.0))
    ratio = tip / (m * length)
    z = brentq(
        lambda z: (
            1.0
            + math.cos(z) * math.cosh(z)
            + ratio * z * (math.cos(z) * math.sinh(z) - math.sin(z) * math.cosh(z))
        ),
        0.5,
        1.9,
    )
    back = (math.sin(z) - math.sinh(z) + z * ratio * (math.cos(z) - math.cosh(z))) / (
        math.cos(z) + math.cosh(z) - z * ratio * (math.sin(z) - math.sinh(z))
    )

    def shape(x: float) -> float:
        u = z * x / length
        return math.cos(u) - math.cosh(u) + back * (math.sin(u) - math.sinh(u))

    slope = z / length * (-math.sin(z) - math.sinh(z) + back * (math.cos(z) - math.cosh(z)))
    size = math.sqrt(m * quad(lambda x: shape(x) ** 2, 0.0, length)[0] + tip * shape(length) ** 2)
    sigma = (m * quad(shape, 0.0, length)[0] + tip * shape(length)) / size
    w2 = (z / length) ** 4 * bending / m
    coupling = abs(d31 * yp) * width * (hp + hs) / 2.0 * abs(slope / size * sigma)
    return {
        "mass": sigma**2,
        "stiffness": w2 * sigma**2,
        "coupling": coupling,
        "capacitance": eps * width * length / (2.0 * hp),
    }


def erturk_inman() -> Iterator[Row]:
    """Resonances, best loads and peak power as measured, and the most that strong coupling gives (Renno and others)."""
    scene = hv.load(SCENES / "erturk_inman_2009.toml")

    def power(frequency: float, resistance: float) -> float:
        return hv.run(shaken(scene, frequency, resistance=resistance), "exact").mean_power.value

    def best(frequency: float) -> float:
        def less(log: float) -> float:
            return -power(frequency, 10.0**log)

        return float(10.0 ** minimize_scalar(less, bounds=(3.0, 7.0), options={"xatol": 1e-9}).x)

    for resistance, measured in ((470.0, 45.6), (995e3, 48.4)):
        found = minimize_scalar(
            lambda f, R=resistance: -power(f, R), bounds=(40.0, 55.0), options={"xatol": 1e-6}
        )
        yield Row(f"resonance at {resistance / 1e3:g} kohm", measured, float(found.x), 0.0, "Hz")
    for frequency, measured in ((45.6, 35.0), (48.4, 186.0)):
        yield Row(f"best load at {frequency:g} Hz", measured, best(frequency) / 1e3, 0.0, "kohm")
    yield row(
        "power at 45.6 Hz, 35 kohm, 1 g", 23.9 / 2.0, hv.run(scene, "exact").mean_power, "mW", 1e3
    )
    mass, stiffness, ratio, _, _ = device(scene)
    # (M a)^2/(8 c): Renno, Daqaq and Inman 2009
    most = (mass * G) ** 2 / (16.0 * ratio * math.sqrt(mass * stiffness))
    found = minimize_scalar(
        lambda f: -power(f, best(f)), bounds=(46.5, 50.0), options={"xatol": 1e-6}
    )
    yield Row("most over load and frequency", 1e3 * most, -1e3 * float(found.fun), 0.0, "mW")


# --- Adhikari, Friswell and Inman 2009: white noise -------------------------------------------------------------------


def white_noise() -> Iterator[Row]:
    """Mean power of the bimorph under white noise, E[P] of the source's closed form, at three loads."""
    scene = hv.load(SCENES / "adhikari_friswell_inman_2009.toml")
    mass, stiffness, zeta, coupling, capacitance = device(scene)
    w0 = math.sqrt(stiffness / mass)
    kappa2 = coupling**2 / (stiffness * capacitance)
    cases = [(hv.Ensemble(within=3e-3), resistance) for resistance in (1e4, 75e3, 1e6)]
    for engine, resistance in [*cases, (hv.Exact(), 75e3)]:
        alpha = w0 * capacitance * resistance
        below = (
            (2.0 * zeta * alpha**2 + alpha) * kappa2
            + 4.0 * zeta**2 * alpha
            + (2.0 * alpha**2 + 2.0) * zeta
        )
        published = 0.25 * mass * scene.excitation.acceleration_psd * alpha * kappa2 / below
        ours = engine.run(scene.with_load(resistance=resistance)).mean_power
        yield row(f"`{engine.NAME}`, {resistance / 1e3:g} kohm", 1e3 * published, ours, "mW", 1e3)


# --- Shu and Lien 2006, Shu, Lien and Wu 2007: rectifiers on a strongly coupled device -------------------------------


def shu_lien(
    scene: hv.Scene, frequency: float, resistance: float, share: float | None = None
) -> float:
    """Mean power (W) of the sources' formulas, ideal diodes; ``share`` q of the voltage left by an inversion: SSHI."""
    mass, stiffness, zeta, coupling, capacitance = device(scene)
    w0 = math.sqrt(stiffness / mass)
    k2 = coupling**2 / (stiffness * capacitance)
    omega = 2.0 * math.pi * frequency / w0
    rho = capacitance * w0 * resistance
    if share is None:
        d = rho * omega + math.pi / 2.0
        loss = 2.0 * k2 * rho / d**2
        stiffening = k2 * rho * omega / d
    else:
        d = (1.0 - share) * rho * omega / 2.0 + math.pi / 2.0
        loss = 2.0 * k2 * rho * (1.0 + rho * omega * (1.0 - share**2) / (2.0 * math.pi)) / d**2
        stiffening = k2 * (1.0 - share) * rho * omega / (2.0 * d)
    u = 1.0 / math.hypot((2.0 * zeta + loss) * omega, 1.0 - omega**2 + stiffening)
    voltage = mass * scene.excitation.acceleration_amplitude / coupling * k2 * rho * omega / d * u
    return voltage**2 / resistance


def first_harmonic(scene: hv.Scene, frequency: float, resistance: float) -> float:
    """Mean power (W) of an ideal bridge whose voltage acts on the mass by its whole first harmonic.

    Liang and Liao 2012.  The rectified voltage is 1 - s of what would block the bridge, theta X/Cp; between two turns
    of the mass the piezo's voltage follows it for the angle b, cos b = 1 - 2 s, and is then held.
    """
    mass, stiffness, zeta, coupling, capacitance = device(scene)
    w = 2.0 * math.pi * frequency
    w0 = math.sqrt(stiffness / mass)
    s = w * capacitance * resistance / (w * capacitance * resistance + math.pi / 2.0)
    b = math.acos(1.0 - 2.0 * s)
    spring = coupling**2 / capacitance * (b - math.sin(b) * math.cos(b)) / math.pi
    damper = coupling**2 / capacitance * math.sin(b) ** 2 / math.pi  # times 1/w: of the velocity
    force = mass * scene.excitation.acceleration_amplitude
    x = force / math.hypot(stiffness + spring - mass * w**2, 2.0 * zeta * mass * w0 * w + damper)
    return (s * coupling * x / capacitance) ** 2 / resistance


def bridge() -> Iterator[Row]:
    """The packaged bridge with nearly ideal diodes, against the published formula and the whole first harmonic."""
    scene = hv.load(SCENES / "shu_lien_2006.toml")
    for frequency, resistance in ((45.6, 5e4), (47.0, 2e4), (47.0, 1e5), (47.0, 5e5), (48.4, 2e5)):
        parameters = dict(scene.load.parameters) | {"R": resistance}
        ours = (
            hv.Spice(budget="60s")
            .run(shaken(scene, frequency, netlist="bridge", parameters=parameters))
            .mean_power
        )
        where = f"{frequency:g} Hz, {resistance / 1e3:g} kohm"
        yield row(
            f"{where}, formula of 2006",
            1e3 * shu_lien(scene, frequency, resistance),
            ours,
            "mW",
            1e3,
        )
        yield row(
            f"{where}, whole first harmonic",
            1e3 * first_harmonic(scene, frequency, resistance),
            ours,
            "mW",
            1e3,
        )


def voltage_left(parameters: Mapping[str, float]) -> float:
    """The share q of its voltage that the packaged netlist's inversion leaves; its closed switch has 100 ohm."""
    surge = math.sqrt(parameters["L"] / parameters["Cp"])
    return math.exp(
        -0.5 * math.pi * ((parameters["Rcoil"] + 100.0) / surge + surge / parameters["Rcore"])
    )


def parallel_sshi() -> Iterator[Row]:
    """Parallel SSHI of the packaged netlist with nearly ideal diodes against the published formula."""
    scene = hv.load(SCENES / "shu_lien_wu_2007.toml")
    p = scene.load.parameters
    share = voltage_left(p)
    for frequency, resistance in ((47.0, 1e5), (47.0, 5e5), (48.4, 2e5)):
        ours = hv.Spice(budget="60s").run(
            shaken(
                scene, frequency, netlist="parallel_sshi", parameters=dict(p) | {"R": resistance}
            )
        )
        published = 1e3 * shu_lien(scene, frequency, resistance, share)
        yield row(
            f"{frequency:g} Hz, {resistance / 1e3:g} kohm", published, ours.mean_power, "mW", 1e3
        )


# --- Erturk, Hoffmann and Inman 2009: a bistable beam -----------------------------------------------------------------


def integrated(amplitude: float, start: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> float:
    """Mean of lambda v^2 over settled periods: the source's equations by Dormand and Prince's rule of order 8."""
    period = 2.0 * math.pi / 0.8
    settle = 170
    count = 4

    def rate(t: float, y: np.ndarray) -> list[float]:
        x, speed, v, _ = y
        spring = 0.5 * x * (1.0 - x * x)
        return [
            speed,
            spring - 0.02 * speed + 0.05 * v + amplitude * math.cos(0.8 * t),
            -0.05 * v - 0.5 * speed,
            0.05 * v * v,
        ]

    ends = solve_ivp(
        rate, (0.0, (settle + count) * period), [*start, 0.0], "DOP853", [settle * period, (settle + count) * period],
        rtol=1e-9, atol=1e-12,
    ).y[3]  # fmt: skip
    return float(ends[1] - ends[0]) / (count * period)


def bistable() -> Iterator[Row]:
    """Mean lambda v^2 of the source's equations over the amplitude f, in one well and across both."""
    scene = hv.load(SCENES / "erturk_hoffmann_inman_2009.toml")
    for amplitude, start in (
        (0.041, (1.0, 0.0, 0.0)),
        (0.115, (1.0, 1.3, 0.0)),
        (0.147, (1.0, 0.0, 0.0)),
        (0.2, (1.0, 0.0, 0.0)),
    ):
        square = (
            hv.Ensemble()
            .run(scene.vary("excitation.acceleration_amplitude", amplitude))
            .mean_square_voltage
        )
        yield row(f"f = {amplitude:g}", 1e3 * integrated(amplitude, start), square, "10^-3", 50.0)


# --- The paper that this package implements ---------------------------------------------------------------------------


def densities() -> Iterator[Row]:
    """The highest points of p(x) and p(x') in Figures 1 and 2: the published theory, and Monte Carlo at 95 %."""
    for number in "12":
        points = [
            point
            for point in paper.figure(number)
            if "amplitude" not in point.panel and point.curve != "c3 = 0.1"
        ]
        for panel, curve in dict.fromkeys((point.panel, point.curve) for point in points):
            those = [point for point in points if (point.panel, point.curve) == (panel, curve)]
            top = max(those, key=lambda point: point.ensemble)
            highest = max(point.published for point in those)
            what = f"Figure {number}, {panel} at its highest, {curve}"
            yield Row(what, highest, top.ensemble, 1.96 * top.ensemble_stderr, "")


def voltages() -> Iterator[Row]:
    """E[V^2] of the same scenes: what the paper's theory says, and Monte Carlo of its equations."""
    for name, values in (("restitution", (0.92, 0.96, 0.99)), ("c3", (0.05, 0.2))):
        for value in values:
            scene = hv.load(SCENES / "entropy_2026.toml").vary(f"nondimensional.{name}", value)
            published = hv.run(scene, "published").mean_square_voltage.value
            ours = hv.Ensemble(within=2e-3).run(scene).mean_square_voltage
            yield row(f"E[V^2], {name} = {value:g}", published, ours, "")


TABLES = {
    one.__name__: one
    for one in (erturk_inman, white_noise, bridge, parallel_sshi, bistable, densities, voltages)
}


def main() -> None:
    for name in sys.argv[1:] or TABLES:
        print(f"\n{name}\n\n| | published | ours | deviation | our error |\n|---|---|---|---|---|")
        for one in TABLES[name]():
            print(one, flush=True)


if __name__ == "__main__":
    main()
