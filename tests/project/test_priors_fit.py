"""The fit of the priors: docs/prediction_fit.md has its tables, and a fit of made-up devices finds their numbers."""

import dataclasses
import importlib
import math
import re
import sys
from collections import Counter

import numpy as np
import pytest

from harvester.studies.prediction import priors
from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
priors_fit, priors_limits, priors_kinds, narrowed = map(
    importlib.import_module, ("priors_fit", "priors_limits", "priors_kinds", "narrowed")
)
PAGE = priors_fit.PAGE.read_text()


def test_the_page_has_what_the_command_prints():
    """Coverage and widths of every kind of interval, and the fit for each device left out."""
    some = [number for number in priors_fit.numbers() if number.measured is not None]
    fits = priors_fit.left_out(some)
    generated = PAGE.partition(priors_fit.BEGIN)[2].partition(priors_fit.END)[0]
    lines = [*priors_fit.table(some, fits), "", *priors_fit.by_device(some, fits)]
    assert generated.strip().splitlines()[: len(lines)] == lines


@pytest.mark.slow
def test_the_page_has_the_limits():
    """Designs, unknowns, widths by device and after one measured number, as the benchmark computes them."""
    generated = PAGE.partition(priors_limits.BEGIN)[2].partition(priors_limits.END)[0]
    assert generated.strip().splitlines() == priors_limits.block()


def test_one_measured_number_gives_the_normal_conditional():
    """If two voltages have all in common, the second is known exactly; between two that have nothing, it stays."""
    fit = priors_fit.Fit(1.0, 0.4, 0.4)
    pair = [
        priors_fit.Number(
            device="a",
            quantity=name,
            unit="V",
            predicted=1.0,
            own=0.05,
            linear=True,
            with_priors=False,
            measured=value,
            half_digit=0.0,
            exponents=priors_fit.EXPONENTS["V"],
            sigmas=(0.0, 0.0, 0.0),
        )
        for name, value in (("first", 1.5), ("second", None))
    ]
    [(low, high)] = priors_limits.conditioned(pair, 0, priors_limits.Common(fit, 1.0)).values()
    assert low == pytest.approx(1.5, rel=1e-6) and high == pytest.approx(1.5, rel=1e-6)
    [(low, high)] = priors_limits.conditioned(pair, 0, priors_limits.Common(fit, 0.0)).values()
    assert (low, high) == pytest.approx(priors_fit.interval(pair[1], fit))


def made_up(fit, rng, devices=60):
    """Numbers of devices whose measured values scatter as a fit states: a voltage, a power and a frequency each."""
    numbers = []
    for device in range(devices):
        shared = rng.standard_normal(2)
        for unit in ("V", "W", "Hz"):
            number = priors_fit.Number(
                device=f"made-up {device}",
                quantity=unit,
                unit=unit,
                predicted=1.0,
                own=0.05,
                linear=device % 2 == 0,
                with_priors=False,
                measured=None,
                half_digit=0.0,
                exponents=priors_fit.EXPONENTS[unit],
                sigmas=(0.2, 0.3, 0.02),
            )
            log = float(np.dot(priors_fit.shared(number, fit), shared))
            log += math.sqrt(priors_fit.alone(number, fit)) * rng.standard_normal()
            numbers.append(dataclasses.replace(number, measured=math.exp(log)))
    return numbers


@pytest.mark.parametrize("seed", range(3))
def test_a_fit_finds_the_numbers_that_made_the_devices(seed):
    """Within four of its standard errors, about 1/sqrt(2 n) of each number: a missing covariance would shift them."""
    truth = priors_fit.Fit(1.5, 0.1, 0.6)
    numbers = made_up(truth, np.random.default_rng(seed))
    fit = priors_fit.fitted(numbers)
    assert fit.factor == pytest.approx(truth.factor, rel=4.0 / math.sqrt(2.0 * 60))
    assert fit.nonlinear == pytest.approx(truth.nonlinear, rel=4.0 / math.sqrt(2.0 * 30))
    met = sum(priors_fit.holds(number, priors_fit.interval(number, fit)) for number in numbers)
    low, high = priors_fit.wilson(met, len(numbers))
    assert low < 0.95 < high


@pytest.mark.slow
def test_a_device_left_out_is_not_in_its_fit():
    """Its measured values do not change its own interval."""
    some = [number for number in priors_fit.numbers() if number.measured is not None]
    moved = [
        dataclasses.replace(number, measured=7.0 * number.measured)
        if number.device == "koga"
        else number
        for number in some
    ]
    assert priors_fit.left_out(some)["koga"] == priors_fit.left_out(moved)["koga"]
    assert priors_fit.left_out(some)["liu"] != priors_fit.left_out(moved)["liu"]


def test_every_quantity_of_the_blind_devices_is_predicted():
    """The counts that were asked for, each with ends about its median, and an interval of the fit."""
    rows = priors_fit.rows("predicted.csv")
    counts = Counter(row["device"] for row in rows if re.fullmatch(r"D\d+", row["device"]))
    assert counts == {
        "D1": 3,
        "D2": 8,
        "D3": 9,
        "D4": 16,
        "D5": 8,
        "D6": 6,
        "D7": 3,
        "D8": 56,
        "D9": 27,
        **dict.fromkeys((f"D{number}" for number in range(10, 25)), 1),
        **dict.fromkeys(("D13", "D14", "D16", "D18", "D21"), 2),
        "D25": 3,
        "D26": 6,
    }
    for row in rows:
        for version in ("", "_1", "_2", "_3"):
            low, value, high = (float(row[name + version]) for name in ("low", "predicted", "high"))
            assert low <= value <= high, row["quantity"]


def test_the_fitted_model_errors_are_those_of_the_package():
    """The data file rounds the nonlinear one, and keeps a larger linear one, which nine numbers cannot lower."""
    some = [number for number in priors_fit.numbers() if number.measured is not None]
    fit = priors_fit.fitted(some)
    model = priors.data()["model"]
    assert model["nonlinear"] == pytest.approx(fit.nonlinear, abs=0.02)
    assert model["linear"] >= fit.linear
    assert model["linear"] == priors_fit.FIRST.linear


def of_kinds(kinds, rng, devices=60):
    """Made-up devices that scatter as a fit by kinds states, a third of each kind."""
    made = made_up(priors_fit.Fit(kinds.factor, 0.0, 0.0), rng, devices)
    numbers = []
    for number in made:
        kind = ("linear", "loss", "spring")[int(number.device.rpartition(" ")[2]) % 3]
        number = dataclasses.replace(number, linear=kind == "linear")
        priors_kinds.KINDS[number.device] = kind
        error = {"linear": kinds.linear, "loss": kinds.loss, "spring": kinds.spring}[kind]
        log = number.exponents[3] * error * rng.standard_normal()
        log += number.exponents[3] * (kinds.offset if kind == "loss" else 0.0)
        numbers.append(dataclasses.replace(number, measured=number.measured * math.exp(log)))
    return numbers


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.slow
def test_a_fit_by_kinds_finds_its_numbers(seed, monkeypatch):
    """Within four standard errors: an offset that is left out, or of another kind, shifts the errors."""
    monkeypatch.setattr(priors_kinds, "KINDS", dict(priors_kinds.KINDS))
    truth = priors_kinds.Kinds(1.3, 0.1, 0.4, 0.9, -1.0, 0.0)
    numbers = of_kinds(truth, np.random.default_rng(seed))
    fit = priors_kinds.fitted(numbers)
    assert fit.offset == pytest.approx(truth.offset, abs=4.0 * fit.offset_error)
    assert 0.4 / math.sqrt(40) < fit.offset_error < 1.0 / math.sqrt(20)
    assert fit.loss == pytest.approx(truth.loss, rel=4.0 / math.sqrt(2.0 * 20))
    assert fit.spring == pytest.approx(truth.spring, rel=4.0 / math.sqrt(2.0 * 20))
    met = [priors_fit.holds(number, fit.ends(number)) for number in numbers]
    low, high = priors_fit.wilson(sum(met), len(met))
    assert low < 0.95 < high
    without = priors_kinds.fitted(numbers, with_offset=False)
    assert without.factor > 1.2 * fit.factor  # which mistakes it for coupling and damping


@pytest.mark.slow
def test_the_page_of_widths_and_its_columns():
    """Page and columns are those that the command computes now, and the data file rounds its fit."""
    results = priors_kinds.computed()
    page = priors_kinds.PAGE.read_text()
    generated = page.partition(priors_kinds.BEGIN)[2].partition(priors_kinds.END)[0]
    assert generated.strip().splitlines() == priors_kinds.block(results)
    columns = {
        (row["device"], row["quantity"]): [float(row[f"{end}_3"]) for end in ("low", "high")]
        for row in priors_fit.rows("predicted.csv")
    }
    for number in results.every:
        kinds = results.fits["middle"].get(number.device, results.final)
        ends = columns[number.device, number.quantity]
        assert ends == pytest.approx(kinds.ends(number), rel=1e-3)
    model = priors.data()["model"]
    fit = priors_kinds.fitted(results.some)
    assert model["stop_factor"] == pytest.approx(math.exp(fit.offset), abs=0.01)
    assert model["stop"] == pytest.approx(math.hypot(fit.loss, fit.offset_error), abs=0.01)


@pytest.mark.slow
def test_the_device_of_no_fit_is_in_none():
    """Its measured values are in a file that no fit reads, one for each of its predictions."""
    of_d9 = [row for row in priors_fit.rows("measured_later.csv") if row["device"] == "D9"]
    later = {row["what"] for row in of_d9}
    rows = priors_fit.rows("predicted.csv")
    assert later == {row["quantity"] for row in rows if row["device"] == "D9"} and len(later) == 27
    assert all(n.measured is None for n in priors_fit.numbers() if n.device == "D9")
    [*_, second, third, whole] = priors_kinds.later()
    assert "| 26 of 27 |" in second and "| 18 of 27 |" in third and "| 52 of 56 |" in whole


def test_no_fit_by_kinds_has_its_own_device():
    """The measured values of a device do not change its own interval, and they do change that of another."""
    some = [number for number in priors_fit.numbers() if number.measured is not None]
    pair = [number for number in some if number.device in ("koga", "liu", "erturk")]
    moved = [
        dataclasses.replace(number, measured=3.0 * number.measured)
        if number.device == "koga"
        else number
        for number in pair
    ]
    first, second = priors_kinds.left_out(pair), priors_kinds.left_out(moved)
    assert first["koga"] == second["koga"] and first["liu"] != second["liu"]


@pytest.mark.slow
def test_a_device_after_a_curve_and_after_a_power():
    """The row of a measured device, computed anew; and of weighted normal numbers the width of a normal posterior."""
    rng = np.random.default_rng(2)
    shared, noise = rng.standard_normal((2, 200_000))
    values = 0.4 * shared + 0.1 * noise
    weights = np.exp(-0.5 * (0.4 * shared / 0.2) ** 2)
    left = math.sqrt(1.0 / (0.4**-2 + 0.2**-2) + 0.1**2)
    assert math.log(narrowed.ratio(values, weights)) == pytest.approx(3.92 * left, rel=0.02)
    [(title, device_class, scene)] = [
        entry for entry in narrowed.devices() if entry[0].startswith("bridge")
    ]
    found = narrowed.widths(scene, device_class)
    row = f"| {title} | {device_class} | {' | '.join(f'{value:.1f}' for value in found)} |"
    assert row in narrowed.PAGE.read_text()
