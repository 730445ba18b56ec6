"""Beams by their geometry: the published bimorph, limits in closed form, and one line for the impossible."""

import dataclasses
import json
import math

import numpy as np
import pytest
from scipy.linalg import eigh

import harvester as hv
from harvester.devices.beam import Beam, lumped

DEVICE_A = Beam(50.8e-3, 31.8e-3, 0.14e-3, 0.26e-3, "PZT-5A", "brass", 2, tip_mass=12e-3)
FLAGS = (
    "--bimorph --length 50.8mm --width 31.8mm --substrate-thickness 0.14mm --piezo-thickness 0.26mm"
)
FLAGS = [
    *FLAGS.split(),
    *["--tip-mass", "12g", "--piezo", "PZT-5A", "--substrate", "brass", "--damping-ratio", "2.7%"],
]


def test_a_published_bimorph(harvester, tmp_path):
    """Erturk and Inman's, measured at 45.6 and 48.4 Hz: every lumped value within 1 % from the geometry alone."""
    status, out, err = harvester(
        "new", tmp_path / "a.toml", *FLAGS, "--resistance", "35k", "--json"
    )
    assert (status, err) == (0, "")
    scene = hv.load(tmp_path / "a.toml")
    assert scene.oscillator.mass == pytest.approx(16.542e-3, rel=0.01)
    assert scene.oscillator.stiffness == pytest.approx(1364.1, rel=0.01)
    assert scene.piezo.coupling == pytest.approx(2.5261e-3, rel=0.01)
    assert scene.piezo.capacitance == pytest.approx(41.259e-9, rel=0.01)
    assert scene.oscillator.damping_ratio == pytest.approx(0.027)
    words = json.loads(out)["words"]
    assert any("Erturk and Inman 2009" in line for line in words)
    assert any("assumed: a slender beam" in line for line in words)
    assert lumped(DEVICE_A).tip == pytest.approx(1.085, rel=0.002)


def test_parallel_is_the_same_beam():
    """The same mass and spring and the same coupling coefficient; twice the charge a displacement."""
    series = lumped(DEVICE_A)
    parallel = lumped(dataclasses.replace(DEVICE_A, parallel=True))
    assert parallel.stiffness == series.stiffness
    assert parallel.coupling / series.coupling == pytest.approx(2.0)
    assert parallel.capacitance / series.capacitance == pytest.approx(4.0)


def test_limits_in_closed_form():
    """Without a tip mass the root is 1.8751; with a large one the spring is 3 EI/L^3 and the mass that of the tip."""
    thin = Beam(0.1, 0.01, 1e-3, 1e-9, "PVDF", "steel", 1)
    bare = lumped(thin)
    bending = 200e9 * 0.01 * 1e-3**3 / 12.0
    per_length = 7850.0 * 0.01 * 1e-3
    w = 1.8751041**2 * math.sqrt(bending / (per_length * 0.1**4))
    assert math.sqrt(bare.stiffness / bare.mass) == pytest.approx(w, rel=1e-4)
    # (int phi)^2/int phi^2 = 0.7830^2
    assert bare.mass == pytest.approx(0.6131 * per_length * 0.1, rel=1e-3)
    heavy = lumped(dataclasses.replace(thin, tip_mass=10.0))
    assert heavy.stiffness == pytest.approx(3.0 * bending / 0.1**3, rel=1e-3)
    assert heavy.mass == pytest.approx(10.0, rel=1e-3)
    # 3 c/L^2 of a force at the tip
    assert heavy.strain == pytest.approx(3.0 * 0.5e-3 / 0.1**2 * heavy.tip, rel=1e-3)
    root = 1.8751041  # phi''(0)/phi(L) of a bare beam is k^2/L^2
    assert bare.strain == pytest.approx(0.5e-3 * (root / 0.1) ** 2 * bare.tip, rel=1e-4)
    block = lumped(dataclasses.replace(DEVICE_A, tip_length=10e-3, tip_height=10e-3))
    assert block.stiffness / block.mass < lumped(DEVICE_A).stiffness / lumped(DEVICE_A).mass


def test_further_modes_of_a_bare_beam():
    """Roots, participations and slopes of a clamped and free beam, as tables have them; the first mode stays itself."""
    thin = Beam(0.1, 0.01, 1e-3, 1e-9, "PVDF", "steel", 1)
    one = lumped(thin)
    found = lumped(thin, 4)
    roots, parts = (
        np.array([1.875104, 4.694091, 7.854757, 10.995541]),
        np.array([0.78299, 0.43394, 0.25443, 0.18190]),
    )
    assert dataclasses.astuple(found)[:-1] == pytest.approx(
        dataclasses.astuple(one)[:-1], rel=1e-12
    )
    ratio = np.array([mode.frequency for mode in found.higher_modes]) / (
        math.sqrt(one.stiffness / one.mass) / (2.0 * math.pi)
    )
    assert ratio == pytest.approx((roots[1:] / roots[0]) ** 2, rel=1e-6)
    signs = np.array([-1.0, 1.0, -1.0])  # with all tips on one side
    assert [mode.base for mode in found.higher_modes] == pytest.approx(
        signs * parts[1:] / parts[0], rel=1e-4
    )
    assert [mode.at_stop for mode in found.higher_modes] == pytest.approx([1.0, 1.0, 1.0], rel=1e-9)
    # phi'(L) = 2 k s/L, s as in Blevins' tables
    slopes = roots * [0.734096, 1.018467, 0.999224, 1.000034]
    assert np.array([mode.coupling for mode in found.higher_modes]) / one.coupling == pytest.approx(
        slopes[1:] / slopes[0], rel=1e-5
    )


def test_further_modes_with_a_tip_mass():
    """A block at the tip, against cubic finite elements, which know nothing of the roots."""
    beam = dataclasses.replace(DEVICE_A, tip_length=12e-3, tip_height=8e-3)
    found = lumped(beam, 3)
    m = beam.width * (9000.0 * beam.substrate_thickness + 2.0 * 7800.0 * beam.piezo_thickness)
    hs, hp = beam.substrate_thickness, beam.piezo_thickness
    layers = 105e9 * hs**3 / 12.0 + 2.0 * 66e9 * (hp**3 / 12.0 + hp * (0.5 * (hs + hp)) ** 2)
    count = 40
    size = beam.length / count
    mass = np.zeros((2 * count + 2,) * 2)
    spring = np.zeros((2 * count + 2,) * 2)
    push = np.zeros(2 * count + 2)
    a = size
    for k in range(count):
        at = slice(2 * k, 2 * k + 4)
        spring[at, at] += beam.width * layers / a**3 * np.array(
            [[12, 6 * a, -12, 6 * a], [6 * a, 4 * a * a, -6 * a, 2 * a * a],
             [-12, -6 * a, 12, -6 * a], [6 * a, 2 * a * a, -6 * a, 4 * a * a]])  # fmt: skip
        mass[at, at] += m * a / 420.0 * np.array(
            [[156, 22 * a, 54, -13 * a], [22 * a, 4 * a * a, 13 * a, -3 * a * a],
             [54, 13 * a, 156, -22 * a], [-13 * a, -3 * a * a, -22 * a, 4 * a * a]])  # fmt: skip
        push[at] += m * a * np.array([0.5, a / 12.0, 0.5, -a / 12.0])
    mass[-2, -2] += beam.tip_mass
    mass[-1, -1] += beam.tip_mass * (beam.tip_length**2 + beam.tip_height**2) / 12.0
    push[-2] += beam.tip_mass
    w2, shapes = eigh(spring[2:, 2:], mass[2:, 2:], subset_by_index=(0, 2))
    shapes *= np.sign(shapes[-2])
    sigma = push[2:] @ shapes
    tip = shapes[-2]
    slope = shapes[-1]
    assert found.mass == pytest.approx(sigma[0] ** 2, rel=1e-5)
    for k, mode in enumerate(found.higher_modes, 1):
        assert mode.frequency == pytest.approx(math.sqrt(w2[k]) / (2.0 * math.pi), rel=1e-4)
        assert mode.base == pytest.approx(sigma[k] / sigma[0], rel=1e-4)
        assert mode.at_stop == pytest.approx(tip[k] / tip[0], rel=1e-4)
        assert mode.coupling / found.coupling == pytest.approx(slope[k] / slope[0], rel=1e-4)


def test_modes_in_the_scene(harvester, tmp_path):
    """Flag --modes writes tables [[mode]] that the scene reads, next to the first mode as it is without."""
    for name, modes in (("one", ()), ("three", ("--modes", "3"))):
        status, _, err = harvester("new", tmp_path / f"{name}.toml", *FLAGS, *modes)
        assert (status, err) == (0, "")
    one, three = (hv.load(tmp_path / f"{name}.toml") for name in ("one", "three"))
    assert three.replace(mode=()) == one
    assert [mode.frequency for mode in three.mode] == pytest.approx([540.85, 1708.3], rel=1e-3)
    assert {mode.damping_ratio for mode in three.mode} == {0.027}
    assert (
        "--modes must be from 1 to 4, but is 5"
        in harvester("new", tmp_path / "a.toml", *FLAGS, "--modes", "5")[2]
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (["--unimorph"], "one of --bimorph, --unimorph must be left out, but both are given"),
        (["--piezo", "PZT5A"], "unknown material of --piezo 'PZT5A': did you mean 'PZT-5A'?"),
        (
            ["--length", "5 kg"],
            "--length must be a length (m), such as '0.26 mm', above 0, but is '5 kg': the unit 'kg'",
        ),
        (["--width=-1mm"], "--width must be a length (m)"),
        (["--mass", "5 g"], "--mass must be left out if the geometry gives it, but both are given"),
    ],
)
def test_what_is_no_beam(harvester, tmp_path, change, says):
    status, out, err = harvester("new", tmp_path / "a.toml", *FLAGS, *change)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not (tmp_path / "a.toml").exists()


def test_a_beam_that_is_not_whole(harvester, tmp_path):
    path = tmp_path / "a.toml"
    assert (
        "--bimorph or --unimorph must be given with --length"
        in harvester("new", path, *FLAGS[1:])[2]
    )
    assert "--length, --width, --substrate-thickness" in harvester("new", path, "--unimorph")[2]
    assert (
        "--parallel must be used with --bimorph"
        in harvester("new", path, "--unimorph", "--parallel")[2]
    )
