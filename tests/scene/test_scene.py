"""Scene files: round trip, and one clear line for everything that is not a scene."""

import os
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import harvester as hv
from harvester.equations.scales import scales
from harvester.errors import InputError
from harvester.scene.keys import TABLES, read_value, split_key
from harvester.scene.load import Load
from harvester.scene.nondimensional import Nondimensional
from harvester.scene.scene import Scene
from harvester.scene.toml import load, loads
from tests.support.paths import ROOT
from tests.support.to_scene import equations

EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))
PLATE = """
[oscillator]
mass = "40 g"
stiffness = "16 N/m"
[piezo]
coupling = "1e-3 N/V"
capacitance = "50.2 nF"
"""
ND = "[nondimensional]\n"


def refused(text):
    """The one line with which a scene text is refused."""
    with pytest.raises(InputError) as caught:
        loads(text)
    line = str(caught.value)
    assert "\n" not in line
    assert len(line) < 400
    return line


@pytest.mark.parametrize(
    "text",
    [path.read_text() for path in EXAMPLES]
    + [
        PLATE,
        ND,
        PLATE + "[excitation]\n",
        'title = "a \\"b\\"\\n\\\\"\n' + PLATE,
        PLATE + '[load]\nnetlist = "bridge"\nparameters = { R = "1 Mohm", "C 2" = 1e-6 }\n',
        PLATE
        + "[stop]\nrestitution = 0\n[excitation]\nacceleration_psd = 0.0\nstiffness_noise = 0.1\n",
        ND + "c1 = 1\nc2 = 0.1\nc3 = 0.1\nalpha = 0.5\nbeta = 0.05\nmu = 0.05\nrestitution = 1\n"
        "eps1 = -1.0\neps2 = 2.0\nD11 = 0.01\nD22 = 0.01\nD12 = -0.01\n",
    ],
)
def test_round_trip(text):
    scene = loads(text)
    assert loads(scene.to_toml()) == scene
    assert loads(scene.to_toml()).digest == scene.digest


def test_units_and_absence():
    scene = loads(PLATE)
    assert scene.oscillator.mass == pytest.approx(0.04)
    assert scene.piezo.capacitance == pytest.approx(50.2e-9)
    assert scene.oscillator.damping is scene.stop is scene.load is scene.excitation is None
    assert scene.physical
    assert not loads(ND).physical


CAPACITANCE = (
    "piezo.capacitance must be a clamped capacitance (F), such as '50.2 nF', above 0, but is "
)
MASS = "oscillator.mass must be a mass (kg), such as '40 g', above 0, "


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "[oscillator] must be given (or [nondimensional] alone), but the table is missing"),
        ("[oscilator]\nmass = 1", "unknown scene table 'oscilator': did you mean 'oscillator'?"),
        ("[oscillator]\nmas = 1", "unknown [oscillator] key 'mas': did you mean 'mass'?"),
        ("[oscillator]\nmass = 1", "oscillator.stiffness must be given, but is missing"),
        (ND + "C1 = 1", "unknown [nondimensional] key 'C1': did you mean 'c1'?"),
        (
            ND + "zzz = 1",
            "unknown [nondimensional] key 'zzz': it must be one of c1, c2, c3, cv, alpha, ",
        ),
        (PLATE.replace("50.2 nF", "50 nH"), CAPACITANCE + "'50 nH'"),
        (PLATE.replace("50.2 nF", "50"), CAPACITANCE + "'50'"),
        (PLATE.replace('"50.2 nF"', "-50e-9"), CAPACITANCE + "-5e-08"),
        (PLATE.replace('"40 g"', "true"), MASS + "but is True"),
        (PLATE.replace('"40 g"', "[1]"), MASS + "but is [1]"),
        (PLATE.replace('"40 g"', '"heavy"'), MASS + "but is 'heavy'"),
        (PLATE.replace('"40 g"', "{ kg = 1 }"), MASS + "but is {'kg': 1}"),
        (PLATE.replace('"40 g"', "2026-01-01"), MASS + "but is datetime.date(2026, 1, 1)"),
        (PLATE.replace('"40 g"', "nan"), MASS + "but is nan"),
        (PLATE.replace('"40 g"', "-inf"), MASS + "but is -inf"),
        (PLATE.replace('"40 g"', "1e999"), MASS + "but is inf"),
        (
            PLATE.replace('"40 g"', "0x" + "f" * 5000),
            MASS + "but is a number of thousands of digits",
        ),
        (
            PLATE.replace('"40 g"', "1e-300"),
            MASS + "between 1e-50 and 1e+50 in size, but is 1e-300",
        ),
        ("oscillator.mass" + ".a" * 500 + " = 1", MASS + "but is {'a': {'a': "),
        ("oscillator = 1", "oscillator must be a table of keys, but is 1"),
        ("[[stop]]\nrestitution = 1", "stop must be a table of keys, but is [{'restitution': 1}]"),
        ("title = 3\n" + PLATE, "title must be a text, but is 3"),
        (
            PLATE + "[stop]\nrestitution = 1.2",
            "stop.restitution must be a restitution coefficient, such as 0.96, ",
        ),
        (PLATE + "[stop]", "stop.restitution must be given, but is missing"),
        (
            PLATE.replace("[piezo]", "damping = 1\ndamping_ratio = 1\n[piezo]"),
            "oscillator.damping_ratio must be left out if damping is given, but both are given",
        ),
        (PLATE + "[load]", "load must have either resistance or netlist, but neither is given"),
        (
            PLATE + '[load]\nresistance = 1\nnetlist = "bridge"',
            "load must have either resistance or netlist, but both are given",
        ),
        (
            PLATE + "[load]\nresistance = 1\nparameters = { R = 1 }",
            "load.parameters must be used with a netlist, but the load is a resistance",
        ),
        (PLATE + "[load]\nnetlist = 3", "load.netlist must be a text, but is 3"),
        (
            PLATE + '[load]\nnetlist = ""',
            "load.netlist must be the name of a netlist or a path, but is ''",
        ),
        (
            PLATE + '[load]\nnetlist = "a\\u0000/b"',
            "load.netlist must be the name of a netlist or a path, but is ",
        ),
        (
            PLATE + '[load]\nnetlist = "bridge"\nparameters = 3',
            "load.parameters must be a table of keys, but is 3",
        ),
        (
            PLATE + '[load]\nnetlist = "bridge"\nparameters = { R = true }',
            "load.parameters.R must be a number or a quantity with a unit, such as '10 uF', but is True",
        ),
        (
            PLATE + ND,
            "[oscillator] must be left out if [nondimensional] is given, but both are given",
        ),
        (ND + "eps1 = 1", "nondimensional.D11 must be given with eps1, but is left out"),
        (ND + "D22 = 1\neps1 = 1", "nondimensional.D11 must be given with eps1, but is left out"),
        (
            ND + "D11 = 1\nD22 = 4\nD12 = -2.1",
            "nondimensional.D12 must be at most sqrt(D11 D22) = 2 in size, but is -2.1",
        ),
        (ND + "mu = -1", "nondimensional.mu must be a number, such as 0.05, at least 0, but is -1"),
        (
            ND + 'mu = "1 ohm"',
            "nondimensional.mu must be a number, such as 0.05, at least 0, but is '1 ohm'",
        ),
        (
            PLATE.replace("16 N/m", "0 N/m"),
            "oscillator.stiffness must be other than 0, for it sets the scale of time",
        ),
        (
            PLATE + "[stop]\nrestitution = 1\nstiffness = 1e5",
            "stop.stiffness must be left out if stop.restitution is given, but both are given",
        ),
        (
            PLATE + "[stop]\ndamping = 1",
            "stop.stiffness must be given with stop.damping, but is left out",
        ),
        (
            PLATE + "[stop]\ngap = 1",
            "stop.restitution must be given, but is missing (or stop.stiffness, for a compliant stop)",
        ),
        (
            PLATE + "[stop]\nstiffness = 1e4\ndamping = 40",
            "stop.damping must be below the critical damping of the contact, 40, but is 40.0",
        ),
        (
            PLATE + "[opposite_stop]\nrestitution = 1\ngap = 1",
            "opposite_stop.restitution must be used with a rigid stop, but there is none: turn the axis round",
        ),
        (
            PLATE + "[stop]\nstiffness = 1\n[opposite_stop]\nrestitution = 1\ngap = 1",
            "opposite_stop.restitution must be used with a rigid stop, but there is none",
        ),
        (
            PLATE
            + '[stop]\nrestitution = 1\ngap = "-1 mm"\n[opposite_stop]\nrestitution = 1\ngap = "1 mm"',
            "opposite_stop.gap must be above 0.001, so that the stops leave room, but is 0.001",
        ),
        (ND + "linear = -2", "nondimensional.linear must be 1 or -1, but is -2.0"),
        (
            ND + "gap = 1",
            "nondimensional.gap must be used with a stop, but there is none: give its restitution",
        ),
        (
            ND
            + "restitution = 1\ngap = 1\nopposite_restitution = 1\nopposite_gap = -0.999999999999999",
            "nondimensional.opposite_gap must be above -1, so that the stops leave room, but is -0.999999999999999",
        ),
        (
            ND + "restitution = 1\nopposite_gap = 1",
            "nondimensional.opposite_gap must be used with a stop, but there is none",
        ),
        (
            ND + "restitution = 1\nopposite_restitution = 1",
            "nondimensional.opposite_gap must be above 0, so that the stops leave room, but is 0.0",
        ),
        (
            ND + "opposite_restitution = 1\nopposite_gap = 1",
            "nondimensional.opposite_restitution must be used with a rigid stop, but there is none",
        ),
        (
            ND + "restitution = 1\nstop_stiffness = 4",
            "nondimensional.stop_stiffness must be left out if nondimensional.restitution is given",
        ),
        (
            ND + "stop_damping = 1",
            "nondimensional.stop_stiffness must be given with nondimensional.stop_damping",
        ),
        (
            ND + "stop_stiffness = 4\nstop_damping = 4",
            "nondimensional.stop_damping must be below the critical damping of the contact, 4, but is 4.0",
        ),
        ("\x00", "scene must be TOML, but Invalid statement (at line 1, column 1)"),
        ("a = " + "9" * 5000, "scene must be TOML, but Exceeds the limit "),
        ("a = " + "[" * 5000, "scene must be TOML, but maximum recursion depth exceeded"),
        (
            "[stop]\nrestitution = .9",
            "scene must be TOML, but Invalid value (at line 2, column 15): write 0.9 for .9",
        ),
        (PLATE + PLATE, "scene must be TOML, but Cannot declare ('oscillator',) twice"),
        ("x" * 5000 + " = 1", "unknown scene table 'xxxxx"),
    ],
)
def test_what_is_no_scene(text, line):
    assert refused(text).startswith(line)


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (b"\xff\xfe\x00", "scene must be UTF-8 text, but "),
        (b"#" * 20_000, "scene must be a file of at most 16384 bytes, but "),
        (None, "scene must be a readable file, but "),  # a folder
    ],
)
def test_what_is_no_scene_file(tmp_path, content, line):
    path = tmp_path / "a.toml"
    path.mkdir() if content is None else path.write_bytes(content)
    with pytest.raises(InputError, match=f"^{re.escape(line + repr(str(path)))}"):
        load(path)


def test_a_file_may_begin_with_the_mark_of_an_editor(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xef\xbb\xbf" + PLATE.encode())
    assert hv.load(tmp_path / "a.toml") == hv.loads(PLATE)


def test_a_pipe_or_a_device(tmp_path):
    """Neither is waited for, nor read without end."""
    os.mkfifo(tmp_path / "a.toml")
    for path in (tmp_path / "a.toml", "/dev/zero"):
        with pytest.raises(
            InputError,
            match=rf"^scene must be a readable file, but '{path}' is not: it is a pipe or",
        ):
            load(path)


def test_a_name_that_no_file_has():
    with pytest.raises(
        InputError, match=r"^scene must be a readable file, but 'a.*b' is not: its name has a NUL"
    ):
        load("a\0b")


@pytest.mark.parametrize("name", ["plat.toml", "plate", "Plate.toml"])
def test_missing_file_has_a_nearest_match(name):
    with pytest.raises(InputError, match=r"there is no '.*': did you mean 'plate.toml'\?$"):
        load(EXAMPLES[0].parent / name)


def test_missing_folder():
    with pytest.raises(
        InputError,
        match=r"^scene must be a file, but there is no '/nope/a.toml': 'harvester new FILE.toml' makes one$",
    ):
        load("/nope/a.toml")


def test_netlist_path_starts_at_the_scene(tmp_path):
    (tmp_path / "a.toml").write_text(PLATE + '[load]\nnetlist = "own.cir"\n')
    assert load(tmp_path / "a.toml").load.netlist == str(tmp_path / "own.cir")
    (tmp_path / "a.toml").write_text(PLATE + '[load]\nnetlist = "bridge"\n')
    assert load(tmp_path / "a.toml").load.netlist == "bridge"


def test_files_outside_the_scenes_folder(tmp_path):
    """A scene of a stranger reaches no file outside its folder, by no path and no link; Python's own paths are free."""
    inside = tmp_path / "scene"
    inside.mkdir()
    (tmp_path / "own.cir").write_text("secret")
    (inside / "link.cir").symlink_to(tmp_path / "own.cir")
    (inside / "loop.cir").symlink_to("loop.cir")
    for name in (
        "../own.cir",
        str(tmp_path / "own.cir"),
        "/etc/passwd",
        "link.cir",
        "loop.cir",
        "sub/../../own.cir",
    ):
        (inside / "a.toml").write_text(PLATE + f'[load]\nnetlist = "{name}"\n')
        with pytest.raises(InputError) as caught:
            load(inside / "a.toml")
        said = (
            f"load.netlist must be in the folder of the scene file (copy it there), but is '{name}'"
        )
        assert str(caught.value) == said
    for name in ("load]\nnetlist", "excitation]\nacceleration_file"):
        with pytest.raises(InputError, match="must be in the folder of the scene file"):
            loads(PLATE + f'[{name} = "a\\u0000/b"', inside)
    assert loads(PLATE + '[load]\nnetlist = "../own.cir"').load.netlist == "../own.cir"


def test_changes():
    scene = loads(PLATE + "[stop]\nrestitution = 0.9\n")
    assert scene.with_load(5.0).load == Load(resistance=5.0)
    assert scene.without_stop() == loads(PLATE)
    for stops in (
        {"restitution": 1.0, "gap": 1.0, "opposite_restitution": 1.0},
        {"stop_stiffness": 4.0, "gap": 1.0},
    ):
        assert Scene(nondimensional=Nondimensional(**stops)).without_stop() == loads(ND)
    both = loads(PLATE + "[stop]\nrestitution = 0.9\n[opposite_stop]\nrestitution = 1\ngap = 1\n")
    assert both.without_stop() == loads(PLATE)
    assert both.vary("opposite_stop.gap", 2.0).opposite_stop.gap == 2.0
    assert scene.vary("load.resistance", 5.0) == scene.with_load(5.0)
    assert scene.vary("oscillator.mass", 1.0).oscillator.mass == 1.0
    bridge = scene.with_load(Load(netlist="bridge", parameters={"C": 1.0}))
    assert bridge.vary("load.parameters.R", 2.0).load.parameters == {"C": 1.0, "R": 2.0}


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("load.resistence", 1.0, "unknown [load] key 'resistence': did you mean 'resistance'?"),
        ("lod.resistance", 1.0, "unknown scene table 'lod': did you mean 'load'?"),
        ("resistanc", 1.0, "unknown scene key 'resistanc': did you mean 'resistance'?"),
        (
            "gap",
            1.0,
            "key 'gap' must be given with its table, but several have it: stop.gap, opposite_stop.gap, nond",
        ),
        ("load", 1.0, "unknown [load] key '': it must be one of resistance, netlist, "),
        ("stop.restitution", 2.0, "stop.restitution must be a restitution coefficient"),
        ("nondimensional.mu", 1.0, "[oscillator] must be left out"),
        (
            "load.parameters.R",
            1.0,
            "load must have either resistance or netlist, but neither is given",
        ),
    ],
)
def test_changes_that_no_scene_takes(key, value, line):
    with pytest.raises(InputError, match=f"^{re.escape(line)}"):
        loads(PLATE).vary(key, value)


def test_command_line_values():
    assert read_value("load.resistance", "1k") == 1e3
    assert read_value("load.parameters.C", "10 uF") == pytest.approx(1e-5)
    assert split_key("load.parameters.C") == ("load", "parameters.C")
    for key, text, line in [
        ("load.netlist", "bridge", "load.netlist must be a key with a number to be varied"),
        (
            "load.resistance",
            "x",
            "load.resistance must be a load resistance (ohm), such as '1 Mohm', above 0, but is",
        ),
        ("load.parameters", "1", "unknown [load] key 'parameters': did you mean 'parameters.R'?"),
    ]:
        with pytest.raises(InputError, match=f"^{re.escape(line)}"):
            read_value(key, text)


NUMBERS = st.floats(width=64) | st.integers() | st.sampled_from([0, 1, 0.5, 1e-50, 1e50, -1e50])
VALUES = NUMBERS | st.sampled_from(
    ["1 kg", "1 N/m", "1 nF", "bridge", "", True, None, [1], {"R": 1}, {"R": "x"}]
)
KEYS = {name: [*table.__annotations__, "wrong"] for name, table in TABLES.items()}
TABLE = {
    name: st.dictionaries(st.sampled_from(keys), NUMBERS.map(abs) | VALUES, max_size=6)
    for name, keys in KEYS.items()
}
# Half of them could be scenes: all that must be there is, and numbers are numbers.
ANY = st.fixed_dictionaries({}, optional=TABLE | {"title": st.text() | VALUES, "other": VALUES})
LIKELY = st.fixed_dictionaries(
    {
        "oscillator": st.fixed_dictionaries(
            {"mass": NUMBERS.map(abs), "stiffness": NUMBERS.map(abs)},
            optional=dict.fromkeys(
                (
                    "quadratic_stiffness",
                    "cubic_stiffness",
                    "damping",
                    "damping_x2",
                    "damping_x4",
                    "damping_v",
                ),
                NUMBERS,
            ),
        ),
        "piezo": st.fixed_dictionaries(
            {"coupling": NUMBERS.map(abs), "capacitance": NUMBERS.map(abs)}
        ),
    },
    optional={
        "excitation": st.fixed_dictionaries({}, optional={"acceleration_psd": NUMBERS.map(abs)}),
        "load": st.fixed_dictionaries({"resistance": NUMBERS.map(abs)}),
        "stop": st.fixed_dictionaries(
            {}, optional=dict.fromkeys(("restitution", "gap", "stiffness", "damping"), NUMBERS)
        ),
        "opposite_stop": st.fixed_dictionaries({"restitution": st.just(1.0), "gap": NUMBERS}),
    },
)
UNIT = st.sampled_from([0, 1, 1e-50, 1e50, 1e-20, 1e20, -1e50, 0.3])


@pytest.mark.slow
@settings(deadline=None, max_examples=300, derandomize=True)
@given(ANY | LIKELY)
def test_any_tables_are_a_scene_or_an_input_error(tables):
    computed_or_refused(tables)


@pytest.mark.slow
@settings(deadline=None, max_examples=200, derandomize=True)
@given(st.dictionaries(st.sampled_from(KEYS["nondimensional"][:-1]), UNIT))
def test_any_sizes_are_computed_or_refused(table):
    computed_or_refused({"nondimensional": table})


def computed_or_refused(tables):
    """A scene with finite coefficients and positive finite scales, or one line."""
    try:
        scene = Scene(**tables)
        found = [*vars(equations(scene)).values(), *vars(scales(scene)).values()]
        s = scales(scene)
        found += [1.0 / s.volts**2, s.volts**2, 1.0 / s.watts, s.watts]
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert all(abs(v) <= 1e100 for v in found if v is not None)
        assert loads(scene.to_toml()) == scene


def test_another_load_by_its_keys():
    """A load is read as the command line reads it; a load and its keys together: none is dropped in silence."""
    scene = loads(PLATE)
    assert (
        scene.with_load(resistance="470k") == scene.with_load("470 kohm") == scene.with_load(470e3)
    )
    bridge = scene.with_load(netlist="bridge", parameters={"R": "1M", "C": 1e-5})
    assert bridge.load == Load(netlist="bridge", parameters={"R": 1e6, "C": 1e-5})
    with pytest.raises(InputError, match="`load` must be left out if `resistance` is given"):
        scene.with_load(bridge.load, resistance="470k")
    with pytest.raises(
        InputError, match=r"load\.resistance must be a load resistance .* but is '470 kg'"
    ):
        scene.with_load(resistance="470 kg")
    with pytest.raises(InputError, match="either resistance or netlist, but neither is given"):
        scene.with_load()


def test_a_scene_without_a_title_is_called_by_what_it_is():
    """Figures have it where a title would be, a sweep's as well."""
    tables = hv.load("examples/plate.toml").tables() | {"title": ""}
    scene = hv.Scene(**tables)
    assert (
        scene.name == "device of 40 g and 3.183 Hz" and scene.replace(title="mine").name == "mine"
    )
    assert hv.Scene(nondimensional={"mu": 1.0}).name == "nondimensional device"
    swept = hv.sweep(scene, vary={"load.resistance": "100k:1M:3"}, engines=["exact"])
    assert scene.name in swept.plot().get_suptitle()
