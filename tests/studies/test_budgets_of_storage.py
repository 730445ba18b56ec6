"""Budgets of `node`, `design` and slow charges: they end in time, with fewer runs or circuits, or state the seconds.

Seconds are without compilation, and CPU time, as the machine may have other work.
"""

import dataclasses
import time
from contextlib import contextmanager, suppress

import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.machine.progress import NoProgress
from harvester.mechanics.kernels.compiled import compilation
from harvester.storage import measured_current, time_limit
from harvester.storage.time_limit import TimeLimit, TooLittleTimeError, check_time, limited
from harvester.storage.time_limit import working_seconds as working
from harvester.studies import node
from harvester.studies.design import yield_share
from harvester.studies.node_current import Effort, measure_current
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


@pytest.mark.slow
def test_more_time_is_a_smaller_error_of_a_node():
    """The shorter budget has the first runs alone, and states it; the longer one has more runs as well."""
    hv.node(NOISY, budget=4)  # compiles
    with ending_within(4.0):
        short = hv.node(NOISY, budget="4s")
    with ending_within(40.0):
        long = hv.node(NOISY, budget=40)
    assert "node_error_by_budget" in [said.code for said in short.diagnostics]
    assert short.packets_per_hour.sampling95 > 1.5 * long.packets_per_hour.sampling95 > 0.0
    both = short.packets_per_hour.known_error95 + long.packets_per_hour.known_error95
    assert abs(short.packets_per_hour.value - long.packets_per_hour.value) <= both


def test_a_budget_bounds_the_courses_of_a_node():
    """Their number was doubled whatever time was left, and so was that of each variant."""
    problem = Problem.of(NOISY)
    consumer = problem.scene.node
    effort = Effort(0, 0.1, 0.1)
    with compilation():
        known = measure_current(problem, problem.scene.storage, None, consumer.wake_voltage, effort)
    parts = node.Parts(problem.scene.storage, consumer, None, None)
    given = known, parts, 0.3, 86400.0, 0
    node.enough_courses(*given)  # compiles
    begin = working()
    free = node.enough_courses(*given)
    with limited(TimeLimit(working() - begin)):
        short = node.enough_courses(*given)
    assert len(short.variates) <= len(free.variates) // 2


def test_a_node_states_the_seconds_that_it_needs():
    with pytest.raises(TooLittleTimeError, match=r"no answer in a `budget` of 1 ms: .* at least"):
        hv.node(NOISY, budget=0.001)
    with pytest.raises(InputError, match="`budget` must be a time above 0"):
        hv.node(NOISY, budget="soon")


@pytest.mark.slow
def test_a_design_without_time_for_a_circuit_has_no_answer():
    with pytest.raises(InputError, match="no answer in a `budget`"):
        hv.design(SENSOR, needs=NEEDS, circuits=["bridge"], budget=0.001)


class HourOfReport(NoProgress):
    """A clock that advances by an hour for each power and each device, always alike."""

    def __init__(self):
        self.begin = working()
        self.reports = 0
        self.circuits = set()

    def step(self, done=1, what=""):
        """Count the first report of a circuit's power, and every one of its devices."""
        self.reports += done > yield_share.NOMINAL or what not in self.circuits
        self.circuits.add(what)

    def seconds(self):
        """The time in place of `working_seconds`."""
        return self.begin + 3600.0 * self.reports


@pytest.mark.slow
def test_circuits_whose_yield_is_late_are_named(monkeypatch):
    """Each yield needs `NODES` hours, and the powers of the two circuits need one hour each."""
    asked = {"needs": NEEDS, "spread": "frequency=2Hz", "circuits": ["bridge", "doubler"]}
    whole = hv.design(SENSOR, **asked)
    clock = HourOfReport()
    for module in (time_limit, measured_current, yield_share):
        monkeypatch.setattr(module, "working_seconds", clock.seconds)
    hours = 2 + 1.5 * yield_share.NODES
    part = hv.design(SENSOR, budget=3600.0 * hours, execution=hv.Execution(progress=clock), **asked)
    late = [said for said in part.diagnostics if said.code == "shares_left_out"]
    assert [said.numbers["names"] for said in late] == ["doubler"]
    known = {each.circuit: each.share_met for each in part.candidates}
    assert known["doubler"] is None
    assert known["bridge"] == {each.circuit: each.share_met for each in whole.candidates}["bridge"]
    assert known["bridge"] is not None
    assert hours < clock.reports <= hours + 1


def test_a_pace_that_is_hopeless_ends_the_work_at_once():
    with limited(TimeLimit(3600.0)):
        check_time(working() - 10.0, 0.5)
        with pytest.raises(TooLittleTimeError, match=r"3 h|10000 s|2 h"):
            check_time(working() - 10.0, 0.001)
    check_time(working() - 10.0, 0.001)


NOISY_BOARD = dataclasses.replace(
    hv.load(SENSOR), excitation=hv.Excitation(acceleration_psd="3e-3 g^2/Hz")
).with_load(netlist="bridge", parameters={"C": "1 mF", "R": "10 Mohm"})


@pytest.mark.slow
@pytest.mark.parametrize("budget", [1.0, 2.0])
def test_a_slow_charge_ends_with_its_budget_or_states_the_seconds_that_it_needs(budget):
    """Without a budget it lasts some four seconds."""
    hv.charge(NOISY_BOARD, "2 V", engine="slow", trajectories="20s")  # compiles
    with ending_within(budget), suppress(TooLittleTimeError):
        found = hv.charge(NOISY_BOARD, "2 V", engine="slow", trajectories=f"{budget} s")
        assert found.time is not None and found.time.error95 > 0.0


def test_a_charge_without_a_budget_leaves_that_of_the_work_around_it():
    with limited(TimeLimit(0.001)), pytest.raises(TooLittleTimeError, match="`budget` of 1 ms"):
        hv.charge(NOISY_BOARD, "2 V", engine="slow")
