"""Noise inside a part: white noise of kicks, and filtered noise in the part's own state."""

import math

from numba import carray, types  # type: ignore[attr-defined]

from harvester.mechanics.kernels.compiled import inlined
from harvester.mechanics.kernels.noise import shuffle, two_variates
from harvester.mechanics.kernels.shaking import Filter, shake
from harvester.mechanics.part.part_state import W

SIZE = int(W.SIZE)
DIGITS = 1.0 / 2.0**53


@inlined
def uniform(words):
    """A number between 0 and 1, from 53 random bits."""
    bits, words[0], words[1] = shuffle(words[0], words[1])
    return ((bits >> types.uint64(11)) + 0.5) * DIGITS


@inlined
def white(words, c):
    """The two variates of a kick; 0 and None without white noise."""
    if c.n1 is None and c.n2 is None:
        return 0.0, None
    bits, words[0], words[1] = shuffle(words[0], words[1])
    return two_variates(bits)


@inlined
def shaker_of(f, w, words):
    """The filter of coloured noise on the state's own numbers; None without."""
    if f is None:
        return None
    state = carray(w, (SIZE,))
    random = carray(words, (2,))
    return Filter(
        a11=f.a11,
        a12=f.a12,
        a21=f.a21,
        a22=f.a22,
        l11=f.l11,
        l21=f.l21,
        l22=f.l22,
        gain=f.gain,
        samples=None,
        p=state[18:19],
        q=state[19:20],
        s0=random[0:1],
        s1=random[1:2],
        tone=None,
    )


@inlined
def begin_noise(w, words, f):
    """Begin filtered noise with its stationary law: the variance S = |A's first row|^2 S + l11^2."""
    if f is not None:
        kept_part = f.a11 * f.a11
        if f.a12 is not None:
            kept_part += f.a12 * f.a12
        length = f.l11 / math.sqrt(1.0 - kept_part)
        length *= math.sqrt(-2.0 * math.log(uniform(words)))
        angle = 2.0 * math.pi * uniform(words)
        w[18] = length * math.cos(angle)
        w[19] = length * math.sin(angle)


@inlined
def filtered(w, f):
    """The filtered noise's present acceleration, 0 without."""
    if f is None:
        return 0.0
    if f.gain is not None:
        return f.gain * w[18]
    return w[18]


@inlined
def step_noise(w, shaker):
    """Advance filtered noise by a step: its acceleration afterwards."""
    if shaker is None:
        return 0.0
    shake(carray(w, (SIZE, 1))[20:22], False, shaker)
    return w[21]
