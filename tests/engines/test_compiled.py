"""Engine `compiled`: a bridge agrees with the closed form of ideal diodes, and ngspice states how far it can be off."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.cosimulation.runs import CoupledDevice
from harvester.engines.cheapest import stands_alone
from harvester.engines.spice.cheap_model import settled_starts
from harvester.engines.spice.difference import (
    AVERAGED,
    difference_come,
    difference_from_ngspice,
    lengths,
)
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from tests.support.netlists import BRIDGE, STORE, on_plate


@pytest.mark.thorough("test_the_power_is_that_of_ngspice_on_the_same_noise")
@pytest.mark.ngspice
@pytest.mark.parametrize("drive", [{}, {"frequency": "3.2 Hz", "acceleration_amplitude": "0.01 g"}])
def test_a_bridge_is_that_of_engine_ideal(tmp_path, drive):
    """Ideal diodes leave out effects below 0.3 % of the power; both are on seeds of their own."""
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    scene = dataclasses.replace(scene, excitation=dataclasses.replace(scene.excitation, **drive))
    ours = hv.Compiled(within="5%", seed=1).run(scene)
    ideal = hv.Ideal(within="1%", seed=2).run(
        scene.with_load(netlist="bridge", parameters={"R": 1.5e6, "C": 1e-6})
    )
    spread = (ours.mean_power.stderr**2 + ideal.mean_power.stderr**2) ** 0.5
    size = ideal.mean_power.value
    assert abs(ours.mean_power.value - size) < 4.0 * spread + 0.003 * size + ours.mean_power.bias
    assert 0.0 < ours.mean_power.model < 2e-3 * size
    assert ours.mean_square_voltage.error95 is not None
    assert "largest difference (95 %) from runs of ngspice on the same motion" in str(ours)
    assert not any("did not converge" in warning for warning in ours.warnings)


@pytest.mark.thorough("test_the_power_is_that_of_ngspice_on_the_same_noise")
@pytest.mark.ngspice
@pytest.mark.parametrize("stop", [None, hv.Stop(restitution=0.96)])
def test_what_extrapolation_leaves_of_a_bias_is_within_what_is_stated(tmp_path, stop):
    """Steps of 0.6/w0 and 0.9/w0, whose biases are 2 to 6 %, against one of 0.2/w0."""
    scene = dataclasses.replace(on_plate(tmp_path, BRIDGE.format("BAT54") + STORE), stop=stop)
    fine, *long = (
        hv.Compiled(dt=dt, trajectories=256, duration=20.0).run(scene) for dt in (None, 0.01, 0.014)
    )
    fine = fine.mean_power
    for power in (one.mean_power for one in long):
        apart = abs(power.value - fine.value)
        assert power.bias > 0.25 * apart  # the error that is stated is not arbitrarily large ...
        # ... nor too small
        assert apart - power.bias - fine.bias < 4.0 * math.hypot(power.stderr, fine.stderr)


@pytest.mark.thorough("test_what_it_cannot_serve_is_said_with_the_element")
@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize("within", [None, "10%"])
def test_a_difference_from_ngspice_is_found(tmp_path, monkeypatch, within):
    """Next to a stop none above 0.1 %, and of a circuit that ngspice has with other diodes more."""
    bridge = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    problem = Problem(dataclasses.replace(bridge, stop=hv.Stop(restitution=0.7)))
    circuit = compiled_circuit(problem.circuit, problem.scales)
    trajectories = Trajectories(problem.equations, 64, np.random.SeedSequence(1), circuit=circuit)
    settling, starts = settled_starts(RichardsonPair(trajectories, 64.0), circuit.memory, 100.0, 1)
    given = problem, trajectories.h, starts, settling, hv.Compiled(seed=1, within=within)
    found = difference_from_ngspice(*given)
    most = 1e-3 if within is None else 0.015
    assert 0.0 < found["load"] < most and 0.0 < found["V2"] < most
    other = Problem(on_plate(tmp_path, BRIDGE.format("BAT54") + STORE, "other")).circuit

    def in_ngspice(eqs, scales, _, *args, **options):
        return CoupledDevice(eqs, scales, other, *args, **options)

    monkeypatch.setattr("harvester.cosimulation.runs.CoupledDevice", in_ngspice)
    assert difference_from_ngspice(*given)["load"] > 0.02


@pytest.mark.thorough("test_what_it_cannot_serve_is_said_with_the_element")
@pytest.mark.ngspice
def test_without_ngspice_the_unknown_part_is_named(tmp_path, monkeypatch):
    def missing(*_, **__):
        raise hv.MissingProgramError("no ngspice")

    monkeypatch.setattr("harvester.cosimulation.worker_pool.map_in_workers", missing)
    ours = hv.Compiled(within="10%", seed=1).run(
        on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    )
    assert ours.mean_power.error95 is None
    assert "the error of the difference from ngspice is not known" in str(ours)
    assert "compare with 'spice'" in str(ours)


def test_what_it_cannot_serve_is_said_with_the_element(tmp_path):
    scene = on_plate(tmp_path, BRIDGE.format("BAT54") + STORE + "T1 p n a b Z0=50 Td=1n")
    with pytest.raises(hv.CannotServeError, match="element t1 is an element of a kind") as error:
        hv.Compiled().run(scene)
    assert "use engine 'spice'" in str(error.value)


@pytest.mark.ngspice
@pytest.mark.parametrize("effect", ["ball", "mode", "parametric"])
def test_every_mechanics_is_judged_by_ngspice(tmp_path, effect):
    """The difference is part of the error, which meets the target, also of a ball or two modes."""
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    ball = hv.Ball(mass=2e-3, room=1e-3, restitution=0.8)
    second = hv.Mode(
        frequency=20.0, mass=60e-3, damping_ratio=0.01, coupling=-1e-3, base=-0.4, at_stop=1.0
    )
    stop = hv.Stop(restitution=0.9, gap=-5e-5)
    noise = dataclasses.replace(scene.excitation, stiffness_noise=1e-3)
    further = {
        "ball": {"ball": ball},
        "mode": {"mode": (second,)},
        "parametric": {"excitation": noise, "stop": stop},
    }[effect]
    power = hv.Compiled(within="4%", seed=1).run(dataclasses.replace(scene, **further)).mean_power
    assert 0.0 < power.model < 5e-3 * power.value
    assert power.error95 <= 0.04 * power.value


@pytest.mark.ngspice
def test_a_response_of_two_modes_is_judged_by_ngspice(tmp_path):
    """The periodic response of two modes has the difference from ngspice in its error."""
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    drive = hv.Excitation(frequency=3.2, acceleration_amplitude=0.1)
    second = hv.Mode(frequency=20.0, mass=60e-3, damping_ratio=0.01, coupling=-1e-3, base=-0.4)
    scene = dataclasses.replace(scene, excitation=drive, mode=(second,))
    ours = hv.Compiled().run(scene).mean_power
    assert 0.0 < ours.model < 2e-3 * ours.value
    assert ours.error95 < 3e-3 * ours.value


def test_a_difference_that_has_not_come_yet_is_counted_whole():
    """A storage capacitor that charges for longer than the runs: a part of the difference is
    seen."""
    slow, quick = (SimpleNamespace(memory=memory) for memory in (1000.0, 20.0))
    assert difference_come(68.0, slow) == pytest.approx(1.0 - math.exp(-0.1))
    assert difference_come(300.0, quick) > 0.999


def test_a_loose_target_has_short_runs_of_ngspice():
    """They leave out and average as much as the target needs, and count what has not developed."""
    close, loose = (lengths(within, 20.0) for within in (0.01, 0.1))
    assert close[1] == AVERAGED and sum(loose) < 0.3 * (40.0 + AVERAGED)
    assert difference_come(loose[0], SimpleNamespace(memory=20.0), loose[1]) > 0.3


def test_a_loose_target_needs_a_part_of_the_steps(tmp_path):
    """Trajectories, their burn-in and those of longer steps are as many as 10 % asks for."""
    scene = on_plate(tmp_path, BRIDGE.format("BAT54") + STORE)
    loose, close = (
        hv.Compiled(within=within, seed=1, judged=False).run(scene) for within in ("10%", "1%")
    )
    assert loose.steps < min(4e5, 0.6 * close.steps)
    power, other = loose.mean_power, close.mean_power
    assert power.known_error95 < 0.1 * power.value
    off = power.value - other.value
    assert abs(off) < 4.0 * math.hypot(power.stderr, other.stderr) + power.bias + other.bias


def test_longer_steps_stop_where_their_bias_is_small_for_the_target(tmp_path):
    """Their half of the time is saved, and averages include the time in which they settled."""
    problem = Problem(on_plate(tmp_path, BRIDGE.format("BAT54") + STORE))
    circuit = compiled_circuit(problem.circuit, problem.scales)
    trajectories = Trajectories(problem.equations, 64, np.random.SeedSequence(1), circuit=circuit)
    pair = RichardsonPair(trajectories, 16.0)
    assert pair.extrapolates and pair.duration > 2.0 * pair.averaged
    assert not pair.extrapolates_in_vain("load", 1e-5)
    assert pair.extrapolates_in_vain("load", 0.5)
    (before, spread), bias = pair.mean("load"), abs(pair.bias("load")[0])
    pair.stop_coarse()
    assert not pair.extrapolates and pair.averaged == pair.duration
    assert pair.mean("load")[0] != before
    assert abs(pair.mean("load")[0] - before) < 4.0 * spread + bias + abs(pair.bias("load")[0])


@pytest.mark.ngspice
def test_a_target_leaves_room_for_the_difference(tmp_path, monkeypatch):
    """A difference of half of the target needs four times the sampling; one beyond it is told."""
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    answers = []
    for difference in (0.005, 0.03):
        monkeypatch.setattr(
            "harvester.engines.spice.difference.difference_from_ngspice",
            lambda *_, difference=difference, **__: {"V2": difference, "load": difference},
        )
        answers.append(hv.Compiled(within="1%", seed=1).run(scene))
    within, beyond = answers
    assert within.mean_power.error95 <= 0.01 * within.mean_power.value
    assert beyond.mean_power.known_error95 > 0.03 * beyond.mean_power.value
    assert any("the difference from ngspice is 3 %" in str(warning) for warning in beyond.warnings)
    assert not any("was not reached" in str(warning) for warning in within.warnings)


@pytest.mark.ngspice
def test_ngspice_is_asked_again_with_the_time_that_a_loose_target_leaves(tmp_path, monkeypatch):
    """Its share of the budget was too short for its runs, and the difference was left unknown."""
    monkeypatch.setattr("harvester.engines.spice.difference.SHARE", 1e-4)
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    power = hv.Compiled(within="20%", budget="60s", seed=1).run(scene).mean_power
    assert power.model is not None
    assert power.error95 is not None and power.error95 <= 0.2 * power.value


@pytest.mark.ngspice
def test_a_ball_takes_the_compiled_circuit_in_place_of_ngspice_alone(tmp_path):
    """Without ideal elements ngspice needs minutes; the answer states the difference from it."""
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    scene = dataclasses.replace(scene, ball=hv.Ball(mass=2e-3, room=1e-3, restitution=0.8))
    answer = hv.run(scene, within="4%")
    assert answer.engine == "compiled" and "its stated error" in str(answer.diagnostics[0])
    assert answer.mean_power.error95 <= 0.04 * answer.mean_power.value


@pytest.mark.ngspice
def test_a_circuit_of_ideal_elements_is_still_that_of_ngspice(tmp_path):
    scene = on_plate(tmp_path, BRIDGE.format("1N4148") + STORE)
    assert not stands_alone(Problem(scene))
    assert stands_alone(Problem(dataclasses.replace(scene, stop=hv.Stop(restitution=0.9))))
