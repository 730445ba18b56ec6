"""Beams by their geometry: the published bimorph, limits in closed form, and one line for what cannot be."""

import dataclasses
import json
import math

import pytest

import harvester as hv
from harvester.devices.beam import Beam, lumped

DEVICE_A = Beam(50.8e-3, 31.8e-3, 0.14e-3, 0.26e-3, "PZT-5A", "brass", 2, tip_mass=12e-3)
FLAGS = "--bimorph --length 50.8mm --width 31.8mm --substrate-thickness 0.14mm --piezo-thickness 0.26mm"
FLAGS = [*FLAGS.split(), *["--tip-mass", "12g", "--piezo", "PZT-5A", "--substrate", "brass", "--damping-ratio", "2.7%"]]


def test_a_published_bimorph(harvester, tmp_path):
    """Erturk and Inman's, measured at 45.6 and 48.4 Hz: every lumped value within 1 % from the geometry alone."""
    status, out, err = harvester("new", tmp_path / "a.toml", *FLAGS, "--resistance", "35k", "--json")
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
    series, parallel = lumped(DEVICE_A), lumped(dataclasses.replace(DEVICE_A, parallel=True))
    assert parallel.stiffness == series.stiffness
    assert parallel.coupling / series.coupling == pytest.approx(2.0)
    assert parallel.capacitance / series.capacitance == pytest.approx(4.0)


def test_limits_in_closed_form():
    """Without a tip mass the root is 1.8751; with a large one the spring is 3 EI/L^3 and the mass that of the tip."""
    thin = Beam(0.1, 0.01, 1e-3, 1e-9, "PVDF", "steel", 1)
    bare = lumped(thin)
    bending, per_length = 200e9 * 0.01 * 1e-3**3 / 12.0, 7850.0 * 0.01 * 1e-3
    w = 1.8751041**2 * math.sqrt(bending / (per_length * 0.1**4))
    assert math.sqrt(bare.stiffness / bare.mass) == pytest.approx(w, rel=1e-4)
    assert bare.mass == pytest.approx(0.6131 * per_length * 0.1, rel=1e-3)  # (int phi)^2/int phi^2 = 0.7830^2
    heavy = lumped(dataclasses.replace(thin, tip_mass=10.0))
    assert heavy.stiffness == pytest.approx(3.0 * bending / 0.1**3, rel=1e-3)
    assert heavy.mass == pytest.approx(10.0, rel=1e-3)
    assert heavy.strain == pytest.approx(3.0 * 0.5e-3 / 0.1**2 * heavy.tip, rel=1e-3)  # 3 c/L^2 of a force at the tip
    root = 1.8751041  # phi''(0)/phi(L) of a bare beam is k^2/L^2
    assert bare.strain == pytest.approx(0.5e-3 * (root / 0.1) ** 2 * bare.tip, rel=1e-4)
    block = lumped(dataclasses.replace(DEVICE_A, tip_length=10e-3, tip_height=10e-3))
    assert block.stiffness / block.mass < lumped(DEVICE_A).stiffness / lumped(DEVICE_A).mass


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
        (["--mass", "5 g"], "--mass must be left out where the geometry gives it, but both are given"),
    ],
)
def test_what_is_no_beam(harvester, tmp_path, change, says):
    status, out, err = harvester("new", tmp_path / "a.toml", *FLAGS, *change)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not (tmp_path / "a.toml").exists()


def test_a_beam_that_is_not_whole(harvester, tmp_path):
    path = tmp_path / "a.toml"
    assert "--bimorph or --unimorph must be given with --length" in harvester("new", path, *FLAGS[1:])[2]
    assert "--length, --width, --substrate-thickness" in harvester("new", path, "--unimorph")[2]
    assert "--parallel must go with --bimorph" in harvester("new", path, "--unimorph", "--parallel")[2]
