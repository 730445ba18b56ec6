"""First-order tolerances of a netlist: slopes of engine `Ideal` between each key's ends."""

import json

import numpy as np
import pytest

import harvester as hv

BRIDGE = hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"})
PLATE = hv.load("examples/plate_with_stop.toml").with_load(BRIDGE)
VARY = {"load.parameters.R": "normal:10%", "piezo.coupling": "normal:5%"}


@pytest.mark.slow
def test_devices_have_the_powers_of_the_linear_law(tmp_path):
    """Devices that the engine computes on other noise are within the stated error, and vary as the law states."""
    execution = hv.Execution(out=tmp_path)
    result = hv.tolerance(
        PLATE, vary=VARY, runs="first-order", samples=256, within=0.02, execution=execution
    )
    about = json.loads((tmp_path / "provenance.json").read_text())
    assert (about["runs"], about["budget"]) == ("first-order", None)
    assert result.engine == "ideal"
    rows = result.samples[:40]
    scenes = [PLATE.varied(dict(zip(VARY, map(float, row), strict=True))) for row in rows]
    engine = hv.Ideal(within=0.02, judged=False)
    powers = [answer.mean_power for answer in engine.run_many(scenes, range(40))]
    computed = np.array([power.value for power in powers])
    errors = np.array([power.known_error95 for power in powers]) + result.off * computed
    assert (np.abs(result.power[:40] - computed) < errors).mean() > 0.85
    assert np.corrcoef(result.power[:40], computed)[0, 1] > 0.9
