"""Charging by the rectifier's mean current, next to direct runs of mass and circuit.

Kept of ngspice 39.3 alone, 23 November 2026, `python benchmarks/slow_circuits.py` on the scene
below for 14.5 s, with steps of 40 us and reltol 1e-5: 20 V after 13.3077 s and 10 V after 5.7299 s.
"""

import pytest

import harvester as hv
from harvester.presentation.diagnostic import has
from tests.support.paths import EXAMPLES
from tests.support.systems import TWO_MODES

TO_20_V, NGSPICE_CHANGES = 13.3077, 0.01


def bimorph(amplitude="1 g", **load):
    return hv.Scene(
        oscillator=hv.Oscillator(mass="16.542 g", stiffness=1364.1, damping_ratio=0.027),
        piezo=hv.Piezo(coupling=2.5261e-3, capacitance="41.259 nF"),
        excitation=hv.Excitation(frequency=46.0, acceleration_amplitude=amplitude),
        load=hv.Netlist("bridge", **load),
    )


@pytest.mark.slow
def test_a_large_store_takes_what_it_takes_in_ngspice():
    found = hv.charge(bimorph(R="10 Mohm", C="470 uF"), to="20 V")
    assert found.engine == "slow"
    assert abs(found.time.value - TO_20_V) < found.time.error95 + NGSPICE_CHANGES
    assert found.time.error95 < 0.01 * TO_20_V


@pytest.mark.ngspice
def test_two_modes_take_what_they_take_in_ngspice():
    """The path that charges the held capacitor continues from the coordinates of both modes."""
    scene = hv.loads(TWO_MODES).with_load(netlist="bridge", parameters={"R": 1e6, "C": 2e-5})
    slow, direct = (hv.charge(scene, to="3 V", engine=name).time for name in ("slow", "spice"))
    assert abs(slow.value - direct.value) < slow.error95 + direct.error95
    assert slow.error95 < 0.1 * direct.value


@pytest.mark.slow
def test_a_farad_takes_its_charge_over_the_current():
    """The mean current between 0 and 3.3 V is that into 1/1000 of the capacitance: a thousand times the time."""
    large = hv.charge(bimorph("0.15 g", R="1 Gohm", C=1.0), to="3.3 V")
    small = hv.charge(bimorph("0.15 g", R="1 Gohm", C="1 mF"), to="3.3 V", engine="slow")
    assert large.time.value == pytest.approx(1e3 * small.time.value, rel=0.01)
    assert large.reached == 1.0 and large.time.value > 3e4


@pytest.mark.thorough("test_a_large_store_takes_what_it_takes_in_ngspice")
def test_where_time_scales_are_not_apart_both_run_together():
    scene = hv.load(EXAMPLES / "plate_bridge.toml").with_load(
        netlist="bridge", parameters={"R": 1e9, "C": 1e-4}
    )
    found = hv.charge(scene, to="1 V", trajectories=128)
    assert found.engine == "ideal" and has(found.notes, "charge_not_slow")
    slow = hv.charge(scene, to="1 V", engine="slow", trajectories=512)
    assert has(slow.warnings, "charge_not_slow")
    assert slow.time.value == pytest.approx(found.time.value, rel=0.15)


def test_what_it_cannot_charge_it_refuses():
    with pytest.raises(hv.HarvesterError):
        hv.charge(EXAMPLES / "plate_recorded.toml", to="1 V", engine="slow")


@pytest.mark.thorough("test_a_large_store_takes_what_it_takes_in_ngspice")
@pytest.mark.slow
@pytest.mark.ngspice
def test_a_circuit_with_transistors():
    """It is there before transients have decayed, which is reported, and the time holds the answer of ngspice."""
    scene = EXAMPLES / "bimorph_self_powered_sshi.toml"
    found, judge = (hv.charge(scene, to="1 V", engine=name) for name in ("slow", "spice"))
    assert has(found.warnings, "charge_not_slow")
    assert abs(found.time.value - judge.time.value) < found.time.known_error95 + judge.time.error95


# When the storage capacitor of a chip's netlist has 4.9 V (LTC3588) or 2.9 V (BQ25570), by ngspice
# in lock-step, with its total error (s), `charge --engine spice` on 25 November 2026.
CHIPS = [
    ("ltc3588", "0.15 g", "10 uF", 0.70536, 0.0003),
    ("ltc3588", "0.3 g", "10 uF", 0.32484, 0.0002),
    ("ltc3588", "0.15 g", "47 uF", 3.07577, 0.0008),
    ("bq25570", "0.1 g", "2.2 uF", 1.8383, 0.0557),
    ("bq25570", "0.07 g", "2.2 uF", 2.6192, 0.0037),
]


@pytest.mark.parametrize("chip, acceleration, store, seconds, error", CHIPS)
def test_a_chip_charges_its_store_as_in_ngspice(chip, acceleration, store, seconds, error):
    """What taking the time scales apart does is measured: the error is whole, and holds the answer of ngspice."""
    scene = hv.load(EXAMPLES / f"bimorph_{chip}.toml").vary(
        "excitation.acceleration_amplitude", acceleration
    )
    scene = scene.vary("load.parameters.C", store).vary("load.parameters.Cout", "10 uF")
    volts = 4.9 if chip == "ltc3588" else 2.9
    found = hv.charge(scene, to=volts, engine="slow", duration=2.0 * seconds)
    assert has(found.notes, "slow_charge_of_chip") and not found.time.unknown
    assert abs(found.time.value - seconds) < found.time.error95 + error
    assert found.time.error95 < 0.1 * seconds


CLAMPED = """* four diodes, and one across the rails
.model D1 D(Is=1u N=1.05 Rs=2 Cjo=20p)
D1 PZ1 OUT D1
D2 PZ2 OUT D1
D3 0 PZ1 D1
D4 0 PZ2 D1
D5 OUT 0 D1
C1 OUT 0 2.2u
R1 OUT 0 220k
.end
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "shaking",
    [
        {"acceleration_amplitude": "0.2 g", "frequency": "60 Hz"},
        {"acceleration_psd": "1e-3 g^2/Hz"},
    ],
)
def test_a_diode_across_the_rails_is_refused_before_anything_long(tmp_path, monkeypatch, shaking):
    """Under noise a step too long for the diode passed 3 V after 75 ms, and a drive took a minute and a half."""
    monkeypatch.setattr(
        "harvester.studies.charging.by_slow.measured", lambda *_: pytest.fail("a table is measured")
    )
    with pytest.raises(hv.SimulationError, match=r"does not reach 3 V: .* the board itself draws"):
        hv.charge(on_board(tmp_path, CLAMPED, shaking), to="3 V", engine="slow")


@pytest.mark.slow
def test_a_capacitor_that_loads_through_a_resistor_is_no_draw_of_the_board(tmp_path):
    """The storage capacitor was stated not to reach 3 V, which it does under a harmonic excitation
    as soon as the other one is full."""
    text = CLAMPED.replace("D5 OUT 0 D1", "R9 OUT X 1k\nC9 X 0 470u")
    scene = on_board(tmp_path, text, {"acceleration_psd": "1e-3 g^2/Hz"})
    with pytest.raises(hv.SimulationError, match=r"follows no capacitor .*, but c9 may still be"):
        hv.charge(scene, to="3 V", engine="slow")


def test_a_capacitor_that_takes_a_tenth_of_the_store_s_charge_is_refused_under_noise(tmp_path):
    """Loaded by less than the mass gives, it made 1.33 +- 0.25 s of 2.01 +- 0.14 s."""
    text = CLAMPED.replace("D5 OUT 0 D1", "R9 OUT X 20k\nC9 X 0 470u")
    scene = on_board(tmp_path, text, {"acceleration_psd": "1e-3 g^2/Hz"})
    with pytest.raises(hv.SimulationError, match=r"under noise, but the charge of c9 is up to"):
        hv.charge(scene, to="1 V", engine="slow")


@pytest.mark.parametrize(
    "shaking",
    [
        {"acceleration_amplitude": "0.2 g", "frequency": "60 Hz"},
        {"acceleration_psd": "1e-3 g^2/Hz"},
    ],
)
@pytest.mark.parametrize(
    "line, card", [("C1 OUT 0 2.2u ic=1.5", ""), ("C1 OUT 0 2.2u", ".ic v(OUT)=1.5")]
)
def test_a_store_that_starts_charged_is_refused(tmp_path, shaking, line, card):
    """Its charge was ignored: 2 V into 22 uF took 1.27 s, which engine compiled passes 0.45 s after 1.5 V."""
    text = CLAMPED.replace("D5 OUT 0 D1\nC1 OUT 0 2.2u", line).replace(".end\n", f"{card}\n.end\n")
    with pytest.raises(hv.HarvesterError, match="charges from 0 V, but the netlist gives csmooth"):
        hv.charge(on_board(tmp_path, text, shaking), to="2 V", engine="slow")


def on_board(folder, text, shaking):
    """A scene with a netlist of one's own."""
    (path := folder / "board.cir").write_text(text)
    return hv.Scene(
        oscillator=hv.Oscillator(mass="8 g", frequency="60 Hz", damping_ratio=0.012),
        piezo=hv.Piezo(coupling="1.5 mN/V", capacitance="47 nF"),
        excitation=hv.Excitation(**shaking),
        load=hv.Load(netlist=str(path), terminals=["PZ1", "PZ2"], resistor="R1", store="C1"),
    )
