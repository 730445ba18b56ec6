"""Current traces of power profilers: charge and duration are kept, and bad files get one line."""

import numpy as np
import pytest

import harvester as hv
from harvester.records.current_trace import STATES, merged, read_trace


def test_merging_keeps_charge_duration_and_peaks():
    """A noisy sleep with one pulse of three samples: the pulse stays apart."""
    rng = np.random.default_rng(1)
    current = np.abs(rng.normal(2e-6, 1e-7, 5000))
    lengths = rng.uniform(0.5e-4, 1.5e-4, 5000)
    current[2000:2003] = 20e-3
    found = np.array(merged(current, lengths))
    assert len(found) == STATES
    assert found[:, 1].sum() == pytest.approx(lengths.sum(), rel=1e-12)
    assert (found[:, 0] * found[:, 1]).sum() == pytest.approx((current * lengths).sum(), rel=1e-12)
    pulse = found[found[:, 0] > 1e-3]
    assert pulse[:, 0] == pytest.approx(20e-3) and pulse[:, 1].sum() == pytest.approx(
        lengths[2000:2003].sum()
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "time (s),current (A)\n-0.001,1e-3\n0.001,1e-3\n",
            "ascend from 0 on, but row 1 has -0.001 s",
        ),
        (
            "time (s),current (A)\n0,1e-3\n0.002,1e-3\n0.001,1e-3\n",
            "ascend from 0 on, but row 3 has 0.001 s",
        ),
        (
            "time (s),current (mA)\n0,1\n0.001,-2\n",
            "currents of at least 0, but row 2 has -0.002 A",
        ),
        ("time (s),voltage (V)\n0,1\n0.001,2\n", "must have a column 'current"),
        ("time (s),current (A)\n0,1\n", "at least 2 rows"),
        ("", "must have rows of numbers"),
    ],
)
def test_a_bad_trace_is_one_line(tmp_path, text, said):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(hv.InputError, match=said) as error:
        read_trace(str(tmp_path / "bad.csv"))
    assert "\n" not in str(error.value) and str(error.value).startswith("node.trace must")


def test_a_trace_outside_of_the_scene_s_folder_is_refused(tmp_path):
    scene = 'node = { wake_voltage = "4 V", stop_voltage = "2 V", interval = "1 s", trace = "../secret.csv" }'
    with pytest.raises(hv.InputError, match=r"node\.trace must be in the folder of the scene file"):
        hv.loads(scene, tmp_path)
