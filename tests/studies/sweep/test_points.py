"""Which scenes a sweep computes: grids, lists from files, several keys set at once."""

import itertools
import re

import pytest

import harvester as hv
from harvester.errors import InputError
from harvester.scene.keys import unit_of
from harvester.studies.sweep.points import Axis, Points, axes_of, grid, read_axis, read_points
from harvester.studies.tolerance.spreads import parse
from tests.support.paths import ROOT

PLATE = hv.load(ROOT / "examples" / "plate_with_stop.toml")


def listed(folder, text):
    path = folder / "points.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_points(path)


def test_a_grid_runs_over_its_last_key_first():
    texts = ("load.resistance=1k,2k", "stop.restitution=.7,.8,.9", "piezo.coupling=1,2")
    points = grid([read_axis(text) for text in texts])
    assert len(points) == 12
    assert [points.values(k) for k in range(12)] == list(
        itertools.product((1e3, 2e3), (0.7, 0.8, 0.9), (1.0, 2.0))
    )
    assert points.varied(1) == {
        "load.resistance": 1e3,
        "stop.restitution": 0.7,
        "piezo.coupling": 2.0,
    }


def test_a_key_without_its_table_is_that_of_the_scene(tmp_path):
    """A gap is clear with one stop, and must have its table with two."""
    present = PLATE.tables()
    assert read_axis("gap=0.2e-3,0.3e-3", present) == Axis("stop.gap", (0.2e-3, 0.3e-3))
    assert axes_of({"gap": ["0.2 mm"]}, present) == [Axis("stop.gap", (0.2e-3,))]
    table = hv.sweep(PLATE, vary={"gap": [0.3e-3, 0.4e-3]}, engines=["averaged"])
    assert [axis.key for axis in table.axes] == ["stop.gap"]
    assert PLATE.vary("gap", "0.3 mm").stop.gap == 0.3e-3
    (tmp_path / "points.csv").write_text("gap\n0.3 mm\n")
    assert read_points(tmp_path / "points.csv", present).keys == ("stop.gap",)
    assert parse("gap=1e-4:2e-4", PLATE).key == "stop.gap"
    free = PLATE.replace(stop=None)
    assert parse("stiffness=10%", free).key == "oscillator.stiffness"
    both = PLATE.replace(opposite_stop=hv.OppositeStop(gap="1 mm", restitution=0.9))
    with pytest.raises(InputError, match=r"with its table, but several have it: stop\.gap, opp"):
        read_axis("gap=1e-3,2e-3", both.tables())


def test_a_list_has_units_and_may_say_a_point_twice(tmp_path):
    text = "\ufeffload.resistance, stop.restitution\r\n1 Mohm,.9\r\n\r\n2k , 0.8\r\n1 Mohm,.9\r\n"
    points = listed(tmp_path, text)
    assert points == Points(
        (Axis("load.resistance", (1e6, 2e3, 1e6)), Axis("stop.restitution", (0.9, 0.8, 0.9))), True
    )
    assert [points.values(k) for k in range(len(points))] == [(1e6, 0.9), (2e3, 0.8), (1e6, 0.9)]


NO_FILE = "`points` must be a readable file, but "


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "`points` must have scene keys in its first line and then points, but "),
        (
            "load.resistance\n",
            "`points` must have scene keys in its first line and then points, but ",
        ),
        ("load.resistence\n1\n", "unknown [load] key 'resistence': did you mean 'resistance'?"),
        (
            "load.netlist\nbridge\n",
            "`points`, line 2: load.netlist must be a key with a number to be varied",
        ),
        (
            "load.resistance\n1k\n\n-1\n",
            "`points`, line 4: load.resistance must be a load resistance (ohm), such as",
        ),
        (
            "load.resistance,piezo.coupling\n1k,1\n1k\n",
            "`points`, line 3, must have 2 values, but has 1",
        ),
        (
            "load.resistance,piezo.coupling\n1k,\n",
            "`points`, line 2: piezo.coupling must be an electromechanical",
        ),
        (
            "load.resistance,load.resistance\n1k,2k\n",
            "`points` must name each only once, but names 'load.resistance'",
        ),
        (b"load.resistance\n\xff\n", "`points` must be a CSV file in UTF-8, but "),
        ('load.resistance\n"1\n', "`points` must be a CSV file in UTF-8, but "),
    ],
)
def test_what_is_no_list(tmp_path, text, line):
    with pytest.raises(InputError, match=f"^{re.escape(line)}"):
        listed(tmp_path, text)


@pytest.mark.thorough("nothing: a list that is too long to be held is written first")
@pytest.mark.slow
def test_too_long_a_list(tmp_path):
    with pytest.raises(
        InputError, match=r"^`points` must make at most 100000 points, but is 100001$"
    ):
        listed(tmp_path, "load.resistance\n" + "1\n" * 100_001)


def test_no_file(tmp_path):
    for path in (tmp_path, tmp_path / "nowhere.csv"):
        with pytest.raises(InputError, match=f"^{re.escape(NO_FILE)}"):
            read_points(path)


def test_an_impossible_point_is_named(tmp_path):
    points = listed(tmp_path, "load.resistance,oscillator.mass\n1k,1\n1,1e-50\n")
    with pytest.raises(InputError, match=r"^`points`, point 2: the power scale "):
        points.check(PLATE)


def test_keys_are_set_together():
    """A stop's gap without its restitution is not a scene, in whatever order they are named."""
    bare = hv.loads("[nondimensional]\nc1 = -0.01\nD11 = 0.01\n")
    keys = {"nondimensional.gap": 0.5, "nondimensional.restitution": 0.9}
    with pytest.raises(InputError):
        bare.vary("nondimensional.gap", 0.5)
    assert bare.varied(keys) == bare.varied(dict(reversed(keys.items())))
    assert bare.varied(keys).nondimensional.gap == 0.5
    bridge = PLATE.with_load(hv.Load(netlist="bridge", parameters={"R": 1.0}))
    both = bridge.varied(
        {"load.parameters.R": 2.0, "load.parameters.C": 3.0, "piezo.coupling": 4.0}
    )
    assert both.load.parameters == {"R": 2.0, "C": 3.0}
    assert both.piezo.coupling == 4.0
    assert bridge.load.parameters == {"R": 1.0}


def test_units():
    assert [unit_of(k) for k in ("load.resistance", "stop.restitution", "load.parameters.R")] == [
        "ohm",
        "1",
        "ohm",
    ]


def test_axes_may_be_texts_of_the_command_line():
    """A list of texts, which `optimise` accepts, ended in an AttributeError."""
    (axis,) = axes_of(["load.resistance=1k,2k"])
    assert axes_of("load.resistance=1k,2k") == axes_of({"load.resistance": "1k,2k"}) == [axis]
    assert axis.values == (1e3, 2e3)
    assert axes_of([axis]) == [axis]
    for wrong in ([3.0], 3, b"x"):
        with pytest.raises(InputError, match="`vary` must be KEY=VALUES"):
            axes_of(wrong)


@pytest.mark.parametrize("keys", [1, 2])
def test_a_list_of_points_has_the_shape_of_its_length(keys):
    """However many keys each point has."""
    axes = tuple(Axis(f"oscillator.key{k}", (1.0, 2.0, 3.0)) for k in range(keys))
    assert Points(axes, listed=True).shape == (3,) == (len(Points(axes, listed=True)),)
    assert Points(axes).shape == keys * (3,)
