"""The report of a run of the circuit next to the power: probes with errors, and each element's
fraction of the energy."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest

import harvester as hv
from harvester.engines.spice.probed_answer import watch_of, with_sampled_probes
from harvester.equations.problem import Problem
from tests.support.judge import fault

DRIVEN = """
[oscillator]
mass = 0.04
stiffness = 16.0
damping = 0.16
[piezo]
coupling = 1e-3
capacitance = 50.2e-9
[excitation]
acceleration_amplitude = "0.05 g"
frequency = 3.2
[load]
netlist = "bridge"
parameters = { R = 1e6, C = 3e-7 }
"""


@pytest.mark.thorough("test_errors_of_sampled_probes")
@pytest.mark.ngspice
def test_steady_probes_and_ledger(tmp_path, harvester):
    """Rload's probe is the mean power, with a like error; the diodes' shares are alike, and sum to the circuit's."""
    (tmp_path / "driven.toml").write_text(DRIVEN)
    words = (
        "run",
        tmp_path / "driven.toml",
        "--engine",
        "spice",
        "--probe",
        "p(load)",
        "--probe",
        "store",
        "--ledger",
    )
    status, said, wrong = harvester(*words, "--within", "2%", "--json")
    assert fault(status, said, wrong) == ""
    answer = json.loads(said)
    load, store = answer["probes"]["p(load)"], answer["probes"]["store"]
    assert load["unit"] == "W"
    assert load["mean"]["value"] == pytest.approx(answer["mean_power"]["value"], rel=1e-3)
    assert load["mean"]["error95"] < 0.02 * load["mean"]["value"]
    assert store["rms"]["value"] ** 2 / 1e6 == pytest.approx(load["mean"]["value"], rel=1e-3)
    assert (
        store["least"]["value"]
        < store["mean"]["value"]
        < store["rms"]["value"]
        < store["largest"]["value"]
    )
    assert 0.0 < answer["details"]["ledger_load_bias"] < 0.02 * answer["details"]["ledger_load"]
    shares = {
        name: value
        for name, value in answer["details"].items()
        if name.startswith("ledger_circuit_")
    }
    assert set(shares) == {f"ledger_circuit_{one}" for one in ("d1", "d2", "d3", "d4", "rest")}
    assert sum(shares.values()) == pytest.approx(answer["details"]["ledger_circuit"])
    assert abs(shares["ledger_circuit_rest"]) < 0.02 * answer["details"]["ledger_circuit"]
    # by symmetry they are equal
    errors = [answer["details"][f"error_of_ledger_circuit_{one}"] for one in ("d1", "d2")]
    assert abs(shares["ledger_circuit_d1"] - shares["ledger_circuit_d2"]) < sum(errors)
    assert max(errors) < 0.05 * shares["ledger_circuit_d1"]


@pytest.mark.thorough("test_errors_of_sampled_probes")
@pytest.mark.ngspice
def test_sampled_probes():
    """Under noise the errors are of sampling, of the step and of ngspice's tolerance; Rload's probe is its power."""
    noisy = DRIVEN.replace('_amplitude = "0.05 g"', '_psd = "1e-5 g^2/Hz"').replace(
        "frequency = 3.2", ""
    )
    bridge = hv.loads(noisy.replace("3e-7", "3e-8"))
    probed = hv.Spice(
        alone=True, trajectories=8, duration="1 s", probe=("store", "i(d1)", "p(load)"), ledger=True
    )
    found = probed.run(bridge)
    store, current = found.probes["store"], found.probes["i(d1)"]
    assert (store.unit, current.unit) == ("V", "A")
    assert store.window == pytest.approx(1.0, rel=0.1)
    assert 0.0 < store.mean.stderr < store.mean.value
    load = found.probes["p(load)"]
    power = found.mean_power
    assert load.mean.value == pytest.approx(power.value, rel=1e-3)
    assert load.mean.stderr == pytest.approx(power.stderr, rel=1e-3)
    for value in vars(load).values():
        if isinstance(value, hv.Value):
            assert 0.0 < value.bias < 0.2 * value.value and value.error95 > value.sampling95
    assert found.details["error_of_ledger_circuit_d1"] > 0.0
    assert found.details["ledger_load_stderr"] == pytest.approx(power.normal_stderr, rel=0.05)
    assert "energy balance, circuit d1" in str(found) and "% (95 %)" in str(found)
    assert current.least.value < 0.0 < current.mean.value < current.largest.value
    assert all(word in str(found) for word in ("\n  store\n", "window", "largest"))


def test_errors_of_sampled_probes():
    """A change by twice the step is a third of its error in a mean, all of it in an extreme; without it: not known."""
    problem = Problem.of("examples/plate_bridge.toml")
    answer = dataclasses.replace(hv.Exact().run("examples/plate.toml"), details={"duration": 1.0})
    rng = np.random.default_rng(1)
    fine = 4.0 + 0.1 * rng.standard_normal((8, 1, 4))
    coarse = fine + np.array([0.3, 2.4, 0.3, -0.3])
    both = ([SimpleNamespace(probed=one) for one in several] for several in (fine, coarse))
    runs = SimpleNamespace(
        **dict(zip(("done", "coarse"), both, strict=True)), followed=8, probed_tolerance=0.0
    )
    watch = watch_of(problem, "store", False)
    store = with_sampled_probes(answer, problem, watch, runs).probes["store"]
    root = 0.8 / (2.0 * store.rms.value)
    assert [one.bias for one in (store.mean, store.rms, store.least, store.largest)] == [
        pytest.approx(error) for error in (0.1, root, 0.3, 0.3)
    ]
    assert store.mean.stderr == pytest.approx(fine[:, 0, 0].std(ddof=1) / np.sqrt(8))
    runs.probed_tolerance = np.array([[0.01, 0.0, 0.0, 0.0]])
    mean = with_sampled_probes(answer, problem, watch, runs).probes["store"].mean
    assert mean.bias == pytest.approx(0.1 + 0.01 * store.rms.value)
    runs.followed = 0
    runs.probed_tolerance = None
    mean = with_sampled_probes(answer, problem, watch, runs).probes["store"].mean
    assert mean.error95 is None and mean.unknown == "the time step and ngspice's tolerance"


def test_other_engines_have_no_circuit(harvester):
    status, _, wrong = harvester(
        "run", "examples/plate.toml", "--engine", "ensemble", "--probe", "v(p)"
    )
    assert (status, "--probe must be left out with engine 'ensemble'" in wrong) == (2, True)
    for option in ("--ledger", "--energy-balance"):
        status, _, wrong = harvester("run", "examples/plate.toml", "--engine", "spice", option)
        assert (status, "--energy-balance must be used with a netlist" in wrong) == (2, True)
