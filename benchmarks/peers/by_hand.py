"""The ensemble's kernel as one would write it by hand for one scene, with only the terms of that scene.

An independent yardstick: it uses nothing of the package's step.  A line marked `#: a b` belongs to
the scenes that have the effects a and b, `#: !a` to those that lack a; `source` picks the lines,
and what is left is plain code without a trace of the others.  Two orders of the loops: both steps
of a draw in one loop, or a loop each.
"""

import math

import numba
import numpy as np

from harvester.mechanics.kernels.compiled import COMPILER

FLAGS = {"fastmath": {"contract", "reassoc", "nsz", "arcp"}, "error_model": "numpy", "nogil": True}

HEAD = """
def kernel(x, v, V, s0, s1, sums, readings, pairs, h, mu, r, alpha, beta, c1, c2, c3, n1, n2, line, line2):
    e = math.exp(-mu * h)                                               #: load
    g = (1.0 - e) / mu                                                  #: load
    e2 = math.exp(-0.5 * mu * h)                                        #: load
    g2 = (1.0 - e2) / mu                                                #: load
    later = np.zeros(64)                                                #: noise
    others = np.zeros(64)                                               #: external parametric
    for _ in range(readings):
        for _ in range(pairs):
            for i in range(64):
"""

DRAW = """
a, b = s0[i], s1[i]                                                     #: noise
bits = a + b                                                            #: noise
b ^= a                                                                  #: noise
s0[i] = ((a << u64(24)) | (a >> u64(40))) ^ b ^ (b << u64(16))          #: noise
s1[i] = (b << u64(37)) | (b >> u64(27))                                 #: noise
high, low = u32(bits >> u64(32)), u32(bits & u64(0xFFFFFFFF))           #: noise
NOW = (-ROOT3 if high < SIXTH else 0.0) + (ROOT3 if high >= REST else 0.0)  #: noise
THEN = (-ROOT3 if low < SIXTH else 0.0) + (ROOT3 if low >= REST else 0.0)    #: noise
"""

LOAD = "p, q, U = x[i], v[i], V[i]"
STORE = "x[i], v[i], V[i] = p, q, U"

DRIFT = """
pn = p + H * q
hit = pn < 0.0                                                          #: stop
Un = E * U + G * q                                                      #: load
Un -= (1.0 + r) * (LINE[0] * q + LINE[1] * pn) if hit else 0.0          #: stop load
pn = -r * pn if hit else pn                                             #: stop
Un = U + (pn - p)                                                       #: stop !load
Un = U + H * q                                                          #: !stop !load
qn = q                                                                  #: !stop
qn = -r * q if hit else q                                               #: stop
"""

KICK = """
speed = -q if hit else 0.0                                              #: stop
sums[10, i] += 1.0 if speed > 0.0 else 0.0                              #: stop
sums[11, i] += speed * speed                                            #: stop
F = -pn
F -= alpha * pn * pn * pn                                               #: cubic
F -= beta * Un                                                          #: back
F *= h
F += XI * math.sqrt(2.0 * h * n1)                                       #: external !parametric
F += XI * math.sqrt(2.0 * h * n2 * pn * pn)                             #: !external parametric
F += XI * math.sqrt(2.0 * h * n1) + XO * math.sqrt(2.0 * h * n2) * pn   #: external parametric
y = -h * c1                                                             #: linear !nonlinear
y = h * (c3 * pn * pn * pn * pn - c2 * pn * pn)                         #: !linear nonlinear
y = h * (c3 * pn * pn * pn * pn - c2 * pn * pn - c1)                    #: linear nonlinear
q = qn + F                                                              #: !linear !nonlinear
q = (qn + (1.0 + 0.5 * y) * F) / (1.0 + y + 0.5 * y * y)                #: damped
p, U = pn, Un
"""

READ = """
sums[0, i] += 0.5 * (U + Un)
sums[1, i] += U * U
sums[2, i] += Un * Un
sums[3, i] += 0.5 * (p + pn)
sums[4, i] += p * p
sums[5, i] += pn * pn
sums[6, i] += qn * qn
sums[7, i] += 0.5 * (p * U + pn * Un)
sums[8, i] += qn * Un
sums[9, i] -= c1 * qn * qn                                              #: linear !nonlinear
sums[9, i] += (c3 * pn * pn * pn * pn - c2 * pn * pn) * qn * qn         #: !linear nonlinear
sums[9, i] += (c3 * pn * pn * pn * pn - c2 * pn * pn - c1) * qn * qn    #: linear nonlinear
"""


def line(mu, h):
    """The straight line first + slope a nearest to (1 - exp(-mu a))/mu by least squares, a from 0 to h."""
    places, weights = np.polynomial.legendre.leggauss(8)
    a = 0.5 * h * (1.0 + places)
    slope, first = np.polyfit(a, -np.expm1(-mu * a) / mu, 1, w=np.sqrt(weights))
    return float(first), float(slope)


def effects(e):
    """Names of the effects of a scene; the mass never rests on the stop (external noise, or no back-coupling)."""
    names = {"stop": e.restitution, "load": e.mu, "cubic": e.alpha, "back": e.beta, "linear": e.c1}
    names |= {"nonlinear": e.c2, "external": e.n1, "parametric": e.n2}
    found = {name for name, value in names.items() if value is not None}
    found |= {"noise"} if found & {"external", "parametric"} else set()
    return found | ({"damped"} if found & {"linear", "nonlinear"} else set())


def source(e, split):
    """The code for a scene; ``split``: a loop for each of the two steps of a draw."""
    found = effects(e)

    def chosen(text, indent, **names):
        lines = []
        for line in text.strip("\n").splitlines():
            code, _, marks = line.partition("#:")
            if all((mark.lstrip("!") in found) != mark.startswith("!") for mark in marks.split()):
                for name, value in names.items():
                    code = code.replace(name, value)
                lines.append(" " * indent + code.rstrip())
        return "\n".join(lines)

    def step(xi, other):
        return chosen(DRIFT + KICK, 16, LINE="line", H="h", E="e", G="g", XI=xi, XO=other)

    load, store = " " * 16 + LOAD, " " * 16 + STORE
    loop = " " * 12 + "for i in range(64):"
    drawn = chosen(DRAW, 16, NOW="xi1", THEN="xi2")
    if {"external", "parametric"} <= found:  # a variate for each
        drawn += "\n" + chosen(DRAW, 16, NOW="other1", THEN="other2")
    first = [chosen(HEAD, 0), load, drawn, step("xi1", "other1")]
    kept = chosen("later[i] = xi2  #: noise\nothers[i] = other2  #: external parametric", 16)
    then = [kept, store, loop, load, step("later[i]", "others[i]")]
    second = then if split else [step("xi2", "other2")]
    half = [chosen(DRIFT, 12, LINE="line2", H="0.5 * h", E="e2", G="g2"), chosen(READ, 12)]
    return "\n".join([*first, *second, store, loop[4:], load[4:], *half]) + "\n"


def kernel(e, split):
    """The compiled kernel: called like the package's, with every coefficient a number, without n12, and two `line`s."""
    names = {"math": math, "np": np, "u64": np.uint64, "u32": np.uint32, "ROOT3": math.sqrt(3.0)}
    names |= {"SIXTH": np.uint32(715827883), "REST": np.uint32(2**32 - 715827883)}
    exec(source(e, split), names)
    return numba.njit(**COMPILER, **FLAGS)(names["kernel"])
