"""Bridges of diodes as their cards state it, without Rs or Cjo as well: every step converges, and the power is right.

The reference is an integration of its own.  With four diodes alike that lead the currents I(v), and
V between the piezo's electrodes, u between the rails, these float so that V - u is across one pair
and -V - u across the other, twice each:

    Cp V' = theta x' - I((V - u)/2) + I(-(V + u)/2)        C u' = I((V - u)/2) + I(-(V + u)/2) - u/R
"""

import dataclasses
import itertools
import math
import time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import harvester as hv
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.circuits.junctions import THERMAL, diode
from harvester.circuits.reduction import SummedEquations
from harvester.equations.problem import Problem
from harvester.errors import CircuitError
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.compiled import interpreted
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.step_size import step_from_rest, whole_steps
from harvester.storage.measured_current import Rectifier, measured
from tests.support.netlists import BRIDGE, compiled, written

HERTZ = 46.0
GRAVITIES = 0.2
CP = 47e-9
THETA = 1.5e-3
MASS = 8e-3
RATIO = 0.012
OHM = 2e5
BARE = BRIDGE.format("d") + "Csmooth a b {farads}\nRload a b 200k\n.model d D{card}\n"
OTHERS = {
    "rails with a path to the piezo": BARE + "Rleak b n 1G",
    "rails with a little capacitance to the piezo": BARE + "Cstray b n 10p",
    "a store with a resistance": BARE.replace("Csmooth a b", "Resr a c 50m\nCsmooth c b")
    + "Rleak b n 10Meg",
    "two diodes in series": "D1 p c d\nD5 c a d\nD2 n a d\nD3 b p d\nD4 b n d\n"
    + BARE.partition("D4 b n d\n")[2],
    "a doubler": "C2 p m 1u\nD1 m a d\nD2 n m d\nCsmooth a n {farads}\nRload a n 200k\n.model d D{card}\n",
    "a zener": BARE + "Dz b a z\n.model z D(Is=1e-15 Bv=5.1)",
}


def driven(folder, body, psd=None):
    """A plate with a netlist of this body, at its resonance or under noise."""
    shaken = {"acceleration_amplitude": f"{GRAVITIES} g", "frequency": f"{HERTZ} Hz"}
    return hv.Scene(
        oscillator=hv.Oscillator(mass=MASS, frequency=f"{HERTZ} Hz", damping_ratio=RATIO),
        piezo=hv.Piezo(coupling=THETA, capacitance=CP),
        excitation=hv.Excitation(**(shaken if psd is None else {"acceleration_psd": psd})),
    ).with_load(netlist=written(folder, body))


def after_jumps(scene, circuit, volts, periods=3):
    """How many steps fail from rest, and after each jump of the storage capacitor to one of
    ``volts``."""
    eqs = Problem.of(scene).equations
    h = whole_steps(step_from_rest(eqs), eqs.shaking_period)
    at = circuit.charge_at("csmooth")
    n_steps = round(eqs.shaking_period / h) * periods
    state = circuit.rest
    start = (0.0, 0.0)
    failed = []
    for k, volt in enumerate([None, *volts]):
        if volt is not None:
            state[at] = volt / circuit.system.charges[at][3]
        path = circuit.trace(
            eqs, np.zeros(n_steps), h, 1, start, state, forcing(eqs, h, n_steps), k > 0
        )
        state = path.state
        start = path.last[:2]
        failed.append(path.failed)
    return failed


def test_no_step_fails_with_default_diodes(tmp_path):
    scene = driven(tmp_path, BARE.format(farads="100u", card=""))
    rectifier = Rectifier(Problem.of(scene))
    assert after_jumps(scene, compiled(scene), [3.0, 0.0]) == [0, 0, 0]
    assert after_jumps(
        scene, rectifier.compiled(rectifier.held), [2.0, 7.0, 0.0, 100.0, 5.0]
    ) == 6 * [0]


@pytest.mark.slow
@pytest.mark.parametrize("more", ["", "Cjo=14p", "Rs=1", "Rs=1u Cjo=14p"])
def test_no_step_fails_whatever_the_diodes_are(tmp_path, more):
    """A held storage capacitor is 1e16 times what leaks: before the rails' equations were summed,
    50 of 100 such cards failed."""
    for saturation, n in itertools.product(
        ["1e-18", "1e-14", "1e-9", "1e-7", "1e-5"], [0.5, 1.0, 3.0]
    ):
        card = f"(Is={saturation} N={n} {more})"
        scene = driven(tmp_path, BARE.format(farads="100u", card=card))
        rectifier = Rectifier(Problem.of(scene))
        assert after_jumps(scene, compiled(scene), [3.0, 0.0]) == [0, 0, 0], card
        held = rectifier.compiled(rectifier.held)
        assert after_jumps(scene, held, [2.0, 7.0, 0.0, 100.0, 5.0]) == 6 * [0], card


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        name
        if k == 0
        else pytest.param(
            name, marks=pytest.mark.thorough("test_no_step_fails_behind_other_rectifiers")
        )
        for k, name in enumerate(OTHERS)
    ],
)
def test_no_step_fails_behind_other_rectifiers(tmp_path, name):
    for saturation, more in itertools.product(
        ["1e-18", "1e-14", "1e-5"], ["", "Rs=1u", "Rs=1m Cjo=14p"]
    ):
        body = OTHERS[name].format(farads="100u", card=f"(Is={saturation} {more})")
        scene = driven(tmp_path, body)
        rectifier = Rectifier(Problem.of(scene))
        held = rectifier.compiled(rectifier.held)
        assert after_jumps(scene, held, [2.0, 7.0, 0.0, 5.0]) == 5 * [0], (saturation, more)


def test_what_rails_get_as_a_whole_has_nothing_of_the_store(tmp_path):
    """C/tau is 1e4 S there, and its rounding error as large as the leaks of four diodes, 1e-12 S each."""
    problem = Problem.of(driven(tmp_path, BARE.format(farads="100u", card="")))
    rectifier = Rectifier(problem)
    reduction = rectifier.compiled(rectifier.held).reduction
    (head,) = SummedEquations(reduction.system).sums
    summed = reduction.stage(1e-5).admittances[reduction.rows.index(head)]
    expected = {"p": -2e-12, "a": 2e-12, "b": 2e-12}
    names = list(reduction.system.unknowns)
    assert dict(zip([names[k] for k in reduction.columns], summed, strict=True)) == pytest.approx(
        {
            next(name for name in names if name.endswith(key)): value
            for key, value in expected.items()
        },
        rel=1e-9,
    )


def integrated(card, farads, seconds):
    """V of the storage capacitor at the end, and the load power (W), from rest: by a stiff integrator."""
    saturation, n = card
    w = 2.0 * math.pi * HERTZ
    law = interpreted(diode)

    def current(v):
        return (
            law(v, saturation, n * THERMAL, math.inf, THERMAL, 0.0, 1.0, 0.5, 0.5, 0.0)[0]
            + 1e-12 * v
        )

    def rates(t, y):
        x, v, piezo, store, _ = y
        forward = current(0.5 * (piezo - store))
        backward = current(-0.5 * (piezo + store))
        force = -MASS * w**2 * x - 2.0 * RATIO * MASS * w * v - THETA * piezo
        acceleration = force / MASS - GRAVITIES * 9.80665 * math.cos(w * t)
        u = forward + backward - store / OHM
        return [v, acceleration, (THETA * v - forward + backward) / CP, u / farads, store**2]

    given = {
        "method": "LSODA",
        "rtol": 1e-7,
        "atol": [1e-11, 1e-9, 1e-7, 1e-8, 1e-9],
        "max_step": 1e-3,
    }
    found = solve_ivp(rates, (0.0, seconds), 5 * [0.0], **given)
    return float(found.y[3, -1]), float(found.y[4, -1]) / OHM / seconds


@pytest.mark.slow
@pytest.mark.parametrize("card", [(1e-14, 1.0), (0.2e-6, 1.05), (1e-18, 3.0), (1e-5, 0.5)])
def test_store_and_power_are_those_of_an_integration_of_its_own(tmp_path, card):
    farads = 10e-6
    vibrations = 23
    scene = driven(tmp_path, BARE.format(farads=farads, card="(Is={} N={})".format(*card)))
    problem = Problem.of(scene)
    eqs = problem.equations
    circuit = CompiledCircuit(problem.circuit, problem.scales, tolerance=3e-3)
    h = whole_steps(0.5 * step_from_rest(eqs), eqs.shaking_period)
    path = circuit.trace(eqs, np.zeros(round(eqs.shaking_period / h) * vibrations), h, 1)
    seconds = vibrations / HERTZ
    volts, power = integrated(card, farads, seconds)
    assert path.failed == 0
    assert path.voltages[-1, 1] == pytest.approx(volts, rel=3e-3)
    assert path.square[-1] / circuit.resistance / seconds == pytest.approx(power, rel=5e-3)


@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize("card", ["", "(Is=0.2u N=1.05)"])
def test_a_charge_by_the_mean_current_takes_the_time_that_an_integration_takes(tmp_path, card):
    """Charging 100 uF to 3 V: the stated error is a per cent, where it never got there before."""
    scene = driven(tmp_path, BARE.format(farads="100u", card=card))
    found = hv.charge(scene, "3 V", engine="slow")
    seconds = {"": 2.1412, "(Is=0.2u N=1.05)": 1.8257}[card]  # `integrated` to there
    assert found.time.value == pytest.approx(seconds, rel=5e-3)
    assert found.time.error95 < 0.02 * seconds


@pytest.mark.slow
def test_under_noise_a_little_resistance_and_capacitance_change_next_to_nothing(tmp_path):
    """Four default diodes on the same noise."""

    def power(card):
        scene = driven(tmp_path, BARE.format(farads="1u", card=card), psd="1e-5 g^2/Hz")
        problem = Problem.of(scene)
        runs = Trajectories(
            problem.equations, 64, np.random.SeedSequence(5), 0.1, circuit=compiled(scene)
        )
        load = float(runs.run(400.0).load.mean())
        assert runs.own_sums[1] == 0.0
        return load

    assert power("") == pytest.approx(power("(Rs=1 Cjo=2p)"), rel=5e-3)


RELAY = (
    BRIDGE.format("d")
    + "Csmooth a b 1u\nRload a b 1.5Meg\n.model d D\nB1 a b I=v(a,b) > 0.01 ? 1m : -1m\n"
)
WHY = "of the circuit's steps did not converge, at netlist element b1"


@pytest.mark.slow
def test_steps_that_fail_are_no_answer(tmp_path):
    """The current jumps where the storage capacitor comes to rest, so that there is no solution;
    the element is named."""
    scene = driven(tmp_path, RELAY, psd="1e-5 g^2/Hz")
    eqs = Problem.of(scene).equations
    circuit = compiled(scene)
    with pytest.raises(hv.SimulationError, match=WHY):
        circuit.trace(eqs, np.random.default_rng(0).normal(size=2000), 0.1)
    with pytest.raises(hv.SimulationError, match=WHY):
        Trajectories(eqs, 16, np.random.SeedSequence(1), 0.1, circuit=circuit).run(30.0)
    # also where a deadline ends the run before its last step, as many failed steps take long
    with pytest.raises(hv.SimulationError, match=WHY):
        Trajectories(eqs, 16, np.random.SeedSequence(1), 0.1, circuit=circuit).run(
            30.0, deadline=time.perf_counter()
        )


@pytest.mark.ngspice
@pytest.mark.slow
def test_studies_refuse_steps_that_fail(tmp_path):
    scene = driven(tmp_path, RELAY, psd="1e-5 g^2/Hz")
    steady = dataclasses.replace(scene, excitation=driven(tmp_path, RELAY).excitation)
    asked = [
        lambda: hv.run(scene, engine="compiled", budget="5s"),
        lambda: hv.charge(scene, "1 V", engine="compiled", trajectories=16),
        lambda: hv.run(steady, engine="compiled", budget="5s"),
    ]
    for ask in asked:
        with pytest.raises(hv.SimulationError, match=WHY):
            ask()
    for one in (scene, steady):  # the current of the board itself is refused before any step
        with pytest.raises(hv.SimulationError, match=f"{WHY}|the board itself draws"):
            hv.charge(one, "1 V", engine="slow")


def test_resistors_across_the_rails_are_part_of_the_held_circuit(tmp_path):
    """The ideal bridge carries them; it represents nothing else that is next to the storage capacitor and the load.

    The current into a storage capacitor that is held is then smaller by V/R.
    """
    plain = BARE.format(farads="1u", card="(Is=1n Rs=1)")
    more = "", "Rx a b 300k\n", "Dx b a d\n"
    problems = []
    for k, one in enumerate(more):
        (tmp_path / f"{k}").mkdir()
        problems.append(Problem.of(driven(tmp_path / f"{k}", plain + one, psd="1e-5 g^2/Hz")))
    without, leaky, other = (Rectifier(problem) for problem in problems)
    assert without.ideal.mu == 0.0
    scales = problems[1].scales
    assert leaky.ideal.mu * scales.capacitance * scales.frequency == pytest.approx(1.0 / 300e3)
    assert other.ideal is None
    assert other.fast(1e-6).charge_at("csmooth") >= 0

    free, loaded = (measured(problem, 1.0, count=3, runs=64).best for problem in problems[:2])
    assert free.current - loaded.current == pytest.approx(free.voltages / 300e3, rel=1e-3, abs=1e-9)


IMPOSED = "Vs a b 2.4\nRs a n 24k\nRload p n 100k\nRt b p 1k\n.model d D\n"


@pytest.mark.ngspice
def test_a_current_that_leaves_no_digits_to_the_others_is_no_answer(tmp_path):
    """A source of 2.4 V across a diode alone drives 1e26 A; in the other direction the diode changes nothing."""
    powers = [
        hv.run(driven(tmp_path, body), "compiled").mean_power.value
        for body in (IMPOSED, IMPOSED + "Dx b a d\n")
    ]
    assert powers[1] == pytest.approx(powers[0], rel=1e-6)
    with pytest.raises(CircuitError, match="dx"):
        hv.run(driven(tmp_path, IMPOSED + "Dx a b d\n"), "compiled")


@pytest.mark.ngspice
def test_the_current_of_a_function_that_leaves_no_digits_to_the_others_is_no_answer(tmp_path):
    """Around a source of 0 V the current 2e9 A/V of a B source cannot change the load's power of microwatts."""
    loop = "V1 p b 0\nRload b n 100k\nB1 p b I=v(p)*{}\n"
    small = hv.run(driven(tmp_path, loop.format("2u")), "compiled").mean_power.value
    alone = hv.run(driven(tmp_path, "Rload p n 100k\n"), "compiled").mean_power.value
    assert small == pytest.approx(alone, rel=1e-6)
    with pytest.raises(CircuitError, match="b1"):
        hv.run(driven(tmp_path, loop.format("2e9")), "compiled")


def test_a_blocked_mosfet_leaks_as_in_ngspice(tmp_path):
    """Through its two junctions, gmin each, and nothing next to them."""
    body = "V1 a n 3\nM1 a n x n m\nRx x n 1e12\nRload p n 100k\n.model m nmos\n"
    circuit = compiled(driven(tmp_path, body))
    assert len(circuit.system.leaks) == 2
