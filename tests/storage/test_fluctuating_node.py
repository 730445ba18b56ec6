"""A node whose current fluctuates: its storage capacitor diffuses as the spectral density states,
and counts are evened out."""

import dataclasses

import numpy as np
import pytest

import harvester as hv
from harvester.storage.fluctuating_node import (
    FINITE,
    POINTS,
    fluctuations,
    lived,
    noisy_course,
    with_a_part,
)
from harvester.storage.node_course import NodeCourse
from harvester.storage.node_run import NodeRun
from harvester.storage.rectified_current import RectifiedCurrent

C = 1e-4
CAME = 1e-5
S = 4e-12


def run(density=S, points=POINTS, **node):
    """10 uA into 100 uF up to 20 V; a node that sends 5 ms of 5 mA every second, from 4 V to 2 V."""
    volts = np.linspace(0.0, 20.0, 12)
    one = np.ones(12)
    table = RectifiedCurrent(volts, CAME * one, 0.0 * one, density * one, one, 0.0 * one, 0.0)
    given = {
        "wake_voltage": 4.0,
        "stop_voltage": 2.0,
        "interval": 1.0,
        "currents": (5e-3,),
        "durations": (5e-3,),
    }
    return NodeRun(table, hv.Storage(capacitance=C), hv.SensorNode(**given | node), points=points)


@pytest.mark.slow
def test_a_store_that_nothing_empties_diffuses():
    """Var V = S T/C^2 after a time T, of 128 courses; z-scores of mean and variance."""
    waits = run(wake_voltage=19.9)
    noise = fluctuations(waits, 0.1, 60.0, 0, 16)
    ends = np.array([noisy_course(waits, noise, k, 60.0).volts[-1] for k in range(128)])
    variance = S / FINITE * 60.0 / C**2
    assert abs(ends.mean() - CAME * 60.0 / C) < 4.0 * (variance / 128) ** 0.5 + 0.01
    assert abs(ends.var(ddof=1) / variance - 1.0) < 4.0 * (2.0 / 127) ** 0.5


def test_without_a_density_it_does_what_the_mean_current_does():
    still = run(density=0.0)
    waits = run(density=0.0, points=4000)
    both = lived(waits, still, 400.0, fluctuations(still, 0.2, 400.0, 0))
    course = waits.course(400.0)
    assert both.number(lambda one: one.packets) == pytest.approx(course.packets, rel=2e-3)
    assert both.number(lambda one: one.given) == pytest.approx(course.given, rel=2e-3)
    assert both.error(lambda one: one.packets) == 0.0
    assert both.quantile(0.5) == pytest.approx(course.interval(0.5))


def test_fluctuations_stop_a_node_that_the_mean_current_just_feeds():
    """25 uC each second out, 25.2 uA in: by the mean current it runs for ever; a density of 3 % of a day stops it."""
    volts = np.linspace(0.0, 5.0, 12)
    one = np.ones(12)
    table = RectifiedCurrent(volts, 25.2e-6 * one, 0.0 * one, 2e-9 * one, one, 0.0 * one, 0.0)
    node = run().node
    fed = NodeRun(table, hv.Storage(capacitance=C), node, points=POINTS)
    found = lived(fed, fed, 400.0, fluctuations(fed, 0.1, 400.0, 0))
    assert found.mean.brown_outs == 0 and found.number(lambda one: one.brown_outs) > 1.0
    packets, error = found.number(lambda one: one.packets), found.error(lambda one: one.packets)
    assert packets < found.mean.packets - 4.0 * error and error > 0.0


@pytest.mark.parametrize("first, interval", [(3.0, 1.0), (0.2, 5.0)])
def test_packets_grow_evenly_over_their_interval(first, interval):
    """A course that is cut anywhere has as many packets as its time after the first, half of one more."""
    for end in np.linspace(first + 0.01, first + 20.0, 37):
        sent = np.arange(first, end, interval)
        course = NodeCourse(packets=len(sent), first=first, last=float(sent[-1]), end=end)
        assert with_a_part(course, interval).packets == pytest.approx(
            (end - first) / interval + 0.5
        )
    assert with_a_part(NodeCourse(), interval).packets == 0


def test_days_beyond_the_courses_are_those_of_the_mean_current():
    """If nothing stops it, a day's packets are as many as its intervals, though a course is 400 s long."""
    volts = np.linspace(0.0, 5.0, 12)
    one = np.ones(12)
    table = RectifiedCurrent(volts, 1e-4 * one, 0.0 * one, S * one, one, 0.0 * one, 0.0)
    runs = [
        NodeRun(table, hv.Storage(capacitance=C), run().node, points=points)
        for points in (4000, POINTS)
    ]
    noise = fluctuations(runs[1], 0.1, 400.0, 0)
    found = lived(*runs, 86400.0, noise)
    assert noise.seconds < 500.0 and found.short is not found.mean
    rate = found.number(lambda course: course.packets / course.end)
    assert rate == pytest.approx(1.0 - found.mean.first / 86400.0, abs=2e-4)
    assert dataclasses.replace(noise).few().variates.shape[0] == 8
