"""Periodic responses of flat netlists: the total error against closed forms, initial conditions, and hard diodes."""

import importlib
import math
import sys

import pytest

import harvester as hv
from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
periodic_errors = importlib.import_module("periodic_errors")

pytestmark = pytest.mark.ngspice

DEVICE = periodic_errors.Device(8e-3, 60.0, 0.012, 1.5e-3, 47e-9, 0.2 * 9.80665, 60.0)
DIODES = "D1 PZ1 OUT DSK\nD2 PZ2 OUT DSK\nD3 0 PZ1 DSK\nD4 0 PZ2 DSK\n"
SOFT, HARD = "Is=1u N=1.05 Rs=2 Cjo=20p Bv=40", "IS=389f N=1.27 CJO=14p"


def board(folder, store="2.2u", diode=SOFT):
    """The scene of a bridge on the device."""
    path = folder / "board.cir"
    path.write_text(
        f"* board\n{DIODES}C1 OUT 0 {store}\nR1 OUT 0 220k\n.model DSK D({diode})\n.end\n"
    )
    return DEVICE.scene(path, "R1", "C1")


def answered(folder, elements, **options):
    """The answer for a linear board, and its power in closed form (W)."""
    path = folder / "board.cir"
    path.write_text(periodic_errors.netlist(elements))
    answer = hv.Spice(**options).run(DEVICE.scene(path, "RL"))
    return answer, periodic_errors.closed_form(DEVICE, elements)


@pytest.mark.parametrize("ohms", [100e3, 110e3, 145e3])
def test_two_resistors_are_within_their_stated_error(tmp_path, ohms):
    """It had settled by what one change between periods stated of a mode that turns: 257 times the stated error."""
    answer, truth = answered(tmp_path, [("R2", "PZ1", "PZ2", 10e6), ("RL", "PZ1", "PZ2", ohms)])
    off = answer.mean_power.value - truth
    stated = answer.mean_power.known_error95
    assert abs(off) < stated < 2e-4 * truth
    # of the finest step, which the power is extrapolated from
    ledger = answer.details["ledger_load"]
    assert abs(ledger - truth) < answer.details["ledger_load_bias"] < 1e-3 * truth


def test_coils_and_further_capacitors_come_back(tmp_path):
    """A period began with inductors without currents: nothing came back, and runs of minutes replaced the response."""
    elements = [
        ("RW", "PZ1", "M", 1e3),
        ("L1", "M", "N1", 200.0),
        ("C1", "N1", "PZ2", 20e-9),
        ("RL", "N1", "PZ2", 1e5),
    ]
    answer, truth = answered(tmp_path, elements)
    assert answer.details["response_periods"] == 1
    assert abs(answer.mean_power.value - truth) < answer.mean_power.known_error95 < 1e-3 * truth


def test_random_ladders_are_within_their_stated_errors(tmp_path):
    rows = periodic_errors.ladders(hv.Spice(), 12, tmp_path)
    assert [
        row["case"] for row in rows if row.get("ratio", math.inf) > 1.0 or not row["periodic"]
    ] == []


def test_a_steady_response_knows_no_initial_condition(tmp_path):
    """Each period began with IC= again: 64 s of CPU time for 4, and 300 times the error."""
    plain, begun = (hv.Spice().run(board(tmp_path, store)) for store in ("2.2u", "2.2u IC=0"))
    assert begun.mean_power == plain.mean_power
    assert begun.details["ngspice_periods"] == plain.details["ngspice_periods"] < 60
    charged = hv.Spice().run(board(tmp_path, "2.2u IC = 2"))
    assert charged.mean_power == plain.mean_power


def test_a_charge_begins_at_the_initial_condition(tmp_path):
    """From 2 V on a storage capacitor of 22 uF has 3 V after 418 ms, from 0 V after 667 ms."""
    times = [
        hv.charge(board(tmp_path, store), to=3.0, engine="spice").time.value
        for store in ("22u IC=2", "22u")
    ]
    assert times == pytest.approx([0.41799, 0.66731], rel=2e-3)


def test_a_series_resistance_of_a_microohm(tmp_path):
    """Its nodes' voltages round to more than ngspice's tolerance for the current between them: no step succeeded."""
    powers = [
        hv.Spice().run(board(tmp_path, diode=f"{HARD} RS={ohms}")).mean_power
        for ohms in ("1u", "20m")
    ]
    assert (
        abs(powers[0].value - powers[1].value)
        < sum(power.known_error95 for power in powers)
        < 1e-3 * powers[0].value
    )


def test_diodes_without_capacitance(tmp_path):
    """ngspice bears them with a capacitance to ground, which is reported: runs of a minute and more replaced it."""
    answer = hv.Spice().run(board(tmp_path, diode="Is=1u N=1.05 Rs=2 Bv=40"))
    known = hv.Spice().run(board(tmp_path)).mean_power
    assert any(one.code == "shunted_response" for one in answer.warnings)
    assert answer.details["response_periods"] == 1
    assert answer.mean_power.known_error95 < 2e-4 * known.value
    # which has 20 pF a diode
    assert abs(answer.mean_power.value - known.value) < 3e-4 * known.value
