"""Counts of packets: the gaps between those that arrive fill the time from the first to the last."""

import numpy as np
import pytest

import harvester as hv
from harvester.storage import node_kernel as kernel

HOURS = 3


@pytest.fixture
def sent():
    """A function that counts packets at given times, of which some arrive: the counts, and those by the hour."""
    send = getattr(kernel.send_packet, "py_func", kernel.send_packet)

    def count(times, arrives):
        counts = np.zeros(kernel.COUNTS)
        hours = np.zeros(HOURS)
        for time, arrived in zip(times, arrives, strict=True):
            counts[kernel.END] = time
            send(counts, hours, arrived)
        return counts, hours

    return count


def test_gaps_fill_the_time_between_the_first_and_the_last(sent):
    rng = np.random.default_rng(61)
    times = np.cumsum(10.0 ** rng.uniform(-4.0, 3.0, 60))
    arrives = rng.random(60) < 0.7
    counts = sent(times, arrives)[0]
    come = times[arrives]
    begin = kernel.INTERVALS
    number = counts[begin : begin + kernel.BINS]
    lasted = counts[begin + kernel.BINS : begin + 2 * kernel.BINS]
    assert counts[kernel.PACKETS] == arrives.sum()
    assert counts[kernel.LOST] == 60 - arrives.sum()
    assert (counts[kernel.FIRST], counts[kernel.LAST]) == (come[0], come[-1])
    assert number.sum() == len(come) - 1
    assert lasted.sum() == pytest.approx(come[-1] - come[0], rel=1e-12)
    # a gap stands in the bin whose limits hold it; the first has all shorter ones
    limits = kernel.SHORTEST * np.exp(kernel.WIDER * np.arange(kernel.BINS + 1))
    full = np.flatnonzero(number)
    mean = lasted[full] / number[full]
    assert (mean < limits[full + 1] * (1.0 + 1e-9)).all()
    assert (mean[full > 0] >= limits[full[full > 0]] * (1.0 - 1e-9)).all()


def test_packets_count_in_the_hour_of_their_arrival(sent):
    """Those after the last hour count in it."""
    hours = sent([1.0, 3599.0, 3601.0, 7201.0, 1e6], [True] * 5)[1]
    assert hours.tolist() == [2.0, 1.0, 2.0]


def test_the_capacitance_that_is_left():
    """A share of the capacitance when new; a battery has none."""
    given = {"capacitance": 2e-3, "leakage_resistance": 1e6}
    assert hv.Storage(**given, capacitance_left=0.7).farads == pytest.approx(1.4e-3)
    assert hv.Storage(**given).farads == 2e-3
    assert hv.Storage(battery_voltage=3.0, battery_charge=360.0).farads == 0.0
