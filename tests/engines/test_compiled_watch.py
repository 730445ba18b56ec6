"""Probes and powers of elements by engine `compiled`, next to ngspice and next to the elements' laws."""

from dataclasses import replace

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.probed_path import powers_of_elements
from harvester.equations.problem import Problem
from tests.support.netlists import BRIDGE, STORE, compiled, on_plate

DRIVE = hv.Excitation(acceleration_amplitude="0.1 g", frequency="4.5 Hz")
BODY = BRIDGE.format("1N4148") + STORE.replace("1u", "100n")


@pytest.mark.thorough("test_what_is_not_told_is_refused_before_anything_is_computed")
def test_powers_of_elements_are_those_of_their_laws(tmp_path):
    """A resistor has v^2/R, a source the power that it gives, a capacitor nothing."""
    scene = on_plate(
        tmp_path, BODY + "Rs p q 10k\nB1 q b I=1n*v(a)*v(a)\nE1 x b a b 2\nRx x b 1Meg"
    )
    circuit = compiled(scene)
    eqs = Problem(scene).equations
    path = circuit.trace(eqs, np.random.default_rng(0).normal(size=4000), 0.05, keep=True)
    y = circuit.unknowns(path.states)
    at = circuit.system.unknowns
    powers = powers_of_elements(circuit, path.states)
    v = {name.removeprefix("xload."): y[:, k] for name, k in at.items()}
    known = {"rs": (v["p"] - v["q"]) ** 2 / 1e4, "rload": (v["a"] - v["b"]) ** 2 / 1.5e6}
    known["b1"] = 1e-9 * v["a"] ** 2 * (v["q"] - v["b"])
    for name, power in known.items():
        assert powers[name] == pytest.approx(power, abs=1e-6 * abs(power).max())
    # a source, which gives
    assert powers["e1"].mean() == pytest.approx(-powers["rx"].mean(), rel=1e-9)
    assert powers["d1"].min() >= 0.0 and "csmooth" not in powers


@pytest.mark.ngspice
def test_resistors_in_series_share_the_power_as_their_resistances(tmp_path):
    """In watts, as the load's own."""
    scene = replace(on_plate(tmp_path, "Rx p a 300k\nRload a n 500k\n"), excitation=DRIVE)
    found = hv.Compiled(ledger=True).run(scene)
    taken = found.details["ledger_circuit_rx"]
    assert taken == pytest.approx(300.0 / 500.0 * found.mean_power.value, rel=5e-3)


@pytest.mark.ngspice
@pytest.mark.thorough("test_what_is_not_told_is_refused_before_anything_is_computed")
def test_probes_and_powers_of_a_driven_bridge_are_those_of_ngspice(tmp_path):
    scene = replace(on_plate(tmp_path, BODY), excitation=DRIVE)
    both = [
        kind(probe=("store", "v(a)", "p(load)"), ledger=True).run(scene)
        for kind in (hv.Compiled, hv.Spice)
    ]
    ours, judge = (one.probes for one in both)
    for name in ours:
        assert ours[name].mean.value == pytest.approx(judge[name].mean.value, rel=3e-3)
        assert ours[name].largest.value == pytest.approx(judge[name].largest.value, rel=3e-3)
        assert "step" in str(ours[name].mean.unknown) and ours[name].mean.error95 is None
    for name in ("d1", "d2", "d3", "d4"):
        taken, known = (one.details[f"ledger_circuit_{name}"] for one in both)
        assert taken == pytest.approx(known, rel=0.03)


@pytest.mark.ngspice
@pytest.mark.thorough("test_what_is_not_told_is_refused_before_anything_is_computed")
def test_elements_beside_a_coil_are_those_of_ngspice():
    """Self-powered SSHI, whose pulses are much shorter than a step of the mass."""
    scene = hv.load("examples/bimorph_self_powered_sshi.toml")
    ours, judge = (kind(ledger=True).run(scene).details for kind in (hv.Compiled, hv.Spice))
    taken = {
        key: value
        for key, value in judge.items()
        if key in ours and key.startswith("ledger_circuit_")
    }
    assert len(taken) > 15
    assert [ours[key] for key in taken] == pytest.approx(
        [*taken.values()], abs=2e-3 * sum(taken.values())
    )


@pytest.mark.thorough("test_what_is_not_told_is_refused_before_anything_is_computed")
@pytest.mark.ngspice
def test_under_noise_the_probe_of_the_load_is_the_answer(tmp_path):
    """To within both sampling errors, which the answer's own power, as control variate, makes alike."""
    scene = replace(on_plate(tmp_path, BODY), stop=hv.Stop(restitution=0.9))
    answer = hv.Compiled(probe=("p(load)", "v(p)"), trajectories=128, duration="10s").run(scene)
    load = answer.probes["p(load)"].mean
    piezo = answer.probes["v(p)"]
    assert (
        abs(load.value - answer.mean_power.value)
        < 4.0 * answer.mean_power.stderr + 0.01 * load.value
    )
    known = answer.mean_square_voltage
    assert abs(piezo.rms.value**2 - known.value) < 4.0 * np.hypot(
        2.0 * piezo.rms.value * piezo.rms.stderr, known.stderr
    )


@pytest.mark.parametrize(("options", "says"), [
    ({"probe": ("i(d1)",)}, "`probe` must be used with engine 'spice' for the current or power of d1"),
    ({"probe": ("v(nowhere)",)}, "nowhere"),
])  # fmt: skip
def test_what_is_not_told_is_refused_before_anything_is_computed(tmp_path, options, says):
    with pytest.raises(hv.InputError, match=says):
        hv.Compiled(**options).run(on_plate(tmp_path, BODY))
