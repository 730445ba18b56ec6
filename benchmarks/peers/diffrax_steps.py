"""diffrax on the CPU, three ways, all compiled by XLA in double precision.

    documented  vmap over trajectories of diffeqsolve with a VirtualBrownianTree, as its manual has it
    unsafe      the same with an UnsafeBrownianPath, which is made for fixed steps
    arrays      its solver's `step` in a loop of our own, on whole arrays of trajectories: the fastest

The stop acts between steps, inside the loop or inside a wrapped solver: x < 0 becomes x = -r x,
x' = -r x', and V follows the displacement.
"""

from functools import partial

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from common import PAPER, counts

jax.config.update("jax_enable_x64", True)
SIZE = 16384  # trajectories at a time: the fastest of 1024 to 65536


def _drift(_t, y, e):
    x, v, V = y
    x2 = x * x
    friction = (e.c3 * x2 - e.c2) * x2 - e.c1
    return v, -friction * v - (1.0 + e.alpha * x2) * x - e.beta * V, v - e.mu * V


class _Noise(diffrax.AbstractTerm):
    """Noise on the velocity alone: one variate a step, no product with zeros."""

    path: diffrax.AbstractBrownianPath

    def vf(self, t, y, args):
        return jnp.sqrt(2.0 * (args.n1 + args.n2 * y[0] ** 2))

    def contr(self, t0, t1, **kwargs):
        return self.path.evaluate(t0, t1, **kwargs)

    def prod(self, vf, control):
        return jnp.zeros_like(vf), vf * control, jnp.zeros_like(vf)


def _reflected(y, e):
    x, v, V = y
    hit = x < 0.0
    r = e.restitution
    bounced = jnp.where(hit, -r * x, x)
    return bounced, jnp.where(hit, -r * v, v), V + (bounced - x)


class _HeunWithStop(diffrax.Heun):
    """Heun's method, and the stop after every step."""

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        y, *rest = super().step(terms, t0, t1, y0, args, solver_state, made_jump)
        return _reflected(y, args), *rest


@partial(jax.jit, static_argnames=("every", "e"))
def _arrays(key, y, readings, h, every, e):
    """(state, mean of V^2) after ``readings`` times ``every`` steps of whole arrays."""
    terms = diffrax.MultiTerm(
        diffrax.ODETerm(_drift), _Noise(diffrax.UnsafeBrownianPath(y[0].shape, key))
    )
    solver = _HeunWithStop()

    def step(k, carry):
        y, state = carry
        y, _, _, state, _ = solver.step(terms, k * h, (k + 1) * h, y, e, state, False)
        return y, state

    def reading(k, carry):
        y, state, total = carry
        y, state = jax.lax.fori_loop(k * every, (k + 1) * every, step, (y, state))
        return y, state, total + y[2] ** 2

    state = solver.init(terms, 0.0, h, y, e)
    y, _, total = jax.lax.fori_loop(0, readings, reading, (y, state, jnp.zeros_like(y[2])))
    return y, total / readings


@partial(jax.jit, static_argnames=("readings", "every", "e", "tree"))
def _solved(key, y, readings, h, every, e, tree):
    """The same by diffeqsolve, one trajectory a lane of vmap."""
    end = readings * every * h

    def one(key, *y):
        path = (
            diffrax.VirtualBrownianTree(0.0, end, h / 2, (), key)
            if tree
            else diffrax.UnsafeBrownianPath((), key)
        )
        terms = diffrax.MultiTerm(diffrax.ODETerm(_drift), _Noise(path))
        saved = diffrax.SaveAt(
            ts=jnp.linspace(every * h, end, readings), fn=lambda t, y, args: y[2], t1=False
        )
        last = diffrax.SubSaveAt(t1=True)
        both = diffrax.SaveAt(subs=(saved.subs, last))
        solution = diffrax.diffeqsolve(
            terms,
            _HeunWithStop(),
            0.0,
            end,
            h,
            y,
            e,
            saveat=both,
            max_steps=None,
            adjoint=diffrax.ForwardMode(),
        )
        V, y = solution.ys
        return jax.tree.map(lambda a: a[-1], y), (V**2).mean()

    return jax.vmap(one)(jax.random.split(key, y[0].shape[0]), *y)


def averages(h, n, burn_in, duration, seed, e=PAPER, way="arrays"):
    """Time average of V^2 of each trajectory."""
    every, readings = counts(h, duration)
    run = _arrays if way == "arrays" else partial(_solved, tree=way == "documented")
    means = []
    for k in range(0, n, SIZE):
        keys = jax.random.split(jax.random.fold_in(jax.random.key(seed), k))
        y = tuple(jnp.zeros(min(SIZE, n - k)) for _ in range(3))
        if burn_in:
            y, _ = run(keys[0], y, counts(h, burn_in)[1], h, every=every, e=e)
        means.append(np.asarray(run(keys[1], y, readings, h, every=every, e=e)[1]))
    return np.concatenate(means)
