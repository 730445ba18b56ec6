"""Parts of a deck at the piezo's source, which may be of its own model."""

import pytest

from harvester.errors import InputError
from harvester.netlists.adoption import adopt

DIODE = ".model DP D(Is=2u N=1.06 Rs=4 Cjo=40p Bv=30)\n"
BOARD = "D1 P O DP\nRL O 0 100k\nCout O 0 10u\n" + DIODE


@pytest.mark.parametrize(
    ("model", "names"),
    [
        ("I1 0 x SIN(0 1m 61)\nVm x y 0\nR1 y P 10\nCp P 0 33n\n", "Vm, R1 are"),
        ("I1 0 x SIN(0 1m 61)\nR1 x P 10\nCp P y 33n\nVm y 0 0\n", "R1 is"),
        ("I1 0 x SIN(0 1m 61)\nR1 x y 10\nVm y P 0\nCp P 0 33n\n", "R1, Vm are"),
        ("I1 0 x SIN(0 1m 61)\nRp x 0 10meg\nR1 x P 10\nCp P 0 33n\n", "R1 is"),
        ("I1 y x SIN(0 1m 61)\nR1 x P 10\nR2 y 0 10\nCp P 0 33n\n", "R2, R1 are"),
    ],
)
def test_meters_and_leaks_do_not_hide_the_capacitor_of_a_current_source(tmp_path, model, names):
    """The capacitor stayed on the board, counted twice and without a remark."""
    path = tmp_path / "deck.cir"
    path.write_text(f"t\n{model}{BOARD}.end\n")
    with pytest.raises(InputError, match=f"{names} between I1 and Cp: leave out"):
        adopt(path)


@pytest.mark.parametrize("part", ["Vm a b 0", "Rs a b 10"])
def test_a_probe_before_a_part_in_series_with_the_capacitor_is_refused(tmp_path, part):
    """The capacitor stayed on the board, counted twice and without a remark."""
    path = tmp_path / "deck.cir"
    path.write_text(f"t\nV1 a 0 SIN(0 8 61)\nRpr a 0 1g\n{part}\nCp b P 33n\n{BOARD}.end\n")
    with pytest.raises(InputError, match=f"capacitor Cp, but Rpr, {part[:2]} are there"):
        adopt(path)


@pytest.mark.parametrize(
    "board",
    [
        "RL P 0 100k\nRs P q 10\nCs q 0 1u\n",
        "RL P 0 2meg\nRs P q 10\nCs q 0 1u\nD1 P q DP\n" + DIODE,
    ],
)
@pytest.mark.parametrize("drive", ["V1", "I1"])
def test_a_board_of_resistors_and_a_capacitor_is_kept(tmp_path, board, drive):
    path = tmp_path / "deck.cir"
    path.write_text(f"t\n{drive} P 0 SIN(0 1m 61)\n{board}.end\n")
    assert board in adopt(path).text


def test_a_pulse_of_a_load_is_not_the_piezo_beside_a_sine(tmp_path):
    """The load's current source was mistaken for the piezo, with the storage capacitor as its
    capacitor."""
    path = tmp_path / "deck.cir"
    pulse = "Iload O 0 PULSE(0 1m 0 1u 1u 8m 160m)\n"
    path.write_text(f"t\nV1 P 0 SIN(0 8 61)\n{pulse}{BOARD}.end\n")
    with pytest.raises(InputError, match=r"several may be it \(Iload at O,0; V1 at P,0\): give"):
        adopt(path)
    adoption = adopt(path, ("P", "0"))
    assert (adoption.store, adoption.capacitance) == ("Cout", "")
    assert pulse in adoption.text


@pytest.mark.parametrize("chain", ["Rs a b 10\nCp b P 33n", "Cp a b 33n\nRs b P 10"])
def test_the_capacitor_behind_a_resistor_is_the_piezo_s(tmp_path, chain):
    """It was left out as the spring of a motional branch, and no capacitance was printed."""
    path = tmp_path / "deck.cir"
    path.write_text(f"t\nV1 a 0 SIN(0 8 61)\n{chain}\n{BOARD}.end\n")
    adoption = adopt(path, ("P", "0"))
    assert adoption.capacitance == "33n"
    assert adoption.text.split("\n")[1:] == [*BOARD.split("\n")[:-1], ".end", ""]
