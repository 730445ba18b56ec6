"""Lines of a deck that name the piezo's own model, which no board has; and sections of libraries."""

from pathlib import Path

import pytest

from harvester.errors import InputError
from harvester.netlists.adoption import adopt

DIODE = ".model DP D(Is=2u N=1.06 Rs=4 Cjo=40p Bv=30)\n"
BRIDGE = "D1 A P DP\nD2 B P DP\nD3 0 A DP\nD4 0 B DP\n"
LOAD = "Cs P 0 40n\nRL P 0 250k\n"
PIEZO = "t\nVp 1 B SIN(0 8 61)\nCp 1 A 33n\n"
SPRING = "t\nVp 1 B SIN(0 8 61)\nL1 1 2 1\nR1 2 A 1k\nC1 A B 33n\n"


def adopted(folder, more, piezo=PIEZO):
    path = folder / "deck.cir"
    path.write_text(f"{piezo}{BRIDGE}{LOAD}{DIODE}{more}\n.tran 1m 1\n.end\n")
    return adopt(path)


@pytest.mark.parametrize(
    ("more", "count"),
    [
        ("Bw w 0 V=v(1,B)*i(Vp)", 1),
        ("Bw w 0 V=v(1,B)\nRw w 0 1k", 2),
        ("Ew w 0 1 B 1\nRw w 0 1k", 2),
        ("Fw w 0 Vp 1\nRw w 0 1k\nBy y 0 V=v(w)^2", 3),
        ("Bw w 0 V=v(P)", 0),
    ],
)
def test_measurements_of_the_piezo_s_own_model_are_left_out(tmp_path, more, count):
    """These were refused, or kept at a net that nothing is connected to."""
    adoption = adopted(tmp_path, more)
    assert set(adoption.terminals) == {"A", "B"}
    told = [remark.code for remark in adoption.diagnostics]
    assert told.count("deck_measurement") == count
    assert all((line in adoption.text) == (count == 0) for line in more.split("\n"))


@pytest.mark.parametrize(
    "more",
    [
        "Bl P 0 I=1u*v(1,B)",
        "S1 P m 1 B sw\nRm m 0 1k\n.model sw sw(vt=0.5 ron=1 roff=1meg)",
        "Bw w 0 V=v(1,B)\nGl P 0 w 0 1u",
    ],
)
def test_what_acts_on_the_board_by_the_piezo_s_own_model_is_refused(tmp_path, more):
    with pytest.raises(InputError, match=r"must not read .*: write it with the nets of the board"):
        adopted(tmp_path, more)


def test_a_coil_beside_the_spring_of_the_piezo_s_own_model_is_left_out(tmp_path):
    more = "L2 w 0 1\nRw w 0 1k\nK1 L1 L2 0.1\n.ic I(L1)=0 v(2)=0"
    text = adopted(tmp_path, more, SPRING).text
    assert all(line not in text for line in ("L2", "Rw", "K1", ".ic"))


def test_starting_values_of_the_piezo_s_own_model_are_left_out(tmp_path):
    adoption = adopted(tmp_path, ".ic v(1)=0 V(P)=1")
    told = {remark.code: remark for remark in adoption.diagnostics}
    assert told["deck_start"].numbers["text"] == "v(1)=0"
    assert told["deck_kept"].numbers["card"] == ".ic V(P)=1"
    assert ".ic V(P)=1" in adoption.text


@pytest.mark.parametrize(
    ("card", "left"),
    [
        (".ic v(1)=0 v(P) = max(1,2)", ".ic v(P) = max(1,2)"),
        (".ic v(1) = max(1,max(0,2)), V(A,B)=3", ".ic V(A,B)=3"),
        (".IC V(P)=pwr(2,1) , v(1)=pwr(2, 1),", ".IC V(P)=pwr(2,1)"),
        (".ic v(A)={f(1,2)}, v(1)={f(1, 2)}, v(B)='1+2'", ".ic v(A)={f(1,2)}, v(B)='1+2'"),
        (".ic v(1)=pwr(2,1)", None),
    ],
)
def test_a_shortened_starting_card_keeps_its_other_values_as_they_are(tmp_path, card, left):
    """It was cut inside of functions, and lost values between two nets."""
    lines = adopted(tmp_path, card).text.split("\n")
    assert [line for line in lines if line.lower().startswith(".ic")] == [left] * (left is not None)


@pytest.mark.parametrize("more", ["", "\n.lib C:\\other\\standard.dio"])
def test_a_section_of_a_library_has_its_models(tmp_path, more):
    """Its BAT54 was mistaken for the package's, with a warning."""
    (tmp_path / "own.lib").write_text(
        f"* sections\n.lib typical\n{DIODE.replace('DP', 'BAT54')}.endl\n.lib other\n.param x=1\n.endl\n"
    )
    path = tmp_path / "deck.cir"
    bridge = BRIDGE.replace("DP", "BAT54")
    for section in ("typical", "other"):
        path.write_text(f"{PIEZO}{bridge}{LOAD}.lib own.lib {section}{more}\n.end\n")
        told = {remark.code for remark in adopt(path).diagnostics}
        assert ("deck_own_model" in told) == (section == "other")
    path.write_text(f"{PIEZO}{bridge}{LOAD}.lib own.lib typicl{more}\n.end\n")
    with pytest.raises(
        InputError,
        match=r"section of own\.lib in netlist deck\.cir line 10 .*did you mean 'typical'",
    ):
        adopt(path)


def test_a_library_is_found_if_the_deck_has_a_relative_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.lib").write_text(DIODE)
    (tmp_path / "deck.cir").write_text(f"{PIEZO}{BRIDGE}{LOAD}.lib C:\\x\\own.lib\n.end\n")
    assert ".include own.lib" in adopt(Path("deck.cir")).text


INTEGRATOR = "t\nIp 0 P SIN(0 1m 61)\nCp P 0 40n\nBw 0 acc I=i(Ip)*v(P)\n{more}Rw acc 0 1G\n.end\n"


@pytest.mark.parametrize(
    ("more", "load", "store"),
    [
        ("RL P 0 100k\nCw acc 0 1\n", "RL", None),
        ("D1 P O DP\nR1 O 0 100k\nCout O 0 10u\nCs acc 0 1\n", "R1", "Cout"),
        ("D1 P O DP\nR1 O 0 100k\nR2 O P 1G\nCout O 0 10u\nCw acc 0 1\n", "R1", "Cout"),
    ],
)
def test_load_and_store_are_elements_of_the_board_not_of_a_measurement(tmp_path, more, load, store):
    """The integrator's capacitor was the storage capacitor, and its resistor the load."""
    path = tmp_path / "deck.cir"
    path.write_text(INTEGRATOR.format(more=more + DIODE))
    adoption = adopt(path)
    assert (adoption.resistor, adoption.store) == (load, store)
    assert "acc" not in adoption.text
    assert adopt(path, load=load).resistor == load
    with pytest.raises(InputError, match=r"line 4 must not read ip, a part of the piezo's own"):
        adopt(path, load="Rw")


CHIP = ".subckt chip a b\nS1 a b sense 0 sw\n.ends\n.model sw sw(vt=0.1 ron=1 roff=1g)\n"


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (".global sense\nBs sense 0 V=v(1)\n", r"line 12 must not read 1, a part of the piezo's"),
        (
            ".global 1\n",
            r"`\.global` must name nets of the board, but 1 is a part of the piezo's own",
        ),
    ],
)
def test_a_global_net_is_read_by_subcircuits(tmp_path, more, why):
    """Its source was left out as a measurement, and nothing drove the chip's switch."""
    with pytest.raises(InputError, match=why):
        adopted(tmp_path, f"{more}X1 P m chip\nRm m 0 1k\n{CHIP}")
    assert "deck_measurement" not in str(adopted(tmp_path, f".global P 0\n{CHIP}").diagnostics)


@pytest.mark.parametrize("place", ["deck", "library"])
def test_a_global_net_of_a_library_is_read_by_subcircuits(tmp_path, place):
    """The card was looked for in the deck alone, and the source was left out as a measurement."""
    shared = ".global sense\n"
    (tmp_path / "chip.lib").write_text(CHIP + shared * (place == "library"))
    card = ".include chip.lib\n" + shared * (place == "deck")
    with pytest.raises(InputError, match="must not read 1, a part of the piezo's own model"):
        adopted(tmp_path, f"{card}Bs sense 0 V=v(1)\nX1 P m chip\nRm m 0 1k\n")


@pytest.mark.parametrize(
    ("inner", "net"),
    [
        ("Es sense 0 1 b 1\n", "sense"),
        ("Xs 1 inner\n.ends\n.subckt inner a\nEs sense 0 a 0 1\n", "sense"),
        ("", "1"),
    ],
)
def test_a_global_net_inside_of_the_piezo_s_subcircuit_is_refused(tmp_path, inner, net):
    """The subcircuit was left out, and nothing drove the chip's switch."""
    piezo = f".subckt pz a b\nVp 1 b SIN(0 8 61)\nCp 1 a 33n\n{inner}.ends\nXpz A B pz\n"
    chip = f"{CHIP.replace('sense', net)}X1 P m chip\nRm m 0 1k\n"
    why = rf"`\.global` must name nets of the board, but {net} is a part of the piezo's own"
    with pytest.raises(InputError, match=why):
        adopted(tmp_path, f".global {net}\n{chip}", f"t\n{piezo}")
    text = adopted(tmp_path, f".global a P 0\n{chip}", f"t\n{piezo}").text
    assert "Xpz" not in text


def test_a_load_that_a_measurement_acts_on_is_refused(tmp_path):
    """The converter passes no current from the electrodes to the load."""
    path = tmp_path / "deck.cir"
    path.write_text(
        "t\nIp 0 P SIN(0 1m 61)\nCp P 0 40n\nEc O 0 P 0 1\nRL O 0 1k\nBw O 0 I=i(Ip)\n.end\n"
    )
    with pytest.raises(InputError, match=r"line 6 must not read ip, a part of the piezo's own"):
        adopt(path)


@pytest.mark.parametrize("name", ["RL", "R_load"])
def test_a_measured_load_is_not_replaced_by_another_resistor(tmp_path, name):
    """The resistor in series with the rectifier became the load."""
    path = tmp_path / "deck.cir"
    path.write_text(
        "t\nIp 0 P SIN(0 1m 61)\nCp P 0 40n\nRs P q 100\nD1 q 0 DP\nEc O 0 q 0 1\n"
        f"{name} O 0 1k\nBw O 0 I=i(Ip)\n{DIODE}.end\n"
    )
    with pytest.raises(InputError, match=r"line 8 must not read ip, a part of the piezo's own"):
        adopt(path)
    assert adopt(path, load="Rs").resistor == "Rs"


def test_a_measured_store_is_not_left_out(tmp_path):
    """The board had no storage capacitor."""
    path = tmp_path / "deck.cir"
    path.write_text(
        "t\nIp 0 P SIN(0 1m 61)\nCp P 0 40n\nRs P q 100\nD1 q 0 DP\nEc O 0 q 0 1\n"
        f"Cs O 0 1u\nRout O 0 1k\nBw O 0 I=i(Ip)\n{DIODE}.end\n"
    )
    with pytest.raises(InputError, match=r"line 9 must not read ip, a part of the piezo's own"):
        adopt(path)


@pytest.mark.parametrize(
    ("filtered", "remedy"),
    [
        ("Rm m q 1k\nCs q 0 1n\n", None),
        ("Cs m 0 1n\nRm m 0 1k\n", "or rename Cs if it only measures"),
        ("RL m 0 1k\n", "or name the load by `load` if RL only measures"),
    ],
)
def test_a_filter_of_a_measurement_is_no_store(tmp_path, filtered, remedy):
    """Its capacitor was refused because of its name, and no remedy worked."""
    path = tmp_path / "deck.cir"
    deck = "t\nIp 0 P SIN(0 1m 61)\nCp P 0 33n\nR1 P 0 100k\nBm m 0 V=i(Ip)\n"
    path.write_text(f"{deck}{filtered}.end\n")
    if remedy is not None:
        with pytest.raises(InputError, match=remedy):
            adopt(path)
    path.write_text(f"{deck}{filtered.replace('Cs', 'Cw')}.end\n")
    adoption = adopt(path, load="R1")
    assert (adoption.resistor, adoption.store) == ("R1", None)
    if remedy is None:
        path.write_text(f"{deck}{filtered}.end\n")
        assert adopt(path).store is None


def test_starting_values_of_a_subcircuit_stay(tmp_path):
    """Its net 1 was mistaken for the net 1 of the piezo's own model."""
    chip = ".subckt ch a b\nC5 a 1 1u\nR5 1 b 1k\n.ic v(1)=2\n.ends\nX1 P 0 ch\n"
    adoption = adopted(tmp_path, chip)
    assert chip in adoption.text
    assert "deck_start" not in {remark.code for remark in adoption.diagnostics}


BOARD = "D1 P O DP\nRL O 0 100k\nCout O 0 10u\n" + DIODE


@pytest.mark.parametrize(
    ("model", "why", "helps"),
    [
        ("V1 v 0 SIN(0 1 61)\nR1 v P 1k\nE1 m 0 v 0 1\nRm m 0 1k\n", "R1 is in series", True),
        ("V1 v 0 SIN(0 1 61)\nVa v P 0\n", "Va is in series with V1: give", True),
        ("V1 v 0 SIN(0 1 61)\nVa v w 0\nCp w P 33n\n", "Va is in series with V1: give", True),
        ("V1 v 0 SIN(0 1 61)\nVb v P 2\n", "the source Vb is in series with V1: write", False),
        (
            "V1 v 0 SIN(0 1 61)\nL1 v 1 1\nR1 1 2 1\nEx 2 0 P 0 1m\nFp 0 P Ex 1m\nCp P 0 33n\n",
            "the source Ex is in series with V1: write",
            False,
        ),
    ],
)
def test_a_part_in_series_with_the_source_is_refused(tmp_path, model, why, helps):
    """They stayed on the board: the part in series, or a whole transducer with its own capacitor."""
    path = tmp_path / "deck.cir"
    path.write_text(f"t\n{model}{BOARD}.end\n")
    with pytest.raises(InputError, match=why):
        adopt(path)
    if helps:
        text = adopt(path, ("P", "0")).text
        assert text.split("\n")[1:] == [*BOARD.split("\n")[:-1], ".end", ""]


@pytest.mark.parametrize("place", ["0 1 2 3 4", "1 0 2 3 4", "1 2 3 4 0"])
def test_a_motional_branch_may_have_an_ammeter(tmp_path, place):
    """It ended at the ammeter: mass, spring, damper and capacitor were of the board."""
    values = ["Va {} {} 0", "Vp {} {} SIN(0 1 61)", "L1 {} {} 1", "C1 {} {} 1u", "R1 {} {} 10"]
    chain = [values[int(k)] for k in place.split()]
    nets = ["0", "1", "2", "3", "4", "P"]
    lines = [line.format(nets[k], nets[k + 1]) for k, line in enumerate(chain)]
    path = tmp_path / "deck.cir"
    path.write_text("\n".join(["t", *lines, f"Cp P 0 33n\nBw w 0 V=i(Va)\n{BOARD}.end\n"]))
    adoption = adopt(path)
    assert (adoption.terminals, adoption.capacitance) == (("P", "0"), "33n")
    assert adoption.text.split("\n")[1:] == [*BOARD.split("\n")[:-1], ".end", ""]


def test_a_motional_branch_with_a_probe_is_refused(tmp_path):
    """It ended at the probe: spring, damper and capacitor were of the board."""
    model = "V1 v 0 SIN(0 1 61)\nL1 v m 1\nC1 m 2 1u\nR1 2 P 10\nCp P 0 33n\n"
    path = tmp_path / "deck.cir"
    path.write_text(f"t\n{model}Rm m 0 1g\n{BOARD}.end\n")
    with pytest.raises(
        InputError, match="but C1, Rm are at the end of L1: leave out those that only measure"
    ):
        adopt(path)
    path.write_text(f"t\n{model}{BOARD}.end\n")
    assert adopt(path).terminals == ("P", "0")


@pytest.mark.parametrize(
    ("probe", "name"),
    [
        ("Rm 1 0 1g\n", "Rm"),
        ("Xo 1 m m op\n.subckt op a b c\nE1 c 0 a b 1k\n.ends\n", "Xo"),
        ("Rm 1 0 10\nVm 1 q 0\nRq q 0 1meg\n", "Rm, Vm"),
    ],
)
def test_a_probe_between_the_source_and_its_capacitor_is_refused(tmp_path, probe, name):
    """The capacitor stayed on the board, in series with the scene's device."""
    path = tmp_path / "deck.cir"
    deck = f"t\nVp 1 0 SIN(0 8 61)\nCp 1 P 33n\nDb 0 P DP\n{BOARD}"
    path.write_text(f"{deck}{probe}.end\n")
    why = rf"nothing else between Vp and the piezo's capacitor Cp, but {name} are there: leave out"
    with pytest.raises(InputError, match=why):
        adopt(path)
    assert "Cp 1 P 33n" in adopt(path, ("1", "0")).text
    path.write_text(f"{deck}.end\n")
    adoption = adopt(path)
    assert (adoption.terminals, adoption.capacitance) == (("P", "0"), "33n")


def test_a_part_between_the_current_source_and_its_capacitor_is_refused(tmp_path):
    """The capacitor stayed on the board, and counted twice."""
    path = tmp_path / "deck.cir"
    path.write_text(f"t\nIp 0 x SIN(0 1m 61)\nR1 x P 10\nCp P 0 33n\n{BOARD}.end\n")
    with pytest.raises(InputError, match="R1 is between Ip and Cp: leave out R1"):
        adopt(path)
    path.write_text(f"t\nIp 0 P SIN(0 1m 61)\nCp P 0 33n\n{BOARD}.end\n")
    assert adopt(path).capacitance == "33n"
