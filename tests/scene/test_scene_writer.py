"""A scene file as people write it: the units of few digits, and exactly the same scene."""

import pytest

import harvester as hv
from harvester.scene.scene_writer import as_written, written
from tests.support.paths import EXAMPLES


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_the_same_scene_comes_back(path):
    scene = hv.load(path)
    assert hv.loads(as_written(scene)) == scene


def test_values_are_those_that_the_user_wrote():
    text = as_written(hv.load(EXAMPLES / "plate_with_stop.toml"))
    for line in (
        'mass = "40 g"',
        'stiffness = "16 N/m"',
        'capacitance = "50.2 nF"',
        'resistance = "1 Mohm"',
    ):
        assert line in text.splitlines()
    assert 'acceleration_psd = "1e-5 g^2/Hz"' in text
    assert "restitution = 0.96" in text
    assert "0000000000" not in text


def test_a_value_of_many_digits_stays_a_number():
    scene = hv.load(EXAMPLES / "plate.toml").varied(
        {"load.resistance": 123456.789012345, "piezo.capacitance": 3e-8 / 7}
    )
    assert "resistance = 123456.789012345" in as_written(scene)
    assert hv.loads(as_written(scene)) == scene


def test_units_are_those_that_people_write():
    """The shortest text of all would be 1e8 mohm or 867008.9 nN/V."""
    assert written("load", "resistance", 100e3) == "100 kohm"
    assert written("piezo", "coupling", 0.0008670089) == "867.0089 uN/V"
    # 29.88288 nF is another float
    assert written("piezo", "capacitance", 2.988288e-08) == "2.988288e-8 F"
    assert written("piezo", "capacitance", 2.2e-10) == "220 pF"
    assert written("excitation", "frequency", 50.0) == "50 Hz"
    assert written("excitation", "acceleration_psd", 9.80665**2 * 1e-5) == "1e-5 g^2/Hz"
