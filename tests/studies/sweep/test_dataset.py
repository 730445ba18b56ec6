"""The labelled dataset: every number where its labels state, with units, through a file and back."""

import json
import subprocess
import sys

import numpy as np
import pytest
import xarray

import harvester as hv
from harvester.presentation import plot
from harvester.studies.sweep.points import Axis, Points, read_axis
from tests.support.paths import EXAMPLES
from tests.support.sweeps import swept

PLATE = hv.load(EXAMPLES / "plate_with_stop.toml")
BOTH = [hv.Published(), hv.Averaged()]


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    monkeypatch.setattr(plot, "save", lambda *_: None)


def test_a_grid(tmp_path):
    axes = [read_axis("load.resistance=1k,1M,10k"), read_axis("stop.restitution=0.9,0.4")]
    table = swept(PLATE, axes, engines=BOTH, out=tmp_path)
    for data in (table.to_xarray(), xarray.open_dataset(tmp_path / "sweep.nc")):
        assert data.mean_power.dims == ("engine", "load.resistance", "stop.restitution")
        assert len(table.rows) == data.mean_power.size == 12
        for row in table.rows:
            one = data.sel(engine=row.engine, **row.varied)
            assert float(one.mean_power) == row.mean_power.value
            assert float(one.mean_square_voltage) == row.mean_square_voltage.value
            assert str(one.warnings.values) == "; ".join(map(str, row.warnings))
            assert np.isnan(float(one.mean_power_stderr))
        assert (data.mean_power.units, data.mean_square_voltage.units, data.seconds.units) == (
            "W",
            "V2",
            "s",
        )
        assert (data["load.resistance"].units, data["stop.restitution"].units) == ("ohm", "1")
        assert data.attrs["scene_digest"] == PLATE.digest
        whence = json.loads(data.attrs["provenance"])
        assert whence["scene"] == PLATE.tables()
        assert whence["versions"]["harvester"] == hv.__version__
        data.close()


def test_a_list_and_a_failure(tmp_path):
    """Points in the order of the list, the same one twice; a nondimensional scene; nan and a text where it failed."""
    scene = hv.loads("[nondimensional]\nc1 = -0.01\nbeta = 0.05\nmu = 0.05\n")
    keys = ("nondimensional.D11", "nondimensional.mu")
    points = Points((Axis(keys[0], (0.02, 0.0, 0.02)), Axis(keys[1], (1.0, 2.0, 1.0))), listed=True)
    table = swept(scene, points, engines=[hv.Published()], out=tmp_path)
    with xarray.open_dataset(tmp_path / "sweep.nc") as data:
        assert data.mean_power.dims == ("engine", "point")
        assert list(data[keys[0]].values) == [0.02, 0.0, 0.02]
        power = data.mean_power.sel(engine="published").values
        assert power[0] == power[2] == table.rows[0].mean_power.value
        assert np.isnan(power[1])
        assert "needs external noise" in str(data.error.values[0, 1])
        assert str(data.error.values[0, 0]) == ""
        assert data.mean_power.units == "1"


@pytest.mark.slow
def test_run_loads_none_of_it_nor_does_a_sweep(tmp_path):
    """Which needed the second that a sweep of a linear scene by its default engine now needs in all."""
    code = f"""
import sys
from harvester.cli import exit_status
plate, heavy = {str(EXAMPLES / "plate.toml")!r}, {{"xarray", "pandas", "distributed", "loky", "numba"}}
for engine in ("exact", "averaged"):
    assert exit_status(["run", plate, "--engine", engine]) == 0
print(sorted((heavy | {{"matplotlib"}}) & set(sys.modules)))
assert exit_status(["sweep", plate, "--vary", "load.resistance=1k:10M:41", "--out", {str(tmp_path)!r}]) == 0
print(sorted(heavy & set(sys.modules)))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert [line for line in done.stdout.splitlines() if line.startswith("[")] == ["[]", "[]"]
