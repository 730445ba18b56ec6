"""Engine `spice` of several modes with a stop and a rectifier, against the compiled circuit."""

import math

import pytest

import harvester as hv
from tests.support.systems import BEAM

pytestmark = [pytest.mark.ngspice, pytest.mark.slow, pytest.mark.thorough("test_one_netlist")]


def test_bridge():
    """Runs that begin in settled states of ideal diodes have the compiled circuit's power, and an
    energy balance that closes."""
    load = hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"})
    scene = BEAM.replace(stop=hv.Stop(restitution=0.5, gap="0.05 mm"), load=load)
    found, other = (
        hv.run(scene, name, within="3%", budget="60s", seed=1) for name in ("spice", "compiled")
    )
    mine, theirs = found.mean_power, other.mean_power
    assert abs(mine.value - theirs.value) < 4.0 * math.hypot(mine.stderr, theirs.stderr) + mine.bias
    assert mine.stderr < 0.02 * mine.value
    assert found.details["control_correlation"] > 0.99
    assert abs(found.details["ledger_residual"]) < 0.01
