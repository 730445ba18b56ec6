"""Current traces of power profilers: charge and duration are kept, and bad files get one line."""

import numpy as np
import pytest

import harvester as hv
from harvester.records.current_trace import STATES, merged, read_trace
from tests.support.file_forms import CURRENT, TIME, TRACES, lines


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


def test_samples_slightly_below_zero_become_zero(tmp_path):
    """Three samples of -48 nA count as 0 and are reported."""
    (tmp_path / "a.csv").write_text(TRACES["Otii"])
    states, notes = read_trace(str(tmp_path / "a.csv"))
    assert min(i for i, _ in states) >= 0.0
    assert "3 samples of the trace are slightly below 0, -4.8e-08 A at least" in str(notes[0])


def test_two_channels_of_currents(tmp_path):
    """Which channel feeds the node is not guessed."""
    two = "Time(s),Main(mA),USB(mA)\n" + lines(TIME, 1e3 * CURRENT, tail=",0")
    (tmp_path / "a.csv").write_text(two)
    with pytest.raises(hv.InputError, match=r"one column 'current \(A\)', but has 'Main, USB'"):
        read_trace(str(tmp_path / "a.csv"))


def test_units_that_a_trace_leaves_open(tmp_path):
    (tmp_path / "a.csv").write_text("time,current (mA)\n" + lines(np.arange(len(CURRENT)), CURRENT))
    with pytest.raises(hv.InputError, match=r"name it 'time \(ms\)' for 1000 Hz.*or 'time \(s\)'"):
        read_trace(str(tmp_path / "a.csv"))
    (tmp_path / "a.csv").write_text(
        "time,current,voltage,power\n0,1,3,9\n0.001,1,3,9\n0.002,1,3,9\n"
    )
    with pytest.raises(hv.InputError, match="must have a unit, such as 'current"):
        read_trace(str(tmp_path / "a.csv"))


@pytest.mark.parametrize("kind", ["constant", "alternating", "ramp"])
def test_merging_takes_few_passes(monkeypatch, kind):
    """65,536 values that are equal, alternate or rise evenly need at most 60 passes, not one for each value."""
    n = 2**16
    current = {"constant": np.full(n, 1e-3), "alternating": 1e-3 * (1 + np.arange(n) % 2)}
    values = current.get(kind, np.linspace(0.0, 1e-3, n))
    passes = []
    lexsort = np.lexsort
    monkeypatch.setattr(np, "lexsort", lambda keys: passes.append(1) or lexsort(keys))
    found = np.array(merged(values, np.full(n, 1e-4)))
    assert len(passes) <= 60
    assert found.prod(axis=1).sum() == pytest.approx(values.sum() * 1e-4, rel=1e-9)
