"""The bias of the step of a netlist that no circuit without ngspice supports, as it has a transistor of level 3."""

import pytest

import harvester as hv

OWN = """* Two halves
.subckt mine p n R=1Meg
Rload p n {2*R}
Rother p n {2*R}
M1 p p p p slow
.model slow nmos level=3
.ends mine
.end
"""


@pytest.mark.thorough("test_a_netlist_of_ones_own")
@pytest.mark.ngspice
@pytest.mark.statistics
def test_whole_error_of_an_own_netlist_holds_the_exact_mean(tmp_path):
    """Two resistors with half of a known mean power each; at a long step the bias is the remainder."""
    (tmp_path / "mine.cir").write_text(OWN)
    plate = hv.load("examples/plate.toml")
    own = plate.with_load(hv.Load(netlist=str(tmp_path / "mine.cir"), parameters={"R": "1 Mohm"}))
    answer = hv.Spice(trajectories=8, duration=20.0, dt=0.012, seed=3).run(own)
    exact = 0.5 * hv.Exact().run(plate).mean_power.value
    power = answer.mean_power
    assert "8 runs of ngspice and those of twice the step" in answer.reason
    assert abs(power.value - exact) < power.error95 < 0.2 * exact
    assert power.bias > 0.0
