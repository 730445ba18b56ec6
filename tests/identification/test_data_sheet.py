"""`identify` with single numbers of a data sheet: their intervals hold the truth, alone and next to a file."""

import json
import math

import numpy as np
import pytest

import harvester as hv
from harvester.linear.single_points import LinearDevice
from harvester.studies.prediction.priors import data, prior_of
from tests.support import bench

G = 9.80665
MODEL = data()["model"]["linear"]
KEYS = ("oscillator.mass", "piezo.coupling", "piezo.capacitance", "quality_factor")


def written(rng, truth, wrong=True):
    """The numbers of a device as a data sheet has them, each with its own error."""
    device = LinearDevice(truth.mass, 2.0 * math.pi * truth.f0, truth.q, truth.c, truth.theta)
    ohm = 1.0 / (2.0 * math.pi * truth.f0 * truth.c)
    errors = rng.standard_normal(6) if wrong else np.zeros(6)
    volts = device.open_voltage(0.25 * G) * math.exp(math.hypot(0.025, 0.5 * MODEL) * errors[0])
    watts = device.power(ohm, 0.25 * G) * math.exp(math.hypot(0.05, MODEL) * errors[1])
    opened = truth.f0 * math.sqrt(1.0 + truth.beta) * math.exp(0.003 * errors[3])
    return {
        "open_circuit_voltage": f"{volts!r} V at 0.25 g",
        "power_at_load": f"{watts!r} W at {ohm!r} ohm and 0.25 g",
        "frequency": f"{truth.f0 * math.exp(0.003 * errors[2])!r} Hz",
        "open_circuit_frequency": f"{opened!r} Hz",
        "capacitance": f"{truth.c * math.exp(0.1 * errors[4])!r} F",
        "q": f"{truth.q * math.exp(0.4 * errors[5])!r}",
    }


def of_class(rng):
    """A device whose coupling two resonances show, and whose damping is of the class."""
    prior = prior_of("damping", "unknown", "bulk")
    zeta = prior.median * math.exp(prior.sigma * rng.standard_normal())
    return bench.Truth(
        mass=math.exp(rng.uniform(*np.log([2e-3, 2e-2]))),
        f0=rng.uniform(30.0, 120.0),
        q=0.5 / zeta,
        beta=math.exp(rng.uniform(*np.log([0.06, 0.3]))),
        c=math.exp(rng.uniform(*np.log([1e-8, 1e-7]))),
    )


@pytest.mark.parametrize("without", ["power_at_load", "q", "mass"])
@pytest.mark.slow
def test_intervals_hold_the_truth(without):
    """Devices drawn from the priors, with numbers as far off as they are stated to be.

    95 % of the intervals hold within four standard errors, so neither an error that is left out nor one that is counted
    twice would pass: those of a Q without its spread hold for a third, those of twice the errors for all.
    """
    rng = np.random.default_rng([5, len(without)])
    scores = []
    for _ in range(24):
        truth = of_class(rng)
        points = written(rng, truth)
        points.pop("q")  # the prior is its spread
        points.pop(without, None)
        known = {} if without == "mass" else {"mass": truth.mass}
        found = hv.identify(known=known, points=points)
        for key, value in truth.parameters(*KEYS).items():
            if key == "oscillator.mass" and known:
                continue
            one = found[key]
            half = 0.5 * math.log(one.high / one.low) / 1.96
            scores.append(math.log(value / one.value) / half)
    held = np.mean(np.abs(scores) < 1.96)
    assert abs(held - 0.95) < 4.0 * math.sqrt(0.95 * 0.05 / 24), held
    assert 0.6 < np.std(scores) < 1.4, np.std(scores)


def test_exact_numbers_give_the_device_back():
    truth = bench.Truth(mass=4e-3, f0=60.0, q=40.0, beta=0.08, c=30e-9)
    points = written(np.random.default_rng(0), truth, wrong=False)
    found = hv.identify(points=points)
    for key, value in truth.parameters(*KEYS).items():
        assert found[key].value == pytest.approx(value, rel=1e-3), key
    assert found.residual_rms < 1e-3 and not found.warnings


def test_the_width_of_the_coupling_is_that_of_its_causes():
    """With a weak coupling V = theta/Cp a Q/w0^2: the logarithm of theta has the variances of V, Cp, Q and twice w0."""
    truth = bench.Truth(mass=4e-3, f0=60.0, q=60.0, beta=1e-4, c=30e-9)
    points = written(np.random.default_rng(0), truth, wrong=False)
    some = {name: points[name] for name in ("open_circuit_voltage", "frequency", "capacitance")}
    for more, damping in (({"q": points["q"]}, 0.4), ({}, 0.5)):
        one = hv.identify(known={"mass": 4e-3}, points=some | more)["piezo.coupling"]
        sigma = math.log(one.high / one.low) / (2.0 * 1.96)
        causes = math.hypot(0.025, 0.5 * MODEL), 0.1, damping, 2.0 * 0.003
        assert sigma == pytest.approx(math.hypot(*causes), rel=0.02)


def test_a_voltage_gives_an_impedance_its_mass(tmp_path):
    """An impedance leaves the mass open; one voltage without load determines it within its own error."""
    rng = np.random.default_rng(3)
    names, truth = bench.KINDS["impedance"](rng, tmp_path)
    alone = hv.identify(names)
    assert "oscillator.mass" in dict(alone.missing)
    mass, short = 7e-3, 2.0 * math.pi * truth["short_circuit_frequency"]
    theta = math.sqrt(truth["coupling_squared_per_mass"] * mass)
    device = LinearDevice(mass, short, truth["quality_factor"], truth["piezo.capacitance"], theta)
    volts = float(device.open_voltage(0.25 * G))
    point = {"open_circuit_voltage": f"{volts!r} V at 0.25 g"}
    found = hv.identify(names, points=point)
    one = found["oscillator.mass"]
    assert one.value == pytest.approx(mass, rel=0.02)
    sigma = math.log(one.high / one.low) / (2.0 * 1.96)
    assert sigma == pytest.approx(2.0 * math.hypot(0.025, 0.5 * MODEL), rel=0.1)
    assert found["quality_factor"].high / found["quality_factor"].low < 1.1


def test_a_power_alone_has_two_couplings():
    """Below and above the best coupling a load gets the same power: the answer warns, and gives the other one."""
    truth = bench.Truth(mass=4e-3, f0=60.0, q=60.0, beta=0.008, c=30e-9)
    points = written(np.random.default_rng(0), truth, wrong=False)
    del points["open_circuit_voltage"]
    del points["open_circuit_frequency"]
    [said] = hv.identify(known={"mass": 4e-3}, points=points).warnings
    assert said.code == "points_have_two_answers"


def test_a_power_next_to_a_ring_down_has_two_couplings():
    """A file with the resonance alone leaves the coupling to the power: the interval holds both answers."""
    file = "examples/bench_bounce.csv"
    points = {"capacitance": "41 nF", "power_at_load": "0.6 mW at 200 kohm and 0.25 g"}
    found = hv.identify(file, known={"mass": "16 g"}, points=points)
    [said] = [entry for entry in found.warnings if entry.code == "points_have_two_answers"]
    one = found["piezo.coupling"]
    other = said.numbers["value"]
    assert {round(1e3 * one.value, 2), round(1e3 * other, 2)} == {1.73, 5.81}
    assert one.low < 0.9 * min(one.value, other) < 1.1 * max(one.value, other) < one.high
    # Either coupling has the power, on its own.
    for theta in (one.value, other):
        short = 2.0 * math.pi * found["short_circuit_frequency"].value
        quality = found["quality_factor"].value
        device = LinearDevice(0.016, short, quality, found["piezo.capacitance"].value, theta)
        assert device.power(2e5, 0.25 * G) == pytest.approx(0.6e-3, rel=0.01)


@pytest.mark.slow
def test_intervals_hold_the_truth_where_two_couplings_have_the_power():
    """The devices are of a class; 95 % of the intervals hold the coupling within four standard errors."""
    rng = np.random.default_rng(11)
    held = []
    for _ in range(200):
        if len(held) == 16:
            break
        truth = of_class(rng)
        points = written(rng, truth)
        for name in ("open_circuit_voltage", "open_circuit_frequency", "q"):
            del points[name]
        found = hv.identify(known={"mass": truth.mass}, points=points)
        two = "points_have_two_answers" in {entry.code for entry in found.warnings}
        if two and "piezo.coupling" not in dict(found.missing):
            one = found["piezo.coupling"]
            held.append(one.low < truth.theta < one.high)
    assert len(held) == 16
    assert np.mean(held) > 0.95 - 4.0 * math.sqrt(0.95 * 0.05 / 16)


SHEET = {"frequency": "60 Hz", "capacitance": "30 nF", "open_circuit_voltage": "15 V at 0.25 g"}


@pytest.mark.parametrize(
    "known, changed, said",
    [
        ({}, {}, "`points` must|points must determine the coupling and mass"),
        ({"mass": "4 g"}, {"capacitance": None}, "`capacitance` must be given with"),
        ({"mass": "4 g"}, {"frequency": None}, "`frequency` or `open_circuit_frequency` must be"),
        ({"mass": "4 g"}, {"open_circuit_voltage": "15 V"}, "VOLTAGE at ACCELERATION"),
        ({"mass": "4 g"}, {"open_circuit_voltage": "9 kV at 0.1 g"}, "possible for one linear device"),
        ({"mass": "4 g"}, {"open_circuit_voltage": "500 V at 0.25 g"}, "largest coupling.*, 10: check"),
        ({"mass": "4 g"}, {"open_circuit_voltage": "500 V at 0.25 g", "frequency": None,
          "open_circuit_frequency": "60 Hz"}, "one linear device, but"),
        ({}, {"power_at_load": "486 uW at 100 kohm and 0.25 g", "open_circuit_voltage":
          "12.8 V at 0.25 g", "frequency": "30.31 Hz", "capacitance": "52.8 nF"},
         "must determine the coupling .*give the mass"),
        ({"mass": "4 g"}, {"open_circuit_frequency": "59 Hz"}, "must be above `frequency`"),
        ({"mass": "4 g"}, {"q": "-3"}, "`q` must be a quality factor"),
        ({"mass": "4 g"}, {"frequenci": "3 Hz"}, "did you mean 'frequency'"),
        ({"mass": "4 g", "capacitance": 3e-8}, {}, "`capacitance` must be given once"),
        ({"mass": "4 g", "damping_ratio": 0.02}, {"q": "30"}, "`q` must be given once"),
    ],
)  # fmt: skip
def test_numbers_that_cannot_be(known, changed, said):
    points = {name: text for name, text in (SHEET | changed).items() if text is not None}
    with pytest.raises(hv.InputError, match=said):
        hv.identify(known=known, points=points)


@pytest.mark.filterwarnings("error")
def test_no_coupling_overflows():
    """The search for an interval leaves the range of any device, without a traceback or a warning of NumPy."""
    points = {"open_circuit_frequency": "60 Hz", "capacitance": "30 nF"}
    points["power_at_load"] = "1 mW at 100 kohm and 0.25 g"
    found = hv.identify(known={"mass": "4 g"}, points=points)
    assert "piezo.coupling" in dict(found.missing)
    assert all(0.0 < one.low <= one.value <= one.high < math.inf for one in found.parameters)


def test_a_class_that_is_not_known():
    with pytest.raises(hv.InputError, match="did you mean 'film'"):
        hv.identify(known={"mass": 4e-3}, points=SHEET, prior="films")


def test_the_prior_is_that_of_the_class():
    """Films have less damping than bonded plates, so the same voltage means a weaker coupling."""
    bulk, film = (
        hv.identify(known={"mass": 4e-3}, points=SHEET, prior=name) for name in ("bulk", "film")
    )
    assert film["quality_factor"].value == pytest.approx(0.5 / 0.009, rel=0.01)
    assert film["piezo.coupling"].value < 0.7 * bulk["piezo.coupling"].value
    assert [note.code for note in film.diagnostics] == ["damping_has_a_prior"]


def test_the_command_writes_a_scene(harvester, tmp_path):
    """Its keys run with an excitation and a load, and `tolerance` reads its intervals; there is no curve to draw."""
    path = tmp_path / "sheet.toml"
    options = ["--known", "mass=4 g", "--frequency", "60 Hz", "--capacitance", "30 nF", "--q", "60"]
    options += ["--open-circuit-voltage", "15 V at 0.25 g"]
    status, out, err = harvester(
        "identify", *options, "--out", path, "--report", tmp_path / "a.html"
    )
    assert (status, err) == (0, "")
    assert "written: " in out and "_fit.png" not in out and not list(tmp_path.glob("*.png"))
    assert "Correlations" in (tmp_path / "a.html").read_text()
    text = path.read_text()
    assert "# F, 95 %: 2.4" in text and "[excitation]" in text
    whole = text + '\n[excitation]\nacceleration_amplitude = "0.25 g"\nfrequency = "60.3 Hz"\n'
    path.write_text(whole + '\n[load]\nresistance = "1 Mohm"\n')
    status, out, _ = harvester("tolerance", path, "--samples", "64", "--json")
    assert status == 0 and "piezo.coupling" in out


def test_the_command_refuses(harvester):
    status, _, err = harvester("identify")
    assert status == 2 and "or the numbers of a datasheet" in err
    status, _, err = harvester("identify", "examples/bench_impedance.csv", "--prior", "film")
    assert status == 2 and "--prior must be given with" in err
    status, _, err = harvester(
        "identify", "--frequency", "60 Hz", "--capacitance", "30 nF", "--json"
    )
    assert status == 2 and "--power-at-load" in err and "Traceback" not in err


def test_json_has_intervals(harvester):
    status, out, _ = harvester(
        "identify", "--known", "mass=4 g", "--frequency", "60 Hz", "--capacitance", "30 nF",
        "--open-circuit-voltage", "15 V at 0.25 g", "--json",
    )  # fmt: skip
    answer = json.loads(out)
    coupling = answer["parameters"]["piezo.coupling"]
    assert status == 0 and coupling["low"] < coupling["value"] < coupling["high"]
    assert "prior" in answer["notes"][0] and answer["points"] == 4


def test_a_figure_needs_a_curve():
    with pytest.raises(hv.InputError, match="needs the curve of a file"):
        hv.identify(known={"mass": 4e-3}, points=SHEET).plot()
