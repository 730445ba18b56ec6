"""Elements of a custom netlist are keys of the optimiser, also for a board from KiCad."""

from dataclasses import replace

import pytest
from scipy.optimize import minimize_scalar

import harvester as hv
from tests.support.netlists import PLATE

BOARD = ".title KiCad schematic\nR1 /P /A 10k\nR7 /A /N 1Meg\nR9 /P /N 10Meg\n.end\n"
DRIVEN = replace(
    PLATE,
    oscillator=hv.Oscillator(mass="40 g", stiffness=16.0, damping=0.05),
    excitation=hv.Excitation(acceleration_amplitude="0.02 g", frequency="3.4 Hz"),
)


def power(load):
    """The power of R7 in closed form (W): the part of the piezo's voltage that reaches R7."""
    series = 1e4 + load
    answer = hv.Exact().run(DRIVEN.with_load(resistance=1.0 / (1.0 / series + 1e-7)))
    return answer.mean_square_voltage.value * load / series**2


@pytest.mark.ngspice
@pytest.mark.thorough("test_every_element_is_a_key")
def test_the_best_element_of_a_board_is_that_of_the_closed_form(tmp_path):
    """By periodic responses, without trajectories: in seconds where hundreds of them needed minutes."""
    (tmp_path / "board.cir").write_text(BOARD)
    load = hv.Load(netlist=str(tmp_path / "board.cir"), terminals=["/P", "/N"], resistor="R7")
    ranges = {"load.parameters.R7": ("10 kohm", "10 Mohm")}
    found = hv.optimise(replace(DRIVEN, load=load), vary=ranges, engine="compiled", budget="10min")
    assert all(one.power.stderr is None for one in found.points)
    (key,) = found.keys
    best = minimize_scalar(lambda ohm: -power(ohm), bounds=(1e4, 1e7), options={"xatol": 1.0})
    assert found.estimate.mean_power.value == pytest.approx(-best.fun, rel=2e-3)
    assert (
        key.key == "load.parameters.R7"
        and 0.99 * key.low95 < best.x < 1.01 * key.high95 < 1.02 * key.low95
    )
