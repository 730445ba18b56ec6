"""The region of stability: theory against Monte Carlo on the boundary, and the files."""

import csv

import numpy as np
import pytest

import harvester as hv
from harvester.errors import CannotServeError
from harvester.machine.progress import CallingBack
from harvester.studies.stability import exponent, region
from tests.support.systems import FIGURE7, changed, scene

pytestmark = pytest.mark.slow


@pytest.mark.thorough("test_ends_of_the_region")
def test_boundary_is_where_the_monte_carlo_is_zero():
    """The paper's Figure 9 oscillator: ours on the measured boundary within 4 errors, the published one far off."""
    found = list(
        region.edges(
            changed(FIGURE7, mu=None, n2=None), np.array([0.05, 0.5]), np.random.SeedSequence(1)
        )
    )
    for edge in found:
        assert abs(edge.averaged - edge.ensemble) < 4 * edge.ensemble_stderr
        assert edge.ensemble_stderr < 0.02 * edge.ensemble
    assert found[1].published > 1.5 * found[1].ensemble


def test_ends_of_the_region():
    """Unstable without any noise: 0, and nothing is measured."""
    (edge,) = region.edges(
        changed(FIGURE7, restitution=1.0), np.array([0.1]), np.random.SeedSequence(1)
    )
    assert (edge.averaged, edge.ensemble, edge.ensemble_stderr) == (0.0, 0.0, np.inf)


def test_files(tmp_path, monkeypatch):
    monkeypatch.setattr(exponent, "LOADS", np.array([0.1, 1.0]))
    ticks = []
    progress = CallingBack(lambda done, what: ticks.append((done, what)))
    execution = hv.Execution(out=tmp_path, progress=progress)
    found = hv.stability(scene(FIGURE7), trajectories=64, duration=50.0, execution=execution)
    with (tmp_path / "stability.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == ("mu", "published", "averaged", "ensemble", "ensemble_stderr")
    assert len(found.as_json()["region"]) == len(found.to_pandas()) == 2
    assert [float(row["mu"]) for row in rows] == [0.1, 1.0]
    assert ticks == sorted(ticks) and [what for _, what in ticks][-2:] == ["region"] * 2
    assert (tmp_path / "stability.png").read_bytes().startswith(b"\x89PNG")


def test_a_netlist_has_no_region(tmp_path):
    bridge = hv.load("examples/plate_with_stop.toml").with_load(hv.Load(netlist="bridge"))
    with pytest.raises(CannotServeError, match="load resistance"):
        hv.stability(bridge, execution=hv.Execution(out=tmp_path / "out"))
    assert not (tmp_path / "out").exists()
