"""Budgets of `node` and `design`: they end in time, with fewer runs or circuits, or state the seconds that are needed.

Seconds are without compilation, and CPU time, as the machine may have other work.
"""

import time
from contextlib import contextmanager

import pytest

import harvester as hv
from harvester.errors import InputError, SimulationError
from harvester.storage.time_limit import TimeLimit, TooLittleTimeError, check_time, limited
from harvester.storage.time_limit import working_seconds as working
from tests.support.own_board import noisy_node
from tests.support.paths import EXAMPLES

MARGIN = 1.5  # times the budget
NOISY = noisy_node(load=hv.Load(netlist="doubler", parameters={}))
SENSOR = EXAMPLES / "bimorph_sensor.toml"
NEEDS = "40 uW at 3.3 V"


@contextmanager
def ending_within(budget):
    """Check that the work ends in `MARGIN` times the budget, by wall or CPU time."""
    begin = working()
    busy = time.process_time()
    compiled = time.perf_counter() - begin
    yield
    compiled = time.perf_counter() - working() - compiled
    assert min(working() - begin, time.process_time() - busy - compiled) <= MARGIN * budget


def test_more_time_is_a_smaller_error_of_a_node():
    with ending_within(60.0):
        long = hv.node(NOISY, budget=60)
    with ending_within(1.0):
        try:
            short = hv.node(NOISY, budget="1s")
        except SimulationError as error:
            assert "`budget`" in str(error)
            return
    assert short.packets_per_hour.sampling95 > long.packets_per_hour.sampling95
    both = short.packets_per_hour.known_error95 + long.packets_per_hour.known_error95
    assert abs(short.packets_per_hour.value - long.packets_per_hour.value) <= both


def test_a_node_states_the_seconds_that_it_needs():
    with pytest.raises(TooLittleTimeError, match=r"no answer in a `budget` of 1 ms: .* at least"):
        hv.node(NOISY, budget=0.001)
    with pytest.raises(InputError, match="`budget` must be a time above 0"):
        hv.node(NOISY, budget="soon")


def test_a_design_ends_in_its_budget():
    with pytest.raises(InputError, match="no answer in a `budget`"):
        hv.design(SENSOR, needs=NEEDS, circuits=["bridge"], budget=0.001)
    with ending_within(2.0):
        try:
            hv.design(SENSOR, needs=NEEDS, spread="frequency=2Hz", budget="2s")
        except (InputError, SimulationError) as error:
            assert "`budget`" in str(error)


def test_circuits_whose_yield_is_late_are_named():
    """Both yields need about the same time, so that a budget of 70 % has one at most, or none."""
    circuits = ["bridge", "doubler"]
    asked = {"needs": NEEDS, "spread": "frequency=2Hz", "circuits": circuits}
    hv.design(SENSOR, **asked)
    begin = working()
    whole = hv.design(SENSOR, **asked)
    seconds = working() - begin
    assert all(each.share_met is not None for each in whole.candidates)
    try:
        part = hv.design(SENSOR, budget=0.7 * seconds, **asked)
    except (InputError, SimulationError) as error:
        assert "`budget`" in str(error)
        return
    late = [said for said in part.diagnostics if said.code == "shares_left_out"]
    known = [each.circuit for each in part.candidates if each.share_met is not None]
    assert not late or known == [name for name in circuits if name not in late[0].numbers["names"]]


def test_a_pace_that_is_hopeless_ends_the_work_at_once():
    with limited(TimeLimit(3600.0)):
        check_time(working() - 10.0, 0.5)
        with pytest.raises(TooLittleTimeError, match=r"3 h|10000 s|2 h"):
            check_time(working() - 10.0, 0.001)
    check_time(working() - 10.0, 0.001)
