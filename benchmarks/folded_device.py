"""A device with stop, springs and load circuit as one netlist for ngspice alone: nothing of the package integrates it.

The motion against a rigid stop is unfolded into a continuous one (Ivanov, J. Appl. Math. Mech. 58,
1994): with kappa = (1 - r)/(1 + r) for the restitution r, and states s and u,

    x = |s| - gap,    x' = u R sgn(s),    s' = u R,    u' = sgn(s) F/(M R),    R = 1 - kappa sgn(s u)

so that an impact, where s goes through 0, multiplies x' by -r and is no event for the simulator.  Without a stop
x = s, x' = u.  F is the force of springs, damping, base and piezo.  States are voltages, in units of ``LENGTH``.
|s| and sgn(s) are rounded over `ROUNDED` steps of the motion, without which ngspice ends with diodes beside a kink: a
smaller step makes both smaller.
"""

import math
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline

LENGTH = 1e-3  # m
ROUNDED = 0.06  # of the way that a mass of the speed w0 `LENGTH` makes in the longest step
LINE = 3e-3
DECK = """whole device, impacts unfolded
{base}
Bs 0 s I={w0!r}*v(u)*{turn}
Cs s 0 1 ic={s0!r}
Bu 0 u I={w0!r}*{side}*({force})/{turn}
Cu u 0 1 ic=0
Bx x 0 V={x}
Bpiezo q 0 V={volts!r}*v(x)
Cp q p {capacitance!r} ic={first!r}
{text}
.options method=gear maxord=2 reltol={reltol!r}
.save @r.xload.rload[p]
.tran {step!r} {end!r} {begin!r} {step!r} uic
.control
run
write out.raw @r.xload.rload[p]
.endc
.end
"""


def powers(problem, settle, windows, length, step, reltol, timeout=120.0):
    """Mean powers (W) of Rload in so many windows of ``length`` (s), after ``settle`` (s) from rest.

    ``step`` (s) is the longest of ngspice.  The shaking is that of the scene: harmonic, or a record from its beginning.

    Raises RuntimeError where ngspice fails or takes more than ``timeout`` (s).
    """
    scene = problem.scene
    load = problem.circuit
    record = problem.equations.record
    stop, excitation = scene.stop, scene.excitation
    damping = scene.oscillator.damping
    rest = problem.equations.resting_places[0] * problem.scales.length
    mass = scene.oscillator.mass
    w0 = math.sqrt(abs(scene.oscillator.stiffness) / scene.oscillator.mass)
    metres = mass * w0**2 * LENGTH  # N in the unit of force
    gap = 0.0 if stop is None else (stop.gap or 0.0) / LENGTH
    kappa = 0.0 if stop is None else (1.0 - stop.restitution) / (1.0 + stop.restitution)
    width = ROUNDED * w0 * step
    side = "1" if stop is None else f"tanh(v(s)/{width!r})"
    turn = "1" if stop is None else f"(1-{kappa!r}*{side}*sgn(v(u)))"
    springs = [f"-{scene.oscillator.stiffness * LENGTH / metres!r}*v(x)"]
    if scene.oscillator.cubic_stiffness:
        springs.append(f"-{scene.oscillator.cubic_stiffness * LENGTH**3 / metres!r}*v(x)*v(x)*v(x)")
    if record is None:
        amplitude = mass * excitation.acceleration_amplitude / metres
        base = f"Vbase base 0 SIN(0 {amplitude!r} {excitation.frequency!r} 0 0 90)"
    else:
        base = recorded(record, problem.scales, mass / metres)
    force = [*springs, f"-{damping * w0 * LENGTH / metres!r}*v(u)*{turn}*{side}"]
    force += ["+v(base)", f"-{scene.piezo.coupling / metres!r}*v(p)"]
    volts = scene.piezo.coupling * LENGTH / scene.piezo.capacitance
    deck = DECK.format(
        base=base,
        w0=w0,
        turn=turn,
        side=side,
        s0=rest / LENGTH + gap + (1e-6 if stop is not None else 0.0),
        force="".join(force),
        x="v(s)" if stop is None else f"sqrt(v(s)^2+{width**2!r})-{gap!r}",
        volts=volts,
        first=volts * rest / LENGTH,
        capacitance=scene.piezo.capacitance,
        text=load.text,
        reltol=reltol,
        step=step,
        begin=settle,
        end=settle + windows * length,
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deck.cir"
        path.write_text(deck)
        try:
            run = ["ngspice", "-b", str(path)]
            done = subprocess.run(
                run, capture_output=True, text=True, check=False, timeout=timeout, cwd=folder
            )
        except subprocess.TimeoutExpired:
            raise RuntimeError(f"ngspice alone took more than {timeout:g} s") from None
        if (
            not (raw := Path(folder) / "out.raw").is_file()
            or "aborted" in done.stdout + done.stderr
        ):
            raise RuntimeError(f"ngspice alone failed: {(done.stdout + done.stderr)[:400]}")
        values = np.frombuffer(raw.read_bytes().split(b"Binary:\n", 1)[1]).reshape(-1, 2)
    time = values[:, 0]
    energy = cumulative_trapezoid(values[:, 1], values[:, 0], initial=0.0)
    keep = np.append(np.diff(time) > 0.0, True)
    course = CubicHermiteSpline(time[keep], energy[keep], values[keep, 1])
    at = course(settle + length * np.arange(windows + 1))
    return np.diff(at) / length


def recorded(record, s, factor):
    """The force of a record as a source: its Fourier series, of which lines below `LINE` of the largest are left out.

    Straight lines between its points would be so many kinks, at each of which ngspice begins with a
    small step.
    """
    series = np.fft.rfft(record.values) * (
        2.0 * s.length * s.frequency**2 * factor / len(record.values)
    )
    series[0] *= 0.5
    terms = [
        f"{abs(one):.8g}*cos({2.0 * math.pi * k * s.frequency / record.period:.12g}*time{np.angle(one):+.10g})"
        for k, one in enumerate(series)
        if abs(one) > LINE * np.abs(series).max()
    ]
    lines = [terms[k : k + 20] for k in range(0, len(terms), 20)]
    sources = [
        f"Bbase{k} base{k} base{k + 1} V=" + "\n+ +".join(some) for k, some in enumerate(lines)
    ]
    return "\n".join(["Vbase base base0 0", *sources, f"Vzero base{len(lines)} 0 0"])
