"""The prediction of D26, two wells on a tilted base under recorded sweeps: gravity, the sweep and its numbers."""

import importlib
import math
import sys

import numpy as np
import pytest

from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
names = ("unseen_recordings", "unseen_tilts", "unseen_wells", "predictions", "priors_fit")
recordings, tilts, wells, predictions, priors_fit = map(importlib.import_module, names)


def two_wells():
    """Wells of 7 and 9.2 Hz, 24 mm apart."""
    scene = predictions.two_wells(12e-3, 9.2, 120.0, 4.2)
    return wells.tilted(scene, 9.2, 7.0, 12e-3, scene.oscillator.mass, at_left=False)


def force(scene, x):
    """K1 x + K2 x^2 + K3 x^3 (N)."""
    one = scene.oscillator
    quadratic = one.quadratic_stiffness or 0.0
    return one.stiffness * x + quadratic * x**2 + one.cubic_stiffness * x**3


@pytest.mark.parametrize("tilt", [10.0, -25.0, 45.0])
def test_gravity_shifts_unlike_wells_along_their_own_force(tilt):
    """The force is that of the upright device at a displaced point, less m g sin(tilt); its image is mirrored."""
    upright = two_wells()
    bent, image = (tilts.leaning(upright, tilt, at_left) for at_left in (False, True))
    weight = upright.oscillator.mass * tilts.G * math.sin(math.radians(tilt))
    k1, k2 = upright.oscillator.stiffness, upright.oscillator.quadratic_stiffness
    rest = np.roots([upright.oscillator.cubic_stiffness, k2, k1, -weight])
    shifts = [float(root.real) for root in rest if abs(root.imag) < 1e-9]
    y = np.linspace(-10e-3, 10e-3, 9)
    off = [np.abs(force(upright, y + s) - weight - force(bent, y)).max() for s in shifts]
    assert min(off) < 1e-9 * abs(weight)
    np.testing.assert_allclose(force(image, -y), -force(bent, y), atol=1e-12)


def test_a_recording_sweeps_as_its_numbers_state():
    """Zero crossings at the stated frequencies, the stated amplitude between them; downwards it is the mirror image."""
    up = next(one for one in recordings.RECORDINGS if not one.down)
    time = np.arange(0.0, 64.0, 1e-3)
    a = up.acceleration(time)
    for begin in (20.0, 40.0, 60.0):
        inside = (time >= begin) & (time < begin + 2.0)
        crossings = np.count_nonzero(np.diff(np.sign(a[inside])))
        frequency = up.first + up.rate * (begin + 1.0)
        assert crossings == pytest.approx(4.0 * frequency, abs=1.0)
        ends = frequency + np.array([-1.0, 1.0]) * up.rate
        most = np.interp(ends, recordings.FREQUENCIES, up.amplitudes).max()
        assert np.abs(a[inside]).max() == pytest.approx(tilts.G * most, rel=0.02)
    down = next(one for one in recordings.RECORDINGS if one.down)
    late, early = (np.abs(down.acceleration(t)).max() for t in (time[-9000:], time[:9000]))
    assert late < 0.1 * early


def test_a_motion_begins_in_the_lower_well_or_in_its_image(tmp_path):
    """Which is how the wells' names choose the start: a recording of the other well begins in the mirror image."""
    seen = []
    one = recordings.RECORDINGS[4]
    motion = recordings.hv.motion

    def watched(*args, **options):
        path = motion(*args, **options)
        seen.append(float(path.displacement[0]))
        return path

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recordings.hv, "motion", watched)
        for at_left in (False, True):
            bent = tilts.leaning(two_wells(), 3.0, at_left)
            assert 1e-5 < recordings.shaken(bent, one, 1.0, str(tmp_path), 0) < 1.0
    roots = np.roots([*_cubic(tilts.leaning(two_wells(), 3.0, at_left=False))])
    assert seen[0] == pytest.approx(min(roots.real), rel=1e-3)
    assert seen[1] == pytest.approx(-max(roots.real), rel=1e-3)


def test_the_page_has_the_judgement_of_the_recordings():
    """Its rows are those that the command prints now: six voltages, of which six intervals hold."""
    cantilevers = importlib.import_module("unseen_cantilevers")
    lines = list(cantilevers.judgement(cantilevers.judged(["D26"])))
    begin = cantilevers.BEGIN.format("recordings")
    page = cantilevers.PAGE.read_text().partition(begin)[2].partition(cantilevers.END)[0]
    assert page.strip().splitlines() == lines
    assert [line.split(" | ")[-1] for line in lines[2:]] == ["yes |"] * 6


def _cubic(scene):
    one = scene.oscillator
    return one.cubic_stiffness, one.quadratic_stiffness, one.stiffness


@pytest.mark.slow
def test_the_file_has_the_predictions_of_the_recordings():
    """With the seed of the file the same numbers; another seed within a sixth of the interval."""
    kept = {row["quantity"]: row for row in priors_fit.rows("predicted.csv")}
    both = zip(recordings.samples(), recordings.samples(seed=2), strict=True)
    for first, second in both:
        row = kept[first.quantity]
        numbers = [float(row[name]) for name in ("predicted", "low", "high")]
        assert first.quantiles() == pytest.approx(numbers, rel=1e-2)
        sixth = math.log(numbers[2] / numbers[1]) / 6.0
        assert abs(math.log(second.quantiles()[0] / numbers[0])) < sixth
