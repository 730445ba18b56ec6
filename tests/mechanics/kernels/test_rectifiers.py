"""Circuits in closed form: the diode's own law, closed forms at a fixed amplitude, ngspice on the same noise."""

import dataclasses
import math
import re
from itertools import pairwise

import numpy as np
import pytest
from numba import njit

from harvester.circuits.idealised import THERMAL, TOPOLOGIES, ideal_circuit
from harvester.cosimulation import runs as worker
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.equations.coefficients import Equations
from harvester.equations.scales import Scales, scales
from harvester.errors import InputError
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.loads import CHARGING_TIMES
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.diode import exponential, logarithm, lowered
from harvester.mechanics.kernels.equation_of_motion import drift
from harvester.mechanics.kernels.ideal_circuit import (
    Flyback,
    IdealCircuit,
    Store,
    SwitchedCoil,
    flown_back,
    fly,
)
from harvester.mechanics.kernels.intervals import interval
from harvester.mechanics.kernels.moments import from_path
from harvester.mechanics.kernels.noise import child, fill_three_point, gaussian_grid
from harvester.mechanics.trace import trace
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from harvester.scene.toml import load
from harvester.uncertainty.value import mean_and_error
from tests.support.systems import changed, z
from tests.support.to_scene import equations

SEED = np.random.SeedSequence(20261121)
PLATE = Equations(beta=1.245, c1=-0.008, n1=1.0)
SWITCHED = {
    "parallel_sshi": {"bridge": True, "hysteresis": 0.005, "parallel": SwitchedCoil(0.7, 150.0)},
    "series_sshi": {"hysteresis": 0.005, "series": SwitchedCoil(0.7, 150.0)},
    "sece": {"hysteresis": 0.005, "sece": Flyback(0.03, 150.0, 0.09, 2e-4, 2.0)},
}
FREE = Coefficients()
KINDS = {"bridge": {"bridge": True}, "doubler": {"doubler": True}, **SWITCHED}


def circuit(kind="bridge", mu=0.5, kappa=20.0, n=0.0066, leak=7e-4, loss=0.0, **changes):
    return IdealCircuit(mu=mu, kappa=kappa, n=n, leak=leak, loss=loss, **{**KINDS[kind], **changes})


def without_drop(kind, mu, kappa=None, **changes):
    """With diodes of next to no drop, in one switching as in many, and a capacitor of ten periods."""
    kappa = 20 * math.pi * mu if kappa is None else kappa
    return circuit(kind, mu, kappa, 1e-4, 1.0, **changes)


def moved(one, x, h, U=0.0):
    """V and U along a motion through the displacements x, h apart, at constant velocity in between."""
    V = 0.0
    m = x[0]
    seen = []
    for a, b in pairwise(x):
        v = (b - a) / h
        (_, _, V), (U, m), _ = fly(
            State(a, v, V), Store(U, m), interval(h, h, None), FREE, one, None
        )
        seen.append((V, U))
    return np.array(seen).T


def harmonic(one, periods=60, steps=120):
    """(mean of U, of U^2 and of V x') over the last ten periods of x = sin t."""
    t = np.linspace(0.0, 2 * math.pi * periods, steps * periods + 1)
    V, U = moved(one, np.sin(t), t[1])
    last = slice(-10 * steps, None)
    before = np.concatenate([[0.0], V[:-1]])
    taken = 0.5 * (V + before) * np.diff(np.sin(t)) / t[1]
    return U[last].mean(), (U[last] ** 2).mean(), taken[last].mean()


def test_exponential_and_logarithm():
    for x in [*np.linspace(-699.0, 699.0, 101), 0.0, 1e-9, 0.3465, -0.3466]:
        assert exponential(x) == pytest.approx(math.exp(x), rel=1e-12)
    for x in [*np.logspace(-300, 300, 101), 1.0, 1.0 + 1e-9, math.sqrt(2.0), 2.0 - 1e-12, 2.0]:
        assert logarithm(x) == pytest.approx(math.log(x), rel=1e-13, abs=1e-13)
    assert exponential(-1e9) == pytest.approx(0.0, abs=1e-300)
    assert math.isfinite(exponential(1e9))


@pytest.mark.slow
def test_lanes_of_diodes_become_vector_instructions():
    @njit(fastmath={"contract", "reassoc", "nsz", "arcp"}, error_model="numpy")
    def many(w, out):
        for i in range(64):
            out[i] = lowered(w[i], w[i] + 0.1, 0.1, 0.01, 1e-3)

    many(np.zeros(64), np.empty(64))
    assert re.search(r"fmul .*<\d x double>", "".join(many.inspect_llvm().values()))


@pytest.mark.parametrize(
    "w0, w1", [(-1.0, 0.3), (0.1, 0.25), (0.2, 0.2), (0.25, -0.1), (-9.0, -8.0), (-60.0, 40.0)]
)
def test_diode_under_a_constant_slope(w0, w1):
    """W' = (w1 - w0)/t - leak exp(w/n) by an independent solver."""
    from scipy.integrate import solve_ivp

    t = 0.3
    n = 0.02
    leak = 1e-4
    w = solve_ivp(
        lambda _, w: (w1 - w0) / t - leak * np.exp(np.minimum(w / n, 690.0)),
        (0, t),
        [w0],
        "LSODA",
        rtol=1e-10,
        atol=1e-12,
    ).y[0, -1]
    assert w1 - lowered(w0, w1, t, n, leak) == pytest.approx(w, rel=1e-7, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["bridge", "doubler"])
@pytest.mark.parametrize("mu, kappa", [(0.5, 20.0), (2.0, 0.3)])
def test_flow_against_the_circuits_equations(kind, mu, kappa):
    """V' = x' - i+ + i-, kappa U' = i+ (+ i-) - mu U, with Shockley's currents; second order."""
    from scipy.integrate import solve_ivp

    one = circuit(kind, mu, kappa, n=0.02, leak=1e-3)

    def slope(t, y):
        V, U = y
        if kind == "bridge":
            up, down = (1e-3 * math.exp((s * V - U) / 0.04) for s in (1.0, -1.0))
            return math.cos(t) - up + down, (up + down - mu * U) / kappa
        up = 1e-3 * math.exp((V - U) / 0.02)
        down = 1e-3 * math.exp(-V / 0.02)
        return math.cos(t) - up + down, (up - mu * U) / kappa

    exact = solve_ivp(slope, (0.0, 9.0), [0.0, 0.0], "Radau", rtol=1e-9, atol=1e-11).y[:, -1]
    errors = []
    for steps in (200, 400):
        t = np.linspace(0.0, 9.0, steps + 1)
        errors.append(np.abs(moved(one, np.sin(t), t[1])[:, -1] - exact).max())
    assert errors[0] < 2e-3
    assert errors[1] < 0.35 * errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("kind", ["bridge", "doubler", "parallel_sshi", "series_sshi"])
def test_voltage_at_a_fixed_amplitude(kind, share):
    """The closed forms of the netlists' headers, no drops, w = Voc = 1; the ripple is 5 % (the doubler's 8 %)."""
    q = 0.7
    best = {
        "bridge": 0.5,
        "doubler": 2.0,
        "parallel_sshi": 1 / (1 - q),
        "series_sshi": 0.5 * (1 - q) / (1 + q),
    }
    inner = math.pi * best[kind]
    mu = 1.0 / (share * inner)
    open_voltage = {
        "bridge": 1.0,
        "doubler": 2.0,
        "parallel_sshi": 2.0 / (1 - q),
        "series_sshi": 1.0,
    }[kind]
    found, square, taken = harmonic(
        without_drop(kind, mu, hysteresis=1e-4 if kind in SWITCHED else None)
    )
    assert found == pytest.approx(
        open_voltage * share / (1 + share), rel=0.03 if kind == "doubler" else 0.012
    )
    if kind in ("bridge", "doubler"):  # nothing else takes power
        assert taken == pytest.approx(mu * square, rel=3e-3)


def test_drop_at_a_fixed_amplitude():
    """Vdc = (Voc - 2 Vd) R/(R + pi/(2 w Cp)) of a nearly ideal threshold Vd, whose loss is 2 Vd times the current."""
    n = 2e-4
    threshold = 0.1
    mu = 1.0
    one = circuit("bridge", mu, 20 * math.pi * mu, n, math.exp(-threshold / n))
    found, square, taken = harmonic(one)
    assert found == pytest.approx((1 - 2 * threshold) / (1 + mu * math.pi / 2), rel=6e-3)
    assert taken == pytest.approx(mu * square + 2 * threshold * mu * found, rel=5e-3)


def test_drop_of_the_switch_at_a_fixed_amplitude():
    """Vdc = (2 Voc - (1 + q) Vs)/(1 - q + pi mu): a switch's diode of Vs, a bridge of none."""
    n = 2e-4
    threshold = 0.1
    q = 0.7
    mu = 0.3
    leak = math.exp(-threshold / n)
    one = circuit(
        "parallel_sshi",
        mu,
        20 * math.pi * mu,
        n,
        leak,
        hysteresis=1e-4,
        parallel=SwitchedCoil(q, 2.0),
    )
    whole = 2 - 2 * (1 - q) * threshold - (1 + q) * threshold
    assert harmonic(one)[0] == pytest.approx(whole / (1 - q + math.pi * mu), rel=6e-3)


@pytest.mark.parametrize("mu", [0.02, 0.2])
def test_sece_at_a_fixed_amplitude(mu):
    """P = 2 w Cp Voc^2/pi, whatever the load, of an inductor without loss and a rest of nothing."""
    one = without_drop("sece", mu, hysteresis=1e-4, sece=Flyback(0.0, 1.0, 0.0, 0.0, 0.0))
    _, square, taken = harmonic(one)
    assert mu * square == pytest.approx(2 / math.pi, rel=6e-3)
    assert taken == pytest.approx(mu * square, rel=6e-3)


@pytest.mark.parametrize("U", [1.5, 6.0])  # the core loses more at a higher voltage
def test_flyback_against_the_coils_equations(U):
    """The quarter oscillation and the inductor's running down, losses included, by an independent solver."""
    from scipy.integrate import solve_ivp

    capacitance = 1.0
    coil = 1e-4
    wire = 6e-4
    closed = 3e-4
    core = 1.0
    kappa = 30.0
    # no drops
    V = 2.0
    rest = 0.1
    n = 1e-9
    leak = 1.0
    root = math.sqrt(coil / capacitance)
    damping = 0.5 * ((wire + closed) / root + root / core)
    one = Flyback(damping, 1.0 / root, rest, wire, 1.0 / core)

    def quarter(_, y):
        w, i = y  # the core sees the inductor's terminals, behind the switch
        behind = (w - closed * i) / (1 + closed / core)
        return -(i + behind / core), (behind - wire * i) / coil

    reached = lambda _, y: y[0] - rest  # noqa: E731
    reached.terminal = True
    i = solve_ivp(quarter, (0, 1), [V, 0.0], rtol=1e-10, atol=1e-12, events=reached).y[1, -1]

    def down(_, y):
        u, i = y
        return (i - u / core) / kappa, -(u + wire * i) / coil

    empty = lambda _, y: y[1] - y[0] / core  # noqa: E731
    empty.terminal = True
    after = solve_ivp(down, (0, 1), [U, i], rtol=1e-10, atol=1e-12, events=empty).y[0, -1]
    left, found = flown_back(V, U, one, kappa, n, leak)
    assert left == rest
    assert found - U == pytest.approx(after - U, rel=0.01)
    lossless = flown_back(V, U, Flyback(0.0, 1.0 / root, rest, 0.0, 0.0), kappa, n, leak)[1]
    assert kappa * (lossless**2 - U**2) == pytest.approx(V**2 - rest**2, rel=1e-6)
    assert lossless - U > 1.03 * (found - U)  # the losses are seen


def test_series_inversion_conserves_charge():
    one = circuit("series_sshi", 1e-9, 0.5)
    V, U = moved(one, np.array([0.0, 2.0, 1.9, 1.8]), 0.1)
    charge = np.array([2.0, 1.9, 1.8]) - V
    assert charge[1] > 0.9
    assert pytest.approx(0.5 * U, rel=1e-7) == charge


def test_series_inversion_of_the_voltage_between_both_capacitors():
    """Without drops V - U becomes -q (V - U), whatever the capacitor's size."""
    for kappa in (0.1, 1.0, 1e3):
        one = without_drop("series_sshi", 1e-9, kappa, hysteresis=1e-9)
        V, U = moved(one, np.array([0.0, 2.0, 2.0 - 1e-6]), 0.1)
        assert V[1] - U[1] == pytest.approx(-0.7 * 2.0, rel=0.02)


@pytest.mark.parametrize("kind", SWITCHED)
def test_switching_within_a_drift_comes_at_its_time(kind):
    """One long drift or a hundred short ones: the same, but for what the diodes do not see of a step's shape."""
    turns = np.array([0.0, 2.0, 1.0])
    one = circuit(kind, 0.01, 30.0, hysteresis=0.3)
    long = moved(one, turns, 1.0)
    short = moved(one, np.concatenate([np.linspace(0, 2, 101)[:-1], np.linspace(2, 1, 101)]), 0.01)
    assert short[:, -1] == pytest.approx(long[:, -1], rel=2e-3, abs=2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_impact_within_a_drift(kind):
    """Two motions, to the stop and away from it, as `drift` has them."""
    one = circuit(kind)
    r = 0.8
    h = 0.2
    x = 0.1
    v = -1.5
    V = 0.6
    U = 0.3
    m = 0.102
    s = State(x, v, V)
    store = Store(U, m)
    d = interval(h, h, None)
    (x1, v1, V1), (U1, _), impact = fly(s, store, d, Coefficients(r=r), one, None)
    there = 0.1 / 1.5
    assert (x1, v1, *impact[:2]) == pytest.approx((*drift(s, d, None, r)[0][:2], there, 1.5))
    assert impact[2:] == pytest.approx([1.0, 0.5 * (1 - r**2) * 1.5**2])
    away = 0.8 * 1.5 * (h - there)
    (_, _, Va), store, _ = fly(s, store, interval(there, there, None), FREE, one, None)
    t = h - there
    (_, _, Vb), (Ub, _), _ = fly(State(0.0, v1, Va), store, interval(t, t, None), FREE, one, None)
    assert pytest.approx((Vb, Ub), rel=1e-12) == (V1, U1)
    assert x1 == pytest.approx(away)


def test_switch_waits_for_one_and_a_half_plays():
    """Back by 1.4 plays nothing happens, by 1.6 the voltage is inverted; a small way up and down does not count."""
    one = circuit("parallel_sshi", 1e-9, 1e9, hysteresis=0.01)
    x = np.array([0.0, 1.0, 0.986, 0.99, 0.9851, 0.984])
    V, _ = moved(one, x, 0.1, U=2.0)
    assert pytest.approx(x[1:-1], abs=1e-6) == V[:-1]
    assert -0.7 < V[-1] < -0.5


# circuits: two have all kinds of code
OTHER = pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "r"),
    [
        ("sece", 0.9),
        ("bridge", 0.9),
        *(pytest.param(kind, 0.9, marks=OTHER) for kind in KINDS if kind not in ("bridge", "sece")),
        pytest.param("bridge", None, marks=OTHER),
    ],
)
def test_lane_and_path_are_the_same_trajectory(kind, r):
    """With a stop there is all that there is without one, and the impact."""
    eqs = changed(PLATE, restitution=r)
    h = 0.07
    time = 12.0 if r else 60.0
    many = Trajectories(eqs, 64, SEED, h, circuit=circuit(kind))
    moments = many.run(time)
    words = Trajectories(eqs, 64, SEED, h, circuit=circuit(kind)).words[0]
    for lane in (0, 63):
        noise = np.empty(round(many.time / h))
        fill_three_point(noise, *words[:, lane])
        path = trace(eqs, noise, h, many.stride, circuit=circuit(kind))
        same = from_path(eqs, path, 0.0, 1, circuit(kind))
        for name in ("V2", "load", "x2", "impacts", "impact_loss"):
            assert getattr(same, name)[0] == pytest.approx(
                getattr(moments, name)[lane], rel=1e-6
            ), name
        assert pytest.approx(many.snapshot()[:, lane], rel=1e-6) == path.samples[-1, 2:]
        assert path.U[-1, 0] == pytest.approx(many.state[0, 3, lane], rel=1e-6)


@pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        (
            "bridge",
            {"n1": None, "drive": 0.7, "drive_frequency": 0.9}
            | {"gap": 0.6, "restitution": 0.8, "opposite_gap": 0.7, "opposite_restitution": 0.5},
        ),
        pytest.param(
            "sece",
            {
                "stop_stiffness": 400.0,
                "stop_damping": 2.0,
                "linear": 0.8,
                "alpha2": 0.1,
                "alpha": 0.2,
            },
            marks=pytest.mark.thorough("test_contact_is_the_equation"),
        ),
    ],
)
def test_the_mass_moves_as_with_a_resistor(kind, changes):
    """Whatever shakes and stops it, where the piezo does not act back; a lane and a path are the same there as well.

    But for the half kick that begins a path.
    """
    eqs = changed(PLATE, **{"beta": None, **changes})
    many = Trajectories(eqs, 64, SEED, 0.02, circuit=circuit(kind))
    words = many.words[0].copy()
    h = many.h
    start = (*many.state[0, :2, 5], 0.0, 0.0)
    phase = math.atan2(many.filter[0, 1, 5], many.filter[0, 0, 5])
    moments = many.run(30.0)
    noise = np.empty(round(many.time / h))
    fill_three_point(noise, *words[:, 5])
    shaking = None
    if eqs.drive is not None:
        shaking = eqs.drive * np.cos(phase + eqs.drive_frequency * h * np.arange(len(noise) + 1))
    path = trace(eqs, noise, h, many.stride, start, shaking, circuit(kind))
    same = trace(eqs, noise, h, many.stride, start[:3], shaking)
    assert len(path.impacts) > 2
    assert (
        pytest.approx(same.samples[:, [0, 2, 3]], rel=1e-9, abs=1e-9) == path.samples[:, [0, 2, 3]]
    )
    assert pytest.approx(same.impacts, rel=1e-9) == path.impacts
    assert moments.impacts[5] * many.time == pytest.approx(len(path.impacts), abs=1)
    assert path.U[-1, 0] == pytest.approx(many.state[0, 3, 5], rel=1e-3)
    assert moments.load[5] == pytest.approx(
        from_path(eqs, path, 0.0, 1, circuit(kind)).load[0], rel=1e-3
    )


@pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")
@pytest.mark.slow
def test_twice_the_step_is_on_the_same_noise_of_both_kinds():
    """Coloured noise and that of the stiffness draw from one generator, in an order that both steps keep."""
    eqs = changed(PLATE, n1=None, n2=0.3, coloured=1.0, correlation_time=1.0)
    fine = Trajectories(eqs, 64, SEED, 0.02, circuit=circuit())
    coarse = fine.coarser()
    for one in (fine, coarse):
        one.run(10.0)
    assert np.corrcoef(fine.state[0, 0], coarse.state[0, 0])[0, 1] > 0.999


@pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")
@pytest.mark.statistics
def test_power_balance():
    """Without drops the load gets all that the damping leaves of N1."""
    many = Trajectories(
        changed(PLATE, c1=-0.05), 1024, SEED, 0.05, circuit=without_drop("bridge", 0.5, 10.0)
    )
    burn_in(many)
    moments = many.run(many.time)
    assert abs(z(mean_and_error(moments.damped + PLATE.beta * moments.load), PLATE.n1)) < 4
    assert PLATE.beta * moments.load.mean() > 0.5


@pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")
@pytest.mark.statistics
def test_step_pair_sees_an_error_of_second_order():
    """The bias of the load's power at h is a quarter of that at 2 h, and is the difference from 2 h over 3."""
    pairs = [
        RichardsonPair(Trajectories(PLATE, 1024, SEED, h, circuit=circuit()), 400.0)
        for h in (0.2, 0.1)
    ]
    (coarse, coarse_error), (fine, fine_error) = (pair.bias("load") for pair in pairs)
    assert abs(coarse) > 8 * coarse_error
    assert abs(z((coarse, coarse_error), 4 * fine, 4 * fine_error)) < 4


@pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")
@pytest.mark.statistics
def test_settling_waits_for_the_capacitor():
    slow = circuit(mu=0.1, kappa=200.0)
    many = Trajectories(PLATE, 128, SEED, 0.1, circuit=slow)
    assert burn_in(many) == []
    assert many.time >= CHARGING_TIMES * slow.memory == 12000.0


def test_detection_begins_at_the_start():
    many = Trajectories(
        PLATE, 64, SEED, 0.1, start=np.array([0.7, 0.0, 0.0]), circuit=circuit("sece")
    )
    assert (many.state[:, 4] == 0.7).all()
    assert (many.with_step(0.2).state[:, 4] == 0.7).all()


def test_a_start_behind_the_stop_and_a_resistor_beside_are_refused():
    with pytest.raises(InputError, match="with a load circuit"):
        Trajectories(changed(PLATE, mu=1.0), 64, SEED, 0.1, circuit=circuit())
    with pytest.raises(InputError, match="the place of the stop"):
        trace(
            changed(PLATE, restitution=0.5),
            np.zeros(8),
            0.1,
            start=(-1.0, 0.0, 0.0, 0.0),
            circuit=circuit(),
        )


@pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")
@pytest.mark.slow
@pytest.mark.parametrize(("kind", "r"), [("bridge", None), *((kind, 0.0) for kind in KINDS)])
@pytest.mark.parametrize("mu", [1e-3, 1.0, 1e6])
@pytest.mark.parametrize("kappa", [1e-4, 1e8])
def test_hard_circuits(kind, mu, kappa, r):
    """From a short to an open load, from no capacitor to a farad, steps of 0.5, a stop of r = 0, no play."""
    play = {"hysteresis": 0.0} if kind in SWITCHED else {}
    load = circuit(kind, mu, kappa, loss=1.4e-3, **play)
    many = Trajectories(changed(PLATE, restitution=r), 64, SEED, 0.5, circuit=load)
    moments = many.run(100.0)
    assert np.isfinite(moments.load).all()
    assert (many.state[:, 3] >= 0.0).all()
    assert PLATE.beta * moments.load.mean() < 2.0 * PLATE.n1


def test_small_capacitor_follows_the_rectified_voltage():
    """kappa -> 0: the load is a resistor behind a bridge without drops, V' + mu V = x'."""
    mu = 1.3
    t = np.linspace(0.0, 60.0, 2001)
    V, U = moved(without_drop("bridge", mu, 1e-4), np.sin(t), t[1])
    exact = (np.sin(t) + mu * np.cos(t) - mu * np.exp(-mu * t))[1:] / (1 + mu * mu)
    assert pytest.approx(exact, abs=0.02) == V
    assert pytest.approx(np.abs(exact), abs=0.05) == U


def plate(name):
    scene = load(f"examples/plate_{name}.toml").without_stop()
    return scene, equations(scene), scales(scene)


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_the_packages_netlists(name):
    scene, _, s = plate(name)
    one = ideal_circuit(load_circuit(scene.load, s.capacitance), s)
    R, C = scene.load.parameters["R"], scene.load.parameters["C"]
    assert one.memory == pytest.approx(R * C * s.frequency)
    assert one.mu == pytest.approx(1.0 / (R * s.capacitance * s.frequency))
    assert one.n * s.volts == pytest.approx(1.752 * THERMAL)
    assert one.leak * s.coupling * s.length * s.frequency == pytest.approx(2.52e-9)
    assert {key for key in KINDS[name] if getattr(one, key) is not None} == set(KINDS[name])
    if one.hysteresis is not None:
        assert one.hysteresis * s.volts == pytest.approx(0.02)
    if one.parallel is not None:
        assert one.parallel.kept == pytest.approx(0.71, abs=0.005)
        assert one.parallel.peak == pytest.approx(
            1.0 / (s.frequency * math.sqrt(2.0 * s.capacitance))
        )
    if one.sece is not None:
        unit = s.capacitance * s.frequency
        assert (one.sece.wire, one.sece.core) == pytest.approx((200.0 * unit, 1.0 / (500e3 * unit)))
        assert one.sece.rest * s.volts == pytest.approx(0.3)


def test_series_coil_oscillates_with_both_capacitors():
    scene, _, s = plate("series_sshi")
    load = dataclasses.replace(
        scene.load, parameters=dict(scene.load.parameters) | {"C": s.capacitance}
    )
    one = ideal_circuit(load_circuit(load, s.capacitance), s)
    z = math.sqrt(2.0 / (0.5 * s.capacitance))
    zeta = 0.5 * (1300.0 / z + z / 500e3)
    assert one.series.kept == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)))
    assert one.series.peak == pytest.approx(1.0 / (z * s.capacitance * s.frequency))


def test_no_ideal_circuit():
    scene, _, s = plate("bridge")
    for one in (
        Load(resistance=1e6),
        Load(netlist="resistor", parameters={"R": 1e6}),
        Load(netlist="netlists/bridge.cir"),
    ):
        assert ideal_circuit(load_circuit(one, s.capacitance), s) is None
    with pytest.raises(InputError, match="unknown parameter"):
        load_circuit(Load(netlist="bridge", parameters={"Q": 1.0}), s.capacitance)
    with pytest.raises(InputError, match="must be above 0"):
        load_circuit(dataclasses.replace(scene.load, parameters={"R": 0.0}), s.capacitance)


def _spice(device, noise, discard):
    drive = worker.run_in_this_process(device, worker.new_drive(device, noise, discard))
    ended = drive.state[0]
    return (
        float(ended.load / (ended.end - ended.begin)) / device.scales.watts,
        drive.path(),
        drive.charge,
    )


def beside(name, trajectories, time, discard, step=0.1):
    """Load power by ngspice and in closed form on the same noise, and the last path of each."""
    scene, eqs, s = plate(name)
    one = ideal_circuit(load_circuit(scene.load, s.capacitance), s)
    h = step / math.sqrt(1 + eqs.beta)
    device = worker.CoupledDevice(eqs, s, load_circuit(scene.load, s.capacitance), h, 6)
    noises = [gaussian_grid(child(SEED, k), round(time / h / 6) * 6) for k in range(trajectories)]
    done = list(map_in_workers(_spice, [(device, noise, discard) for noise in noises]))
    paths = [trace(eqs, noise, h, 6, circuit=one) for noise in noises]
    mine = np.array([eqs.beta * from_path(eqs, path, discard, 1, one).load[0] for path in paths])
    return np.array([power for power, _, _ in done]), mine, done[-1], paths[-1], s


def rms(a, b):
    return np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2))


@pytest.mark.thorough("test_lane_and_path_are_the_same_trajectory")
@pytest.mark.ngspice
@pytest.mark.parametrize(
    "name",
    [
        "bridge",
        pytest.param(
            "doubler", marks=pytest.mark.thorough("test_ngspice_on_the_same_noise_with_a_switch")
        ),
    ],
)
def test_ngspice_on_the_same_noise(name):
    """Load power of 4 trajectories: the same but for 1e-3 of its variance, its mean to 0.1 %; V to 0.2 %."""
    spice, mine, (_, path, charge), same, s = beside(name, 4, 240.0, 100.0, step=0.05)
    assert 1.0 - np.corrcoef(spice, mine)[0, 1] ** 2 < 1e-3
    assert mine.mean() == pytest.approx(spice.mean(), rel=1e-3)
    assert rms(same.V, path.V) < 2e-3
    assert rms(s.volts * same.U[:, 1], charge) < 1e-3


@pytest.mark.ngspice
@pytest.mark.parametrize("name", ["parallel_sshi", "series_sshi", "sece"])
def test_ngspice_on_the_same_noise_with_a_switch(name):
    """The capacitor's voltage along one path: inversions are instantaneous here, 0.02/w0 there."""
    _, _, (_, _, charge), same, s = beside(name, 1, 60.0, 20.0)
    assert (
        rms(s.volts * same.U[:, 1], charge)
        < {"parallel_sshi": 0.03, "series_sshi": 0.02, "sece": 0.06}[name]
    )


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_reverse_currents_that_empty_the_capacitor(name):
    """Is/(Cp V w0) of each path of diodes from its one plate to the other: two of a bridge, one of the others."""
    s = Scales(mass=0.04, frequency=20.0, length=0.05, coupling=2e-4, capacitance=50.2e-9)
    found = ideal_circuit(
        load_circuit(Load(netlist=name, parameters={"Is": 3e-9}), s.capacitance), s
    )
    assert found.leak == pytest.approx(3e-9 / (s.capacitance * s.volts * s.frequency), rel=1e-12)
    assert found.loss == {"doubler": 1, "sece": 1}.get(name, 2) * found.leak
