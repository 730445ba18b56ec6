"""Quantiles and yield against 20,000 devices of a closed form, checks by a more accurate engine,
the command and its files."""

import csv
import json
import os
import sys
from dataclasses import replace

import numpy as np
import pytest

import harvester as hv
from harvester.engines import selection
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import has
from harvester.studies.sweep.compute import compute_table
from harvester.studies.sweep.points import Axis, Points
from harvester.studies.tolerance import samples as sampled
from harvester.studies.tolerance.device_limits import parse
from harvester.studies.tolerance.distribution import quantile, share_met, wilson
from tests.support.paths import ROOT

PLATE = ROOT / "examples" / "plate.toml"
STOP = ROOT / "examples" / "plate_with_stop.toml"
VARY = {"piezo.capacitance": "10%", "oscillator.damping": "normal:20%", "load.resistance": "E24:5%"}
COUNT = 20_000
ALONE = hv.Execution(workers=1)


def closed_form(capacitance, damping, resistance):
    """The mean power of the plate under white noise in SI, from its Lyapunov equation; arrays (n,)."""
    mass = 0.04
    stiffness = 16.0
    coupling = 1e-3
    density = 1e-5 * 9.80665**2
    w0 = np.sqrt(stiffness / mass)
    c = damping / (mass * w0)
    mu = 1.0 / (resistance * capacitance * w0)
    beta = coupling**2 / (stiffness * capacitance)
    loss = c * (1.0 + beta + mu * mu + c * mu) + beta * mu
    return 0.25 * density * mass * beta * mu / loss


def brute(designs):
    """Random devices of the plate: the columns of VARY by NumPy's generators, and their powers."""
    rng = np.random.default_rng(7)
    capacitance = 50.2e-9 * rng.uniform(0.9, 1.1, COUNT)
    resistance = 1e6 * rng.uniform(0.95, 1.05, COUNT)
    return closed_form(
        capacitance, designs * rng.normal(1.0, 0.2, COUNT).clip(0.2, 1.8), resistance
    )


@pytest.mark.slow
@pytest.mark.parametrize("damping", [3.2e-3, 6.4e-3, 2.5e-2])
def test_quantiles_and_yield_against_random_devices(damping):
    """Three designs: z-scores below 4 of every quantile and of the yield, which a wrong spread or law would break."""
    power = brute(damping)
    limit = float(np.quantile(power, 0.2))
    scene = hv.load(PLATE).vary("oscillator.damping", damping)
    found = hv.tolerance(
        scene, vary=VARY, limits=[f"mean_power > {limit} W"], samples=4096, runs=256
    )
    assert found.engine == "exact" and found.off < 0.01
    for share, one in found.quantiles.items():
        z = ((power < one.value).mean() - share) / np.sqrt(
            share * (1.0 - share) * (1.0 / COUNT + 1.0 / 4096)
        )
        assert abs(z) < 4.0, share
        assert one.low <= one.value <= one.high
    z = (found.met.value - 0.8) / np.sqrt(0.16 * (1.0 / COUNT + 1.0 / 4096))
    assert abs(z) < 4.0
    assert found.met.low < 0.8 < found.met.high
    assert found.met.high - found.met.low < 0.04


LINEAR_LAW = {"piezo.capacitance": "10%", "oscillator.damping": "normal:5%"}


@pytest.mark.thorough("test_gradient_is_that_of_differences")
@pytest.mark.slow
def test_first_order_states_what_it_leaves_out():
    """The plate, whose power is known in closed form: 95 % of the devices, and the mean, within the stated error."""
    found = hv.tolerance(PLATE, vary=LINEAR_LAW, runs="first-order", samples=2048)
    true = closed_form(*found.samples.T, 1e6)
    off = np.abs(found.power / true - 1.0)
    assert np.quantile(off, 0.95) < found.off < 10.0 * np.quantile(off, 0.95)
    assert abs(found.mean / true.mean() - 1.0) < found.off < 1e-3
    assert found.voltage == pytest.approx(np.sqrt(1e6 * true), rel=2.0 * found.off)
    assert has(found.diagnostics, "linear_law") and "curvature along the keys" in found.check


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (
            {"engine": "ensemble"},
            "`engine` must have a gradient of the power for `runs` 'first-order', such as 'density'",
        ),
        (
            {"limits": "peak_displacement < 1 mm"},
            "`limits` must have no peaks with `runs` 'first-order', but have peak_displacement",
        ),
        (
            {"limits": "peak_displacement < 1 mm", "lifetime": "1 year"},
            "`limits` must have no peaks with `runs` 'first-order', but have peak_displacement",
        ),
        ({"checks": 4}, "`checks` must be left out with `runs` 'first-order', but is given"),
        ({"runs": "few"}, "`runs` must be a whole number or 'first-order', but is 'few'"),
        ({"runs": "3"}, "`runs` must be between 16 and 50000, but is 3"),
    ],
)
def test_first_order_is_for_a_gradient(options, line):
    with pytest.raises(hv.InputError, match=f"^{line}"):
        hv.tolerance(PLATE, vary=LINEAR_LAW, **({"runs": "first-order"} | options))


@pytest.mark.thorough("test_an_engine_that_samples")
@pytest.mark.slow
def test_checks_by_the_ensemble_narrow_what_averaged_says():
    """The plate with a stop: the error left by 8 more expensive runs is below what `averaged`
    states, and names the key."""
    vary = {"piezo.capacitance": "10%", "stop.restitution": ".94:.98"}
    plain = hv.tolerance(STOP, vary=vary, samples=1024, runs=64, checks=0, engine="averaged")
    checked = hv.tolerance(
        STOP, vary=vary, limits=["mean_power > 8 uW"], samples=1024, runs=64, execution=ALONE
    )
    assert (checked.engine, plain.off > 0.02, checked.off < 0.015) == ("averaged", True, True)
    assert "8 runs of 'ensemble'" in checked.check
    assert checked.tornado[0].key == "stop.restitution"
    shares = checked.sensitivity
    assert shares["stop.restitution"].total > 0.7
    assert shares["piezo.capacitance"].total < 0.3
    # What the ensemble states of a device that was not checked lies within the error stated.
    device = hv.load(STOP).varied({"piezo.capacitance": 46e-9, "stop.restitution": 0.975})
    direct = hv.Ensemble(within="0.5%", seed=5).run(device).mean_power
    near = np.argmin(np.abs(checked.samples / [46e-9, 0.975] - 1.0).sum(axis=1))
    assert abs(checked.power[near] / direct.value - 1.0) < checked.off + 0.01


@pytest.mark.slow
def test_an_engine_that_samples():
    """A few runs with the same noise, and a polynomial: `ensemble` agrees with `exact` on the linear plate."""
    vary = {"piezo.capacitance": "20%"}
    exact = hv.tolerance(PLATE, vary=vary, samples=2048)
    noisy = hv.tolerance(
        PLATE,
        vary=vary,
        samples=2048,
        runs=16,
        engine=hv.Ensemble(trajectories=256),
        execution=ALONE,
    )
    assert "16 runs" in noisy.check and noisy.off < 0.05
    for share in (0.05, 0.5, 0.95):
        assert (
            noisy.quantiles[share].low < exact.quantiles[share].value < noisy.quantiles[share].high
        )


def test_without_salib_there_are_no_shares(monkeypatch):
    """The rest of the answer is the same, and a note has the remedy."""
    study = {"vary": {"nondimensional.c1": "20%"}, "samples": 256}
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    whole = hv.tolerance(scene, **study)
    monkeypatch.setitem(sys.modules, "SALib.analyze", None)
    without = hv.tolerance(scene, **study)
    assert whole.sensitivity and not without.sensitivity
    assert without.quantiles == whole.quantiles
    assert without.why.endswith(
        "is not installed: python -m pip install 'piezo-harvester[tolerance]'"
    )


def test_correlated_keys_have_no_shares():
    found = hv.tolerance(
        PLATE, vary=VARY, correlate=["piezo.capacitance,load.resistance=.8"], samples=256, runs=128
    )
    assert found.sensitivity == {} and "correlated" in found.why
    assert np.corrcoef(found.samples[:, [0, 2]].T)[0, 1] == pytest.approx(0.8, abs=0.06)


def test_devices_without_an_answer_do_not_meet_a_limit():
    """Damping from below to above zero: about half the devices never come to rest in a stationary law."""
    vary = {"oscillator.damping": "-.5:.5"}
    found = hv.tolerance(
        PLATE, vary=vary, limits=["mean_power > 0 W"], samples=256, runs=256, engine="exact"
    )
    assert 0.1 < found.failed / 256 < 0.9
    assert found.met.value == pytest.approx(1.0 - found.failed / 256)
    assert has(found.warnings, "samples_failed")


def test_outer_quantiles_of_few_runs():
    """A normal spread by 16 runs: its 1 % and 99 % are those of the closed form, not of the outermost run."""
    found = hv.tolerance(PLATE, vary={"oscillator.damping": "normal:10%"}, samples=4096, runs=16)
    power = closed_form(50.2e-9, found.samples[:, 0], 1e6)
    for share in (0.01, 0.99):
        assert found.quantiles[share].value / found.quantiles[0.5].value == pytest.approx(
            np.quantile(power, share) / np.median(power), rel=1e-6
        )


def test_a_polynomial_knows_of_failed_devices():
    """Half the computed devices have no answer: so have half of all samples, which counts in the yield."""
    vary = {"oscillator.damping": "-.5:.5"}
    found = hv.tolerance(
        PLATE, vary=vary, limits=["mean_power < 1 kW"], samples=1024, runs=64, engine="exact"
    )
    whole = hv.tolerance(
        PLATE, vary=vary, limits=["mean_power < 1 kW"], samples=64, runs=64, engine="exact"
    )
    assert len(found.power) + found.failed == 1024
    assert found.met.value == pytest.approx(whole.met.value, abs=0.02)
    assert has(found.warnings, "samples_outside")


@pytest.mark.parametrize(
    ("name", "engine"),
    [
        ("plate", "exact"),
        ("plate_with_stop", "averaged"),
        ("plate_compliant_stop", "ensemble"),
        ("plate_bridge", "ideal"),
    ],
)
def test_the_cheapest_engine_of_a_scene(name, engine):
    kind = sampled.cheapest(Problem.of(ROOT / "examples" / f"{name}.toml"))
    assert kind is selection.ENGINES[engine]


def test_a_spread_may_give_the_scene_a_stop():
    """The engine is chosen for the devices of the spreads, not for the scene without them."""
    vary = {"stop.gap": "0.1 mm:0.2 mm", "stop.restitution": "0.7:0.9"}
    found = hv.tolerance(PLATE, vary=vary, samples=16, checks=0)
    assert (found.engine, found.failed) == ("ensemble", 0)


def test_the_error_of_the_engine_widens_shares_and_deviation():
    """Values by `density` at 54 devices and a polynomial through them: `averaged` is 3 % high at one end."""
    plate = hv.load(STOP).vary("excitation.acceleration_psd", 1e-4 * 9.80665**2)
    vary = {"stop.gap": "0.5 mm:1.5 mm", "stop.restitution": "0.7:0.9", "piezo.coupling": "20%"}
    found = hv.tolerance(
        plate, vary=vary, samples=2048, runs=256, engine="averaged", execution=ALONE
    )
    shares = {"stop.gap": 0.5875, "stop.restitution": 0.0869, "piezo.coupling": 0.2713}
    for key, share in shares.items():
        stated = found.sensitivity[key]
        assert abs(stated.first - share) < stated.first_error95 < 0.25
    deviation = found.standard_deviation
    assert abs(deviation / 6.466e-6 - 1.0) > 0.02
    assert abs(deviation - 6.466e-6) < found.standard_deviation_error95 < 0.25 * deviation


@pytest.mark.slow
def test_limits_of_peaks():
    """The fraction of devices within a limit of the largest displacement, against Rice's level of
    each of 200 of them."""
    vary = {"oscillator.damping": "50%"}
    found = hv.tolerance(
        PLATE,
        vary=vary,
        limits="peak_displacement < 1.51 mm",
        runs=64,
        samples=1024,
        lifetime="5 years",
        execution=ALONE,
    )
    levels = [
        hv.extremes(
            hv.load(PLATE).vary("oscillator.damping", float(damping)), lifetime="5 years"
        ).levels["peak_displacement"]
        for damping in np.linspace(3.2e-3, 9.6e-3, 200)
    ]
    expected = np.mean([one[0.95].value < 1.51e-3 for one in levels])
    assert found.met.value == pytest.approx(expected, abs=0.01)
    assert found.met.low < expected < found.met.high < found.met.low + 0.25


def test_intervals():
    """Wilson's of 0 and all, and of 81 in 263 (Newcombe, Stat. Med. 17, 1998); quantiles hold what they should."""
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(0, 20)[0] == 0.0 and wilson(20, 20)[1] == 1.0
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(400):
        one = quantile(rng.random(200), 0.1)
        held += one.low <= 0.1 <= one.high
    assert held / 400 > 0.95 - 4.0 * np.sqrt(0.05 * 0.95 / 400)
    # 100 samples have no rank that is below the 1 % quantile, or above the 99 % one, with 97.5 %
    assert (
        quantile(rng.random(100), 0.01).low is None and quantile(rng.random(100), 0.99).high is None
    )
    assert (
        quantile(rng.random(100), 0.01).high is not None
        and quantile(rng.random(1000), 0.01).low is not None
    )


def test_an_error_with_an_unknown_part_is_not_stated():
    """The error of the engine itself, and of the more expensive one that checks it."""
    points = Points((Axis("oscillator.damping", (5e-3, 6e-3, 7e-3)),), listed=True)
    table = compute_table(hv.load(PLATE), points, [hv.Exact()], ALONE)
    engine = hv.Exact()
    assert sampled.direct(engine, table).off["mean_power"] is not None
    assert sampled.compared(table, [0, 1, 2], table, engine, engine).off["mean_power"] is not None
    rows = [replace(row, mean_power=row.mean_power.with_unknown("the model")) for row in table.rows]
    without = replace(table, rows=rows)
    assert sampled.direct(engine, without).off["mean_power"] is None
    ratio = sampled.compared(table, [0, 1, 2], without, engine, engine)
    assert ratio.off["mean_power"] is None and ratio.check.code == "no_error_stated"
    assert ratio.ratio["mean_power"] == pytest.approx(1.0)


def test_an_error_of_the_engine_widens_the_yield():
    power = {"mean_power": np.linspace(1.0, 2.0, 1001)}
    plain = share_met([parse("mean_power > 1.5 W")], power, {})
    wide = share_met(
        [parse("mean_power > 1.5 W")], power, {"mean_power": 0.1 * power["mean_power"]}
    )
    assert plain.value == wide.value == pytest.approx(501 / 1001)
    assert wide.low < 0.4 < plain.low < plain.high < 0.6 < wide.high


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mean_power", "QUANTITY > VALUE"),
        ("mean_powr > 1 uW", "did you mean 'mean_power'"),
        ("mean_power > 1 V", "a mean power"),
        ("mean_power > nan", "a mean power"),
        ("mean_power == 5 uW", "QUANTITY < VALUE"),
    ],
)
def test_bad_limit(text, words):
    with pytest.raises(hv.InputError, match=words):
        parse(text)


def test_points_name_their_argument():
    points = Points((Axis("stop.restitution", (0.9, 1.1)),), listed=True, argument="`vary`")
    with pytest.raises(hv.InputError, match=r"`vary`, point 2: stop\.restitution must"):
        points.check(hv.load(STOP))


@pytest.mark.slow
def test_command(harvester, tmp_path):
    """JSON as the contract has it; files; --resume gives the same answer; a report."""
    words = [
        "tolerance",
        PLATE,
        "--vary",
        "piezo.capacitance=10%",
        "--vary",
        "load.resistance=E24:5%",
        "--samples",
    ]
    words += [
        "512",
        "--runs",
        "128",
        "--limit",
        "mean_power > 9.4 uW",
        "--out",
        tmp_path / "out",
        "--report",
        "--json",
    ]
    status, out, err = harvester(*words)
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert {"engine", "quantiles", "yield", "sensitivity"} <= {*found}
    assert found["quantiles"]["0.05"] < found["quantiles"]["0.5"]
    assert found["yield"]["low"] < found["yield"]["value"] < found["yield"]["high"]
    assert {"first", "total"} <= {*found["sensitivity"]["piezo.capacitance"]}
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"tolerance.csv", "tolerance.png", "provenance.json", "report.html", "exact"}
    with (tmp_path / "out" / "tolerance.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 512 and [*rows[0]] == [
        "piezo.capacitance (F)",
        "load.resistance (ohm)",
        "mean_power (W)",
        "voltage_rms (V)",
    ]
    again = json.loads(harvester(*words, "--resume")[1])
    assert {**found, "seconds": 0} == {**again, "seconds": 0}
    status, out, err = harvester(*words, "--resume", "--seed", "3")
    assert (status, out) == (2, "") and "same sweep" in err


def test_command_says_it_in_words(harvester):
    status, out, _ = harvester(
        "tolerance", PLATE, "--vary", "piezo.capacitance=10%", "--runs", "64", "--samples", "64"
    )
    assert status == 0
    assert "devices below" in out and "variance share" in out and "5 % point" in out


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ([], "--vary"),
        (["--vary", "piezo.capacitance=10"], "the spread of piezo.capacitance"),
        (["--vary", "piezo.capacitance=10%", "--limit", "power>5"], "mean_power"),
        (["--vary", "piezo.capacitance=10%", "--samples", "3"], "--samples must be between 16"),
        (["--vary", "piezo.capacitance=10%", "--runs", "-3"], "--runs must be between 16"),
        (["--vary", "piezo.capacitance=10%", "--checks", "1"], "--checks must be 0"),
        (["--vary", "piezo.capacitance=10%", "--engine", "cheapest"], "--engine must be one"),
        (["--vary", "piezo.capacitance=10%", "--engine", "ideal"], "netlist"),
        (["--vary", "piezo.capacitance=10%", "--resume"], "--resume must be used with"),
        (
            ["--vary", "piezo.capacitance=10%", "--correlate", "a,b"],
            "--correlate must be KEY,KEY=NUMBER",
        ),
        (["--vary", "piezo.capacitance=10%", "--vector", "svg"], "--out"),
        (["--vary", "piezo.capacitance=-1:1"], "piezo.capacitance must"),
        (
            ["--vary", "piezo.capacitance=10%", "--limit", "peak_voltage < 9 V"],
            "--lifetime must be given",
        ),
        (["--vary", "piezo.capacitance=10%", "--lifetime", "1 h"], "--lifetime must be used with"),
        (
            [
                "--vary",
                "piezo.capacitance=10%",
                "--limit",
                "peak_voltage < 9 V",
                "--lifetime",
                "1 ns",
            ],
            # at once: it was stated after 16 s of computing
            "--lifetime must be at least 50 cycles of the device",
        ),
        (
            [
                "--vary",
                "piezo.capacitance=10%",
                "--limit",
                "impact_rate < 7 Hz",
                "--lifetime",
                "1 h",
            ],
            "a limit of impact_rate must be used with a stop, but the scene has none",
        ),
    ],
)
def test_bad_input(harvester, words, error):
    status, out, err = harvester("tolerance", PLATE, *words)
    assert (status, out) == (2, "")
    assert error in err and len(err.splitlines()) == 1


def test_a_pipe_as_scene(harvester, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    status, _, err = harvester("tolerance", tmp_path / "pipe", "--vary", "piezo.capacitance=10%")
    assert status == 2 and "pipe" in err
