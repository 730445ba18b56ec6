"""What each shortcut of the ensemble's kernel is worth: one at a time exchanged for what it stands for, in turn.

    python benchmarks/shortcuts.py

The kernel is built anew from its own source with some of its functions replaced, and runs the same trajectories; the
smallest processor time of a step counts, sums of controls included.  All give E[V^2] of a scene, with controls.  The
``bias`` of a shortcut is that mean less the one without it, trajectory by trajectory where both are on the same noise,
and ``z`` over its standard error.  The error that a second of the processor leaves is

    sqrt(bias^2 + S/T),    S/T: variance of the mean over the time T that a second simulates

in which a bias counts where it is seen, |z| > 3.  A shortcut is worth it where the ratio ``error a
second``, without it over with it, is above 1.
"""

import argparse
import dataclasses
import math
import os
import time
import types
from unittest import mock

import numba
import numpy as np
from common import PAPER, report
from numba import float64, int64, uint64
from numba.core.compiler import Compiler
from numba.core.dispatcher import Dispatcher

from harvester.mechanics.ensemble import trajectories
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.kernels import absent_effects
from harvester.mechanics.kernels.compiled import COMPILER, FLAGS
from harvester.mechanics.kernels.equation_of_motion import impulse
from harvester.mechanics.kernels.intervals import Update
from harvester.mechanics.kernels.noise import (
    HALF_ROOT,
    draw_noise,
    draw_two_noises,
    shuffle,
    variates,
)
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.kernels.trajectory_batch import advance
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.value import mean_and_error

H, SEEN = 0.1, 3.0
SCENES = {
    "paper's": PAPER,
    "mu = 3": dataclasses.replace(PAPER, mu=3.0),
    "one noise": dataclasses.replace(PAPER, n2=None),
}
ROOT3 = math.sqrt(3.0)
SIXTH = uint64(2**64 // 6)
REST = uint64(2**64 - 2**64 // 6)


class Narrow(Compiler):
    """The package's compiler with the vectors that LLVM takes of itself."""

    def define_pipelines(self):
        """The passes."""
        return absent_effects.add_to(super().define_pipelines())


def rebuilt(function, replaced, options=None, known=None):
    """A compiled function, and those that it calls, compiled anew with those of ``replaced`` in the place of others."""
    known = {} if known is None else known
    if function not in known:
        plain = replaced.get(function, function)
        further = {} if function in replaced else replaced
        plain = plain.py_func if isinstance(plain, Dispatcher) else plain
        names = dict(plain.__globals__)
        for name in plain.__code__.co_names:
            if isinstance(names.get(name), Dispatcher):
                names[name] = rebuilt(
                    names[name], further, options, known if further is replaced else {}
                )
        copy = types.FunctionType(
            plain.__code__, names, plain.__name__, plain.__defaults__, plain.__closure__
        )
        inline = {} if function is advance else {"forceinline": True}
        known[function] = numba.njit(
            nogil=True, **inline, **(COMPILER if options is None else options), **FLAGS
        )(copy)
    return known[function]


def one_kick(s, xi, h, c, a, other):
    """The kick with a variate and a root for both noises."""
    return kick_at_stops(s, xi, h, c, a)


def one_impulse(x, xi, h, c, other):
    """The impulse for it."""
    return impulse(x, xi, h, c)


def one_draw(noise, other, s0, s1, coarse):
    """The draw for it."""
    for i in range(noise.shape[1]):
        bits, s0[i], s1[i] = shuffle(s0[i], s1[i])
        noise[0, i], noise[1, i] = variates(bits, coarse)


@numba.njit(**FLAGS)
def normal_pair(bits):
    """Two standard normal variates of 64 bits by Box and Muller, with series that vectorise, to 1e-7.

    ln u = 2 artanh((m - 1)/(m + 1)) + k ln 2 of u = m 2^k, m from sqrt(1/2) to sqrt(2); sine and
    cosine of a quarter.
    """
    u = float64((bits >> uint64(32)) + uint64(1)) * 2.0**-32
    word = np.float64(u).view(np.int64)
    k = (word - int64(0x3FE6A09E667F3BCD)) >> 52
    m = np.int64(word - (k << 52)).view(np.float64)
    s = (m - 1.0) / (m + 1.0)
    s2 = s * s
    logarithm = 2.0 * s * (1.0 + s2 * (1 / 3 + s2 * (1 / 5 + s2 * (1 / 7 + s2 / 9)))) + float64(
        k
    ) * math.log(2.0)
    radius = math.sqrt(max(-2.0 * logarithm, 0.0))
    turns = float64(bits & uint64(0x3FFFFFFF)) * 2.0**-30 - 0.5  # of a quarter, from -1/2 to 1/2
    a = turns * (0.5 * math.pi)
    a2 = a * a
    sine = a * (1.0 - a2 * (1 / 6 - a2 * (1 / 120 - a2 / 5040)))
    cosine = 1.0 - a2 * (1 / 2 - a2 * (1 / 24 - a2 * (1 / 720 - a2 / 40320)))
    sign = 1.0 if bits & uint64(0x40000000) else -1.0
    swapped = (bits & uint64(0x80000000)) != uint64(0)
    first, second = (sine, cosine) if swapped else (cosine, sine)
    return sign * radius * first, sign * radius * second


def normal_variates(bits, coarse):
    """Gaussian variates in the place of those of three points."""
    first, second = normal_pair(bits)
    return (first + second) * HALF_ROOT if coarse else first, second


@numba.njit(**FLAGS)
def three_point64(bits):
    """A three-point variate of all 64 bits."""
    return (-ROOT3 if bits < SIXTH else 0.0) + (ROOT3 if bits >= REST else 0.0)


def draw64(noise, s0, s1, coarse):
    """The draw of one noise with a word of 64 bits for each variate."""
    for i in range(noise.shape[1]):
        first, a, b = shuffle(s0[i], s1[i])
        second, s0[i], s1[i] = shuffle(a, b)
        one, two = three_point64(first), three_point64(second)
        noise[0, i] = (one + two) * HALF_ROOT if coarse else one
        noise[1, i] = two


def draw_two64(noise, other, s0, s1, coarse):
    """The same for both noises."""
    for i in range(noise.shape[1]):
        first, a, b = shuffle(s0[i], s1[i])
        second, a, b = shuffle(a, b)
        third, a, b = shuffle(a, b)
        fourth, s0[i], s1[i] = shuffle(a, b)
        one, two = three_point64(first), three_point64(second)
        noise[0, i] = (one + two) * HALF_ROOT if coarse else one
        noise[1, i] = two
        one, two = three_point64(third), three_point64(fourth)
        other[0, i] = (one + two) * HALF_ROOT if coarse else one
        other[1, i] = two


def no_lines(eqs, h, ngspice_rule):
    """The voltage at an impact by a division and a series."""
    return Update()


def kinds():
    """Name -> (kernel, update): the package's way, and the ways without one shortcut each."""
    update = trajectories.update_of
    same = rebuilt(advance, {})
    one_noise = {draw_two_noises: one_draw, kick_at_stops: one_kick, impulse: one_impulse}
    return {
        "all of them": (same, update),
        "line of impacts": (same, no_lines),
        "a variate for each noise": (rebuilt(advance, one_noise), update),
        "variates of three points": (rebuilt(advance, {variates: normal_variates}), update),
        "words of 32 bits": (
            rebuilt(advance, {draw_noise: draw64, draw_two_noises: draw_two64}),
            update,
        ),
        "vectors of 512 bits": (rebuilt(advance, {}, {"pipeline_class": Narrow}), update),
    }


def sampled(eqs, count, duration, seed):
    """E[V^2] of trajectories, their controls, and nanoseconds of a step; with whatever kernel there is."""
    many = trajectories.Trajectories(eqs, count, np.random.SeedSequence(seed), H, controlled=True)
    many.run(1.0)  # compiles
    burn_in(many)
    before = many.steps
    begin = time.process_time()
    found = many.run(duration)
    return found.V2, found.controls, 1e9 * (time.process_time() - begin) / (many.steps - before)


def rows_of(name, eqs, options):
    """The rows of a scene, one for each shortcut that changes what it does."""
    ways = kinds()
    found = {kind: [] for kind in ways}
    if eqs.n2 is None:
        del ways["a variate for each noise"]
    if trajectories.update_of(eqs, H).line is None:
        del ways["line of impacts"]
    for seed in range(options.rounds):
        for kind, (kernel, update) in ways.items():
            with mock.patch.multiple(trajectories, advance=kernel, update_of=update):
                found[kind].append(sampled(eqs, options.trajectories, options.duration, seed))
    values = {kind: np.concatenate([one[0] for one in found[kind]]) for kind in ways}
    controls = {kind: np.vstack([one[1] for one in found[kind]]) for kind in ways}
    costs = {kind: min(one[2] for one in found[kind]) for kind in ways}
    total = options.rounds * options.trajectories * options.duration
    mean, error = mean_and_error(controlled_entries(values["all of them"], controls["all of them"]))

    def left(bias, cost):
        return math.sqrt(bias**2 + (error / mean) ** 2 * total * cost / (1e9 * H))

    for kind in list(ways)[1:]:
        both = np.hstack([controls["all of them"], controls[kind]])
        bias, unsure = mean_and_error(
            controlled_entries(values["all of them"] - values[kind], both)
        )
        seen = bias / mean if abs(bias) > SEEN * unsure else 0.0
        yield {
            "scene": name,
            "shortcut": kind,
            "ns a step": costs["all of them"],
            "without it": costs[kind],
            "bias": bias / mean,
            "its error": unsure / mean,
            "z": bias / unsure if unsure > 0.0 else 0.0,  # the same to the last digit
            "error a second": left(seen, costs["all of them"]),
            "error a second, without over with": left(0.0, costs[kind])
            / left(seen, costs["all of them"]),
        }


def main():
    """Measure every scene and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trajectories", type=int, default=4096)
    parser.add_argument("--duration", type=float, default=800.0)
    parser.add_argument("--rounds", type=int, default=12)
    options = parser.parse_args()
    rows = [row for name, eqs in SCENES.items() for row in rows_of(name, eqs, options)]
    report("shortcuts", rows, ("numba", "llvmlite"), options=vars(options), load=os.getloadavg()[0])


if __name__ == "__main__":
    main()
