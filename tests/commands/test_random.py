"""Random scenes, options and netlists through the whole command line: an answer with errors, or one line.

`HARVESTER_RANDOM=long pytest tests/commands/test_random.py` tries five times as many, of every
combination of effects, with other numbers each time; it compiles kernels for hundreds of
combinations, which takes an hour.
"""

import json
import os
import re
import shutil
import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from harvester import cli
from harvester.errors import InputError
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support import strategies
from tests.support.judge import asked, fault, refusal
from tests.support.paths import EXAMPLES

QUIET = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}
LONG = os.environ.get("HARVESTER_RANDOM") == "long"
FEW = ("--trajectories", "16")
# Those with the kernels that other tests compile as well.
COMPILED = [
    tomllib.loads((EXAMPLES / f"{name}.toml").read_text())
    for name in (
        "paper_figure3",
        "plate",
        "plate_with_stop",
        "plate_harmonic",
        "plate_preloaded",
        "plate_coloured",
    )
]
IDEAL = [
    tomllib.loads((EXAMPLES / f"{name}.toml").read_text())
    for name in ("plate_bridge", "plate_sece")
]


def tries(count):
    """A test of so many examples, five times as many in the long run."""
    short = settings(
        max_examples=count, derandomize=True, phases=[Phase.explicit, Phase.generate], **QUIET
    )
    long = settings(
        max_examples=5 * count, phases=[Phase.explicit, Phase.generate], print_blob=True, **QUIET
    )
    return long if LONG else short


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    """A folder with a scene's records, next to one that a scene must not read."""
    here = tmp_path_factory.mktemp("random") / "scene"
    here.mkdir()
    for name in ("shake.csv", "shake_psd.csv"):
        shutil.copy(EXAMPLES / name, here)
    shutil.copy(EXAMPLES / "shake.csv", here.parent / "outside.csv")
    shutil.copy(EXAMPLES / "paper_figure3.toml", here / "paper.toml")
    shutil.copy(EXAMPLES / "plate_with_stop.toml", here / "plate.toml")
    (here / "points.csv").write_text("load.resistance\n1e3\n1e4\n")
    before = Path.cwd()
    os.chdir(here)
    yield here
    os.chdir(before)
    assert {p.name for p in here.parent.iterdir()} == {"scene", "outside.csv"}


def judged(scene, *arguments):
    """Ask one command of a scene, and judge the answer."""
    Path("scene.toml").write_bytes(strategies.written(scene))
    command, *others = arguments
    answer = asked(command, "scene.toml", *others)
    assert not fault(*answer), answer
    return answer[0]


def answered(statuses, least):
    """Whether at least that share of the requests had an answer; the rest are refusals, one line each."""
    share = statuses.count(0) / len(statuses)
    assert share > least, f"{share:.0%} of {len(statuses)} have an answer"


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.slow
def test_formulas():
    """A fifth of the scenes have what the theories know, and an answer."""
    statuses = {"published": [], "averaged": []}

    @tries(200)
    @given(strategies.scenes)
    def one(scene):
        for engine, found in statuses.items():
            found.append(judged(scene, "run", "--engine", engine, "--json"))

    one()
    for found in statuses.values():
        answered(found, 0.2)


NONLINEAR = re.compile("stop|restitution|gap|cubic|quadratic|damping_x|alpha|c2|c3|linear")


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.slow
def test_exact():
    """What is linear of the scenes, under all their shaking."""
    statuses = []

    @tries(200)
    @given(strategies.scenes)
    def one(scene):
        linear = {
            name: {key: value for key, value in table.items() if not NONLINEAR.match(str(key))}
            if isinstance(table, dict)
            else table
            for name, table in scene.items()
            if not NONLINEAR.search(str(name))
        }
        statuses.append(judged(linear, "run", "--engine", "exact", "--json"))

    one()
    answered(statuses, 0.12)


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.slow
def test_ensemble():
    """Scenes like the examples, and some with extreme numbers, which are mostly refused."""
    statuses = []

    @tries(60)
    @given(strategies.scenes if LONG else strategies.near(COMPILED))
    def one(scene):
        statuses.append(
            judged(scene, "run", "--engine", "ensemble", "--json", *FEW, "--budget", "1s")
        )

    one()
    answered(statuses, 0.1 if LONG else 0.5)


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.slow
def test_ideal():
    """Circuits of ideal elements."""
    statuses = []

    @tries(15)
    @given(strategies.scenes if LONG else strategies.near(IDEAL))
    def one(scene):
        statuses.append(judged(scene, "run", "--engine", "ideal", "--json", *FEW, "--budget", "1s"))

    one()
    answered(statuses, 0.0 if LONG else 0.4)


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.ngspice
@pytest.mark.slow
def test_spice():
    """ngspice runs of one second each."""
    few = ("--alone", "--json", "--trajectories", "2", "--duration", "1", "--budget", "2s")
    statuses = []

    @tries(8)
    @given(strategies.scenes if LONG else strategies.near([COMPILED[0], IDEAL[0]]))
    def one(scene):
        statuses.append(judged(scene, "run", "--engine", "spice", *few))

    one()
    answered(statuses, 0.0 if LONG else 0.2)


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.slow
def test_stability():
    """Exponents of any scene that has one."""
    statuses = []

    @tries(60)
    @given(strategies.scenes)
    def one(scene):
        statuses.append(judged(scene, "stability", "--json", "--trajectories", "64"))

    one()
    answered(statuses, 0.15)


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.slow
@tries(60)
@given(st.data())
def test_options(data):
    command = data.draw(
        st.sampled_from(["run", "sweep", "optimise", "motion", "response", "stability"])
    )
    scene = data.draw(
        st.sampled_from(["plate.toml", "paper.toml", "none.toml", "../outside.csv", ""])
    )
    engine = ["--engine", "averaged"] if command in ("run", "sweep", "optimise") else []
    arguments = data.draw(strategies.options(cli.cli.commands[command]))
    answer = asked(command, scene, *engine, *arguments)
    bad = fault(*answer) if "--json" in arguments else answer[0] and refusal(*answer)
    assert not bad, answer


@pytest.mark.thorough("test_commands_and_files_are_refused")
@pytest.mark.slow
def test_netlists():
    """A netlist is read, without anything dangerous in it, or refused in one line."""
    path = Path("mine.cir")
    read = []

    @tries(300)
    @given(strategies.netlists())
    def one(text):
        path.write_bytes(text)
        try:
            circuit = load_circuit(Load(netlist=str(path.absolute()), parameters={}))
        except InputError as error:
            assert str(error).isprintable()
            assert len(str(error)) < 600
            read.append(2)
        else:
            assert circuit.name == "mine" or "{" not in circuit.text
            assert not any(
                word in circuit.text.lower()
                for word in (".include", ".control", "shell", "system", "*#")
            )
            read.append(0)

    one()
    answered(read, 0.05)  # most draws have a line that the reader refuses


def test_a_load_slower_than_rounding():
    """Found here: 1/mu of 1e50 made the slow voltage's matrix singular to rounding; it has a limit."""
    table = {"restitution": 0.9, "c1": -0.01, "beta": 0.05, "D11": 0.01}
    answers = []
    for mu in (1e-50, 1e-12, 1e-8):
        Path("scene.toml").write_bytes(strategies.written({"nondimensional": table | {"mu": mu}}))
        status, out, _ = asked("run", "scene.toml", "--engine", "averaged", "--json")
        assert status == 0
        answers.append(json.loads(out)["mean_square_voltage"]["value"])
    assert answers == pytest.approx([answers[-1]] * 3, rel=1e-6)


def test_an_exponent_that_overflowed():
    """Found here: e^(c1 t) of a strong negative damping."""
    for c1 in (300.0, 1e12):
        Path("scene.toml").write_bytes(
            strategies.written(
                {"nondimensional": {"c1": c1, "mu": 0.05, "beta": 0.3, "restitution": 1.0}}
            )
        )
        assert not fault(*asked("stability", "scene.toml", "--json", "--trajectories", "64"))


ENSEMBLE = ("run", "--engine", "ensemble")


@pytest.mark.thorough("test_any_tables_are_a_scene_or_an_input_error")
@pytest.mark.ngspice
@pytest.mark.parametrize(
    ("keys", "arguments", "says"),
    [
        (
            {"beta": 1e12, "mu": 0.05, "c1": -0.01, "D11": 1e-6},
            ENSEMBLE,
            "trajectory-steps of 1e-07/w0",
        ),
        ({"beta": 1e50, "mu": 1.0, "c1": -0.01}, ("stability",), "trajectory-steps of 5e-27/w0"),
        (
            {"c1": -0.01, "drive": 0.1, "drive_frequency": 1e-50, "mu": 1.0, "beta": 0.1},
            ENSEMBLE,
            "the excitation repeats after",
        ),
        (
            {"beta": 0.05, "mu": 2e-3, "c1": -0.01, "D11": 0.01},
            ("run", "--engine", "spice", "--alone", "--budget", "2s", "--trajectories", "32"),
            "ngspice runs would need",
        ),
    ],
    ids=["stiff", "stiff exponent", "slow drive", "slow spice"],
)
def test_hours_are_a_named_error(keys, arguments, says):
    """Found here: what would need hours or years begins, and shows nothing."""
    Path("scene.toml").write_bytes(strategies.written({"nondimensional": keys}))
    command, *others = arguments
    answer = asked(command, "scene.toml", "--json", *others)
    assert not fault(*answer)
    assert answer[0] == 3
    assert says in answer[2]
