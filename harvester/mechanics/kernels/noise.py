"""Seeded noise: Gaussian on a fixed grid for paths, three-point from random bits for statistics.

Strong: `gaussian_grid` holds one standard normal variate a step, so that the same trajectory can be
given to the exact update and to ngspice, and `refined` splits every step in two by the
Brownian bridge without changing the trajectory at the old grid points.

Weak: a variate that is 0 with probability 2/3 and +-sqrt(3) with 1/6 each has the first five
moments of a Gaussian, which is all that a scheme of weak order 2 uses (Kloeden and Platen,
section 14.2).  One draw of 64 bits gives two.
"""

import math

import numpy as np
from numba import uint32, uint64

from harvester.arrays import Floats, Words
from harvester.mechanics.kernels.compiled import forced, inlined, kernel

_SQRT3 = math.sqrt(3.0)
HALF_ROOT = math.sqrt(0.5)  # two variates in a row, times this, are one of twice the step
_SIXTH = 715827883  # 2^32/6, rounded; the probability is off by 1e-10
_FIVE_SIXTHS = 2**32 - _SIXTH


def child(seed: np.random.SeedSequence, *keys: int) -> np.random.SeedSequence:
    """An independent seed, the same for the same keys (``SeedSequence.spawn`` counts its calls)."""
    return np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, *keys))


def gaussian_grid(seed: np.random.SeedSequence, steps: int) -> Floats:
    """Standard normal variates, one for each of ``steps`` kicks.

    The same seed, the same trajectory.
    """
    return np.random.default_rng(seed).standard_normal(steps)


def refined(noise: Floats, rng: np.random.Generator) -> Floats:
    """Refine a noise path to a grid of half the step, shape (n,) -> (2 n,).

    W(t+h) - W(t) = sqrt(h) xi is kept; its halves are sqrt(h/2) (xi +- eta)/sqrt(2) with eta
    an independent standard normal variate (Brownian bridge).
    """
    eta = rng.standard_normal(noise.size)
    return (np.stack([noise + eta, noise - eta], axis=1) / math.sqrt(2.0)).ravel()


def random_words(seed: np.random.SeedSequence, count: int) -> Words:
    """Start states of the generator of `shuffle`: shape (2, count), never both words zero."""
    words = np.random.default_rng(seed).integers(0, 2**64, size=(2, count), dtype=np.uint64)
    words[0] |= np.uint64(1)
    return words


@inlined
def shuffle(s0, s1):
    """Draw 64 random bits by xoroshiro128+ (Blackman and Vigna 2018): (bits, new s0, new s1)."""
    bits = s0 + s1
    s1 ^= s0
    s0 = ((s0 << uint64(24)) | (s0 >> uint64(40))) ^ s1 ^ (s1 << uint64(16))
    s1 = (s1 << uint64(37)) | (s1 >> uint64(27))
    return bits, s0, s1


@inlined
def three_point(bits):
    """A three-point variate from 32 random bits: 0 with probability 2/3, +-sqrt(3) with 1/6 each."""
    low = -_SQRT3 if bits < uint32(_SIXTH) else 0.0
    high = _SQRT3 if bits >= uint32(_FIVE_SIXTHS) else 0.0
    return low + high


@inlined
def two_variates(bits):
    """The two three-point variates of 64 random bits."""
    return three_point(uint32(bits >> uint64(32))), three_point(uint32(bits & uint64(0xFFFFFFFF)))


@inlined
def variates(bits, coarse):
    """The variates of the coming two steps, or of one ``coarse`` step in the first place.

    The sum of both has the moments that weak order 2 uses, as they have: a coarse step is made on
    the same noise.
    """
    first, second = two_variates(bits)
    return (first + second) * HALF_ROOT if coarse else first, second


@forced
def draw_noise(noise, s0, s1, doublings):
    """Draw the `variates` of all lanes: into noise, shape (2, lanes).

    Steps that are doubled once have a draw each, and those doubled twice have two, whose sum they
    need.
    """
    for i in range(noise.shape[1]):
        bits, s0[i], s1[i] = shuffle(s0[i], s1[i])
        noise[0, i], noise[1, i] = variates(bits, doublings > 0)
    if doublings == 2:
        for i in range(noise.shape[1]):
            bits, s0[i], s1[i] = shuffle(s0[i], s1[i])
            noise[0, i] = (noise[0, i] + variates(bits, True)[0]) * HALF_ROOT


@forced
def draw_two_noises(noise, other, s0, s1, doublings):
    """The same for two independent noises, from twice as many draws of bits a lane."""
    for i in range(noise.shape[1]):
        bits, a, b = shuffle(s0[i], s1[i])
        noise[0, i], noise[1, i] = variates(bits, doublings > 0)
        bits, s0[i], s1[i] = shuffle(a, b)
        other[0, i], other[1, i] = variates(bits, doublings > 0)
    if doublings == 2:
        for i in range(noise.shape[1]):
            bits, a, b = shuffle(s0[i], s1[i])
            noise[0, i] = (noise[0, i] + variates(bits, True)[0]) * HALF_ROOT
            bits, s0[i], s1[i] = shuffle(a, b)
            other[0, i] = (other[0, i] + variates(bits, True)[0]) * HALF_ROOT


@kernel
def fill_three_point(noise, s0, s1):
    """Fill ``noise`` with the three-point variates that a lane of generator words s0, s1 draws."""
    for k in range(0, len(noise) - 1, 2):
        bits, s0, s1 = shuffle(s0, s1)
        noise[k], noise[k + 1] = two_variates(bits)
    if len(noise) % 2 == 1:
        bits, s0, s1 = shuffle(s0, s1)
        noise[-1], _ = two_variates(bits)


def coarsened(noise: Floats) -> Floats:
    """The same trajectory's noise for steps of twice the length, shape (2 n,) -> (n,), as `draw_noise` makes it."""
    return np.asarray((noise[::2] + noise[1::2]) * HALF_ROOT)


def three_point_grid(seed: np.random.SeedSequence, steps: int) -> Floats:
    """Three-point variates, one for each of ``steps`` kicks: the noise of one lane of an ensemble."""
    noise = np.empty(steps)
    fill_three_point(noise, *random_words(seed, 1)[:, 0])
    return noise
