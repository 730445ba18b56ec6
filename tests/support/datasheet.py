"""The datasheet of a device that several tests share."""

import harvester as hv
from harvester.devices.device import scene_tables
from harvester.devices.scene_file import text
from harvester.equations.problem import Problem

SHEET = {
    "mass": "40 g",
    "stiffness": "16 N/m",
    "damping_ratio": "0.004",
    "coupling": "1e-3 N/V",
    "capacitance": "50.2 nF",
}
NOISE = {"acceleration_psd": "1e-5 g^2/Hz"}


def scene_of(sheet):
    """The scene of a datasheet, read from its file's text."""
    return hv.loads(text(scene_tables(sheet)))


def problem_of(sheet):
    """The problem of that scene."""
    return Problem(scene_of(sheet))
