"""What a run tells of the circuit beside the power: probes with errors, and each element's share of the energy."""

import json

import pytest

import harvester as hv
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


@pytest.mark.ngspice
def test_steady_probes_and_ledger(tmp_path, harvester):
    """Rload's probe is the mean power, with a like error; the diodes' shares are alike, and sum to the circuit's."""
    (tmp_path / "driven.toml").write_text(DRIVEN)
    words = ("run", tmp_path / "driven.toml", "--engine", "spice", "--probe", "p(load)", "--probe", "store", "--ledger")
    status, said, wrong = harvester(*words, "--within", "2%", "--json")
    assert fault(status, said, wrong) == ""
    answer = json.loads(said)
    load, store = answer["probes"]["p(load)"], answer["probes"]["store"]
    assert load["unit"] == "W"
    assert load["mean"]["value"] == pytest.approx(answer["mean_power"]["value"], rel=1e-3)
    assert load["mean"]["error95"] < 0.02 * load["mean"]["value"]
    assert store["rms"]["value"] ** 2 / 1e6 == pytest.approx(load["mean"]["value"], rel=1e-3)
    assert store["least"]["value"] < store["mean"]["value"] < store["rms"]["value"] < store["largest"]["value"]
    shares = {name: value for name, value in answer["details"].items() if name.startswith("ledger_circuit_")}
    assert set(shares) == {f"ledger_circuit_{one}" for one in ("d1", "d2", "d3", "d4", "rest")}
    assert sum(shares.values()) == pytest.approx(answer["details"]["ledger_circuit"])
    assert abs(shares["ledger_circuit_rest"]) < 0.02 * answer["details"]["ledger_circuit"]
    errors = [answer["details"][f"error_of_ledger_circuit_{one}"] for one in ("d1", "d2")]  # by symmetry they are equal
    assert abs(shares["ledger_circuit_d1"] - shares["ledger_circuit_d2"]) < sum(errors)
    assert max(errors) < 0.05 * shares["ledger_circuit_d1"]


@pytest.mark.ngspice
def test_sampled_probes():
    """Under noise the errors are of sampling, and the step's is named as not known."""
    bridge = hv.load("examples/plate_bridge.toml")
    found = hv.Spice(alone=True, trajectories=4, duration="2 s", probe=("store", "i(d1)")).run(bridge)
    store, current = found.probes["store"], found.probes["i(d1)"]
    assert (store.unit, current.unit) == ("V", "A")
    assert store.window == pytest.approx(2.0, rel=0.1)
    assert 0.0 < store.mean.stderr < store.mean.value
    assert store.mean.whole_error95 is None
    assert current.least.value < 0.0 < current.mean.value < current.largest.value
    assert "store (least and largest in" in str(found)


def test_other_engines_have_no_circuit(harvester):
    status, _, wrong = harvester("run", "examples/plate.toml", "--engine", "ensemble", "--probe", "v(p)")
    assert (status, "--probe must be left out with engine 'ensemble'" in wrong) == (2, True)
    status, _, wrong = harvester("run", "examples/plate.toml", "--engine", "spice", "--ledger")
    assert (status, "--ledger must go with a netlist" in wrong) == (2, True)
