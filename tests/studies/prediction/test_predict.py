"""Predictions of a real device: closed forms of the interval, its narrowing, the data file, and refusals."""

import json
import math
import re

import numpy as np
import pytest
from click.testing import CliRunner

import harvester as hv
from harvester import report
from harvester.answers.estimate import DISPLACEMENT
from harvester.cli import cli
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.studies.prediction import predict as predictions
from harvester.studies.prediction import priors
from harvester.studies.prediction.predict import interval

GIVEN = dict.fromkeys(("frequency", "damping", "coupling", "capacitance"), "given")


def weak(**load):
    """A device whose coupling is so weak that its power scales with theta^2 and damping^-2, at resonance."""
    return hv.Scene(
        oscillator=hv.Oscillator(mass=0.01, frequency=50.0, damping_ratio=0.02),
        piezo=hv.Piezo(coupling=1e-7, capacitance=20e-9),
        excitation=hv.Excitation(acceleration_amplitude=1.0, frequency=50.0),
        load=hv.Load(**(load or {"resistance": 1e3})),
    )


@pytest.mark.parametrize(
    "quantity, origin, exponent", [("coupling", "geometry", 2), ("damping", "measured", -2)]
)
def test_a_power_law_has_a_lognormal_power(quantity, origin, exponent):
    """ln P is normal with (exponent sigma)^2 + model^2: a wrong exponent, quantile or model would show in the width."""
    result = hv.predict(weak(), prior="composite", known=GIVEN | {quantity: origin}, seed=3)
    sigma = priors.prior_of(quantity, origin, "composite").sigma
    whole = math.hypot(exponent * sigma, result.model_sigma)
    assert math.log(result.power.ratio) == pytest.approx(2.0 * 1.96 * whole, rel=0.02)
    assert result.power.median == pytest.approx(result.computed.value, rel=0.02)
    assert math.log(result.voltage.ratio) == pytest.approx(1.96 * whole, rel=0.02)


@pytest.mark.slow
def test_a_measurement_narrows_as_its_smaller_spread_does():
    """The width after a measurement is that of a prediction whose number was measured; a wrong spread would differ."""
    unknown = GIVEN | {"coupling": "geometry", "damping": "unknown"}
    result = hv.predict(weak(), prior="composite", known=unknown)
    after = {one.quantity: one.width_after for one in result.quantities}
    for quantity in ("coupling", "damping"):
        measured = hv.predict(weak(), prior="composite", known=unknown | {quantity: "measured"})
        assert after[quantity] == pytest.approx(measured.power.ratio, rel=0.05)
    assert result.next_measurement == min(after, key=after.get) == "damping"


def test_an_impedance_curve_narrows_all_that_it_measures():
    """Its width is that of a prediction whose numbers were measured at a low level, and None if it narrows nothing."""
    unknown = GIVEN | {"coupling": "geometry", "damping": "unknown"}
    result = hv.predict(weak(), prior="composite", known=unknown)
    low = GIVEN | {"coupling": "measured_low", "damping": "measured_low"}
    measured = hv.predict(weak(), prior="composite", known=low)
    assert result.impedance_curve == pytest.approx(measured.power.ratio, rel=0.05)
    assert result.impedance_curve < 0.5 * result.power.ratio
    assert result.measurements.columns[0].cells[-1] == "impedance curve"
    assert measured.impedance_curve is None
    assert "impedance curve" not in measured.measurements.columns[0].cells


def test_points_give_the_normal_posterior():
    """With a weak coupling the voltage without load scales with theta/c: its point leaves a normal posterior.

    The voltage's error has half of the model error of a power and 2.5 % of the meter; a missing or a doubled error, a
    wrong exponent or an ignored point would each show in the standard deviation, the shift or the interval.
    """
    scene = weak(resistance=1e3)
    resonance = 2.0 * math.pi * 50.0
    volts = 1e-7 / 20e-9 / (0.04 * resonance**2)  # theta/Cp a/(w0^2 2 zeta)
    unknown = GIVEN | {"coupling": "geometry"}
    result = hv.predict(
        scene,
        prior="composite",
        known=unknown,
        points={"open_circuit_voltage": f"{1.2 * volts!r} V at 1 m/s^2"},
    )
    prior = priors.prior_of("coupling", "geometry", "composite").sigma
    error = math.hypot(0.025, 0.5 * 0.15)
    left = 1.0 / math.sqrt(prior**-2 + error**-2)
    [coupling] = result.quantities
    assert coupling.sigma_left == pytest.approx(left, rel=0.05)
    assert coupling.factor == pytest.approx(1.2 ** (left / error) ** 2, rel=0.01)
    whole = math.hypot(2.0 * left, result.model_sigma)
    assert math.log(result.power.ratio) == pytest.approx(2.0 * 1.96 * whole, rel=0.05)
    assert result.power.median == pytest.approx(
        result.computed.value * coupling.factor**2, rel=0.03
    )


@pytest.mark.slow
def test_a_power_and_a_resonance_pair_are_points_too():
    """The true device's own points give its coupling and damping back, each narrower than its prior."""
    scene = hv.load("examples/published/erturk_inman_2009.toml")
    modal = priors.in_modal_keys(scene)
    one, piezo = modal.oscillator, modal.piezo
    stiffer = one.stiffness + piezo.coupling**2 / piezo.capacitance
    hertz = math.sqrt(stiffer / one.mass) / (2.0 * math.pi)
    result = hv.predict(
        scene,
        known={"frequency": "tuned", "damping": "unknown"},
        samples=256,
        points={
            "open_circuit_frequency": f"{hertz!r} Hz",
            "power_at_load": "11.9 mW at 35 kohm and 1 g",
        },
    )
    left = {entry.quantity: entry for entry in result.quantities}
    assert left["damping"].sigma_left < 0.3 < left["damping"].sigma
    assert left["coupling"].sigma_left < left["coupling"].sigma
    assert left["coupling"].factor == pytest.approx(1.0, abs=0.05)


def test_a_measurement_after_a_point_does_not_widen_the_interval():
    """So many devices count that the ends of an interval do not depend on single ones."""
    scene = hv.load("examples/published/erturk_inman_2009.toml")
    points = {"open_circuit_frequency": "48.22 Hz"}
    result = hv.predict(scene, samples=256, points=points)
    widths = [entry.width_after for entry in result.quantities]
    assert len(widths) == 4 and max(widths) < 1.03 * result.power.ratio


def test_a_width_from_few_devices_is_not_stated(monkeypatch):
    """The devices that are left are the fewer, the more a measurement narrows."""
    monkeypatch.setattr(predictions, "FEWEST", 1e6)
    points = {"open_circuit_frequency": "48.22 Hz"}
    scene = hv.load("examples/published/erturk_inman_2009.toml")
    result = hv.predict(scene, samples=64, points=points)
    assert result.impedance_curve is None and not result.next_measurement


@pytest.mark.parametrize(
    "points, words",
    [
        ({"open_circuit_voltag": "2 V at 1 g"}, "did you mean 'open_circuit_voltage'"),
        ({"open_circuit_voltage": "2 V"}, "VOLTAGE at ACCELERATION"),
        ({"open_circuit_frequency": "2 V"}, "open_circuit_frequency"),
        ({"open_circuit_voltage": "2 kV at 1 m/s^2"}, "must be possible for devices of the priors"),
    ],
)
def test_impossible_points_are_refused(points, words):
    """A wrong name or form, and a voltage that no device of the priors has."""
    with pytest.raises(InputError, match=words):
        hv.predict(weak(), known=GIVEN | {"coupling": "geometry"}, points=points, samples=64)


def test_the_command_takes_points():
    """They are in the table; without --predict they are refused."""
    words = ["run", "examples/plate_harmonic.toml", "--points", "open_circuit_frequency=3.5 Hz"]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code and "--predict is left out" in str(done.output) + str(done.exception)


def test_the_error_of_the_computation_stays_apart():
    """The scene as it is written has its closed form, without the spread of the device."""
    result = hv.predict(weak(), samples=64)
    assert result.computed.error95 < 1e-6 * result.computed.value
    assert result.computed.value == hv.run(weak()).mean_power.value


def test_a_report_names_class_and_next_measurement():
    """The printed answer has both as well. Without a narrowing there is no line."""
    scene = weak()
    answer = hv.run(scene)
    for origin, named in (("unknown", "damping"), ("measured", "")):
        result = hv.predict(scene, prior="film", known=GIVEN | {"damping": origin}, samples=64)
        page = report.html(report.of_run(scene, answer, 0, prediction=result))
        assert "class film" in page
        assert ("Next measurement:" in page) == bool(named)
        assert not named or f"Next measurement: {named}" in page


def test_a_device_with_a_stop_gives_less_than_computed():
    """The median has the factor of the data file and the width its error; a linear device has neither."""
    known = GIVEN | {"coupling": "measured", "gap": "given", "restitution": "given"}
    result = hv.predict("examples/plate_with_stop.toml", known=known, samples=64)
    model = priors.data()["model"]
    assert (result.model_factor, result.model_sigma) == (model["stop_factor"], model["stop"])
    assert result.power.median == pytest.approx(0.34 * result.computed.value, rel=0.05)
    assert math.log(result.power.ratio) == pytest.approx(2.0 * 1.96 * 0.45, rel=0.05)
    assert "predicted_stop" in {entry.code for entry in result.diagnostics}
    assert hv.predict(weak(), samples=64).model_factor == 1.0


NOISE = hv.Excitation(acceleration_psd="1e-5 g^2/Hz")
DRIVE = hv.Excitation(acceleration_amplitude="0.05 g", frequency="50 Hz")


@pytest.mark.parametrize("shaking", [NOISE, DRIVE])
@pytest.mark.parametrize("opposite", [False, True])
def test_a_stop_that_is_not_reached_changes_no_model_error(shaking, opposite):
    """The model error is that of a linear device if the stop is 6 RMS displacements away, else that of a stop."""
    free = weak().replace(excitation=shaking)
    rms = hv.run(free).details[DISPLACEMENT]

    def at(gap):
        both = {"stop": hv.Stop(restitution=0.8, gap=gap)}
        if opposite:
            both = {
                "stop": hv.Stop(restitution=0.8, gap=1.0),
                "opposite_stop": hv.OppositeStop(restitution=0.8, gap=gap),
            }
        return priors.model_error(Problem(free.replace(**both)))

    model = priors.data()["model"]
    assert at(6.01 * rms) == at(1.0) == priors.model_error(Problem(free))
    assert at(5.99 * rms) == at(1e-9) == priors.ModelError(model["stop_factor"], model["stop"])


def test_a_pressed_stop_and_a_spring_keep_their_model_errors():
    model = priors.data()["model"]
    pressed = weak().replace(stop=hv.Stop(restitution=0.8, gap="-0.1 mm"))
    assert priors.model_error(Problem(pressed)).factor == model["stop_factor"]
    bent = weak().replace(
        oscillator=hv.Oscillator(
            mass=0.01, frequency=50.0, damping_ratio=0.02, cubic_stiffness=1e9
        ),
        stop=hv.Stop(restitution=0.8, gap=1.0),
    )
    assert priors.model_error(Problem(bent)) == priors.ModelError(1.0, model["nonlinear"])


def test_keys_in_other_forms_are_the_same_device():
    """Stiffness, damping and coupling replace frequency, q and the open-circuit frequency, and the power stays."""
    scene = hv.load("examples/plate.toml")
    assert hv.run(priors.in_modal_keys(scene)).mean_power.value == pytest.approx(
        hv.run(scene).mean_power.value, rel=1e-9
    )


def test_every_row_of_the_data_file_can_be_used():
    """Each prior has a class, an origin, a source, and a sigma or a range; defaults have one for each class."""
    data = priors.data()
    for row in data["prior"]:
        assert row["class"] in {*data["classes"], "any"} and row["origin"] in data["origins"]
        assert row["quantity"] in priors.KEYS and len(row["source"]) > 5
        assert 0.0 < row.get("sigma", 0.1) < 1.0 and ("sigma" in row) != ("range" in row)
    for quantity, origin in data["defaults"].items():
        assert all(priors.prior_of(quantity, origin, name) is not None for name in data["classes"])
    rows = [(row["quantity"], row["origin"], row["class"]) for row in data["prior"]]
    assert len(rows) == len(set(rows))


@pytest.mark.parametrize(
    "options, words",
    [
        ({"prior": "fim"}, "did you mean 'film'"),
        ({"known": {"dampin": "measured"}}, "did you mean 'damping'"),
        ({"known": {"damping": "measurd"}}, "did you mean 'measured'"),
        ({"known": {"damping": "tuned"}}, "must give damping one of the origins"),
        ({"known": GIVEN}, "must leave a quantity with a spread"),
    ],
)
def test_refusals(options, words):
    """One line with the nearest match or the remedy."""
    with pytest.raises(InputError, match=words):
        hv.predict(weak(), **options)


def test_a_nondimensional_scene_is_refused():
    """Its keys are ratios, which do not scatter one by one."""
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    with pytest.raises(InputError, match="needs a scene with units"):
        hv.predict(scene)


def test_lognormal_spread():
    """Its median and the standard deviation of its logarithm are those that were written."""
    from harvester.studies.tolerance.spreads import spread

    part = spread("piezo.coupling", "lognormal:0.3", weak())
    values = np.log(part.at((np.arange(20000) + 0.5) / 20000) / 1e-7)
    assert np.mean(values) == pytest.approx(0.0, abs=1e-6)
    assert np.std(values) == pytest.approx(0.3, rel=2e-3)
    assert spread("piezo.coupling", "lognormal:2e-7:0.3", weak()).values == (2e-7, 0.3)


def test_the_command_has_two_numbers(tmp_path):
    """The error of the computation and the interval of a device are two entries, and the page has the interval."""
    page = tmp_path / "page.html"
    words = [
        "run",
        "examples/plate_harmonic.toml",
        "--predict",
        "--prior",
        "film",
        "--known",
        "frequency=tuned",
    ]
    done = CliRunner().invoke(
        cli, [*words, "--json", "--report", str(page)], catch_exceptions=False
    )
    prediction = json.loads(done.stdout)["prediction"]
    assert prediction["computed"]["value"] == json.loads(done.stdout)["mean_power"]["value"]
    assert (
        0.0
        < prediction["power"]["low"]
        < prediction["power"]["median"]
        < prediction["power"]["high"]
    )
    assert "a real device: 95 % of devices" in page.read_text()


@pytest.mark.ngspice
def test_a_budget_includes_the_devices_of_a_netlist():
    """They needed a minute after any budget: the power and the devices end in it."""
    words = ["run", "examples/bimorph_board.toml", "--predict", "--budget", "12s", "--json"]
    done = CliRunner().invoke(cli, words, catch_exceptions=False)
    told = json.loads(done.stdout)
    # twice the budget on a machine that is busy otherwise; it was three times and more
    assert told["seconds"] + told["prediction"]["seconds"] < 24.0
    codes = {entry["code"] for entry in told["diagnostics"]}
    assert "prediction_beyond_budget" not in codes


@pytest.mark.parametrize("command", ["run", "tolerance"])
def test_known_alone_is_refused(command):
    """An option without effect is an error."""
    done = CliRunner().invoke(cli, [command, "examples/plate.toml", "--known", "damping=measured"])
    assert done.exit_code and "must be given with" in str(done.output) + str(done.exception)


def test_tolerance_accepts_a_prior(tmp_path):
    """The spreads of the class, and one of the user next to them."""
    words = ["tolerance", "examples/plate.toml", "--prior", "bulk", "--vary", "load.resistance=5%"]
    done = CliRunner().invoke(cli, [*words, "--samples", "64", "--json"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert {"piezo.coupling", "load.resistance"} <= set(json.loads(done.stdout)["tornado"])


def test_a_number_of_a_real_device_is_printed_in_its_unit():
    """It was printed as a time: "5 % have after 11.25 us"."""
    result = hv.predict("examples/plate_harmonic.toml", samples=64)
    assert re.fullmatch(r"[\d.]+ uW \([\d.]+ uW to [\d.]+ uW\)", str(result.power))
    assert str(result.voltage).count(" V") == 3


def test_devices_without_power_are_in_the_interval():
    """A share of zeros above 2.5 % makes the lower end 0; the others keep their place among all."""
    values = np.linspace(1.0, 2.0, 100_001)
    whole = interval(values, 0.0, "W")
    some = interval(values, 0.1, "W")
    assert (whole.low, whole.high) == pytest.approx((1.025, 1.975), abs=1e-4)
    assert some.low == 0.0
    assert some.median == pytest.approx(1.0 + 0.4 / 0.9, abs=1e-4)


def test_an_interval_that_begins_at_0_has_no_width():
    """A chip that may stay off has no power at the low end; the ratio was printed as inf."""
    assert predictions.RealDevice(median=1.0, low=0.0, high=5.0, unit="W").ratio is None
    assert predictions.RealDevice(median=1.0, low=2.0, high=5.0, unit="W").ratio == 2.5
