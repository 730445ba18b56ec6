"""Profiles: densities against the rms that their standards state, shocks against a quadrature, what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import harvester as hv
from harvester.equations.repeated_shaking import events
from harvester.records.profiles.lines_and_shocks import SHOCKS, WALKING, machine, shock, walking
from harvester.records.profiles.standard_curves import CURVES, G, density
from tests.support.paths import EXAMPLES

SHAPES = {
    "half-sine-shock": lambda t, d, f: math.sin(math.pi * t / d),
    "sawtooth-shock": lambda t, d, f: t / d,
    "damped-sine-shock": lambda t, d, f: math.exp(-t / d) * math.sin(2.0 * math.pi * f * t),
}


def plate(**excitation):
    """The plate of the examples under another excitation."""
    text = (EXAMPLES / "plate.toml").read_text().replace('acceleration_psd = "1e-5 g^2/Hz"', "\n".join(
        f"{key} = {value!r}" for key, value in excitation.items()))  # fmt: skip
    return hv.loads(text)


@pytest.mark.parametrize("curve", CURVES.values(), ids=lambda one: one.name)
def test_a_density_has_the_rms_that_its_standard_states(curve):
    """To the digits that are there: a wrong breakpoint would show."""
    f, g = np.array(curve.points).T
    slopes = np.diff(np.log(g)) / np.diff(np.log(f))
    pieces = zip(f[:-1], f[1:], g[:-1], slopes, strict=True)
    whole = sum(quad(lambda x, low, at, slope: at * (x / low) ** slope, low, high, (low, at, slope))[0]
                for low, high, at, slope in pieces)  # fmt: skip
    digits = 2 - math.floor(math.log10(curve.rms)) if curve.rms < 10 and curve.rms != 7.7 else 1
    assert round(math.sqrt(whole), digits) == curve.rms
    assert density(curve.name, 0.5).rms == pytest.approx(0.5 * G * math.sqrt(whole), rel=1e-9)


@pytest.mark.parametrize("name", SHOCKS)
def test_lines_of_a_shock(name):
    """Each is the integral of the shock over a period, times exp(-i w t); the mean is subtracted."""
    period = 0.7
    duration = 0.05
    frequency = 31.0 if name == "damped-sine-shock" else None
    record = shock(name, 3.0, duration, frequency, period, 10.0)
    assert record.period == pytest.approx(period)
    series = np.fft.rfft(record.values) / len(record.values)
    end = duration if frequency is None else 40.0 * duration
    for n in (0, 1, 2, 7, 40, 200):
        w = 2.0 * math.pi * n / period
        real, imaginary = (
            quad(
                lambda t, turn=turn, w=w: 3.0 * SHAPES[name](t, duration, frequency) * turn(w * t),
                *(0.0, end),
                limit=2000,
            )[0]
            for turn in (math.cos, math.sin)
        )
        expected = (real - 1j * imaginary) / period if n else 0.0
        assert series[n] == pytest.approx(expected, abs=1e-8)


def test_a_ramp_at_small_angles():
    """The series and the closed form meet: a shock that is short next to its period has no jump between its lines."""
    record = shock("sawtooth-shock", 1.0, 0.01, None, 50.0, 1.0)
    lines = np.abs(np.fft.rfft(record.values))[1:60]
    assert np.abs(np.diff(lines, 2)).max() < 1e-6 * lines.max()


def test_lines_of_a_machine_and_of_walking():
    turning = machine(25.0, [1.0, 0.0, 0.5], 2.0)
    walked = walking(None, 1.0)
    for record, period, peaks in (
        (turning, 0.04, [2.0, 0.0, 1.0]),
        (walked, 0.5, [G * a for a in WALKING]),
    ):
        assert record.period == pytest.approx(period)
        series = 2.0 * np.abs(np.fft.rfft(record.values)) / len(record.values)
        assert series[1 : 1 + len(peaks)] == pytest.approx(peaks, abs=1e-12)
        assert series[0] == pytest.approx(0.0, abs=1e-12)
        assert record.rms**2 == pytest.approx(0.5 * sum(a * a for a in peaks))


def test_a_machine_of_one_line_is_a_harmonic_motion():
    there = plate(profile="machine", frequency=4.5, harmonics=[0.1])
    harmonic = plate(acceleration_amplitude=0.1, frequency=4.5)
    assert hv.run(there, "exact").mean_power.value == pytest.approx(
        hv.run(harmonic, "exact").mean_power.value, rel=1e-9
    )


def test_a_single_shock_depends_on_the_one_before_by_twice_the_amplitude_that_is_left():
    """With negligible coupling the motion decays by exp(-zeta w0 T) until the next shock, after the time T."""
    shocked = plate(**SHOCK)
    shocked = replace(shocked, piezo=replace(shocked.piezo, coupling=1e-9))
    modal = shocked.modal
    found = events(shocked)
    decay = 0.5 * modal.damping / modal.mass
    assert found.single
    assert 1.0 / found.rate == pytest.approx(0.011 + math.log(1e4) / decay, rel=1e-9)
    assert found.memory == pytest.approx(2.0 * math.exp(-decay / found.rate), rel=1e-6)


def test_energy_of_a_single_shock():
    """A blow much shorter than the response leaves M v^2/2, which load and damping share; the ensemble agrees."""
    scene = plate(profile="half-sine-shock", acceleration_amplitude="1 g", pulse_duration="2 ms")
    answer = hv.run(scene, "exact")
    speed = 9.80665 * 2e-3 * 2.0 / math.pi
    given = 0.5 * 0.04 * speed**2
    energy = answer.energy_per_event
    assert 0.96 * given < energy.value < given
    assert answer.mean_power.value * answer.as_json()["event_rate"] ** -1 == pytest.approx(
        energy.value
    )
    assert "energy per event" in str(answer)
    assert str(answer.warnings[0]).startswith("the shock is a single one: the mean power is over ")
    rare = hv.run(plate(**SHOCK, event_rate=0.02), "exact")
    often = hv.run(plate(**SHOCK, event_rate=0.05), "exact")
    assert rare.energy_per_event.value == pytest.approx(often.energy_per_event.value, rel=1e-3)
    assert rare.warnings == ()


SHOCK = {"profile": "half-sine-shock", "acceleration_amplitude": "1 g", "pulse_duration": "11 ms"}


@pytest.mark.slow
def test_the_best_load_of_a_single_shock_is_that_of_most_energy():
    """Its mean power is over a time that no load changes."""
    single = [hv.run(plate(**SHOCK).with_load(r), "exact") for r in (1e5, 1e6, 1e7)]
    assert len({one.as_json()["event_rate"] for one in single}) == 1
    without = plate(**SHOCK)
    assert hv.run(
        without.vary("excitation.level", -2.0), "exact"
    ).mean_power.value == pytest.approx(4.0 * hv.run(without, "exact").mean_power.value)


def test_by_the_ensemble():
    """It integrates what `exact` sums up, for shocks, with the same energy within its time-step error."""
    scene = plate(**SHOCK, event_rate=1.0)
    sampled, exact = hv.run(scene, "ensemble"), hv.run(scene, "exact")
    energy = sampled.energy_per_event
    assert abs(energy.value - exact.energy_per_event.value) < 1.5 * energy.known_error95
    assert energy.known_error95 < 1e-3 * energy.value
    # the shock is resolved, though the response asks for less
    assert sampled.details["step"] <= 11e-3 / 8.0
    assert hv.run(scene, "ensemble", dt="3 ms").details["step"] > 2e-3


@pytest.mark.parametrize(
    ("excitation", "error"),
    [
        ({"profile": "wolking"}, "unknown profile 'wolking': did you mean 'walking'?"),
        ({"profile": 3}, "excitation.profile must be a text, but is 3"),
        ({"level": 2.0}, "excitation.profile must be given with level, but is left out"),
        (
            {"profile": "walking", "level": 0.0},
            "excitation.level of profile 'walking' must be other than 0, but is 0.0",
        ),
        (
            {"profile": "gevs-acceptance", "level": -1.0},
            "'gevs-acceptance' must be above 0, but is -1.0",
        ),
        ({"profile": "walking", "frequency": 5.0}, "must be between 1.6 and 2.2 Hz"),
        (
            {"profile": "walking", "event_rate": 5.0},
            "excitation.event_rate must be left out with profile 'walking'",
        ),
        (
            {"profile": "machine", "frequency": 5.0},
            "excitation.harmonics must be given with profile 'machine'",
        ),
        (
            {"profile": "machine", "frequency": 5.0, "harmonics": 3},
            "excitation.harmonics must be a list, but is 3",
        ),
        (
            {"profile": "machine", "frequency": 5.0, "harmonics": [0.0]},
            "some of them above 0, but is [0.0]",
        ),
        (
            {"profile": "machine", "frequency": 5.0, "harmonics": ["1 kg"]},
            "excitation.harmonics.0 must be an accel",
        ),
        (
            {"profile": "walking", "acceleration_file": "a.csv"},
            "must be left out if profile is given",
        ),
        (
            {**SHOCK, "acceleration_amplitude": 0.0},
            "excitation.acceleration_amplitude of a shock must be above 0",
        ),
        (
            {**SHOCK, "event_rate": 200.0},
            "excitation.pulse_duration must be at most the time between two shocks",
        ),
        (
            {**SHOCK, "event_rate": 1e-9},
            "excitation.event_rate must be so high that a period of the shocks has",
        ),
    ],
)
def test_what_is_refused(excitation, error):
    with pytest.raises(hv.InputError) as caught:
        hv.run(plate(**excitation), "exact")
    assert error in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_single_shock_of_a_device_that_never_rests():
    scene = plate(**SHOCK).vary("oscillator.damping", 0.0)
    with pytest.raises(
        hv.InputError, match=r"event_rate must be given for a device without damping"
    ):
        hv.run(scene, "exact")


def test_the_list_of_profiles(harvester):
    """Each with its keys and its source; a report has them as the scene file's text."""
    status, out, err = harvester("keys", "profile")
    assert (status, err) == (0, "")
    assert out.count("  source: ") == out.count("  keys: ") == len(CURVES) + len(SHOCKS) + 2
    assert '"mil-std-810-minimum-integrity"' in harvester("keys", "profile", "--json")[1]


def test_a_scene_file_with_a_profile_is_written_and_read_again(harvester, tmp_path):
    """`new` writes what is asked for; the scene's own text gives the same scene."""
    path = tmp_path / "machine.toml"
    known = (
        "--mass",
        "40g",
        "--frequency",
        "3.2Hz",
        "--q",
        "125",
        "--capacitance",
        "50nF",
        "--coupling",
        "1e-3",
    )
    asked = ("--profile", "machine", "--drive-frequency", "1500rpm", "--harmonics", "0.1 g, 0.03 g")
    status, _, err = harvester("new", path, *known, *asked)
    assert (status, err) == (0, "")
    scene = hv.load(path)
    assert scene.excitation.harmonics == pytest.approx((0.1 * G, 0.03 * G))
    assert scene.excitation.frequency == pytest.approx(25.0)
    assert hv.loads(scene.to_toml()) == scene
