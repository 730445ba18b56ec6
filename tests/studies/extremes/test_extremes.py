"""The largest values over a lifetime: extrapolated ones against Rice's of the same device, and the command."""

import json
import math

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.linear.level_crossings import peaks
from harvester.studies.extremes import counted
from harvester.studies.extremes.counted import count
from harvester.studies.extremes.extremes import extremes_both_ways
from harvester.studies.extremes.levels import fit, rare
from tests.support import systems
from tests.support.paths import ROOT

PLATE, STOP = (ROOT / "examples" / f"{name}.toml" for name in ("plate", "plate_with_stop"))
EQS = systems.linear(0.5, 1.0, 0.1)


@pytest.mark.parametrize(
    "eqs", [EQS, Problem(systems.BEAM).equations], ids=["one mode", "two modes"]
)
def test_counting_agrees_with_rice(eqs):
    """Blocks of a path of 50 cycles each, extrapolated 1,000 times: within four standard errors of the closed form."""
    found_blocks = count(eqs, blocks=512)
    for maxima, one in zip((found_blocks.x, found_blocks.V), peaks(eqs), strict=True):
        found = fit(maxima).largest(0.5, 512_000.0)
        exact = one.largest(0.5, 512_000.0 * found_blocks.block)
        assert abs(found.value - exact) < 4.0 * found.stderr
        assert found.stderr < 0.15 * exact


def test_a_path_of_two_modes_goes_on_from_piece_to_piece(monkeypatch):
    """Its impacts are as frequent as in one piece, which begins and ends with the coordinates of all modes."""
    eqs = Problem(hv.load(ROOT / "examples" / "two_modes_with_stop.toml")).equations
    whole = count(eqs, blocks=128)
    monkeypatch.setattr(counted, "LONGEST", 200_000)
    parts = count(eqs, blocks=128)
    apart = parts.impacts.value - whole.impacts.value
    assert abs(apart) < 4.0 * math.hypot(parts.impacts.stderr, whole.impacts.stderr)
    assert parts.impacts.value > 0.0


@pytest.mark.thorough("test_first_passages_are_fewer_than_passages")
@pytest.mark.slow
def test_first_passages_give_the_level_of_rice_and_vanmarcke():
    """A linear scene: the largest displacement lies between Vanmarcke's level and Rice's bound, within its error."""
    scene = systems.scene(systems.linear(0.3, 0.7, 0.1))
    lifetime = 1e5
    found = hv.extremes(scene, lifetime=lifetime, passages=True).levels["peak_displacement"]
    closed = hv.extremes(scene, lifetime=lifetime).levels["peak_displacement"]
    for share in (0.5, 0.95):
        ours, theirs = found[share], closed[share]
        assert ours.bias < 0.03 * ours.value
        assert theirs.value - ours.bias <= ours.value <= theirs.value + theirs.model + ours.bias


def test_first_passages_need_an_open_side():
    both = systems.changed(
        EQS, restitution=0.9, gap=0.5, opposite_gap=0.5, opposite_restitution=0.9
    )
    with pytest.raises(
        hv.CannotServeError, match="`passages` must be used with a side without a rigid stop"
    ):
        hv.extremes(systems.scene(both), lifetime=1e5, passages=True)


def test_tail_of_a_known_law():
    """Largest of n exponential squares: the level of N blocks is known, -log(1 - share^(1/(n N)))."""
    rng = np.random.default_rng(5)
    maxima = np.sqrt(rng.exponential(size=(2000, 100)).max(axis=1))
    for share in (0.5, 0.95):
        found = fit(maxima).largest(share, 1e4)
        exact = np.sqrt(-np.log(-np.expm1(np.log(share) / 1e6)))
        assert abs(found.value - exact) < 4.0 * found.stderr
        assert found.stderr < 0.1 * exact


def test_tail_of_rare_events():
    """Poisson clusters of exponential squares: for n blocks the level is size log(n rate/log 2); few have none."""
    rng = np.random.default_rng(7)
    maxima = np.array(
        [np.sqrt(rng.exponential(size=k)).max(initial=0.0) for k in rng.poisson(0.4, 2000)]
    )
    for share, blocks in ((0.5, 200.0), (0.95, 1e6)):
        found = rare(maxima).largest(share, blocks)
        exact = np.sqrt(np.log(0.4 * blocks / -np.log(share)))
        assert abs(found.value - exact) < 4.0 * found.stderr
        assert found.stderr < 0.06 * exact
    assert rare(maxima).largest(0.5, 1e6).model > 0.0
    assert rare(np.where(np.arange(2000) < 50, 1.0, 0.0)) is None


RARE = """
[oscillator]
mass = "40 g"
stiffness = "16 N/m"
damping = "6.4e-3 N s/m"
[piezo]
coupling = "3e-4 N/V"
capacitance = "50.2 nF"
[load]
resistance = "1 Mohm"
[excitation]
acceleration_psd = "1e-5 g^2/Hz"
[stop]
restitution = 0.9
gap = "2 mm"
"""


@pytest.mark.thorough("test_counting_agrees_with_rice")
@pytest.mark.slow
def test_impacts_that_are_rare():
    """Two blocks of three have no impact: 0.067 m/s in an hour and 1.39 in a year were stated to 4 and 12 %.

    On a million seconds the median of the hours was 0.0462 +- 0.0009 m/s; the energy of a year's
    largest displacement lets it be 0.09.
    """
    hour, year = (
        hv.extremes(hv.loads(RARE), lifetime=of).levels["peak_impact_speed"]
        for of in ("1 h", "1 year")
    )
    assert abs(hour[0.5].value - 0.0462) < 4.0 * np.hypot(hour[0.5].stderr, 0.0009)
    assert year[0.5].value - year[0.5].error95 < 0.09 and year[0.95].value < 0.11
    seldom = hv.extremes(hv.loads(RARE.replace("2 mm", "3 mm")), lifetime="1 year")
    assert "peak_impact_speed" not in seldom.levels and "few_impacts" in [
        one.code for one in seldom.diagnostics
    ]


@pytest.mark.slow
def test_a_stop_is_hit():
    """The mass hits its stop at rest once in each half of a free period, about w0/pi times per second."""
    found = hv.extremes(STOP, lifetime="30 days")
    assert found.impact_rate.value == pytest.approx(20.0 / np.pi, rel=0.05)
    assert {*found.levels} == {"peak_displacement", "peak_voltage", "peak_impact_speed"}
    for of in found.levels.values():
        assert 0.0 < of[0.5].value < of[0.95].value
        assert of[0.5].stderr < 0.25 * of[0.5].value
    speed, far = (
        found.levels[name][0.5].value for name in ("peak_impact_speed", "peak_displacement")
    )
    assert speed == pytest.approx(20.0 * far, rel=0.3)  # the energy of the farthest cycle


def test_command(harvester, tmp_path):
    status, out, err = harvester("run", PLATE, "--lifetime", "5 years", "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)["extremes"]
    assert (
        found["peak_displacement"]["0.5"]["error95"]
        < 0.01 * found["peak_displacement"]["0.5"]["value"]
    )
    assert found["impact_rate"] is None
    page = tmp_path / "report.html"
    status, out, _ = harvester("run", PLATE, "--lifetime", "5 years", "--report", page)
    assert status == 0 and "peak_voltage" in out
    assert "Largest over a lifetime" in page.read_text() and "peak_displacement" in page.read_text()


@pytest.mark.parametrize(
    ("path", "words", "error"),
    [
        ("plate", ["--lifetime", "5 ohm"], "--lifetime must be a time"),
        ("plate", ["--lifetime", "-3"], "--lifetime must be a time"),
        ("plate", ["--lifetime", "0"], "--lifetime must be a time"),
        (
            "paper_figure3",
            ["--lifetime", "5 years", "--engine", "averaged"],
            "--lifetime must be a number of 1/w0",
        ),
        ("plate_harmonic", ["--lifetime", "5 years", "--engine", "exact"], "white noise alone"),
        # before any run
        ("plate_harmonic", ["--lifetime", "5 years", "--engine", "spice"], "white noise alone"),
        ("plate_bridge", ["--lifetime", "5 years"], "--lifetime is for a load resistance or none"),
        (
            "plate_with_stop",
            ["--lifetime", "1s", "--engine", "averaged"],
            "--lifetime must be at least",
        ),
    ],
)
def test_bad_input(harvester, path, words, error):
    status, out, err = harvester("run", ROOT / "examples" / f"{path}.toml", *words)
    assert (status, out) == (2, "") or (status, out) == (3, "")
    assert error in err and len(err.splitlines()) == 1


def test_strain_is_a_multiple_of_the_displacement(harvester, tmp_path):
    """`new --bimorph` writes the factor; lifetimes and limits have the strain, and state where the factor lacks."""
    path = tmp_path / "beam.toml"
    (q1, q2) = ("--lifetime", "5 years")
    sizes = {
        "length": "50.8mm",
        "width": "31.8mm",
        "substrate-thickness": "0.14mm",
        "piezo-thickness": "0.26mm",
    }
    sizes |= {"tip-mass": "12g", "piezo": "PZT-5A", "substrate": "brass", "damping-ratio": "2.7%"}
    sizes |= {"acceleration-psd": "1e-3 g^2/Hz", "resistance": "100k"}
    words = [word for name, value in sizes.items() for word in (f"--{name}", value)]
    assert harvester("new", path, "--bimorph", *words)[0] == 0
    factor = hv.load(path).piezo.strain_per_displacement
    found = json.loads(harvester("run", path, q1, q2, "--json")[1])["extremes"]
    for share in ("0.5", "0.95"):
        strain, far = (found[name][share] for name in ("peak_strain", "peak_displacement"))
        assert strain["value"] == pytest.approx(factor * far["value"])
        assert strain["error95"] == pytest.approx(factor * far["error95"])
    over = ("--vary", "load.resistance=E6:10k:1M", "--limit", "peak_strain < 100e-6")
    answer = json.loads(harvester("optimise", path, *over, q1, q2, "--json")[1])
    assert not answer["met"]
    wanted = "piezo.strain_per_displacement must be given for a limit of peak_strain"
    assert wanted in harvester("optimise", PLATE, *over, q1, q2)[2]


@pytest.mark.thorough("test_counting_agrees_with_rice")
@pytest.mark.slow
def test_compare_has_both_ways(harvester, tmp_path):
    """Rice's formula and what is counted, which agree within the errors of both; a scene that has none is refused."""
    rice, counted = extremes_both_ways(PLATE, "1 day")
    assert counted.method.startswith("extrapolated") and rice.method.startswith("Rice")
    for name, of in rice.levels.items():
        for share, one in of.items():
            other = counted.levels[name][share]
            assert abs(one.value - other.value) < 4.0 * other.stderr + one.known_error95
    assert len(extremes_both_ways(STOP, "1 day")) == 1
    status, out, err = harvester(
        "compare", ROOT / "examples" / "plate_harmonic.toml", "--lifetime", "5 years"
    )
    assert (status, out) == (2, "") and "--lifetime must be used with white noise alone" in err
