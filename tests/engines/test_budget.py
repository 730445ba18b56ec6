"""A budget bounds every engine, whose kernels are compiled ahead, and the study of the cost of accuracy.

The CPU time of this process is bounded, a core each, which other programs on the machine do
not change; it is below the time that passes.
"""

import dataclasses
import time

import pytest

import harvester as hv
from harvester.engines.selection import ENGINES
from harvester.machine.cores import cores
from harvester.presentation.diagnostic import has
from harvester.storage import noisy_power, steady_power
from harvester.studies.work_precision.cost import cost
from tests.support.paths import EXAMPLES

BUDGET = 2.0  # s
MOST = 1.5  # times that
AMPLE, COMPILED = 60.0, 5.0  # s: a budget, and a delay that would exceed it as the pace of a pilot

DRIVEN = hv.load(EXAMPLES / "bimorph_bq25570.toml")
SHAKEN = dataclasses.replace(
    hv.load(EXAMPLES / "bimorph_ltc3588.toml").with_load(
        netlist="ltc3588", parameters={"R": 10e3, "C": "10 uF"}
    ),
    excitation=hv.Excitation(acceleration_psd="0.002 g^2/Hz"),
)
STOPPED = hv.load(EXAMPLES / "plate_with_stop.toml")


def seconds_of(run):
    """The CPU time of a second call on one core, and what it gives; None if it asks for a longer budget."""
    answer = None
    for _ in range(2):
        begin = time.process_time()
        try:
            answer = run()
        except hv.SimulationError as error:  # of a machine that has much else to do
            assert "`budget`" in str(error)
    return (time.process_time() - begin) / cores(), answer


@pytest.mark.slow
@pytest.mark.ngspice
@pytest.mark.parametrize(
    "scene, engine",
    [
        (DRIVEN, "slow"),
        (SHAKEN, "slow"),
        (STOPPED, "density"),
        (STOPPED, "ensemble"),
        (hv.load(EXAMPLES / "plate_bridge.toml"), "ideal"),
        (hv.load(EXAMPLES / "plate_bridge.toml"), "compiled"),
    ],
)
def test_an_engine_ends_in_its_budget(scene, engine):
    took, answer = seconds_of(lambda: ENGINES[engine](budget=BUDGET).run(scene))
    assert took < MOST * BUDGET
    assert answer is None or answer.mean_power.value > 0.0


@pytest.mark.ngspice
def test_a_chip_in_a_short_budget_is_within_its_error_of_the_whole_answer():
    """Longer steps are part of the error; if no step is long enough the quick answer comes, and states so."""
    scene = DRIVEN
    whole = hv.Slow().run(scene).mean_power
    for budget in (1.0, 0.05):
        answer = hv.Slow(budget=budget).run(scene)
        power = answer.mean_power
        assert abs(power.value - whole.value) < power.known_error95 + whole.known_error95
        assert power.known_error95 >= 0.9 * whole.known_error95
    assert has(answer.diagnostics, "quick_in_budget")


@pytest.mark.slow
@pytest.mark.ngspice
def test_a_chip_whose_slow_runs_are_long_ends_in_its_budget():
    """It tracks under noise: on most machines its slow runs alone need longer, and the quick answer comes."""
    shaken = dataclasses.replace(DRIVEN, excitation=SHAKEN.excitation)
    took, answer = seconds_of(lambda: hv.Slow(budget=4.0).run(shaken))
    assert took < MOST * 4.0
    assert answer is not None and answer.mean_power.value > 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene, module, direct",
    [
        (hv.load(EXAMPLES / "bimorph_ltc3588.toml"), steady_power, "_direct"),
        (SHAKEN, noisy_power, "_together"),
    ],
)
def test_compilation_is_not_taken_for_the_pace(monkeypatch, scene, module, direct):
    """The first direct run is as late as one that is compiled, the others are not: the whole answer comes."""
    run = getattr(module, direct)
    late = [COMPILED]

    def first_late(*given, **named):
        if late:
            time.sleep(late.pop())
        return run(*given, **named)

    monkeypatch.setattr(module, direct, first_late)
    answer = hv.Slow(budget=AMPLE).run(scene)
    assert not late
    assert not has(answer.diagnostics, "quick_in_budget")
    assert answer.seconds < AMPLE


@pytest.mark.slow
@pytest.mark.ngspice
def test_what_accuracy_costs_ends_in_its_budget():
    took, table = seconds_of(lambda: cost(STOPPED, budget=3.0))
    assert took < MOST * 3.0
    assert table is None or any(row.total_error for row in table.rows)
