"""ngspice in lock-step with the mass, against the exact RC update on the same noise path."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation import runs as worker
from harvester.cosimulation.lockstep.transitions import proposed_step
from harvester.cosimulation.same_motion import tolerance_in_workers
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.engines.spice.setup import set_up
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.mechanics.kernels.moments import from_path
from harvester.mechanics.kernels.noise import gaussian_grid, refined
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from harvester.uncertainty.value import mean_and_error
from tests.support.lockstep import PLATE, SEED, WEAK, both, device, rms_difference
from tests.support.python_callbacks import path_in_python
from tests.support.systems import PAPER, changed, linear, padded

pytestmark = pytest.mark.ngspice

PLATE_WITH_STOP = changed(PLATE, restitution=0.96)


@pytest.mark.parametrize("h", [0.1, 0.05])
def test_paper_path(h):
    """r = 0.96, relative RMS difference of V over 100 time units and some thirty impacts: below 1e-5."""
    ours, exact = both(PAPER, h)
    assert len(exact.impacts) > 20
    assert rms_difference(ours, exact) < 1e-5
    assert rms_difference(ours, exact, "x") < 1e-5
    assert ours.impacts == pytest.approx(exact.impacts, abs=1e-4)


@pytest.mark.thorough("test_paper_path")
def test_strongly_coupled_plate():
    """beta = 1.25 without a stop: relative RMS difference of V below 1e-4 over 1,000 time units."""
    ours, exact = both(PLATE, 0.05, 1000.0)
    assert rms_difference(ours, exact) < 1e-4


@pytest.mark.parametrize("seed", [7, 8, 9])
def test_strongly_coupled_plate_with_its_stop(seed):
    """beta = 1.25, r = 0.96: below 1e-3 over the first 30 impacts; beyond, impacts make paths chaotic."""
    ours, exact = both(
        PLATE_WITH_STOP, 0.05, stride=1, noise=gaussian_grid(np.random.SeedSequence(seed), 4000)
    )
    upto = exact.t < exact.impacts[30, 0]
    assert np.sqrt(np.mean((ours.V - exact.V)[upto] ** 2) / np.mean(exact.V[upto] ** 2)) < 1e-3


@pytest.mark.thorough("test_paper_path")
@pytest.mark.parametrize(
    "eqs, duration",
    [(PAPER, 100.0), (PLATE_WITH_STOP, 60.0), (PLATE, 100.0)],
    ids=["paper", "plate-stop", "plate"],
)
def test_difference_falls_with_the_square_of_the_step(eqs, duration):
    """Noise paths refined by the bridge; the exact update makes the same steps, so only the circuit differs.

    Where impacts fall in a step varies, so the order is that of the geometric mean over paths.
    """
    steps = (0.2, 0.1, 0.05, 0.025, 0.0125)
    differences = np.empty((3, len(steps)))
    for seed, row in zip((7, 8, 9), differences, strict=True):
        noise = gaussian_grid(np.random.SeedSequence(seed), round(duration / 0.2))
        rng = np.random.default_rng(1)
        for i, h in enumerate(steps):
            row[i] = rms_difference(*both(eqs, h, stride=1, noise=noise))
            noise = refined(noise, rng)
    order = np.polyfit(np.log(steps), np.log(differences).mean(axis=0), 1)[0]
    assert order > 1.8
    assert differences[:, -1].max() < 1e-5


@pytest.mark.thorough("test_paper_path")
def test_whole_scheme_is_of_second_order():
    """x(t) on a refined path against a fine one, without noise in the way: a decaying, coupled, nonlinear motion."""
    weak = {"n1": 1e-12, "n2": 0.0, "c1": -0.05, "c2": 0.0, "c3": 0.0}
    eqs = changed(PAPER, **weak, restitution=None, beta=1.25, mu=1.0, alpha=2.0)
    ends = []
    for h in (0.2, 0.1, 0.05, 0.0125):
        n = round(8 / h)
        # a kick of 0.9 at the start does what an initial velocity would
        noise = np.zeros(n)
        noise[0] = 0.9 / np.sqrt(2 * h * eqs.n1)
        # the kick comes at t = h: shift the clock so that every run starts its motion at the same
        # time
        path = worker.path_in_worker(
            device(eqs, h), np.concatenate([noise, np.zeros(round(1 / h))])
        )
        ends.append(np.interp(6.0, path.t - h, path.V))
    errors = np.abs(np.array(ends[:3]) - ends[3])
    assert np.polyfit(np.log([0.2, 0.1, 0.05]), np.log(errors), 1)[0] > 1.6


@pytest.mark.thorough("test_paper_path")
@pytest.mark.parametrize("mu", [0.01, 1.0, 5.0, 30.0, 100.0, 1000.0])
@pytest.mark.parametrize("beta", [0.05, 1.25, 10.0])
def test_stiff_and_strong_coupling_stay_stable(beta, mu):
    """long time constants and short ones, up to a hundred steps long."""
    eqs = linear(beta, mu)
    ours, exact = both(eqs, 0.1 / np.sqrt(1 + beta), 200.0)
    assert rms_difference(ours, exact) < 0.03
    assert rms_difference(ours, exact, "x") < 0.01


@pytest.mark.thorough("test_paper_path")
@pytest.mark.parametrize("mu", [0.05, 5.0, 100.0, 1000.0])
def test_energy_of_the_load_with_a_stop(mu):
    """E[V^2] of the path with impacts, where short steps meet a rule fitted to long ones: within 1 %."""
    eqs = changed(linear(0.05, mu), restitution=0.96)
    noise = gaussian_grid(SEED, 100_000)
    ours, exact = (from_path(eqs, p, 100.0, 16) for p in both(eqs, 0.1, noise=noise))
    difference, error = mean_and_error(ours.V2 - exact.V2)
    assert abs(difference) < 0.01 * exact.V2.mean() + 4 * error


@pytest.mark.thorough("test_strongly_coupled_plate_with_its_stop")
@pytest.mark.parametrize(
    "beta, mu",
    [
        *((10.0, 0.01), (None, 0.01), (0.05, 0.1), (1.25, 1.0), (10.0, 1.0)),
        *((1.25, 10.0), (10.0, 10.0), (0.05, 100.0), (10.0, 100.0)),
    ],
)
def test_coupling_with_impacts_is_stable_and_converges(beta, mu):
    """beta from 0 to 10, mu from 0.01 to 100, r = 0.9: finite, and closer to the exact update at a finer step.

    The steps are shares of the fastest time: that of the open circuit's motion, or of R Cp.  Over ten time units
    impacts do not yet spread paths apart; the order is that of the geometric mean over five paths.  A step of twenty
    time constants is stable all the same.
    """
    eqs = changed(linear(beta, mu), restitution=0.9)
    longest = 0.2 / np.sqrt(1 + (beta or 0.0))
    ours, exact = both(eqs, longest, 200.0)
    assert np.mean(ours.V**2) == pytest.approx(np.mean(exact.V**2), rel=0.3)
    steps = min(longest, 2.0 / mu) / 2.0 ** np.arange(4)
    differences = np.empty((5, len(steps)))
    for seed, row in zip(range(5), differences, strict=True):
        noise = gaussian_grid(np.random.SeedSequence(seed), round(10 / steps[0]))
        rng = np.random.default_rng(1)
        for i, h in enumerate(steps):
            ours, exact = both(eqs, h, stride=1, noise=noise)
            assert np.isfinite(ours.samples).all()
            assert (ours.samples[:, 2] >= 0.0).all()
            row[i] = rms_difference(ours, exact)
            noise = refined(noise, rng)
    mean = np.exp(np.log(differences).mean(axis=0))
    order = np.polyfit(np.log(steps), np.log(mean), 1)[0]
    assert mean[-1] < 1e-3
    assert order > 1.7


def test_lossless_device_keeps_its_energy():
    """No damping, r = 1, no noise after a first kick, load of 10^15 ohm: drift below 5e-5 over 500 periods."""
    eqs = padded(Equations(beta=1.25, mu=1e-9, c1=-1e-12, restitution=1.0, n1=1.0))
    h = 0.04
    noise = np.zeros(round(500 * 2 * np.pi / h))
    noise[0] = 10.0
    path = worker.path_in_worker(device(eqs, h), noise)
    energy = 0.5 * path.v**2 + 0.5 * path.x**2 + 0.5 * eqs.beta * path.V**2
    periods = energy[: len(energy) // 500 * 500].reshape(500, -1).mean(axis=1)
    assert periods == pytest.approx(periods[0], rel=5e-5)


@pytest.mark.thorough("test_paper_path")
@pytest.mark.parametrize("load", ["resistor", "bridge", "parallel_sshi"])
def test_python_callbacks_are_the_reference(load):
    """The same functions, interpreted, on the same noise, with impacts: the compiled path gives the same to 1e-9."""
    noise = gaussian_grid(SEED, 300)
    one = device(PAPER, 0.1, 4)
    if load != "resistor":
        circuit = load_circuit(Load(netlist=load), WEAK.capacitance)
        one = worker.CoupledDevice(changed(PAPER, mu=None), WEAK, circuit, 0.1, 4)
    compiled = worker.path_in_worker(one, noise)
    python = next(map_in_workers(path_in_python, [(one, noise)]))
    assert len(python.impacts) > 5
    assert rms_difference(python, compiled) < 1e-9
    assert python.samples == pytest.approx(compiled.samples, rel=1e-9, abs=1e-12)
    assert python.impacts == pytest.approx(compiled.impacts, rel=1e-9)


def failing(one, noise, what):
    """A Python path whose `what` raises at its tenth call; then, in the same process, one that does not."""
    from tests.support import python_callbacks as reference

    calls = []
    whole = reference.interpreted

    def broken(function):
        def counted(*arguments):
            calls.append(function)
            if len(calls) >= 10:
                raise ZeroDivisionError(f"in {what}")
            return whole(function)(*arguments)

        return counted if function.__name__ == what else whole(function)

    reference.interpreted = broken
    try:
        with pytest.raises(ZeroDivisionError, match=what):
            path_in_python(one, noise)
    finally:
        reference.interpreted = whole
    return len(calls), path_in_python(one, noise)


@pytest.mark.parametrize("what", ["source_voltage", "proposed_step", "accept_point"])
def test_an_exception_in_a_python_callback_is_raised_after_the_run(what):
    """ngspice gets finite values to its end, and the exception comes out; the process continues."""
    noise = gaussian_grid(SEED, 100)
    one = device(PAPER, 0.1, 4)
    calls, path = next(map_in_workers(failing, [(one, noise, what)]))
    assert calls == 10
    assert (path.samples == worker.path_in_worker(one, noise).samples).all()


@pytest.mark.thorough("test_paper_path")
@pytest.mark.parametrize("volts", [1e-6, 1e3])
def test_signal_level_does_not_matter(volts):
    """1 uV and 1 kV signals, same relative accuracy."""
    scales = Scales(
        mass=0.04, frequency=20.0, length=volts * 50.2e-9 / 1e-3, coupling=1e-3, capacitance=50.2e-9
    )
    ours, exact = both(PAPER, 0.1, scales=scales)
    assert rms_difference(ours, exact) < 1e-5


def test_time_constant_in_ngspice_is_one_over_mu():
    """mu of the scaling is that of the circuit: a charged Cp decays through the load by exp(-mu t) in ngspice.

    One kick moves the mass, the stop with r = 0 holds it from its return on; then V decays freely.
    """
    mu = 0.31
    eqs = padded(Equations(n1=1.0, restitution=0.0, mu=mu))
    h = 0.01
    noise = np.zeros(round(20 / h))
    noise[0] = 5.0
    path = worker.path_in_worker(device(eqs, h), noise)
    held = path.t > np.pi + 0.1
    slope = np.polyfit(path.t[held], np.log(np.abs(path.V[held])), 1)[0]
    assert abs(path.x[held]).max() < 1e-12
    assert slope == pytest.approx(-mu, rel=1e-5)


def test_coupling_of_the_circuit_is_beta():
    """With the load open and the mass on its own, the frequency in lock-step is sqrt(1 + beta)."""
    beta, h = 1.25, 0.01
    eqs = linear(beta, 1e-9, c=1e-12, n1=1.0)
    noise = np.zeros(round(60 / h))
    noise[0] = 5.0
    path = worker.path_in_worker(device(eqs, h), noise)
    up = np.flatnonzero((path.x[:-1] < 0) & (path.x[1:] >= 0))
    crossings = path.t[up] - path.x[up] * h / (path.x[up + 1] - path.x[up])
    assert 2 * np.pi / np.diff(crossings).mean() == pytest.approx(np.sqrt(1 + beta), rel=1e-4)


@pytest.mark.thorough("test_paper_path")
def test_same_seed_same_answer_and_runs_do_not_disturb_each_other():
    a = both(PAPER, 0.1)[0]
    worker.path_in_worker(device(linear(1.25, 1.0), 0.1), gaussian_grid(SEED, 100))
    b = both(PAPER, 0.1)[0]
    assert (a.samples == b.samples).all()
    assert (a.impacts == b.impacts).all()


def test_bridge_in_lock_step():
    """A nonlinear load: the smoothed output is charged, the load gets power, and less than the circuit drew."""
    eqs = Equations(beta=0.05, c1=-0.05, n1=0.01)
    bridge = load_circuit(Load(netlist="bridge", parameters={"R": 1.5e6, "C": 1e-6}))
    one = worker.CoupledDevice(eqs, WEAK, bridge, 0.1, 4)
    measured = next(worker.measure_in_workers(one, [SEED], n_steps=20_000, burn_in=400.0))
    taken = eqs.beta * measured.moments.vV.mean() * WEAK.watts
    assert 0.93 * taken < measured.load_power < taken


@pytest.mark.parametrize("share", [1e-9, 0.3, 0.5, 0.7, 1 - 1e-9, 1.0, 3.0])
def test_no_sliver_is_left_before_a_landing(share):
    """A free circuit's step is all of the remainder, or at most half of it; the plain load resistor's is all of it."""
    run = {"noise_size": 100, "h": 2.0, "w0": 1.0}
    state = SimpleNamespace(target_time=1.5, free=1, smooth=0, turned=0, **run)
    step = proposed_step.py_func(state, 0.5, share)
    assert step == (1.0 if share >= 1.0 else min(share, 0.5))
    assert (
        proposed_step.py_func(SimpleNamespace(target_time=1.5, free=0, smooth=0, **run), 0.5, share)
        == 1.0
    )


def test_rounding_does_not_halve_the_steps_near_a_landing():
    """A bridge came to steps of 2e-15 s there, at which nothing converges."""
    state = SimpleNamespace(
        target_time=1.5, free=1, smooth=0, turned=0, noise_size=100, h=2.0, w0=1.0
    )
    assert proposed_step.py_func(state, 1.499, 0.001 - 1e-15) == 1.5 - 1.499
    assert proposed_step.py_func(state, 1.499, 0.0009) == 0.5 * (1.5 - 1.499)


@pytest.mark.parametrize("free", [0, 1])
@pytest.mark.parametrize("kicks", range(100, 120))
def test_no_step_goes_beyond_the_end_of_the_run(kicks, free):
    """ngspice 42 to 47 leave a rest of a step that does, and some ends are then never reached.

    They take a time within 100 roundings of the end for the end.
    """
    h, w0 = 0.1, 20.123
    end = (kicks + 0.75) * h / w0
    state = SimpleNamespace(
        target_time=(kicks + 1) * h / w0,
        free=free,
        smooth=0,
        turned=0,
        h=h,
        w0=w0,
        noise_size=kicks,
    )
    t = (kicks + 0.5) * h / w0
    landed = t + proposed_step.py_func(state, t, 1.0)
    assert 0.0 < end - landed < 90 * np.spacing(end)


def test_a_leg_after_a_turn_begins_with_a_small_step():
    """A 64th of a kick's step, however long ngspice's own is; from there on ngspice's own counts again."""
    state = SimpleNamespace(
        target_time=1.5, free=1, smooth=0, turned=1, leg_t=0.5, h=2.0, w0=1.0, noise_size=100
    )
    assert proposed_step.py_func(state, 0.5, 3.0) == 2.0 / 64.0
    assert proposed_step.py_func(state, 0.5, 1e-3) == 1e-3
    assert proposed_step.py_func(state, 0.5 + 1e-6, 0.25) == 0.25


@pytest.mark.thorough("test_a_switching_takes_few_steps")
@pytest.mark.statistics
def test_no_step_goes_over_a_switch():
    """A tenth of ngspice's tolerance changes the power of SECE by less than 0.2 %: 0.04 %, 1.7 % with longer steps.

    ngspice judges a step by the differences of several; the first one after an impact was much
    shorter than those.
    """
    problem = Problem(hv.load("examples/plate_sece.toml"))
    one = worker.CoupledDevice(problem.equations, problem.scales, problem.circuit, 1.0 / 15.0, 6)
    starts = [
        (1.6, 0.9, 0.4, 0.7),
        (0.7, -1.1, -0.5, 0.7),
        (1.9, 0.2, 0.6, 0.7),
        (0.4, 1.3, -0.2, 0.7),
    ]
    found = tolerance_in_workers(
        one, np.random.SeedSequence(2).spawn(4), 480, 2.0, math.inf, starts
    )
    errors = [abs(each["load"]) for each, _ in found]
    assert max(errors) < 0.01
    assert sum(errors) / 4.0 < 0.002


@pytest.mark.parametrize(
    "name, most",
    [
        pytest.param(
            "parallel_sshi", 18.0, marks=pytest.mark.thorough("test_a_switching_takes_few_steps")
        ),
        ("series_sshi", 11.0),
    ],
)
def test_a_switching_takes_few_steps(name, most):
    """Accepted steps a kick, 15.7 and 9.0: with elements L, on which ngspice resolves microvolts, 23.7 and 20.5."""
    problem = Problem(hv.load(f"examples/plate_{name}.toml"))
    one = worker.CoupledDevice(problem.equations, problem.scales, problem.circuit, 1.0 / 15.0, 6)
    seeds = np.random.SeedSequence(2).spawn(2)
    starts = [(1.6, 0.9, 0.4, 0.7), (0.7, -1.1, -0.5, 0.7)]
    found = list(worker.measure_in_workers(one, seeds, 960, 2.0, starts=starts))
    assert sum(each.steps for each in found) / (2 * 960) < most


def test_burn_in_waits_for_the_smoothing_capacitor(tmp_path):
    """At least six time constants Rload Csmooth; one of months is cut short at 20,000 time units, with a word.

    A circuit without an ideal counterpart, whose trajectories would be waited for as long.
    """
    scene = hv.load("examples/plate_bridge.toml")
    own = tmp_path / "own.cir"
    own.write_text(
        "* own\n.subckt own p n R=1Meg C=1u\nRseries p a 1k\nCsmooth a n {C}\nRload a n {R}\n.ends\n"
    )

    def examined(farad):
        load = hv.Load(netlist=str(own), parameters={"R": 1e6, "C": farad})
        ready = set_up(Problem(scene.with_load(load)), hv.Spice())
        return ready.burn_in, [str(one) for one in ready.diagnostics]

    w0 = 20.0
    assert 6 * 100.0 * w0 <= examined(1e-4)[0] <= 1.5e4
    burn_in, warnings = examined(1.0)
    assert burn_in == 2e4
    assert "before the load's capacitor was charged" in warnings[-1]
