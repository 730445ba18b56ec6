"""`harvester keys board.toml`: the parts of a board that vary, each of which a scene may set."""

import json

import pytest

import harvester as hv
from harvester.errors import InputError
from tests.support.paths import ROOT

BOARD = ROOT / "examples" / "bimorph_board.toml"


def test_each_listed_part_varies(harvester):
    status, out, error = harvester("keys", BOARD, "--json")
    assert (status, error) == (0, "")
    parts = json.loads(out)
    assert {"load.parameters.C1", "load.parameters.R4"} <= set(parts)  # as in the schematic
    assert "load.parameters.R" not in parts  # which is R4
    scene = hv.load(BOARD)
    for key, value in parts.items():
        if value:
            assert scene.varied({key: 1.01 * value}) is not None
    text = harvester("keys", BOARD)[1]
    assert text.count("\n") == len(parts)


def test_an_unknown_part_is_answered_with_the_list(harvester):
    names = [
        key.removeprefix("load.parameters.")
        for key in json.loads(harvester("keys", BOARD, "--json")[1])
    ]
    status, _, error = harvester("sweep", BOARD, "--vary", "load.parameters.C1x=1u:2u:2")
    assert status == 2
    assert error.count("\n") == 1
    assert all(name in error for name in names)


@pytest.mark.parametrize("spread", ["5%", "1k:2k", "normal:2%"])
def test_a_spread_of_an_unknown_part_is_answered_with_the_list(harvester, spread):
    """The remedy was LOW:HIGH, which such a part does not have either."""
    status, _, error = harvester("tolerance", BOARD, "--vary", f"load.parameters.R99={spread}")
    assert (status, error.count("\n")) == (2, 1)
    assert "unknown parameter of netlist board 'R99': it must be one of R, C, C1, R1" in error
    assert "LOW:HIGH" not in error and "devices" not in error


def test_a_part_of_a_scene_without_a_netlist(harvester):
    """The remedy was LOW:HIGH, which such a scene does not have either."""
    scene = ROOT / "examples" / "plate.toml"
    status, _, error = harvester("tolerance", scene, "--vary", "load.parameters.R99=5%")
    assert (status, error.count("\n")) == (2, 1)
    assert "must be of a netlist, but the scene has no load.netlist" in error


def test_a_scene_without_a_netlist(harvester):
    status, _, error = harvester("keys", ROOT / "examples" / "plate.toml")
    assert (status, "must have a netlist" in error) == (2, True)
    with pytest.raises(InputError, match="unknown parameter of netlist"):
        hv.load(BOARD).varied({"load.parameters.Q9": 1.0}) and hv.run(
            hv.load(BOARD).varied({"load.parameters.Q9": 1.0}), engine="slow"
        )
