"""The base's acceleration as a source for a circuit simulator: 1 V is 1 m/s^2."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.records.records import Record
from harvester.scene.physical import Excitation

# of noise in a period of the response, or of the highest mode: what lies between is a straight line
POINTS = 64
MOST_POINTS = 200_000  # of a source that is written point by point
FINER = 8  # times as many points as a record has
A_LINE = 4  # points


def base_source(problem: Problem, name: str, duration: float, seed: int) -> Iterator[str]:
    """The lines of the subcircuit ``name``_base, a source of the scene's excitation.

    None if nothing shakes the base.

    A harmonic excitation is SIN, a record PWL (once, from its beginning), white noise TRNOISE,
    which ngspice and KiCad know: a new value every T/`POINTS` of root mean square sqrt(G/(2 dt)),
    so that the one-sided density at low frequencies is G.  Other noise is one draw of ``duration``
    (s), point by point, from the ``seed``.
    """
    sources = [*_periodic_and_white(problem), *_from_points(problem, duration, seed)]
    count = sum("{}" in line for line in sources)
    if not count:
        return
    yield f".subckt {name}_base acc"
    done = 0
    for line in sources:
        if "{}" in line:
            ends = "acc" if done == 0 else f"s{done}", "0" if done == count - 1 else f"s{done + 1}"
            done += 1
            yield line.replace("{}", " ".join(ends))
        else:
            yield line
    yield f".ends {name}_base"


def spacing(problem: Problem) -> float:
    """The time between points of noise, in s, of which the simulator's longest step is a part."""
    eqs = problem.equations
    highest = eqs.modal.highest(abs(eqs.spring[0]), eqs.beta or 0.0)
    return 2.0 * math.pi / (problem.scales.frequency * highest * POINTS)


def _periodic_and_white(problem: Problem) -> Iterator[str]:
    """The sources that a simulator draws itself: a harmonic excitation, and white noise."""
    excitation = problem.scene.excitation or Excitation()
    step = spacing(problem)
    if excitation.acceleration_amplitude and excitation.frequency and excitation.profile is None:
        amplitude, frequency = excitation.acceleration_amplitude, excitation.frequency
        yield f"* Harmonic: {amplitude:.10g} m/s^2, {frequency:.10g} Hz; the mass is pushed by its opposite"
        yield f"Vharmonic {{}} SIN(0 {-amplitude:.10g} {frequency:.10g} 0 0 90)"
    density = excitation.acceleration_psd
    if density and not excitation.filtered:
        size = math.sqrt(density / (2.0 * step))
        yield f"* White noise of one-sided density {density:.10g} (m/s^2)^2/Hz, a value every {step:.10g} s"
        yield "* (TRNOISE is known to ngspice and KiCad; ngspice draws other values in each run, whatever its seed)"
        yield f"Vnoise {{}} DC 0 TRNOISE({size:.10g} {step:.10g} 0 0)"


def _from_points(problem: Problem, duration: float, seed: int) -> Iterator[str]:
    """The source that is written point by point: a record, or one draw of other noise."""
    if (record := problem.equations.record) is not None:
        yield "* The record, once, from its beginning; between its points a straight line"
        yield from _points("Vrecord", *_recorded(problem, record))
    elif problem.equations.coloured is not None or problem.equations.density is not None:
        yield f"* One draw of {duration:g} s of the scene's noise, of seed {seed}"
        yield from _points("Vdrawn", *_drawn(problem, duration, spacing(problem), seed))


def _recorded(problem: Problem, record: Record) -> tuple[Floats, Floats]:
    """Times (s) and the base's accelerations (m/s^2) of one period of a record.

    They are so near each other that straight lines between them are its Fourier series to 0.1 % or
    so.
    """
    s = problem.scales
    count = max(len(record.values), min(FINER * len(record.values), MOST_POINTS))
    t = record.period / count * np.arange(count, dtype=np.float64)
    return t / s.frequency, -record.at_even_times(count) * s.length * s.frequency**2


def _drawn(problem: Problem, duration: float, step: float, seed: int) -> tuple[Floats, Floats]:
    """Times (s) and accelerations (m/s^2) of one draw of the scene's noise."""
    from harvester.mechanics.kernels.forcing import forcing

    s = problem.scales
    steps = math.ceil(duration / step)
    # the sinusoid is a source of its own
    noise = replace(problem.equations, drive=None, drive_frequency=None)
    force = forcing(noise, step * s.frequency, steps, np.random.default_rng([seed, 10]))
    assert force is not None, "the scene has such noise"
    return step * np.arange(steps + 1, dtype=np.float64), -force * s.length * s.frequency**2


def _points(name: str, t: Floats, a: Floats) -> Iterator[str]:
    """A source through points, as lines of a netlist that continue each other.

    After the last one it is 0.
    """
    t = np.append(t, 2.0 * t[-1] - t[-2])
    a = np.append(a, 0.0)
    yield f"{name} {{}} PWL("
    for k in range(0, len(t), A_LINE):
        yield "+ " + " ".join(
            f"{x:.9g} {y:.7g}" for x, y in zip(t[k : k + A_LINE], a[k : k + A_LINE], strict=True)
        )
    yield "+ )"
