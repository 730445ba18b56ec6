"""Single points of a data sheet: a device that is solved for from them gives them again, by the engines."""

import json
import math

import numpy as np
import pytest

import harvester as hv
from harvester.devices.device import scene_tables
from harvester.devices.scene_file import text
from harvester.linear.single_points import LinearDevice, read_point, solve
from harvester.presentation.diagnostic import note

G = 9.80665
SHEET = {"frequency": 60.0, "capacitance": 30e-9, "mass": 4e-3, "q": 60.0}
VOLTS, WATTS = "15 V at 0.25 g", "0.3 mW at 100 kohm and 0.25 g"


def engine_says(values, resistance):
    """The largest mean power and voltage amplitude that engine exact finds over the frequency, at 0.25 g."""
    every = {**SHEET, **values}
    texts = {name: f"{value:.12g}" for name, value in every.items()}
    best = 0.0, 0.0
    for hertz in np.linspace(59.0, 63.0, 401):
        shaken = {"acceleration_amplitude": "0.25 g", "drive_frequency": f"{hertz}"}
        shaken["resistance"] = f"{resistance}"
        scene = hv.loads(text(scene_tables({**texts, **shaken})))
        answer = hv.run(scene, engine="exact")
        volts = math.sqrt(2.0 * answer.mean_square_voltage.value)
        best = max(best[0], answer.mean_power.value), max(best[1], volts)
    return best


def test_a_voltage_without_load_gives_the_coupling():
    found = solve(SHEET, {"open_circuit_voltage": VOLTS})
    assert not found.ambiguous and set(found.values) == {"coupling"}
    assert engine_says(found.values, 1e12)[1] == pytest.approx(15.0, rel=1e-3)


def test_voltage_and_power_give_coupling_and_damping():
    sheet = {name: value for name, value in SHEET.items() if name != "q"}
    found = solve(sheet, {"open_circuit_voltage": VOLTS, "power_at_load": WATTS})
    assert set(found.values) == {"coupling", "q"}
    assert engine_says(found.values, 1e12)[1] == pytest.approx(15.0, rel=1e-3)
    assert engine_says(found.values, 1e5)[0] == pytest.approx(0.3e-3, rel=1e-3)


@pytest.mark.parametrize("name", ["coupling", "q", "mass"])
def test_a_device_is_found_again_from_its_own_points(name):
    truth = {**SHEET, "coupling": 6e-4}
    device = LinearDevice(4e-3, 2.0 * math.pi * 60.0, 60.0, 30e-9, 6e-4)
    points = {"power_at_load": f"{device.power(1e5, 0.25 * G)!r} W at 100k and 0.25 g"}
    sheet = {key: value for key, value in truth.items() if key != name}
    assert solve(sheet, points).values[name] == pytest.approx(truth[name], rel=1e-6)


def test_rms_and_peak_to_peak_are_read():
    peak = read_point("open_circuit_voltage", "10 V at 0.1 g")
    for written in (
        "10 V peak at 0.1 g",
        "20 Vpp at 0.1 g",
        "20 V p-p at 0.1g",
        "7.0710678 V rms at 0.1 g",
    ):
        again = read_point("open_circuit_voltage", written)
        assert again.value == pytest.approx(peak.value, rel=1e-7)
    assert read_point("open_circuit_voltage", "10 V at 0.1 g rms").acceleration == pytest.approx(
        0.1 * math.sqrt(2.0) * G
    )


@pytest.mark.parametrize(
    ("sheet", "points", "said"),
    [
        (SHEET, {"open_circuit_voltage": "21 V"}, "VOLTAGE at ACCELERATION"),
        (SHEET, {"open_circuit_voltage": "21 A at 1 g"}, "a voltage"),
        (SHEET, {"open_circuit_voltage": "0 V at 1 g"}, "above 0"),
        (SHEET, {"open_circuit_voltage": "9 kV at 0.1 g"}, "no `coupling`.*gives"),
        (
            SHEET,
            {"open_circuit_voltage": VOLTS, "power_at_load": WATTS},
            "left out are `coupling`: leave one out",
        ),
        (SHEET | {"coupling": 1e-3}, {"open_circuit_voltage": VOLTS}, "left out are none: leave"),
        ({"capacitance": 3e-8}, {"open_circuit_voltage": VOLTS}, "`frequency` must be given"),
        (
            {"frequency": 60.0, "capacitance": 3e-8, "mass": 4e-3},
            {"power_at_load": WATTS},
            "left out are `coupling` and `q`: give one more, or another point",
        ),
    ],
)
def test_points_that_cannot_be(sheet, points, said):
    with pytest.raises(hv.InputError, match=said.replace("`", ".")):
        solve(sheet, points)


def test_the_command_writes_the_scene(harvester, tmp_path):
    path = tmp_path / "sheet.toml"
    args = ["--mass", "4 g", "--frequency", "60 Hz", "--q", "60", "--capacitance", "30 nF"]
    status, out, err = harvester("new", path, *args, "--open-circuit-voltage", VOLTS, "--json")
    assert (status, err) == (0, "")
    words = json.loads(out)["words"]
    assert any(word.startswith("coupling: 437.") and "N/V" in word for word in words), words
    expected = solve(SHEET, {"open_circuit_voltage": VOLTS}).values["coupling"]
    assert hv.load(path).piezo.coupling == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("prior", "quality"), [(None, 31.25), ("film", 55.56)])
def test_a_voltage_alone_takes_the_damping_from_the_prior(harvester, tmp_path, prior, quality):
    path = tmp_path / "sheet.toml"
    args = ["--mass", "4 g", "--frequency", "60 Hz", "--capacitance", "30 nF"]
    args += [] if prior is None else ["--prior", prior]
    status, out, err = harvester("new", path, *args, "--open-circuit-voltage", VOLTS, "--json")
    assert (status, err) == (0, "")
    words = json.loads(out)["words"]
    assert any("its prior is a quality factor of" in word and "50 %" in word for word in words), (
        words
    )
    scene = hv.load(path)
    assert 0.5 / scene.oscillator.damping_ratio == pytest.approx(quality, rel=1e-3)
    expected = solve(SHEET | {"q": quality}, {"open_circuit_voltage": VOLTS}).values["coupling"]
    assert scene.piezo.coupling == pytest.approx(expected, rel=2e-3)


def test_a_resonance_pair_and_a_voltage_give_the_mass(harvester, tmp_path):
    """The pair gives theta^2/(K Cp), so that the voltage replaces the mass."""
    truth = LinearDevice(4e-3, 2.0 * math.pi * 60.0, 60.0, 30e-9, 6e-4)
    pair = 60.0 * math.sqrt(1.0 + truth.beta)
    path = tmp_path / "sheet.toml"
    args = ["--frequency", "60 Hz", "--open-circuit-frequency", f"{pair!r}", "--q", "60"]
    volts = f"{truth.open_voltage(0.25 * G)!r} V at 0.25 g"
    status, _, err = harvester(
        "new", path, *args, "--capacitance", "30 nF", "--open-circuit-voltage", volts
    )
    assert (status, err) == (0, "")
    scene = hv.load(path)
    assert scene.oscillator.mass == pytest.approx(4e-3, rel=1e-5)
    assert scene.piezo.coupling == pytest.approx(6e-4, rel=1e-5)


def test_the_prior_leaves_coupling_and_mass_open(harvester, tmp_path):
    args = ["--frequency", "60 Hz", "--capacitance", "30 nF", "--open-circuit-voltage", VOLTS]
    status, _, err = harvester("new", tmp_path / "sheet.toml", *args)
    assert status == 2 and err.count("\n") == 1
    assert "left out are --coupling and --mass: give one more, or another point" in err


def test_a_prior_without_a_point_is_refused(harvester, tmp_path):
    args = ["--mass", "4 g", "--frequency", "60 Hz", "--capacitance", "30 nF", "--coupling", "1e-3"]
    status, _, err = harvester("new", tmp_path / "sheet.toml", *args, "--prior", "bulk")
    assert status == 2 and err.count("\n") == 1
    assert "--prior must be used with --open-circuit-voltage or --power-at-load" in err


def test_one_verdict_on_the_coupling():
    """Two numbers that three digits do not distinguish have more, and a single line states how strong it is."""
    said = str(note("coupling", "coupling", how="medium", merit=2.0172, strong_from=2.0178))
    assert said.startswith("medium, k^2 Q = 2.017 (strong from 2.018)")
    assert "strong" not in str(note("coupling_explained", share=0.4))
    best = {"power": 1e-3, "ohm": 1e5, "low": 5e4, "high": 2e5, "near": 0.95, "at_end": False}
    for share, words in ((0.9, "near the best"), (0.897, "near the best"), (0.89, "far from")):
        said = str(note("own_load", resistance=1e5, share=share, nearly=0.9, **best))
        assert said.startswith(words), said


def test_new_of_a_stiffness_and_a_mass_knows_the_frequency():
    from harvester.devices.device import known_values

    known = known_values({"mass": "4 g", "stiffness": "568.49 N/m", "damping_ratio": "0.01"})
    assert known["frequency"] == pytest.approx(60.0, rel=1e-4) and known["q"] == 50.0
