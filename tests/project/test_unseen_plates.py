"""The prediction of D25, a bistable plate: the states of its scene, its best load, and the numbers of the file."""

import importlib
import math
import sys

import numpy as np
import pytest

from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
unseen_plates, priors_fit = map(importlib.import_module, ("unseen_plates", "priors_fit"))
MIDDLE = {
    "ply": 0.2e-3,
    "corners": 0.05,
    "radius": 0.5,
    "damping": 0.0,
    "coupling": 0.0,
    "rms": 0.5,
}


def force_per_mass(scene, x):
    """K1 x + K2 x^2 + K3 x^3 over the mass, and its derivative."""
    one = scene.oscillator
    a, b, c = one.stiffness, one.quadratic_stiffness, one.cubic_stiffness
    return (a * x + b * x**2 + c * x**3) / one.mass, (a + 2 * b * x + 3 * c * x**2) / one.mass


def test_the_states_of_the_plate_have_their_resonances_and_distance():
    """A corner of a strip of radius R rises by L^2/(8 R), which the participation of the mode scales."""
    scene, level = unseen_plates.plate(MIDDLE)
    one = scene.oscillator
    roots = np.roots([one.cubic_stiffness, one.quadratic_stiffness, one.stiffness])
    hertz = sorted(math.sqrt(force_per_mass(scene, x)[1]) / (2.0 * math.pi) for x in roots)
    assert hertz == pytest.approx([9.4, 10.9], rel=1e-6)
    assert force_per_mass(scene, 0.0)[1] < 0.0
    kilograms = 4 * 0.2e-3 * 1570.0 * 0.04
    first, second = kilograms / 3 + 0.05, kilograms / 5 + 0.05
    assert one.mass == pytest.approx(first**2 / second)
    assert abs(roots[0] - roots[1]) == pytest.approx(2.0 * 0.04 / (8.0 * 0.5) * second / first)
    assert level == 2.0 * 9.80665
    assert unseen_plates.plate(MIDDLE | {"rms": 0.1})[1] == pytest.approx(math.sqrt(2.0) * level)


def test_a_motion_that_stays_in_its_state_gives_nothing():
    """Far below the barrier no load has a power; the capacitance is free, since the load is the best."""
    scene, level = unseen_plates.plate(MIDDLE)
    assert unseen_plates.power(scene, 0.01 * level, 8.6, 0) == 0.0
    most = unseen_plates.power(scene, level, 8.6, 0)
    assert most > 0.0
    other = scene.varied(
        {
            "piezo.capacitance": 4.0 * scene.piezo.capacitance,
            "piezo.coupling": 2.0 * scene.piezo.coupling,
        }
    )
    assert unseen_plates.power(other, level, 8.6, 0) == pytest.approx(most, rel=0.1)


@pytest.mark.slow
def test_the_file_has_the_predictions_of_the_plate():
    """With the seed of the file the same numbers; another seed within four standard errors of the median."""
    kept = {row["quantity"]: row for row in priors_fit.rows("predicted.csv")}
    for first, second in zip(unseen_plates.samples(), unseen_plates.samples(seed=2), strict=True):
        row = kept[first.quantity]
        numbers = [float(row[name]) for name in ("predicted", "low", "high")]
        assert first.quantiles() == pytest.approx(numbers, rel=1e-2)
        logs = [np.log(one.values) for one in (first, second)]
        error = math.hypot(*(1.2533 * log.std() / math.sqrt(len(log)) for log in logs))
        assert abs(np.median(logs[0]) - np.median(logs[1])) < 4.0 * error


def test_the_page_has_the_judgement_of_the_plate():
    """Its rows are those that the command prints now: three powers, of which three intervals hold."""
    cantilevers = importlib.import_module("unseen_cantilevers")
    lines = list(cantilevers.judgement(cantilevers.judged(["D25"])))
    begin = cantilevers.BEGIN.format("plates")
    page = cantilevers.PAGE.read_text().partition(begin)[2].partition(cantilevers.END)[0]
    assert page.strip().splitlines() == lines
    assert [line.split(" | ")[-1] for line in lines[2:]] == ["yes |"] * 3
