"""The front by an engine that samples: which designs are on it, and which cannot be distinguished from it."""

import dataclasses
import json

import pytest

import harvester as hv
from harvester.studies.optimum.pareto_front import FrontPoint, ParetoFront
from harvester.studies.optimum.sampled_front import split
from tests.support import systems
from tests.support.paths import ROOT

PLATE = ROOT / "examples" / "plate.toml"


def design(power, quantity, error=0.0):
    return FrontPoint({"key": power}, hv.Value(power, model=error), quantity, error)


def test_a_design_beaten_within_the_errors_is_said():
    """Low quantity, much power: (1, 1) and (3, 3) are the front; (2.9, 3.1) is beaten by 0.1, (1, 5) by far."""
    designs = [
        design(1.0, 1.0, 0.2),
        design(2.9, 3.1, 0.2),
        design(3.0, 3.0, 0.2),
        design(1.0, 5.0, 0.2),
    ]
    points, alike = split(designs, -1)
    assert [one.mean_power.value for one in points] == [1.0, 3.0]
    assert [(one.mean_power.value, one.quantity) for one in alike] == [(2.9, 3.1)]
    exact = [design(one.mean_power.value, one.quantity) for one in designs]
    assert split(exact, -1)[1] == ()
    # high: each has more power than the last
    assert [one.quantity for one in split(designs, 1)[0]] == [5.0, 3.1, 3.0]


def test_the_picture_has_bars_both_ways_on_every_design():
    """The designs that indistinguishable from the front as well: their errors are why."""
    found = ParetoFront(
        "ensemble",
        "peak_voltage",
        -1,
        (design(1.0, 1.0, 0.2), design(3.0, 3.0, 0.2)),
        False,
        1.0,
        (),
    )
    found = dataclasses.replace(found, alike=(design(2.9, 3.1, 0.3),))
    wide = []
    for bars in found.plot().figure.axes[0].collections:
        for (x0, y0), (x1, y1) in bars.get_segments():
            if y0 == y1:
                wide.append((y0, round(x1 - x0, 9)))
    assert sorted(wide) == [(1.0, 0.4), (2.9, 0.6), (3.0, 0.4)]


@pytest.mark.thorough("test_front_of_power_and_voltage")
@pytest.mark.slow
def test_the_front_is_that_of_the_closed_form(harvester, tmp_path):
    """E[V^2] falls with mu: a place is on the front, or alike, if mu is not far below that of the most power."""
    scene = systems.scene(systems.linear(0.5, 1.0, 0.1))
    (tmp_path / "scene.toml").write_text(scene.to_toml())
    words = [
        "--vary",
        "nondimensional.mu=0.05:20",
        "--objective",
        "mean_square_voltage",
        "--engine",
        "ensemble",
    ]
    words += [
        "--trajectories",
        "256",
        "--duration",
        "50",
        "--budget",
        "60s",
        "--out",
        tmp_path / "out",
    ]
    status, out, err = harvester("optimise", tmp_path / "scene.toml", *words, "--json")
    # on a busy machine it states that it will take long
    assert status == 0 and "Traceback" not in err
    found = json.loads(out)
    assert found["engine"] == "ensemble" and found["aim"] == "low" and len(found["front"]) >= 3
    free = (
        hv.optimise(scene, vary={"nondimensional.mu": (0.05, 20.0)}, engine="exact").keys[0].value
    )
    for one in found["front"]:
        eqs = systems.linear(0.5, one["keys"]["nondimensional.mu"], 0.1)
        off = one["mean_square_voltage"] - systems.linear_v2(eqs)
        assert abs(off) < 2.5 * one["mean_square_voltage_error95"]
        assert eqs.mu > 0.5 * free
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"pareto.csv", "pareto.png", "provenance.json"}
    rows = (tmp_path / "out" / "pareto.csv").read_text().splitlines()
    assert rows[0].endswith(",on_front") and "mean_square_voltage_error95" in rows[0].split(",")
    assert len(rows) == 1 + len(found["front"]) + len(found["not_told_from_front"])


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--engine", "ideal"), "netlist"),
        (
            ("--engine", "ensemble", "--spread", "piezo.capacitance=10%"),
            "--engine must be one of formulas",
        ),
        pytest.param(
            (
                "--engine",
                "ensemble",
                "--trajectories",
                "64",
                "--duration",
                "1",
                "--constraint",
                "mean_power > 1 W",
            ),
            "a front must have 3 places with an answer that keeps all limits, but 0 of",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_is_refused(harvester, words, error):
    status, out, err = harvester(
        "optimise", PLATE, "--vary", "load.resistance=1k:1M", "--objective", "voltage_rms", *words
    )
    assert status in (2, 3) and out == ""
    assert error in err.splitlines()[-1]
