"""The JSON schema of scene files: as tolerant as the program, marks plain mistakes,
and editors read it."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given, settings

import harvester as hv
from harvester.errors import InputError
from harvester.scene.keys import keys
from harvester.scene.schema import NAME, schema
from tests.support import strategies
from tests.support.paths import EXAMPLES

SCHEMA = schema()
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)
SCENES = [*sorted(EXAMPLES.glob("*.toml")), *sorted(EXAMPLES.glob("published/*.toml"))]
OSCILLATOR, PIEZO = (
    '[oscillator]\nmass = "40 g"\nstiffness = 16\n',
    "[piezo]\ncoupling = 1e-3\ncapacitance = 5e-8\n",
)
BARE = OSCILLATOR + PIEZO
ND = "[nondimensional]\nbeta = 0.05\n"

# Texts of scenes with one thing wrong each, fifty of them, that an editor marks by the schema.
BROKEN = [
    "",
    "title = 3\n" + BARE,
    "titel = 'plate'\n" + BARE,
    OSCILLATOR,
    PIEZO,
    "[oscilator]\nmass = 1\nstiffness = 1\n" + PIEZO,
    BARE + "[stops]\nrestitution = 0.9\n",
    "oscillator = 3\n" + PIEZO,
    "oscillator = 'stiff'\n" + PIEZO,
    "[[oscillator]]\nmass = 1\nstiffness = 1\n" + PIEZO,
    "[oscillator]\nstiffness = 16\n" + PIEZO,
    "[oscillator]\nmass = 0.04\n" + PIEZO,
    OSCILLATOR + "[piezo]\ncoupling = 1e-3\n",
    OSCILLATOR + "[piezo]\ncapacitance = 5e-8\n",
    OSCILLATOR + "[piezo]\n",
    OSCILLATOR + "damping = 1\ndamping_ratio = 0.1\n" + PIEZO,
    OSCILLATOR + "frequency = 3\n" + PIEZO,
    *(
        BARE.replace('mass = "40 g"', f"mass = {wrong}")
        for wrong in ("true", "-0.04", "0", '"40"', '"-40 g"', '"forty g"', '""', "[0.04]", "{}")
    ),
    *(BARE + f"[stop]\nrestitution = {wrong}\n" for wrong in ("1.1", "-0.1", '"high"', "false")),
    BARE + "[stop]\nrestitutoin = 0.9\n",
    BARE + "[stop]\nstiffness = 1e5\ndamping = -1\n",
    BARE + "[stop]\nrestitution = 0.9\n[opposite_stop]\ngap = 1e-3\n",
    BARE + '[load]\nresistance = "0.5"\n',
    BARE + "[load]\nresistance = 0\n",
    BARE + "[load]\nresistor = 1e6\n",
    BARE + "[load]\nnetlist = 7\n",
    BARE + '[load]\nnetlist = "bridge"\nparameters = { R = "much" }\n',
    BARE + '[load]\nnetlist = "bridge"\nparameters = [1e6]\n',
    BARE + '[load]\nnetlist = "./board.cir"\nterminals = ["a"]\n',
    BARE + '[load]\nnetlist = "./board.cir"\nterminals = ["a", "b", "c"]\n',
    BARE + '[load]\nnetlist = "./board.cir"\nterminals = ["a", 2]\n',
    BARE + '[load]\nnetlist = "./board.cir"\nterminals = ["a", "b"]\nsupplies = { VCC = "3.3" }\n',
    BARE + "[excitation]\nacceleration_psd = -1e-3\n",
    BARE + "[excitation]\nacceleration_amplitude = 1\nfrequency = 0\n",
    BARE + '[excitation]\nacceleration_psd = 1\ncorrelation_time = "-1 s"\n',
    BARE + "[excitation]\nacceleration_file = 3\n",
    BARE + '[excitation]\nprofile = "rotating"\nharmonics = "0.1 g"\n',
    BARE + '[excitation]\nprofile = "rotating"\nharmonics = [-1]\n',
    ND + "mu = -1\n",
]
# What only the program can tell: a unit of another quantity, and keys that exclude or need each
# other.
BEYOND = [
    BARE.replace('"40 g"', '"40 V"'),
    BARE + "[load]\n",
    BARE + "[excitation]\nfrequency = 3\n",
    ND + BARE,
]


def faults(text):
    """What the schema finds wrong with a scene's text."""
    return [error.message for error in VALIDATOR.iter_errors(tomllib.loads(text))]


def test_it_is_a_schema_with_every_key():
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    assert "$ref" not in json.dumps(SCHEMA)
    for key in keys():
        table = SCHEMA["properties"][key.table]
        table = table.get("items", table)  # of [[mode]] there are several
        said = table["properties"][key.name]
        assert said["title"] == (key.unit or key.name)
        assert key.meaning[1:] in said["description"] and key.example in said["description"]
        assert key.needed == (key.name in table.get("required", []))


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_it_takes_every_example(path):
    assert faults(path.read_text()) == []


@pytest.mark.parametrize("text", BROKEN)
def test_it_marks_a_broken_scene(text):
    """The program refuses each of the fifty as well."""
    assert faults(text)
    with pytest.raises(InputError):
        hv.loads(text)


def test_there_are_fifty_broken_scenes():
    assert len(set(BROKEN)) == len(BROKEN) == 50


@pytest.mark.parametrize("text", BEYOND)
def test_what_it_cannot_tell(text):
    """The page on scenes states so."""
    assert faults(text) == []
    with pytest.raises(InputError):
        hv.loads(text)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(strategies.scenes)
def test_it_takes_what_the_program_takes(scene):
    """Random scenes, sensible, extreme and broken: an editor marks nothing that would run."""
    text = strategies.written(scene).decode("utf-8", "replace")
    try:
        hv.loads(text)
    except InputError:
        return
    assert faults(text) == []


def test_keys_schema(harvester, tmp_path):
    assert json.loads(harvester("keys", "--schema")[1]) == SCHEMA
    assert harvester("keys", "--schema", "--out", tmp_path / NAME)[:2] == (
        0,
        f"written: {tmp_path / NAME}\n",
    )
    assert json.loads((tmp_path / NAME).read_text()) == SCHEMA
    assert harvester("keys", "load", "--schema")[2] == (
        "harvester: TABLE|KEY must be left out with --schema, but is given\n"
    )
    assert (
        harvester("keys", "--out", "x")[2]
        == "harvester: --out must be used with --schema, but --schema is left out\n"
    )


@pytest.mark.thorough("test_it_marks_a_broken_scene")
@pytest.mark.slow
def test_taplo_reads_it(harvester, tmp_path):
    """The language server behind editors finds the schema that a scene's first line names, without a network."""
    taplo = Path(sys.executable).with_name("taplo")
    assert harvester("examples", "plate_bridge", "--out", tmp_path / "good.toml")[0] == 0
    good = (tmp_path / "good.toml").read_text()
    assert good.startswith(f"#:schema ./{NAME}\n")
    (tmp_path / "bad.toml").write_text(good.replace("stiffness", "stifness"))
    for name, status, says in (("good", 0, ""), ("bad", 1, "'stifness' was unexpected")):
        done = subprocess.run(
            [taplo, "lint", f"{name}.toml"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        assert (done.returncode, says in done.stderr) == (status, True), done.stderr
