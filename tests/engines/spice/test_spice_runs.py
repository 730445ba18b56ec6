"""What is concluded from runs next to a cheap model: the power's variance, and how the effort is split."""

import dataclasses
import math
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation import runs as worker
from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger
from harvester.engines.sampling import refine
from harvester.engines.spice import spice
from harvester.engines.spice.runs import Runs
from harvester.engines.spice.setup import SpiceSetup
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, OutOfTimeError
from harvester.presentation.diagnostic import warning
from harvester.uncertainty.control_variate import Controlled, split
from harvester.uncertainty.target import Target, added_effort
from harvester.uncertainty.value import Value
from tests.support.systems import linear

BETA, MU = 0.5, 3.0


def made_up():
    """Eight runs of a load resistor that cost half a second each, next to a cheap model, without any ngspice."""
    low = 1.0 + np.random.default_rng(3).standard_normal(8)
    high = low + 0.1 * np.random.default_rng(4).standard_normal(8)
    done = [
        SimpleNamespace(
            moments=SimpleNamespace(V2=[a], controls=None), control=SimpleNamespace(V2=[b])
        )
        for a, b in zip(high, low, strict=True)
    ]
    pair = SimpleNamespace(
        mean=lambda name: (1.0, 0.02),
        bias=lambda name: (0.003, 0.0),
        largest_bias=lambda name: 0.003,
        relative_bias=lambda name: (0.003, 0.0),
        duration=50.0,
        seconds_a_unit=0.02,
    )
    setup = SpiceSetup(SimpleNamespace(eqs=linear(BETA, MU)), 10.0, [], pair, 1.0)
    seed = np.random.SeedSequence(1)
    return Runs(setup=setup, paired=True, n_steps=100, seed=seed, done=done, ngspice_seconds=4.0)


def test_power_of_a_resistor_is_the_voltage_scaled():
    """E[P] = beta mu E[V^2]: its errors scale with beta mu, the variance of a pair with the square of it."""
    runs = made_up()
    power, voltage = runs.power(), runs.mean_square_voltage()
    assert power.value == voltage.value.scaled(BETA * MU)
    assert power.residual == pytest.approx((BETA * MU) ** 2 * voltage.residual, rel=1e-12)
    assert (power.weight, power.correlation) == (voltage.weight, voltage.correlation)


def test_more_runs_and_a_longer_ensemble_as_the_split_says():
    """The ensemble's variance is what the pairs leave of the whole, and falls with its time."""
    runs = made_up()
    residual = 0.04
    error = 0.1
    variance = 2e-3
    spread = (error**2 - residual / 8) * 50.0
    count, duration = split(variance, residual, 0.5, spread, 0.02)
    asked = runs.effort(Controlled(Value(1.0, error), residual, 1.0, 0.9), variance)
    assert asked == pytest.approx(
        (added_effort(8.0, count), added_effort(50.0, duration)), rel=1e-12
    )
    assert 8.0 < count < 64.0 and 50.0 < duration < 400.0  # no limit of `further` hides the numbers


def test_runs_alone_pay_for_all():
    """Without a cheap model the variance of one run decides, and nothing else continues."""
    runs = made_up()
    runs.paired = False
    found = runs.mean_square_voltage()
    high = np.array([one.moments.V2[0] for one in runs.done])
    assert found.value.stderr == pytest.approx(high.std(ddof=1) / math.sqrt(8), rel=1e-12)
    assert found.value.dof == 7.0
    assert runs.effort(found, found.residual / 20.0) == (added_effort(8.0, 20.0), 0.0)


@pytest.mark.parametrize(
    ("ledger", "told"),
    [
        (EnergyLedger(input=1.0, load=0.5, circuit=0.3, damping=0.2), []),
        (EnergyLedger(input=1.0, load=0.5, circuit=-0.001, stored=0.01, damping=0.491), []),
        (EnergyLedger(input=0.4, load=0.5, circuit=-0.1), ["the netlist supplies 20 % of"]),
        (
            EnergyLedger(input=1.0, load=0.5, stored=0.25, damping=0.25),
            ["not stationary: mass, piezo and Csmooth still store 50 %"],
        ),
        (
            EnergyLedger(input=1.0, load=1e-9, stored=0.5, damping=0.5),
            [
                "not stationary: mass, piezo and Csmooth still store more than 10 times the load power"
            ],
        ),
    ],
)
def test_what_the_ledgers_tell(ledger, told):
    runs = made_up()
    runs.done = [SimpleNamespace(**vars(one), ledger=ledger) for one in runs.done]
    assert [
        one[: len(word)] for one, word in zip(map(str, runs.remarks()), told, strict=True)
    ] == told


def ended(count):
    """Measurements of which ``count`` end before the deadline."""

    def measure(*_, **__):
        yield from made_up().done[:count]
        raise OutOfTimeError("ngspice stopped at 1 s of 5 s")

    return measure


def test_runs_that_ended_in_the_budget_are_used(monkeypatch):
    monkeypatch.setattr(worker, "measure_in_workers", ended(3))
    runs = made_up()
    runs.run_batch(16)
    assert len(runs.done) == 11
    assert runs.setup.diagnostics == [warning("runs_ended", ended=11, requested=24, paired=False)]


def test_of_a_budget_that_ends_early_some_goes_to_the_error_of_the_step(monkeypatch):
    """Sixteen runs were made, and none of twice the step; now a few of both come first, and a rest is left."""
    calls = []

    def measure(device, seeds, *_, **__):
        calls.append((device, len(seeds)))
        yield from made_up().done[: len(seeds)]

    monkeypatch.setattr(worker, "measure_in_workers", measure)
    monkeypatch.setattr("harvester.cosimulation.worker_pool.worker_count", lambda: 2)
    runs = made_up()
    runs.setup = dataclasses.replace(runs.setup, pair=None)
    runs.setup.device.coarser = lambda: "coarse"
    # each costs 1 s
    runs.done = []
    runs.paired = False
    runs.deadline = time.monotonic() + 9.5
    runs.run_first(16)
    fine = runs.setup.device
    assert calls == [(fine, 4), ("coarse", 4), (fine, 5), ("coarse", 5)]
    assert (len(runs.done), runs.followed) == (9, 9)
    assert runs.setup.diagnostics == [warning("runs_ended", ended=9, requested=16, paired=False)]


def test_too_few_runs_to_pair_are_used_alone(monkeypatch):
    monkeypatch.setattr(worker, "measure_in_workers", ended(7))
    runs = made_up()
    runs.done = []
    runs.run_batch(16)
    assert runs.setup.diagnostics == [warning("runs_ended", ended=7, requested=16, paired=True)]
    assert runs.power().value.dof == 6.0


def test_a_single_run_in_the_budget_is_an_error(monkeypatch):
    monkeypatch.setattr(worker, "measure_in_workers", ended(1))
    runs = made_up()
    runs.done = []
    with pytest.raises(
        OutOfTimeError,
        match=r"^ngspice stopped at 1 s of 5 s; 1 of 16 ngspice runs had ended .*, and 2 ",
    ):
        runs.run_batch(16)


@pytest.mark.ngspice
@pytest.mark.parametrize(
    ("files", "warm", "left"), [((7, 7), 2.0, 10.0), ((7, 8), 2.0, 12.0), ((7, 7), 60.0, 6.0)]
)
def test_the_start_of_the_processes_is_in_the_budget(monkeypatch, files, warm, left):
    """Unless they compiled kernels, which gives the cache another file; half of the time is the runs' in any case."""
    found = []

    def measure(*_, deadline, **__):
        found.append(deadline - time.monotonic())
        raise CircuitError("it is enough to know the deadline")

    monkeypatch.setattr("harvester.mechanics.kernels.compiled.machine_code", iter(files).__next__)
    monkeypatch.setattr(worker, "warm_up_workers", lambda *_: warm)
    monkeypatch.setattr(worker, "measure_in_workers", measure)
    setup = spice.set_up(Problem.of("examples/plate.toml"), hv.Spice())
    monkeypatch.setattr(spice, "set_up", lambda *_, **__: dataclasses.replace(setup, seconds=0.0))
    with pytest.raises(CircuitError):
        hv.Spice(budget=10.0).run("examples/plate.toml")
    assert found == [pytest.approx(left, abs=0.5)]


@pytest.mark.parametrize(
    ("tolerance", "code"), [(0.2, "needs_smaller_tolerance"), (0.0, "needs_smaller_dt")]
)
def test_a_bias_that_no_runs_make_smaller_is_named(tolerance, code):
    """No further run helps if ngspice's tolerance or the step alone is off by more than the target."""
    runs = made_up()
    runs.setup.device.reltol = 1e-4
    runs.tolerance = {"V2": tolerance, "load": tolerance}
    runs.setup.pair.largest_bias = lambda name: 0.5
    assert refine(runs, Target(0.05)).code == code
    assert len(runs.done) == 8


def test_a_target_that_is_nearly_reached_is_reached(monkeypatch):
    """The split may ask for less than a pair and for no longer ensemble, which once looped for ever."""
    runs = made_up()
    asked = []
    found = [
        Controlled(Value(1.0, error, 0.0), error**2 * 8, 1.0, 0.9) for error in (0.0256, 0.025)
    ]
    monkeypatch.setattr(runs, "power", lambda: found[len(asked)])
    monkeypatch.setattr(runs, "effort", lambda found, variance: (0.8, 0.0))
    monkeypatch.setattr(runs, "run_batch", asked.append)
    assert refine(runs, Target(0.05)) is None
    assert asked == [2]


def test_a_tolerance_that_cannot_be_measured_is_unknown(monkeypatch):
    """ngspice may not bear a tenth of its tolerance, or the time may be spent: the answer stays, and states so."""
    from harvester.cosimulation import same_motion

    def refused(device, seeds, kicks, burn_in, deadline, starts):
        assert deadline == runs.deadline
        raise CircuitError("it did not converge")

    monkeypatch.setattr(same_motion, "tolerance_in_workers", refused)
    runs = made_up()
    known = vars(runs.setup.device) | {"load": SimpleNamespace(linear=False), "h": 0.1, "stride": 4}
    vars(runs.setup.device).update(known)
    runs.deadline = time.monotonic() + 1e6
    runs.measure_tolerance()
    assert runs.setup.diagnostics == [
        warning("tolerance_not_measured", error="it did not converge")
    ]
    power = runs.power().value
    assert (power.error95, power.unknown) == (None, "ngspice's tolerance")
    assert power.known_error95 > 0.0


def test_the_note_says_whether_the_tolerance_was_measured():
    """It must not speak of a measurement for which no time was left."""
    device: Any = SimpleNamespace(eqs=SimpleNamespace(mu=None))
    pair: Any = object()
    setup = SpiceSetup(device, 0.0, [], pair, 0.0)
    assert "ngspice's tolerance was measured against a tenth of it" in str(setup.biases(True, 0))
    assert "ngspice's tolerance was not measured" in str(setup.biases(False, 0))
