"""The benchmarks compare like with like: kernels by hand give the package's numbers, peers integrate the same scene."""

import importlib
import importlib.util
import io
import os
import subprocess
import sys

import numpy as np
import pytest

from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
absent = importlib.import_module("absent")
effects = importlib.import_module("effects")
mutants = importlib.import_module("mutants")
random_mutants = importlib.import_module("random_mutants")
same_answers = importlib.import_module("same_answers")
by_hand = importlib.import_module("peers.by_hand")

from harvester.engines.selection import ENGINES  # noqa: E402
from harvester.equations.coefficients import Equations  # noqa: E402
from harvester.mechanics.ensemble.trajectories import Trajectories  # noqa: E402
from harvester.studies.registry import STUDIES  # noqa: E402
from tests.support.systems import PAPER, changed  # noqa: E402

pytestmark = pytest.mark.slow

SCENES = dict(effects.scenes())


@pytest.mark.thorough("test_trajectories.py")
@pytest.mark.parametrize(
    ("name", "split"), [("stop alone", True), ("all without stop", False), ("all", True)]
)
def test_kernel_by_hand_gives_the_same_numbers(name, split):
    """State and sums to rounding, random words exactly, in both orders of the loops."""
    e = SCENES[name]
    expected, found = effects.arrays(), effects.arrays()
    effects.prepared(e, expected, readings=20)()
    effects.prepared_by_hand(e, split, found, readings=20)()
    for ours, theirs in zip(expected, found, strict=True):
        np.testing.assert_allclose(theirs, ours, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["cv", "softening", "inertia", "gamma"])
def test_an_effect_has_lines_that_can_be_removed(name):
    """Without them no condition asks for the coefficient, all other effects keep theirs, and the source compiles."""
    source = ROOT / "harvester/mechanics/kernels/equation_of_motion.py"
    text = source.read_text()
    left = absent.without(text, name)
    assert f"c.{name} is" not in left and f"\n    if {name} is" not in left and left != text
    for other in {"cv", "softening", "inertia", "gamma"} - {name}:
        assert left.count(f"c.{other} is") == text.count(f"c.{other} is"), other
    compile(left, str(source), "exec")


def test_code_by_hand_holds_nothing_of_what_is_absent():
    """Every mark names an effect; the bare scene's code has no stop, noise, damping or load in it."""
    known = {
        "stop",
        "load",
        "cubic",
        "back",
        "linear",
        "nonlinear",
        "external",
        "parametric",
        "noise",
        "damped",
    }
    assert by_hand.effects(PAPER) == known
    bare = by_hand.source(Equations(), split=False).partition("\n")[2]
    for word in (
        "hit",
        "xi",
        "bits",
        "mu",
        "alpha",
        "beta",
        "c1",
        "c2",
        "c3",
        "sqrt",
        "exp",
        "speed",
        "later",
    ):
        assert word not in bare, word


@pytest.mark.thorough("test_no_noise_dies_out_with_a_word")
@pytest.mark.parametrize("e", [changed(PAPER, n1=None, n2=None), Equations(alpha=0.5, c1=-0.01)])
def test_no_noise_no_draw(e):
    """A scene without noise leaves its generators as they were; with noise they all move on."""
    held = effects.arrays()
    before = held[1].copy()
    effects.prepared(e, held, readings=5)()
    assert (held[1] == before).all()
    effects.prepared(PAPER, held, readings=5)()
    assert (held[1] != before).all()


def averages(module, needs, *arguments, **options):
    """A peer's averages; those of JAX in an interpreter of its own, because after its import every fork warns."""
    if needs != "diffrax":
        return importlib.import_module(f"peers.{module}").averages(*arguments, **options)
    code = f"""
import sys
import numpy
from peers.{module} import averages
numpy.save(sys.stdout.buffer, averages(*{arguments!r}, **{options!r}))
"""
    paths = os.pathsep.join([str(ROOT / "benchmarks"), str(ROOT)])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr.decode()[-2000:]
    return np.load(io.BytesIO(done.stdout))


@pytest.mark.parametrize(
    ("module", "needs", "options", "h", "n"),
    [
        ("numpy_arrays", "numpy", {"way": "tuned"}, 0.1, 2048),
        ("numpy_arrays", "numpy", {"way": "plain"}, 0.1, 2048),
        ("rk4", "numpy", {}, 0.025, 2048),
        ("sdeint_paths", "sdeint", {}, 0.05, 64),
        ("diffrax_steps", "diffrax", {"way": "arrays"}, 0.025, 2048),
        ("diffrax_steps", "diffrax", {"way": "unsafe"}, 0.025, 1024),
        ("diffrax_steps", "diffrax", {"way": "documented"}, 0.05, 64),
    ],
)
@pytest.mark.filterwarnings("ignore")
def test_peers_integrate_the_same_scene(module, needs, options, h, n):
    """E[V^2] of the first 20 time units from rest, |z| < 4 next to this package's."""
    if importlib.util.find_spec(needs) is None:
        pytest.skip(f"{needs} is not installed: make bench")
    means = averages(module, needs, h, n, 0.0, 20.0, 5, **options)
    ours = Trajectories(PAPER, 4096, np.random.SeedSequence(3), 0.05).run(20.0).V2
    assert means.shape == (n,)
    error = np.hypot(means.std(ddof=1) / np.sqrt(n), ours.std(ddof=1) / np.sqrt(ours.size))
    assert abs(means.mean() - ours.mean()) < 4 * error


def test_every_mutant_fits_the_package():
    """Each piece of code that the mutation check replaces is found exactly once, and its tests by their names."""
    texts, files = mutants.sources(ROOT), mutants.test_files(ROOT)
    assert [
        f"{one.name}: {wrong}"
        for one in mutants.mutants()
        if (wrong := mutants.misfit(one, texts, files))
    ] == []


def test_answers_that_differ_are_found():
    """In a last digit, by a key that is missing, or by a status; not by a time, a sentence or a new key."""
    before = {
        "rows.0.power": 1.0,
        "rows.1.power": None,
        "warnings.0": "before",
        "seconds": 1.0,
        "version": "1",
    }

    def wrong(status=0, **changes):
        after = {key: value for key, value in (before | changes).items() if value != "gone"}
        return same_answers.differences((status, after, ""), (0, before, ""), None)[0]

    assert (
        wrong()
        == wrong(**{"warnings.0": "after", "seconds": 2.0, "version": "2", "new": 1.0})
        == []
    )
    assert wrong(**{"rows.0.power": 1.0 + 2.0**-52}) == [
        "rows.0.power: 1.0000000000000002, there 1.0 (+2.2e-16)"
    ]
    assert wrong(**{"rows.1.power": 0.0}) == ["rows.1.power: 0.0, there None"]
    assert wrong(**{"rows.1.power": "gone"}) == ["2 values, there 3"]
    assert (
        wrong(**{"rows.0.power": "gone", "rows.1.power": "gone"})[0]
        == "keys that are gone: rows.*.power"
    )
    assert wrong(3) == ["exit status 3, there 0: "]


def test_answers_of_every_engine_and_study_are_compared():
    """But for the study `cost`, which measures times."""
    asked = [words for _, words in same_answers.cases()]
    by_engine = [words for words in asked if words[0] == "run" and "--engine" in words]
    assert set(ENGINES) == {words[words.index("--engine") + 1] for words in by_engine}
    assert {study.name for study in STUDIES} - {"cost"} <= {words[0] for words in asked}
    assert all((ROOT / "examples" / f"{scene}.toml").exists() for scene in same_answers.RUNS)


def test_random_mutants_are_small_changes_that_python_takes():
    """One of each kind, in its place; docstrings, annotations and texts stay."""
    body = b"if x < 2 and x:\n  x += 1\n g(x)\n return '1' + x * 0.5\n"
    text = b'def f(x: int = 3):\n """A < 1."""\n ' + body
    found = {
        text[begin:end].decode(): (new, line)
        for begin, end, new, line in random_mutants.changes(text)
    }
    assert found == {
        " and ": (" or ", 3), " < ": (" >= ", 3), "2": ("3", 3), "x += 1": ("pass", 4), "1": ("2", 4),
        "g(x)": ("pass", 5), " * ": (" / ", 6), "0.5": ("0.625", 6),
    }  # fmt: skip
    for begin, end, new, _ in random_mutants.changes(text):
        compile(text[:begin] + new.encode() + text[end:], "mutant", "exec")
