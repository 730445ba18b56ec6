"""Engine `compiled` under a steady excitation: the periodic response is ngspice's, at a fraction of its periods."""

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.circuit_period import periodic_response
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem


@pytest.mark.thorough("test_the_periodic_response_is_what_a_long_run_from_rest_comes_to")
@pytest.mark.ngspice
@pytest.mark.slow
def test_self_powered_sshi_is_ngspices_within_what_is_stated():
    scene = hv.load("examples/bimorph_self_powered_sshi.toml")
    ours, judge = hv.run(scene, "compiled"), hv.run(scene, "spice")
    assert "netlist" in ours.effects
    for name in ("mean_power", "mean_square_voltage"):
        here, there = getattr(ours, name), getattr(judge, name)
        assert abs(here.value - there.value) < here.error95 + there.error95
        assert here.error95 < 2e-3 * here.value
        assert 0.0 < here.model < 1e-3 * here.value
    assert ours.details["displacement_phase"] == pytest.approx(
        judge.details["displacement_phase"], abs=0.1
    )
    assert ours.details["voltage_phase"] == pytest.approx(judge.details["voltage_phase"], abs=0.3)


@pytest.mark.slow
def test_the_periodic_response_is_what_a_long_run_from_rest_comes_to():
    """A bridge whose capacitor charges for hundreds of periods: far fewer are computed, to the same power."""
    scene = hv.load("examples/plate_harmonic.toml").with_load(
        netlist="bridge", parameters={"R": "1 Mohm", "C": "2 uF"}
    )
    problem = Problem.of(scene)
    circuit = compiled_circuit(problem.circuit, problem.scales)
    eqs = problem.equations
    h = eqs.shaking_period / 64
    found = periodic_response(circuit, eqs, h, 1e-5)
    assert found is not None and found.turns == 1
    many = 160 * 64
    path = circuit.trace(eqs, np.zeros(many), h, 64)
    seconds = 64 * h / problem.scales.frequency
    last = (path.square[-1] - path.square[-2]) / circuit.resistance / seconds
    assert found.power == pytest.approx(last, rel=1e-3)
    assert found.steps < 0.5 * many
    again = periodic_response(circuit, eqs, h, 1e-5, found)
    assert again is not None and again.power == pytest.approx(found.power, rel=1e-5)
    assert again.steps < 0.7 * found.steps


@pytest.mark.slow
def test_a_circuit_that_never_comes_back_is_no_periodic_response(tmp_path):
    """A relay that opens and closes a load at a rhythm of its own."""
    body = (
        ".model relay SW(Ron=1k Roff=1G Vt=3 Vh=1.5)\nD1 p a BAT54\nD2 n a BAT54\nD3 b p BAT54\nD4 b n BAT54\n"
        "Csmooth a b 1u\nS1 a c a b relay\nRload c b 10k"
    )
    path = tmp_path / "board.cir"
    path.write_text(f"* a board\n.subckt board p n\n{body}\n.ends\n")
    problem = Problem.of(hv.load("examples/plate_harmonic.toml").with_load(netlist=str(path)))
    circuit = compiled_circuit(problem.circuit, problem.scales)
    eqs = problem.equations
    assert periodic_response(circuit, eqs, eqs.shaking_period / 64, 1e-4) is None


@pytest.mark.thorough("test_the_periodic_response_is_what_a_long_run_from_rest_comes_to")
@pytest.mark.ngspice
@pytest.mark.slow
def test_a_path_and_its_probes_are_ngspices():
    scene = hv.load("examples/bimorph_self_powered_sshi.toml")
    asked = ("store", "v(top)", "i(lcoil)", "p(load)", "i(rcore)")
    ours, theirs = (
        hv.motion(scene, one, 0.3, from_rest=True, probe=asked) for one in ("compiled", "spice")
    )
    assert np.corrcoef(ours.voltage, theirs.voltage)[0, 1] > 0.9999
    for name in asked:
        here, there = ours.probes[name], theirs.probes[name]
        assert np.std(here - there) < 0.03 * np.std(there), name
    with pytest.raises(hv.InputError, match="engine 'spice' for the current or power of d1"):
        hv.motion(scene, "compiled", 0.01, from_rest=True, probe="i(d1)")


@pytest.mark.thorough("test_the_periodic_response_is_what_a_long_run_from_rest_comes_to")
@pytest.mark.ngspice
@pytest.mark.slow
def test_the_frequency_response_is_ngspices():
    scene = hv.load("examples/plate_harmonic.toml").with_load(
        netlist="bridge", parameters={"C": "0.2 uF"}
    )
    ours, theirs = (
        hv.response(scene, [4.2, 4.5, 4.8], engine=one) for one in ("compiled", "spice")
    )
    for here, there in zip(ours.points, theirs.points, strict=True):
        assert here.mean_power.value == pytest.approx(there.mean_power.value, rel=2e-3)
        assert here.displacement_rms.value == pytest.approx(there.displacement_rms.value, rel=1e-3)
        assert here.voltage_phase == pytest.approx(there.voltage_phase, abs=0.2)


@pytest.mark.ngspice
def test_ngspice_has_no_more_than_its_patience_and_the_way_there_is_shown(monkeypatch):
    for name in ("PATIENCE", "AGAIN"):
        monkeypatch.setattr(f"harvester.engines.compiled_steady.{name}", 0.0)
    scene = hv.load("examples/plate_harmonic.toml").with_load(netlist="bridge")
    fractions = []
    answer = hv.Compiled().run(scene, fractions.append)
    assert answer.mean_power.model is None and "compiled_circuit" in {
        word.code for word in answer.diagnostics
    }
    assert fractions[0] == 0.0 and np.all(np.diff(fractions) > 0.0) and fractions[-1] < 1.0


LONG_CHARGED = {"netlist": "parallel_sshi", "parameters": {"R": "272 kohm", "C": "47 uF"}}


@pytest.mark.slow
def test_sampling_that_nobody_bounds_is_refused_where_it_would_take_minutes(monkeypatch):
    """Parallel SSHI whose storage capacitor needs 750 periods to charge, where iterating the periods does
    not converge."""
    monkeypatch.setattr("harvester.engines.compiled.LONGEST_SAMPLING", 2.0)
    monkeypatch.setattr("harvester.engines.compiled_steady.steady_answer", lambda *_: (None, None))
    with pytest.raises(hv.SimulationError, match="`budget` of more than"):
        hv.Compiled().run(hv.load("examples/bimorph_sensor.toml").with_load(**LONG_CHARGED))


@pytest.mark.slow
def test_a_store_that_takes_750_periods_to_charge_is_right_or_refused(monkeypatch):
    """By ngspice 228.2 uW at one step.  Whether a quarter of the step comes back is on the edge: rounding decides."""
    monkeypatch.setattr("harvester.engines.compiled.LONGEST_SAMPLING", 2.0)
    scene = hv.load("examples/bimorph_sensor.toml").with_load(**LONG_CHARGED)
    try:
        answer, response = hv.Compiled().run_from(scene, None, judged=False)
    except hv.SimulationError as error:
        assert "`budget` of more than" in str(error)
    else:
        assert response is not None
        assert abs(answer.mean_power.value - 228.2e-6) < answer.mean_power.bias < 0.01 * 228.2e-6
