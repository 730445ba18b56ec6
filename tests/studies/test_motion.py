"""One path on paper: it is the path of the equations, in the scene's units, whichever engine makes it."""

import csv
import dataclasses
import json

import numpy as np
import pytest
from click.testing import CliRunner

import harvester as hv
from harvester.cli import cli
from harvester.errors import CannotServeError, InputError
from harvester.studies.motion import motion
from tests.support.systems import DRIVEN, PAPER, changed, continuum, scene

TWO = hv.load("examples/plate_two_stops.toml")


def test_steady_response_to_a_drive():
    """RMS voltage of the part shown is that of the transfer function, within the step's second order."""
    found = motion(scene(DRIVEN))
    last = found.time >= found.time[-1] - found.shown
    assert np.sqrt(np.mean(found.voltage[last] ** 2)) == pytest.approx(
        abs(continuum(DRIVEN)[1]) / 2**0.5, rel=5e-3
    )
    assert found.acceleration.max() == pytest.approx(DRIVEN.drive, rel=1e-3)


def test_units_of_a_physical_scene():
    """x stays between the stops in metre, v is dx/dt, Cp dV/dt + V/R = theta v."""
    found = motion(TWO, duration=2.0)
    assert found.stops == pytest.approx((-TWO.stop.gap, TWO.opposite_stop.gap))
    assert found.stops[0] <= found.displacement.min() < 0.9 * found.stops[0]
    assert 0.9 * found.stops[1] < found.displacement.max() <= found.stops[1]
    theta = TWO.piezo.coupling
    capacitance = TWO.piezo.capacitance
    load = TWO.load.resistance
    dt = np.diff(found.time)
    charge = (
        capacitance * np.diff(found.voltage)
        + dt * 0.5 * (found.voltage[1:] + found.voltage[:-1]) / load
    )
    error = charge - theta * np.diff(found.displacement)
    assert np.sqrt(np.mean(error**2)) < 0.02 * np.sqrt(np.mean(charge**2))
    assert (found.impacts[:, 1] > 0).any()
    assert (found.impacts[:, 1] < 0).any()


@pytest.mark.thorough("test_files_and_command")
@pytest.mark.ngspice
@pytest.mark.parametrize("eqs", [changed(PAPER, gap=0.3), changed(DRIVEN, restitution=0.8)])
def test_ngspice_makes_the_same_path(eqs):
    """The same seed, the same noise: V and x of the first part, before chaos parts them."""
    ours, theirs = (motion(scene(eqs), engine, duration=15.0) for engine in ("ensemble", "spice"))
    early = ours.time < 40.0
    assert (ours.time == theirs.time).all()
    for name in ("displacement", "voltage"):
        a, b = getattr(ours, name)[early], getattr(theirs, name)[early]
        assert np.abs(a - b).max() < 2e-3 * np.abs(a).max()


@pytest.mark.thorough("test_files_and_command")
@pytest.mark.ngspice
def test_a_pilot_says_how_long_a_path_by_ngspice_takes(monkeypatch):
    """Once, before it, and the path is what it is without a pilot; a harmonic excitation, as it has
    shaking to cut short."""
    monkeypatch.setattr("harvester.studies.motion_in_ngspice.MANY_STEPS", 100)
    told = []
    one, other = (
        motion(scene(DRIVEN), "spice", duration=20.0, expected=ask) for ask in (told.append, None)
    )
    assert len(told) == 1 and 0.0 < told[0] < 600.0
    assert np.array_equal(one.voltage, other.voltage)


@pytest.mark.ngspice
def test_netlists_need_ngspice(tmp_path):
    bridge = hv.load("examples/plate_bridge.toml")
    with pytest.raises(CannotServeError, match="use engine 'spice'"):
        motion(bridge)
    found = motion(bridge, "spice", duration=0.5, execution=hv.Execution(out=tmp_path))
    assert np.abs(found.voltage).max() > 0.1


@pytest.mark.ngspice
def test_probes_from_rest(tmp_path, harvester):
    """The storage capacitor begins empty; it is v(a,b), Rload dissipates v^2/R, and both files have the
    same columns with units."""
    words = (
        "motion",
        "examples/plate_bridge.toml",
        "--from-rest",
        "--duration",
        "2s",
        "--out",
        tmp_path,
    )
    status, _, wrong = harvester(
        *words, "--probe", "store", "--probe", "v(a,b)", "--probe", "p(load)"
    )
    assert (status, wrong) == (0, "")
    with np.load(tmp_path / "motion.npz") as packed:
        found = dict(packed)
    assert found["time"][0] < 0.01
    assert found["time"][-1] == pytest.approx(2.0, rel=0.01)
    assert abs(found["store"][0]) < 1e-3
    assert found["store"][-1] > 0.5
    assert found["v(a,b)"] == pytest.approx(found["store"], abs=1e-9)
    assert found["p(load)"] == pytest.approx(found["store"] ** 2 / 1.5e6, rel=1e-3, abs=1e-9)
    with (tmp_path / "motion.csv").open() as file:
        heads = next(csv.reader(file))
    assert heads == [f"{name} ({unit})" for name, unit in found["units"]]
    assert heads[-1] == "p(load) (W)"


def test_probes_need_the_circuit():
    with pytest.raises(InputError, match="`probe` must be used with engine 'spice'"):
        motion(scene(PAPER), duration=20.0, probe=["v(p)"])


@pytest.mark.slow
def test_files_and_command(tmp_path):
    arguments = [
        "motion",
        "examples/plate_recorded.toml",
        "--duration",
        "2",
        "--out",
        str(tmp_path),
    ]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0, done.output
    assert "a single trajectory is not a mean" in done.output
    with (tmp_path / "motion.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "time (s)",
        "displacement (m)",
        "velocity (m/s)",
        "voltage (V)",
        "base_acceleration (m/s^2)",
    ]
    assert float(rows[-1]["time (s)"]) == pytest.approx(10.0, rel=0.01)
    assert (tmp_path / "motion.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "provenance.json").read_text())["engine"] == "ensemble"


def test_seed_and_refusals():
    same = motion(scene(PAPER), duration=20.0)
    other = motion(scene(PAPER), duration=20.0, seed=1)
    assert (same.displacement == motion(scene(PAPER), duration=20.0).displacement).all()
    assert (same.displacement != other.displacement).any()
    with pytest.raises(
        InputError, match="unknown engine 'averaged': it must be one of ensemble, compiled, spice"
    ):
        motion(scene(PAPER), "averaged")
    for duration in (0.0, -1.0, 1e9, float("nan")):
        with pytest.raises(InputError, match="`duration` must be between"):
            motion(scene(PAPER), duration=duration)


def test_a_probe_that_is_rounding_is_drawn_as_zero():
    """The output of a chip that does not run yet is femtovolts of noise, no signal; a small current is one."""
    path = motion("examples/plate.toml", duration=2.0, from_rest=True)
    wave = np.sin(np.arange(len(path.time))) * np.max(np.abs(path.voltage))
    probes = {"v(out)": 1e-14 * wave, "v(in)": 1e-6 * wave, "i(d1)": 1e-14 * wave}
    units = {"v(out)": "V", "v(in)": "V", "i(d1)": "A"}
    drawn = dataclasses.replace(path, probes=probes, probe_units=units).plot()
    heights = {
        one.get_ylabel().split("\n")[0]: np.ptp(one.lines[0].get_ydata())
        for one in drawn.axes
        if one.lines
    }
    assert heights["v(out)"] == 0.0 < min(heights["v(in)"], heights["i(d1)"])
