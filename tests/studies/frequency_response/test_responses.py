"""Responses of circuits and of several values of a key: engines agree, phases, per g, maps, files, refusals."""

import csv
import json

import numpy as np
import pytest

import harvester as hv
from harvester.engines import Spice
from harvester.equations.coefficients import Equations
from harvester.errors import CannotServeError, CircuitError, InputError
from harvester.studies.frequency_response.curve import Failure, FrequencyResponse
from harvester.studies.frequency_response.engines import engines_of
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.frequency_response.response import draw, points_of, rows_of
from harvester.studies.frequency_response.responses import FrequencyResponses
from harvester.uncertainty.value import Value
from tests.support.bimorph import bimorph
from tests.support.systems import DRIVEN, TWO_MODES, changed, scene

pytestmark = pytest.mark.slow

BRIDGE = 'title = "Bimorph with a bridge"' + bimorph('R = "100 kohm", C = "0.3 uF"')
SWEEP = [44.0, 47.0, 50.0]


@pytest.mark.ngspice
def test_engines_agree_on_a_resistor():
    """Power, displacement and phases by ngspice and by trajectories are those of the closed form."""
    linear = hv.loads(BRIDGE).with_load(resistance=50e3)
    closed, sampled, spice = (
        hv.response(linear, SWEEP, engine=name) for name in ("exact", "ensemble", "spice")
    )
    assert spice.directions == ["from rest"] and sampled.directions == closed.directions == [
        "up",
        "down",
    ]
    for true, *found in zip(
        closed.sweep("up"), sampled.sweep("down"), spice.sweep("from rest"), strict=True
    ):
        for one, factor, degrees in zip(
            found, (1.2, 1.0), (0.3, 0.02), strict=True
        ):  # the step's own error
            for name in ("mean_power", "displacement_rms"):
                a, b = getattr(one, name), getattr(true, name)
                assert abs(a.value - b.value) < factor * a.known_error95 < 0.015 * b.value
            assert one.displacement_phase == pytest.approx(true.displacement_phase, abs=degrees)
            assert one.voltage_phase == pytest.approx(true.voltage_phase, abs=degrees)


@pytest.mark.thorough("test_engines_agree_on_a_resistor")
def test_phases_of_a_resonance():
    """The tip follows the base far below the resonance, is a quarter period off at it, and opposite to it far above.

    The base's acceleration is opposite to its displacement.
    """
    weak = hv.loads(BRIDGE.replace("2.5261e-3", "1e-9")).with_load(resistance=50e3)
    resonance = np.sqrt(1364.1 / 16.542e-3) / (2 * np.pi)
    low, at, high = (
        p.displacement_phase for p in hv.response(weak, [0.01, resonance, 1e4]).sweep("up")
    )
    assert (low, at, high) == (
        pytest.approx(180.0, abs=0.01),
        pytest.approx(90.0),
        pytest.approx(0.0, abs=0.02),
    )


@pytest.mark.thorough("test_engines_agree_on_a_resistor")
@pytest.mark.ngspice
def test_a_bridge_by_ngspice_and_by_ideal_diodes(tmp_path):
    """By ngspice a netlist has a response from rest, whose power is that of ideal diodes within 1 %; files and JSON."""
    found = draw(hv.loads(BRIDGE), "44Hz:50Hz:3", tmp_path, engines=["spice", "ideal"], per_g=True)
    spice, ideal = found.curves
    assert not ideal.hysteresis and not spice.failures
    for one, other in zip(spice.sweep("from rest"), ideal.sweep("up"), strict=True):
        assert one.mean_power.value == pytest.approx(other.mean_power.value, rel=0.01)
        assert one.displacement_rms.value == pytest.approx(other.displacement_rms.value, rel=0.01)
        assert one.voltage_phase == pytest.approx(other.voltage_phase, abs=1.5)
    with (tmp_path / "response.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["engine"] for row in rows] == 3 * ["spice"] + 6 * ["ideal"]
    power, volts = float(rows[0]["mean_power (W)"]), float(rows[0]["voltage_rms (V)"])
    assert float(rows[0]["mean_power_per_g2 (W/g^2)"]) == pytest.approx(16.0 * power)
    assert float(rows[0]["voltage_rms_per_g (V/g)"]) == pytest.approx(4.0 * volts)
    assert (tmp_path / "response.png").read_bytes().startswith(b"\x89PNG")
    both = found.as_json()["responses"]
    assert [one["engine"] for one in both] == ["spice", "ideal"]
    assert both[0]["sweeps"]["from rest"]["points"][0]["mean_power_per_g2"] == pytest.approx(
        16.0 * power
    )
    assert "up and down" in str(found) and "at least" in str(found)


@pytest.mark.thorough("test_engines_agree_on_a_resistor")
def test_several_loads_and_a_map(harvester, tmp_path):
    """Each value has a response of its own, those of a scene with it; many values of the level make a map."""
    linear = hv.loads(BRIDGE).with_load(resistance=50e3)
    (tmp_path / "scene.toml").write_text(linear.to_toml())
    asked = [
        "response",
        str(tmp_path / "scene.toml"),
        "--sweep",
        "44Hz:50Hz:7",
        "--out",
        str(tmp_path),
    ]
    status, text, _ = harvester(*asked, "--vary", "load.resistance=10k,100k", "--json")
    assert status == 0
    for one, load in zip(json.loads(text)["responses"], (1e4, 1e5), strict=True):
        alone = hv.response(linear.with_load(resistance=load), "44Hz:50Hz:7")
        assert one["varied"] == {"load.resistance": load}
        assert one["sweeps"]["up"]["peak_power"]["value"] == pytest.approx(
            alone.peak("up").mean_power.value, rel=1e-12
        )
    levels = ["--vary", "acceleration_amplitude=.1g:1g:8"]
    status, text, _ = harvester(*asked, *levels)
    assert status == 0 and "up and down" in text
    found = hv.responses(linear, "44Hz:50Hz:7", {"excitation.acceleration_amplitude": ".1g:1g:8"})
    per_g2 = {round(c.peak("up").mean_power.value / c.level**2, 12) for c in found.curves}
    assert len(per_g2) == 1  # of a linear scene
    drawn = found.plot(per_g=True)
    heights = drawn.axes[0].collections[0].get_array()
    assert heights.shape[0] == 8 and np.ptp(heights, axis=0).max() < 1e-9 * heights.max()
    with (tmp_path / "response.csv").open() as file:
        assert next(csv.reader(file))[:3] == [
            "excitation.acceleration_amplitude (m/s^2)",
            "engine",
            "direction",
        ]


@pytest.mark.ngspice
def test_a_frequency_that_fails(monkeypatch):
    """It is left out and reported with its reason, and the others are there; if all fail, that is the error."""
    linear = hv.loads(BRIDGE).with_load(resistance=50e3)
    follow = Spice.run_near

    def fails_above_45(self, problem, near, progress=None):
        if problem.scene.excitation.frequency > 45.0:
            raise CircuitError("the circuit does not converge at node 7")
        return follow(self, problem, near, progress)

    monkeypatch.setattr(Spice, "run_near", fails_above_45)
    found = hv.response(linear, SWEEP, engine="spice")
    assert [p.frequency for p in found.points] == [44.0] and [f for f, _ in found.failures] == [
        47.0,
        50.0,
    ]
    assert "failed at 2 of 3 frequencies, as 47 Hz: the circuit does not converge at node 7" in str(
        found
    )
    with pytest.raises(CircuitError, match="node 7"):
        hv.response(linear, [46.0, 47.0, 48.0], engine="spice")


@pytest.mark.thorough("test_engines_agree_on_a_resistor")
@pytest.mark.ngspice
def test_a_neighbour_leads_to_the_response_from_rest():
    """With a capacitor of 46 periods, where a way that ends too early is seen in the power."""
    slow = hv.loads(BRIDGE.replace("0.3 uF", "10 uF"))
    followed = hv.response(slow, [45.0, 45.5], engine="spice").points[1].mean_power
    alone = Spice().run(slow.vary("excitation.frequency", 45.5)).mean_power
    assert (
        abs(followed.value - alone.value)
        < followed.known_error95 + alone.known_error95
        < 2e-3 * alone.value
    )


@pytest.mark.thorough("test_engines_agree_on_a_resistor")
@pytest.mark.ngspice
def test_ngspice_follows_branches_up_and_down():
    """A hardening spring: at 1.25 both branches are there, and each way is on its own, as by the ensemble."""
    eqs = Equations(beta=0.05, mu=0.5, c1=-0.05, alpha=0.3, drive=0.15, drive_frequency=1.0)
    found = hv.response(scene(eqs), [1.15, 1.25, 1.4], engine="spice")
    assert found.directions == ["up", "down"] and found.hysteresis == [1.25]
    up, down = (found.sweep(way)[1].mean_power.value for way in ("up", "down"))
    assert up == pytest.approx(0.02690, rel=3e-3) and down == pytest.approx(9.47e-4, rel=5e-3)


def test_rows_of_the_bar():
    linear = scene(DRIVEN)
    points = points_of(linear, {"nondimensional.mu": [0.5, 1.0, 2.0]})
    assert rows_of(linear, engines_of(linear, ["exact", "spice"]), 5, points) == {
        "exact": 30,
        "spice": 15,
    }


@pytest.mark.parametrize(
    "options, said",
    [
        (
            ["--vary", "excitation.frequency=1,2"],
            "--vary must leave out excitation.frequency, which --sweep",
        ),
        (["--vary", "load.resistance=-1k,2k"], "load.resistance"),
        (
            ["--vary", "acceleration_amplitude=0,1"],
            "acceleration_amplitude must be given, above 0, for a frequency",
        ),
        (["--engine", "spicy"], "did you mean 'spice'"),
        (["--engine", "exact", "--engine", "exact"], "names 'exact' twice"),
        (["--engine", "exact", "--budget", "3s"], "--budget must be left out with engine 'exact'"),
    ],
)
def test_refused(harvester, tmp_path, options, said):
    """One line that names the option, status 2, and no file."""
    path = tmp_path / "scene.toml"
    path.write_text(hv.loads(BRIDGE).with_load(resistance=50e3).to_toml())
    status, _, error = harvester(
        "response", str(path), "--sweep", "44Hz:50Hz:3", "--out", str(tmp_path / "o"), *options
    )
    assert status == 2 and said in error and len(error.splitlines()) == 1
    assert not (tmp_path / "o" / "response.csv").exists()


def test_per_g_needs_a_base(tmp_path):
    with pytest.raises(InputError, match="`per_g` must be used with a physical scene"):
        draw(scene(DRIVEN), "0.9:1.1:3", tmp_path, per_g=True)
    with pytest.raises(CannotServeError, match="linear equations"):
        hv.response(scene(changed(DRIVEN, alpha=0.1)), [0.9, 1.0, 1.1], engine="exact")


@pytest.mark.ngspice
def test_a_wrong_unit_of_the_sweep_is_doubted_before_the_run(harvester, monkeypatch, tmp_path):
    """kHz for Hz: both ends are on stderr before anything is computed, and nothing is refused."""
    (tmp_path / "scene.toml").write_text(BRIDGE)

    def stopped(*_):
        raise CircuitError("begun")

    monkeypatch.setattr(Spice, "run_near", stopped)
    asked = ["response", str(tmp_path / "scene.toml"), "--out", str(tmp_path), "--sweep"]
    _, _, error = harvester(*asked, "3kHz:4kHz:3")
    first, second, last = error.splitlines()
    for line, shown in ((first, "3000"), (second, "4000")):
        assert line.startswith(
            f"response: warning: at an end of --sweep, excitation.frequency is {shown} Hz"
        )
    assert "begun" in last
    assert len(harvester(*asked, "44Hz:50Hz:3")[2].splitlines()) == 1


def test_a_csv_file_of_what_is_not_known():
    """The total error of a power is there if it is known, and a frequency that failed has its reason."""
    known = Value(2.0, bias=0.5)
    half = Value(2.0, bias=0.5, unknown="ideal diodes")
    points = [
        ResponsePoint("up", float(k), Value(1.0), power, 0.0)
        for k, power in enumerate((known, half))
    ]
    found = FrequencyResponse(
        tuple(points), False, failures=(Failure(7.0, "no convergence, at node 7"),)
    )
    several = FrequencyResponses((found,)).table.csv(units=True)
    for text in (found.table.csv(units=True), several):
        rows = list(csv.DictReader(text.splitlines()))
        assert [row["mean_power_error95"] for row in rows] == ["0.5", "", ""]
        assert [row["error"] for row in rows] == ["", "", "no convergence, at node 7"]
        assert {name for name, cell in rows[2].items() if cell} - {"engine"} == {
            "frequency",
            "error",
        }
        assert all(
            len(row) == len(next(csv.reader(text.splitlines())))
            for row in csv.reader(text.splitlines())
        )


def test_numbers_without_a_unit():
    """No blank is before what follows the number of a nondimensional scene."""
    points = [
        ResponsePoint(way, f, Value(v2), Value(v2), 0.0)
        for way, v2 in (("up", 1.0), ("down", 2.0))
        for f in (1.3, 1.4, 1.6)
    ]
    text = str(FrequencyResponse(tuple(points), False))
    assert "between 1.3 and 1.6: hysteresis" in text and "are up to 0.2 apart" in text


@pytest.mark.thorough("test_engines_agree_on_a_resistor")
def test_ideal_trajectories_are_judged_by_their_power():
    """A voltage that is inverted is read at few phases of the period: that scatter is an error, no other response."""
    inverted = hv.loads(BRIDGE).with_load(hv.Netlist("parallel_sshi", R="100 kohm"))
    point = hv.response(inverted, [47.0], engine="ideal").points[0]
    assert 0.001 < point.spread < 0.05 and point.voltage_phase is not None
    assert point.mean_square_voltage.stderr > 1e-4 * point.mean_square_voltage.value


def test_only_some_responses_have_a_bandwidth():
    """The column of the bandwidth is empty if the half power is beyond the sweep."""
    linear = hv.loads(BRIDGE).with_load(resistance=50e3)
    resonance = float(np.sqrt(1364.1 / 16.542e-3) / (2 * np.pi))
    wide, narrow = (
        hv.response(linear, [resonance - d, resonance, resonance + d]) for d in (8.0, 0.01)
    )
    assert wide.bandwidth("up") is not None and narrow.bandwidth("up") is None
    cells = FrequencyResponses((narrow, wide)).peaks["half_power_bandwidth"]
    assert [cell is None for cell in cells] == [True] * (len(cells) - 1) + [False]


def test_phases_of_two_modes_are_those_of_the_closed_form():
    """Each frequency has both modes' parts, the second mode's at its resonance the larger."""
    closed, sampled = (
        hv.response(hv.loads(TWO_MODES), [48.0, 80.0, 133.0], engine=name)
        for name in ("exact", "ensemble")
    )
    for true, found in zip(closed.sweep("up"), sampled.sweep("down"), strict=True):
        assert found.displacement_phase == pytest.approx(true.displacement_phase, abs=0.1)
        assert found.voltage_phase == pytest.approx(true.voltage_phase, abs=1.0)


def test_phases_of_two_modes_with_a_bridge_are_those_of_its_netlist():
    """By ideal diodes, and by the netlist's own diodes in its periodic response."""
    bridge = hv.loads(TWO_MODES).with_load(
        netlist="bridge", parameters={"R": "50 kohm", "C": "0.3 uF"}
    )
    ideal, compiled = (
        hv.response(bridge, [48.0, 133.0], engine=name) for name in ("ideal", "compiled")
    )
    for one, other in zip(ideal.sweep("up"), compiled.sweep("from rest"), strict=True):
        assert one.displacement_phase == pytest.approx(other.displacement_phase, abs=1.5)
        assert one.voltage_phase == pytest.approx(other.voltage_phase, abs=1.5)
