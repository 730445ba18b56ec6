"""A write or an allocation that fails once, at its n-th time: one line, or the whole answer."""

import importlib
import json
import os
import subprocess
import sys

import pytest

from harvester.errors import named
from tests.support.judge import refusal
from tests.support.paths import EXAMPLES, ROOT

sys.path.append(str(ROOT / "benchmarks"))
shim = importlib.import_module("attacks.shim")
ABORTED = importlib.import_module("attacks.wholeness").ABORTED

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="a library before the system's: LD_PRELOAD"),
    pytest.mark.slow,
]

PLATE = str(EXAMPLES / "plate.toml")
RUN = ["run", PLATE, "--engine", "averaged", "--json"]
SWEEP = ["sweep", PLATE, "--vary", "load.resistance=1k:10M:3", "--engine", "averaged"]
SWEEP += ["--workers", "1", "--out", "out"]
NODE = ["node", str(EXAMPLES / "bimorph_chip.toml"), "--json"]
# a seventh part of the first 200, and then ever rarer until an answer is printed
SAMPLE = ",".join(str(n) for n in (*range(1, 200, 13), *(int(250 * 1.6**k) for k in range(10))))
ALL = "1-200," + ",".join(str(int(200 * 1.12**k)) for k in range(1, 60))


def answers(folder, kind, numbers, words):
    """The status, words and files of the command at each n."""
    env = {**os.environ, "LD_PRELOAD": shim.built(folder)}
    env["PYTHONPATH"] = os.pathsep.join([str(ROOT), str(ROOT / "benchmarks")])
    command = [sys.executable, "-m", "attacks.nth_fault", str(folder), kind, numbers, *words]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def wrong(answer):
    """What is wrong with an answer; "" if it is one line, or a whole one.

    Python and libraries themselves may abort where memory ends: docs/reliability.md.
    """
    if answer["left"]:
        return answer["left"]
    if answer["status"] in ABORTED:
        return ""
    if answer["status"] == 0:
        return ""
    if "internal error" in answer["err"]:
        return answer["err"]
    return refusal(answer["status"], "", answer["err"])


@pytest.mark.parametrize("kind", ["object", "allocation"])
def test_memory_ends_while_a_formula_runs(tmp_path, kind):
    if kind == "object":
        pytest.importorskip("_testcapi", reason="Python without its test module")
    found = answers(tmp_path, kind, f"{SAMPLE},{10**9}", RUN)
    assert found[-1]["status"] == 0
    bad = {one["n"]: text for one in found if (text := wrong(one))}
    assert bad == {}
    assert {one["status"] for one in found} >= {0, 3}


def test_a_write_fails_while_a_sweep_runs(tmp_path):
    found = answers(tmp_path, "write", "1,4,9,14,17,19,20,1000", SWEEP)
    assert {one["n"]: text for one in found if (text := wrong(one))} == {}
    assert {one["status"] for one in found} == {0, 2}


@pytest.mark.parametrize("kind", ["object", "allocation", "write"])
@pytest.mark.parametrize("words", [RUN, SWEEP, NODE], ids=lambda words: words[0])
def test_each_of_the_first_200_of_a_command_that_is_loaded(tmp_path, kind, words):
    """Faults strike the command itself, as the imports are done; NumPy aborts at one of twenty.

    `a[:, :1, :1] + a` alone ends Python with a segmentation fault if its third allocation fails.
    """
    if kind == "object":
        pytest.importorskip("_testcapi", reason="Python without its test module")
    numbers = {"write": "1-20" if words[0] == "sweep" else "1-5"}.get(kind, "1-200")
    found = answers(tmp_path, kind, numbers, ["--warm", *words])
    assert {one["n"]: text for one in found if (text := wrong(one))} == {}
    assert sum(one["status"] in ABORTED for one in found) <= 0.08 * len(found)
    assert kind == "write" or 3 in {one["status"] for one in found}


@pytest.mark.thorough("nothing: each of the first 200 faults")
@pytest.mark.parametrize("kind", ["object", "allocation", "write"])
@pytest.mark.parametrize("words", [RUN, SWEEP, NODE], ids=lambda words: words[0])
def test_each_of_the_first_200(tmp_path, kind, words):
    """One line or the answer, and whole files, at each n."""
    if kind == "object":
        pytest.importorskip("_testcapi", reason="Python without its test module")
    numbers = ALL if kind != "write" else "1-30" if words[0] == "sweep" else "1-5"
    found = answers(tmp_path, kind, numbers, words)
    assert {one["n"]: text for one in found if (text := wrong(one))} == {}
    assert sum(one["status"] in ABORTED for one in found) <= 0.02 * len(found)


def test_a_defect_in_the_text_of_a_circuit_is_no_lack_of_memory():
    """A text that Python cannot read was a lack of memory, whoever had written it."""
    errors = [
        SyntaxError("invalid syntax", (name, 1, 1, "")) for name in ("<string>", "<circuit_1>")
    ]
    assert ["memory" in str(named(error)) for error in errors] == [True, False]


def test_a_class_that_was_not_initialised_for_lack_of_memory():
    """A library in Rust names the MemoryError as the cause of its RuntimeError."""
    error = RuntimeError("An error occurred while initializing class Known")
    assert "internal error" in str(named(error))
    error.__cause__ = MemoryError()
    assert "memory" in str(named(error))


def test_a_lock_without_memory_is_a_lack_of_memory():
    """Python's locks and its locks of files have errors of their own."""
    errors = [RuntimeError(f"can't allocate {kind}lock") for kind in ("", "read ")]
    assert ["memory" in str(named(error)) for error in errors] == [True, True]
