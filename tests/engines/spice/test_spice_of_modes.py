"""Engine `spice` of several modes with a stop and a rectifier, against the compiled circuit."""

import math

import pytest

import harvester as hv
from tests.support.systems import BEAM

pytestmark = [pytest.mark.ngspice, pytest.mark.slow, pytest.mark.thorough("test_one_netlist")]


OWN = """own bridge
.subckt load p n
D1 p a dd
D2 n a dd
D3 b p dd
D4 b n dd
Csmooth a b 20n
Rload a b 1meg
.model dd D(Is=1e-9 N=1.6 Cjo=4p)
.ends
"""


@pytest.mark.parametrize("netlist", ["bridge", "own.cir"])
def test_bridge(netlist, tmp_path):
    """Runs that begin in settled states of ideal diodes, or of the board's own compiled ones, have
    the compiled circuit's power, and an energy balance that closes."""
    load = hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"})
    if netlist != "bridge":
        (tmp_path / netlist).write_text(OWN)
        load = hv.Load(netlist=str(tmp_path / netlist))
    scene = BEAM.replace(stop=hv.Stop(restitution=0.5, gap="0.05 mm"), load=load)
    found, other = (
        hv.run(scene, name, within="3%", budget="60s", seed=1) for name in ("spice", "compiled")
    )
    mine, theirs = found.mean_power, other.mean_power
    assert abs(mine.value - theirs.value) < 4.0 * math.hypot(mine.stderr, theirs.stderr) + mine.bias
    assert mine.stderr < 0.02 * mine.value
    assert found.details["control_correlation"] > 0.99
    assert abs(found.details["ledger_residual"]) < 0.01
