"""The time after the first passage: shares of time on known paths, and of a chip in ngspice."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.studies.charging.afterwards import Afterwards, afterwards
from harvester.studies.charging.passages import Passages
from tests.support.paths import EXAMPLES


def test_shares_of_known_paths():
    """Whole cycles if it rises again, else all the time to the end; nothing if it never gets there."""
    t = np.linspace(0.0, 10.0, 100001)
    pulses = np.where(t % 2.0 >= 1.5, 1.0, 0.0)
    share, error, rises = afterwards(t, pulses, 0.5)
    assert (share, rises) == (pytest.approx(0.25, abs=1e-4), 5)
    assert error < 1e-6
    # 1.5 to 2 and 3.5 to 4 of the 5.5 after 1.5: the second rise is too early for whole cycles to
    # be most of it
    assert afterwards(t, np.where(t > 4.0, 0.0, pulses), 0.5).share == pytest.approx(
        1.0 / 8.5, abs=1e-4
    )
    assert afterwards(t, t, 4.0) == Afterwards(1.0, 0.0, 1)
    assert afterwards(t, 5.0 - t, 4.0).share == pytest.approx(0.1)  # it begins above
    assert afterwards(t, 0.0 * t, 4.0).rises == 0
    assert math.isnan(afterwards(t, 0.0 * t, 4.0).share)


@pytest.mark.parametrize("first", [0.0, 2.0])
def test_a_triangle_wave_is_above_its_mean_for_half_of_the_time(first):
    """Straight between points that are below and above in turn, from either side."""
    t = np.arange(9.0)
    u = np.where(t % 2.0 == 0.0, first, 2.0 - first)
    assert afterwards(t, u, 1.0).share == pytest.approx(0.5, rel=1e-12 if first == 0.0 else 0.1)


def test_a_single_cycle_states_what_the_end_changes():
    t = np.linspace(0.0, 10.0, 100001)
    u = np.where((t >= 2.0) & (t < 4.0) | (t >= 8.0), 1.0, 0.0)
    share, error, rises = afterwards(t, u, 0.5)
    assert (share, error, rises) == (
        pytest.approx(2 / 6, abs=1e-4),
        pytest.approx(0.5 - 2 / 6, abs=1e-4),
        2,
    )


def test_error_over_cycles_holds_the_mean_of_random_ones():
    """95 % intervals of ten random cycles hold the true share of on-times in most of 200 runs."""
    rng = np.random.default_rng(4)
    held = 0
    for _ in range(200):
        on, off = rng.uniform(0.5, 1.5, (2, 11))
        edges = np.cumsum(np.column_stack([off, on]).ravel())
        t = np.sort(np.concatenate([[0.0], edges - 1e-9, edges, [edges[-1] + 0.01]]))
        u = (np.searchsorted(edges, t, side="right") % 2).astype(float)
        share, error, _ = afterwards(t, u, 0.5)
        held += abs(share - 0.5) <= error
    assert 178 <= held <= 199  # binomial of 0.95, z within 4, less what few cycles leave


def test_a_run_that_never_gets_there_has_no_share():
    runs = [Afterwards(0.2, 0.01, 3), Afterwards(math.nan, math.nan, 0)]
    times = np.array([[1.0], [math.inf]])
    found = Passages(
        np.array([1.0]),
        times,
        times,
        np.zeros(1),
        np.zeros((2, 1)),
        10.0,
        0.0,
        1,
        0.0,
        after=(runs, runs),
    )
    assert found.share_afterwards() is None
    assert found.rises() == 1.5


@pytest.mark.thorough("test_a_step_down_chip_wakes_and_sleeps_as_its_closed_form")
@pytest.mark.ngspice
def test_a_chip_wakes_up_and_runs_for_a_part_of_the_time():
    """As counted on the path that `motion` hands out; nothing is reported without a duration."""
    more = "acceleration_amplitude = '0.3 g'"
    text = (
        (EXAMPLES / "bimorph_ltc3588.toml")
        .read_text()
        .replace('acceleration_amplitude = "0.15 g"', more)
    )
    scene = hv.loads(text.replace('C = "47 uF", Cout = "10 uF"', 'C = "1 uF", Cout = "0.3 uF"'))
    found = hv.charge(scene, "3 V", probe="v(out,com)", duration="0.4 s")
    path = hv.motion(scene, "spice", duration=0.4, from_rest=True, probe=["v(out,com)"])
    on = path.probes["v(out,com)"] >= 3.0
    woken = np.flatnonzero(on[1:] & ~on[:-1]) + 1
    assert len(woken) == found.rises > 2
    assert found.time.value == pytest.approx(path.time[woken[0]], rel=0.02)
    share = on[woken[0] : woken[-1]].mean()
    assert found.afterwards.value == pytest.approx(share, rel=0.05)
    assert 0.05 < share < 0.95
    said = found.as_json()
    assert said["afterwards"]["value"] == found.afterwards.value
    assert said["rises"] == found.rises
    assert "duty cycle afterwards" in str(found)
