"""What a long charge states before it ends: which engine was chosen and why, and how long it will run."""

import dataclasses

import pytest

import harvester as hv
from harvester.studies.charging.by_spice import FIRST, lengths_of_runs

PLATE = hv.load("examples/plate_bridge.toml")
DRIVE = hv.load("examples/plate_harmonic.toml").excitation
SHAKEN = dataclasses.replace(
    PLATE,
    excitation=dataclasses.replace(
        PLATE.excitation,
        acceleration_amplitude=DRIVE.acceleration_amplitude,
        frequency=DRIVE.frequency,
    ),
)


class Told(Exception):
    """The notice came, before any run."""


def test_ngspice_that_nobody_chose_is_told_before_it_runs():
    def notice(text):
        raise Told(text)

    with pytest.raises(
        Told,
        match=r"engine 'spice' was chosen: engine 'ideal' supports charging under noise only.*; 16 runs",
    ):
        hv.charge(SHAKEN, "2 V", notice=notice)


def test_the_parts_of_the_work_are_known_beforehand():
    """Ever longer runs up to the end; with a duration the whole of it, after a pilot if that is short beside it."""
    assert lengths_of_runs(10.0 * FIRST, False) == [FIRST, 4.0 * FIRST, 10.0 * FIRST]
    assert lengths_of_runs(0.5 * FIRST, False) == [0.5 * FIRST]
    assert lengths_of_runs(2.0 * FIRST, True) == [2.0 * FIRST]
    assert lengths_of_runs(20.0 * FIRST, True) == [FIRST, 20.0 * FIRST]
