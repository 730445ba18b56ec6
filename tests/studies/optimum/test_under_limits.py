"""The best design for most of the devices and under limits: closed forms, the plate with a stop, series, command."""

import dataclasses
import json
import re

import numpy as np
import pytest

import harvester as hv
from harvester.presentation.diagnostic import has
from harvester.quantities import preferred_numbers as preferred
from harvester.studies.optimum.robust import Robust
from harvester.studies.optimum.under_limits import followed
from harvester.studies.tolerance.spreads import spread
from tests.support import systems
from tests.support.paths import ROOT

STOP = ROOT / "examples" / "plate_with_stop.toml"
PLATE = ROOT / "examples" / "plate.toml"
BETA, DAMPING = 0.5, 0.05
LINEAR = systems.scene(systems.linear(BETA, 1.0, DAMPING))
MU = {"nondimensional.mu": (0.05, 20.0)}


def linear_power(mu):
    return BETA * mu * systems.linear_v2(systems.linear(BETA, mu, DAMPING))


@pytest.mark.slow
def test_quantile_of_a_known_function():
    """mu anywhere within 40 %: the worst 5 % are at the ends, and the best mu is where the ends are equally bad."""
    best = hv.optimise(
        LINEAR,
        vary="nondimensional.mu=E48:.5:5",
        spread={"nondimensional.mu": "40%"},
        objective="5%",
    )
    grid = np.geomspace(0.5, 5.0, 2001)
    u = (np.arange(400) + 0.5) / 400
    table = np.array(
        [[linear_power(mu * (0.6 + 0.8 * one)) for one in u[::8]] for mu in grid[::10]]
    )
    worst = np.quantile(table, 0.05, axis=1)
    found = best.keys[0].value
    assert found == pytest.approx(grid[::10][worst.argmax()], rel=0.1)
    assert best.mean_power.value == pytest.approx(worst.max(), rel=0.01)
    assert best.binds == () and best.met


def narrow():
    """A bimorph with a resistor at its resonance, which is far narrower than the spread of its mass."""
    scene = hv.load(ROOT / "examples" / "bimorph_ltc3588.toml")
    device = dataclasses.replace(scene.oscillator, damping_ratio=0.01)
    return dataclasses.replace(scene, oscillator=device).with_load(43e3)


def by_brute_force(scene, share):
    """The mean of 2,000 devices (``share`` None), or what all but the share exceed (W)."""
    part = spread("oscillator.mass", "10%", scene)
    masses = map(float, part.at((np.arange(2000) + 0.5) / 2000))
    answers = hv.Exact().run_many([scene.vary("oscillator.mass", mass) for mass in masses])
    powers = np.array([answer.mean_power.value for answer in answers])
    return powers.mean() if share is None else np.quantile(powers, share)


@pytest.mark.parametrize("share", [None, 0.05])
@pytest.mark.slow
def test_a_spread_across_a_narrow_resonance(share):
    """No polynomial follows it: the error states so, and devices one by one give the power to 1
    %."""
    scene = narrow()
    true = by_brute_force(scene, share)
    robust = Robust(hv.Exact(), (("oscillator.mass", "10%"),), share)
    few = robust.outcome(scene)[1]
    assert few.unresolved > 0.03
    assert abs(few.power.value - true) < few.power.known_error95
    many = robust.resolved(scene, 60.0)
    assert many.devices > few.devices and many.unresolved <= 0.01
    assert abs(many.power.value - true) < many.power.known_error95
    cut_short = robust.resolved(scene, 0.0)
    assert cut_short.devices == 64 and cut_short.unresolved > 0.01


@pytest.mark.slow
def test_an_answer_across_a_narrow_resonance_is_not_left_wide():
    best = hv.optimise(
        narrow(),
        vary="load.resistance=10k:1M",
        spread={"oscillator.mass": "10%"},
        objective="5%",
        budget="30s",
    )
    true = by_brute_force(narrow().with_load(best.keys[0].value), 0.05)
    assert abs(best.mean_power.value - true) < best.mean_power.known_error95 < 0.015 * true
    assert has(best.warnings, "spread_not_followed")


@pytest.mark.thorough("test_an_answer_across_a_narrow_resonance_is_not_left_wide")
@pytest.mark.slow
def test_a_front_across_a_narrow_resonance_is_not_left_wide():
    front = hv.optimise(
        narrow(),
        vary="load.resistance=10k:1M",
        spread={"oscillator.mass": "10%"},
        objective=["5%", "voltage_rms:high"],
        points=3,
        budget="400s",
    )
    assert len(front.points) == 3
    for point in front.points:
        (resistance,) = point.keys.values()
        true = by_brute_force(narrow().with_load(resistance), 0.05)
        power = point.mean_power
        assert abs(power.value - true) < power.known_error95 < 0.015 * true
    codes = [remark.code for remark in front.diagnostics]
    assert codes.count("spread_not_followed") == 1


@pytest.mark.slow
def test_a_limit_far_from_its_bound_does_not_bind():
    """The next values of a series are compared by the power of the search, not by that of more devices."""
    best = hv.optimise(
        narrow(),
        vary="load.resistance=E24:10k:1M",
        spread={"oscillator.mass": "10%"},
        objective="5%",
        constraints="voltage_rms < 6 V",
        budget="4s",
    )
    (key,) = best.keys
    robust = Robust(hv.Exact(), (("oscillator.mass", "10%"),), 0.05)
    series = key.range.steps
    index = series.index(key.value)
    powers = [
        robust.outcome(narrow().with_load(one))[1].objective
        for one in series[index - 1 : index + 2]
    ]
    assert best.outcome.devices > 15
    assert best.binds == () or max(powers) > powers[1]


def test_devices_that_cannot_be_leave_the_search():
    """A spread so wide that one of many devices has a negative mass: a warning, and the power of the search."""
    robust = Robust(hv.Exact(), (("oscillator.mass", "normal:29%"),), 0.05)
    searched = robust.outcome(narrow())[1]
    outcome, warnings = followed(robust, narrow(), searched, seconds=120.0, budget=120.0)
    assert outcome is searched
    assert [one.code for one in warnings] == ["spread_without_answers", "spread_not_followed"]
    assert "mass" in str(warnings[0])


def test_limit_binds_where_it_should():
    """E[V^2] falls with mu: below its unlimited optimum a limit keeps mu at the place that the closed form names."""
    free = hv.optimise(LINEAR, vary=MU, engine="exact").keys[0].value
    bound = systems.linear_v2(systems.linear(BETA, 2.0 * free, DAMPING))
    best = hv.optimise(
        LINEAR, vary=MU, constraints=[f"mean_square_voltage < {bound}", "mean_power > 1e-9"]
    )
    assert best.keys[0].value == pytest.approx(2.0 * free, rel=0.01)
    assert [one.quantity for one in best.binds] == ["mean_square_voltage"] and best.met


def test_limits_that_no_place_meets():
    best = hv.optimise(LINEAR, vary=MU, constraints=["mean_power > 1e9"])
    assert not best.met
    assert "no point in the range meets all limits" in str(best.warnings[-1])


@pytest.mark.thorough("test_quantile_of_a_known_function")
@pytest.mark.slow
def test_the_plate_with_a_stop():
    """The optimum for the 5 % quantile has a higher quantile than that for the mean, also by `tolerance` itself."""
    over = {"load.resistance": "E24:200k:1M"}
    spread = {"load.resistance": "50%", "piezo.capacitance": "30%"}
    worst, mean = (
        hv.optimise(STOP, vary=over, spread=spread, objective=aim) for aim in ("5%", "mean_power")
    )
    loads = [one.keys[0].value for one in (worst, mean)]
    assert loads[0] != loads[1] and {*loads} < {*preferred.between("E24", 2e5, 1e6)}
    quantiles, means = [], []
    for load in loads:
        scene = hv.load(STOP).with_load(load)
        found = hv.tolerance(scene, vary=spread, engine="averaged", checks=0, runs=32, samples=4096)
        quantiles.append(found.quantiles[0.05].value)
        means.append(found.power.mean())
    assert quantiles[0] > quantiles[1]
    assert means[1] > means[0]
    assert worst.mean_power.value == pytest.approx(quantiles[0], rel=0.005)


def test_next_value_of_a_series_breaks_the_limit():
    """The limit is named though the best value of the series has something to spare."""
    best = hv.optimise(PLATE, vary="load.resistance=E6:10k:10M", constraints="voltage_rms < 2 V")
    assert best.keys[0].value == 330e3
    assert [one.quantity for one in best.binds] == ["voltage_rms"]
    assert best.outcome.quantities[0] < 1.95


@pytest.mark.slow
def test_limit_of_a_peak():
    """The best load without it breaks it; with it, the largest voltage over the lifetime is just allowed."""
    over = {"load.resistance": ("100 kohm", "10 Mohm")}
    best = hv.optimise(
        PLATE, vary=over, constraints=["peak_voltage < 12 V"], lifetime="5 years", budget=20
    )
    load = best.keys[0].value
    there = hv.extremes(hv.load(PLATE).with_load(load), lifetime="5 years").levels["peak_voltage"][
        0.95
    ]
    assert there.value + there.known_error95 == pytest.approx(12.0, rel=0.01)
    assert [one.quantity for one in best.binds] == ["peak_voltage"]
    assert load < 0.9 * hv.optimise(PLATE, vary=over, engine="exact").keys[0].value


@pytest.mark.thorough("test_limit_of_a_peak")
@pytest.mark.slow
def test_limit_of_a_peak_behind_a_stop(monkeypatch):
    """Twelve paths represent all loads; the long path of the design found keeps the limit that binds."""
    monkeypatch.setattr("harvester.studies.optimum.place_peaks.COUNTED", 5)
    monkeypatch.setattr("harvester.studies.tolerance.peaks.BLOCKS", 256)
    monkeypatch.setattr("harvester.studies.optimum.under_limits.LONG", 1)
    over = {"load.resistance": ("100 kohm", "1 Mohm")}
    most = (
        hv.extremes(hv.load(STOP).with_load("250 kohm"), lifetime="1 h")
        .levels["peak_voltage"][0.95]
        .value
    )
    best = hv.optimise(
        STOP, vary=over, constraints=[f"peak_voltage < {most} V"], lifetime="1 h", budget=40
    )
    load = best.keys[0].value
    own = best.limited_peaks["peak_voltage"]
    assert [one.quantity for one in best.binds] == ["peak_voltage"] and best.met
    assert best.outcome.quantities[0] == pytest.approx(most, rel=0.01)
    assert own.value - own.known_error95 < most and 120e3 < load < 300e3
    assert ("cannot decide" in str(best)) == bool(best.straddled)
    assert "values of peaks are at the unsafe end of their error" in str(
        best
    ) and "  binds  " in str(best)
    assert best.mean_power.value > 7e-6  # not what the search makes of a broken limit


@pytest.mark.slow
def test_a_budget_too_short_for_the_paths(harvester):
    words = (
        "--vary",
        "load.resistance=100k:1M",
        "--constraint",
        "peak_voltage < 9 V",
        "--lifetime",
        "1 h",
    )
    status, out, err = harvester("optimise", STOP, *words, "--budget", "0.1s")
    assert (status, out) == (3, "") and "whose peaks are counted: allow a --budget of" in err


def test_devices_without_an_answer():
    robust = Robust(hv.Exact(), (("oscillator.damping", "-5:5"),))
    with pytest.raises(hv.SimulationError, match="devices have no answer"):
        robust.run(PLATE)


@pytest.mark.slow
def test_command(harvester, tmp_path):
    words = [
        "optimise",
        PLATE,
        "--vary",
        "load.resistance=E12:100k:10M",
        "--spread",
        "piezo.capacitance=10%",
        "--objective",
    ]
    words += ["5%", "--constraint", "voltage_rms < 2.5 V", "--out", tmp_path / "best", "--json"]
    status, out, err = harvester(*words)
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert (found["engine"], found["for"], found["met"]) == ("exact", 0.05, True)
    assert found["binds"] == ["voltage_rms < 2.5 V"]
    assert {path.name for path in (tmp_path / "best").iterdir()} == {
        "optimise.csv",
        "optimise.png",
        "provenance.json",
    }
    status, out, _ = harvester(*words[:-3])
    assert status == 0 and out.count("  binds\n") == 1 and "all but 5 % of the devices" in out


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (
            ["--vary", "load.resistance=1k:1M", "--objective", "5%"],
            "--objective of a share must be used with --spread",
        ),
        (
            [
                "--vary",
                "load.resistance=1k:1M",
                "--spread",
                "piezo.capacitance=10%",
                "--objective",
                "70%",
            ],
            "--objective must be a fraction",
        ),
        (
            [
                "--vary",
                "load.resistance=1k:1M",
                "--spread",
                "piezo.capacitance=10%",
                "--objective",
                "x",
            ],
            "unknown quantity of --objective",
        ),
        (["--vary", "load.resistance=1k:1M", "--constraint", "voltage > 3"], "voltage_rms"),
        (
            [
                "--vary",
                "load.resistance=1k:1M",
                "--constraint",
                "voltage_rms<3V",
                "--engine",
                "ensemble",
            ],
            "one of formulas",
        ),
        (["--vary", "load.resistance=E24:1M:1M"], "two values of E24"),
        (["--vary", "load.resistance=E24:1k"], "KEY=E24:LOW:HIGH"),
        (["--vary", "load.resistance=E25:1k:1M"], "KEY=LOW:HIGH"),
        (
            [
                "--vary",
                "load.resistance=1k:1M",
                "--constraint",
                "voltage_rms<3V",
                "--trajectories",
                "5",
            ],
            "--trajectories",
        ),
    ],
)
def test_bad_input(harvester, words, error):
    status, out, err = harvester("optimise", PLATE, *words)
    assert (status, out) == (2, "")
    assert error in err and len(err.splitlines()) == 1


@pytest.mark.slow
def test_front_of_power_and_voltage():
    """E[V^2] falls with mu: from the mu of most power to the range's end the front is the closed form."""
    found = hv.optimise(LINEAR, vary=MU, objective="mean_square_voltage", points=4)
    free = hv.optimise(LINEAR, vary=MU, engine="exact").keys[0].value
    mus = [one.keys["nondimensional.mu"] for one in found.points]
    assert mus[0] == pytest.approx(20.0) and mus[-1] == pytest.approx(free, rel=0.02)
    assert len(mus) == 4 and sorted(mus, reverse=True) == mus
    for one, mu in zip(found.points, mus, strict=True):
        assert one.quantity == pytest.approx(
            systems.linear_v2(systems.linear(BETA, mu, DAMPING)), rel=1e-6
        )
        assert one.mean_power.value == pytest.approx(linear_power(mu), rel=1e-6)
    powers = [one.mean_power.value for one in found.points]
    assert sorted(powers) == powers
    rows = found.table.csv().splitlines()
    heads = {"nondimensional.mu", "mean_square_voltage", "mean_power", "mean_power_error95"}
    assert heads < {*rows[0].split(",")} and len(rows) == 5


@pytest.mark.slow
def test_a_front_with_nothing_to_choose():
    """If the range holds no trade-off it is one design, and that is reported."""
    found = hv.optimise(
        LINEAR, vary={"nondimensional.mu": (5.0, 6.0)}, objective="voltage_rms:high", points=3
    )
    assert len(found.points) == 1
    assert (
        str(found.warnings[0])
        == "there is nothing to choose: the highest power also has the best voltage_rms"
    )


@pytest.mark.parametrize(
    ("aim", "error"),
    [
        (
            "peak_displacment",
            "unknown quantity of --objective 'peak_displacment': did you mean 'peak_displacement'?",
        ),
        (
            "colour",
            "unknown quantity of --objective 'colour': it must be one of mean_square_voltage, "
            "voltage_rms, peak_displacement, peak_voltage, peak_strain, peak_impact_speed, impact_rate",
        ),
        (
            "voltage_rms:up",
            "--objective must be voltage_rms:low or voltage_rms:high, but is 'voltage_rms:up'",
        ),
        (
            "peak_displacement",
            "--lifetime must be given for a limit of peak_displacement, but is left out",
        ),
    ],
)
def test_a_second_aim_that_cannot_be(harvester, aim, error):
    status, out, err = harvester(
        "optimise", PLATE, "--vary", "load.resistance=1k:10M", "--objective", aim
    )
    assert (status, out, err) == (2, "", f"harvester: {error}\n")


@pytest.mark.slow
def test_the_front_by_the_command(harvester, tmp_path):
    words = (
        "--vary",
        "load.resistance=E6:100k:1M",
        "--objective",
        "voltage_rms",
        "--budget",
        "20s",
        "--out",
        tmp_path,
    )
    status, out, err = harvester("optimise", PLATE, *words)
    assert (status, err) == (0, "")
    assert "voltage_rms is to be low, the power large" in out and "680 kohm" in out
    assert {one.name for one in tmp_path.iterdir()} == {
        "pareto.csv",
        "pareto.png",
        "provenance.json",
    }


@pytest.mark.parametrize(
    ("options", "error"),
    [
        (
            {"objective": ["5%", "10%"]},
            "`objective` must be a fraction of devices, a second quantity, or one of each",
        ),
        (
            {"points": 3},
            "`points` must be used with a second quantity in `objective`, but there is none",
        ),
        ({"objective": "voltage_rms", "points": 1}, "`points` must be between 2 and 50, but is 1"),
        (
            {"vary": {"load.resistance": 5}},
            "the range of load.resistance must be (LOW, HIGH) or a text 'LOW:HIGH'",
        ),
        (
            {"vary": {"load.resistance": "1k:1M", "load.netlist": ["bridge"]}},
            "`vary` must be load.netlist=A,B,...",
        ),
    ],
)
def test_what_a_search_cannot_be(options, error):
    with pytest.raises(hv.InputError, match=f"^{re.escape(error)}"):
        hv.optimise(PLATE, **{"vary": {"load.resistance": "1k:1M"}} | options)


SWUNG = systems.scene(
    systems.changed(systems.linear(BETA, 1.0, DAMPING), n1=None, drive=0.1, drive_frequency=1.1)
)


@pytest.mark.slow
def test_a_limit_of_the_displacement_under_a_sinusoid_needs_no_lifetime():
    """The amplitude is the same for ever: the limit keeps the load where `exact` finds that very amplitude."""
    free = hv.optimise(SWUNG, vary=MU, engine="exact").keys[0].value

    def amplitude(mu):
        return (
            hv.Exact()
            .run(SWUNG.varied({"nondimensional.mu": mu}))
            .details["displacement_amplitude"]
        )

    bound = 0.98 * amplitude(free)
    found = hv.optimise(SWUNG, vary=MU, constraints=f"peak_displacement < {bound!r}")
    assert found.binds and found.met
    assert amplitude(found.keys[0].value) == pytest.approx(bound, rel=1e-3)
    many = hv.tolerance(
        SWUNG, vary={"nondimensional.mu": "10%"}, limits=f"peak_displacement < {amplitude(1.0)!r}"
    )
    assert 0.1 < many.met.value < 0.9
