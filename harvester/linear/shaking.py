"""E[x^2] and E[V^2] of the linear equations under non-white excitation: sums over lines, integrals over densities.

    lines     a harmonic excitation, a record    sum of |H|^2 p over their frequencies and powers
    density   coloured, band-pass, table         integral of |H|^2 G df,  G one-sided

The integral is over u = ln f, in which power laws are exponentials, by Gauss and Legendre on panels
that halve towards the poles of H and of the filter, however near the axis: they converge to
rounding, and two orders report how far.
"""

import math
from functools import lru_cache

import numpy as np

from harvester.arrays import Complexes, Floats
from harvester.equations.bounds import flow
from harvester.equations.coefficients import Equations
from harvester.linear.transfer import gains
from harvester.records.records import Record

# of each coefficient's relative rounding, with what is made of them
ROUNDING = 16.0 * float(np.finfo(float).eps)
NODES = (16, 12)  # of a panel, for the integral and for its error
STEEP = 4.0  # change of the density's logarithm over a panel, at most
# in ln f beyond all poles: e^-40 is left at |H|^2 f, and less above at |H|^2/f
BELOW, ABOVE = 40.0, 10.0
AT_ONCE = 4096  # panels, so that a table of a million rows takes no more memory than a short one
NEAREST = 1e-16  # pole to the axis that is reported from one on it
TURN = 2.0 * math.pi


def response_to_shaking(eqs: Equations) -> tuple[Floats, Floats]:
    """E[x^2] and E[V^2], shape (2,), and the errors of the record's lines or of the integral.

    The rounding error at a sharp resonance is not in them.
    """
    mean_squares, error = np.zeros(2), np.zeros(2)
    if eqs.drive is not None:
        assert eqs.drive_frequency is not None, "Scene checks this"
        mean_squares = 0.5 * eqs.drive**2 * gains(eqs, eqs.drive_frequency)
    if eqs.record is not None:
        w, p = lines(eqs.record)
        # of the strong lines over all
        g = gains(eqs, w)
        spread = (ROUNDING * math.log2(len(p))) ** 2 * p.mean()
        return g @ p, g @ (2.0 * np.sqrt(p * spread) + spread)
    if eqs.coloured is not None or eqs.density is not None:
        noise, error = _integral(eqs)
        mean_squares = mean_squares + noise
    return mean_squares, error


def lines(record: Record) -> tuple[Floats, Floats]:
    """Frequencies from 0 and powers of the Fourier series through a record, shape (n,)."""
    size = len(record.values)
    powers = np.abs(np.fft.rfft(record.values)) ** 2 / (0.5 * size * size)
    powers[0] *= 0.5
    if size % 2 == 0:
        powers[-1] *= 0.25  # a cosine through the samples has half of what they have
    return TURN / record.period * np.arange(float(len(powers))), powers


def _integral(eqs: Equations) -> tuple[Floats, Floats]:
    """The integral of |H|^2 G df for x and V, and its error: a narrow G is rounded as a sharp resonance is."""
    poles = np.linalg.eigvals(flow(eqs)).astype(complex)
    if eqs.density is not None:
        edges = np.log(eqs.density.frequencies)
        narrow = eqs.density.frequencies[eqs.density.values.argmax()] / eqs.density.width
    else:
        narrow = (eqs.centre or 0.0) / (eqs.bandwidth or 1.0)
        poles = np.append(poles, _filter_poles(eqs))
        scales = _resonances(poles)[0]
        edges = np.array([scales.min() - BELOW, scales.max() + ABOVE])
    with np.errstate(all="ignore"):  # far below all poles and between two zeros of a table
        ends = _panels(eqs, edges, poles)
        fine, coarse = (_sum(eqs, ends, *_rule(count)) for count in NODES)
    return fine, np.abs(fine - coarse) + ROUNDING * narrow * fine


def _density(eqs: Equations, f: Floats) -> Floats:
    """The one-sided density G of the excitation: the table's, or 4 D |F|^2 of a filter F."""
    if eqs.density is not None:
        return eqs.density.at(f)
    w = TURN * f
    if eqs.correlation_time is not None:
        off = w * eqs.correlation_time
    else:
        assert eqs.bandwidth is not None and eqs.centre is not None
        off = (eqs.centre - w) * (eqs.centre / w + 1.0) / eqs.bandwidth
    return np.asarray(4.0 * (eqs.coloured or 0.0) / (1.0 + off * off))


def _filter_poles(eqs: Equations) -> Complexes:
    """The poles of F: that of 1/(1 + tau s), or those of B s/(s^2 + B s + W^2)."""
    if eqs.correlation_time is not None:
        return np.array([-1.0 / eqs.correlation_time + 0j])
    assert eqs.bandwidth is not None and eqs.centre is not None
    return np.roots([1.0, eqs.bandwidth, eqs.centre**2]).astype(complex)


def _resonances(poles: Complexes) -> tuple[Floats, Floats]:
    """The poles s in ln f: their place on the axis of frequencies, and how far off it they are."""
    poles = poles[poles != 0.0]
    return np.log(np.abs(poles) / TURN), np.arctan2(np.abs(poles.real), np.abs(poles.imag))


def _panels(eqs: Equations, edges: Floats, poles: Complexes) -> Floats:
    """The ends of the panels in ln f: the edges, halvings towards each pole, and no panel longer than 1 or steep."""
    ends = [edges]
    for at, off in zip(*_resonances(poles), strict=True):
        away = max(off, NEAREST) * 2.0 ** np.arange(math.ceil(-math.log2(max(off, NEAREST))) + 1.0)
        ends += [at - away, np.array([at]), at + away]
    end = np.unique(np.clip(np.concatenate(ends), edges[0], edges[-1]))
    steep = np.nan_to_num(np.abs(np.diff(np.log(_density(eqs, np.exp(end))))) / STEEP, posinf=0.0)
    parts = np.ceil(np.maximum(np.diff(end), steep)).astype(int)
    return np.interp(np.arange(parts.sum() + 1), np.append(0, np.cumsum(parts)), end)


def _sum(eqs: Equations, ends: Floats, nodes: Floats, weights: Floats) -> Floats:
    """The sum over panels of a rule's nodes, shape (2,)."""
    whole = np.zeros(2)
    for first in range(0, len(ends) - 1, AT_ONCE):
        end = ends[first : first + AT_ONCE + 1]
        half = 0.5 * np.diff(end)
        middle = 0.5 * (end[1:] + end[:-1])
        f = np.exp(middle[:, None] + half[:, None] * nodes)
        whole += (gains(eqs, TURN * f) * (_density(eqs, f) * f) @ weights) @ half
    return whole


@lru_cache
def _rule(count: int) -> tuple[Floats, Floats]:
    """Gauss and Legendre's nodes and weights."""
    return np.polynomial.legendre.leggauss(count)
