"""The width of vectors: measured once and kept, never if the user or the processor has decided; equal answers."""

import json
import subprocess
import sys

import pytest

from harvester.machine.folders import VARIABLE
from harvester.mechanics.kernels import vector_width
from harvester.mechanics.kernels.vector_width import FASTER, FILE, may_be_wide, width

MEANS = """
import numpy as np
from harvester.mechanics.ensemble.trajectories import Trajectories
from tests.support.systems import PAPER
many = Trajectories(PAPER, 64, np.random.SeedSequence(5), 0.1, controlled=True)
moments = many.run(20.0)
print(*(float(one) for name in ("V2", "x2", "v2", "impacts") for one in getattr(moments, name)))
"""


@pytest.fixture
def measured(tmp_path, monkeypatch):
    """A wide processor with an empty cache; the list that it gives has the answers of measurements still to come."""
    ratios = []
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    monkeypatch.setattr(vector_width, "may_be_wide", lambda: True)
    monkeypatch.setattr(vector_width, "faster", lambda: ratios.pop(0))
    yield ratios
    width.cache_clear()


def anew():
    """The width, as a new process finds it."""
    width.cache_clear()
    return width()


@pytest.mark.parametrize("ratio, bits", [(1.3, 512), (FASTER, 512), (1.01, 256), (0.7, 256)])
def test_it_is_measured_once_and_kept(ratio, bits, measured, tmp_path):
    measured.append(ratio)
    assert anew() == anew() == bits
    assert measured == []
    assert json.loads((tmp_path / FILE).read_text())["bits"] == bits


@pytest.mark.parametrize(
    "change",
    [
        lambda kept: "",
        lambda kept: kept[: len(kept) // 2],
        lambda kept: "[512]",
        lambda kept: "x" * 100_000,
        lambda kept: "[" * 5_000,
        lambda kept: json.dumps({**json.loads(kept), "processor": "z80"}),
        lambda kept: json.dumps({**json.loads(kept), "numba": "0.1"}),
        lambda kept: json.dumps({**json.loads(kept), "bits": 64}),
        lambda kept: json.dumps({"bits": 512}),
    ],
    ids=[
        "empty",
        "cut off",
        "a list",
        "long",
        "brackets",
        "another processor",
        "another numba",
        "no width",
        "of nothing",
    ],
)
def test_a_wrong_file_is_measured_anew(change, measured, tmp_path):
    measured += [1.3, 1.0]
    assert anew() == 512
    (tmp_path / FILE).write_text(change((tmp_path / FILE).read_text()))
    assert anew() == 256
    assert json.loads((tmp_path / FILE).read_text())["bits"] == 256


def test_nothing_is_measured_without_a_place_to_keep_it(measured, monkeypatch):
    monkeypatch.setenv(VARIABLE, "/dev/null/nowhere")
    assert anew() == 256


@pytest.mark.parametrize("name, value", [("CPU_FEATURES", "+avx2"), ("CPU_NAME", "haswell")])
def test_what_the_user_asks_numba_for_is_left_alone(name, value, monkeypatch):
    monkeypatch.setattr(vector_width.config, name, value)
    assert not may_be_wide()


@pytest.mark.thorough("test_trajectories.py")
@pytest.mark.skipif(not may_be_wide(), reason="this processor has no vectors of 512 bits")
@pytest.mark.slow
def test_both_widths_give_the_same_answers_up_to_rounding(tmp_path, monkeypatch):
    """In processes of their own, and from kernels of their own: neither uses the machine code of the other."""
    found, files = [], []
    for bits in (256, 512):
        monkeypatch.setenv(VARIABLE, str(tmp_path))
        known = {
            "processor": vector_width.binding.get_host_cpu_name(),
            "numba": vector_width.numba.__version__,
        }
        (tmp_path / FILE).write_text(json.dumps({**known, "bits": bits}))
        done = subprocess.run(
            [sys.executable, "-c", MEANS], capture_output=True, text=True, check=True
        )
        found.append([float(word) for word in done.stdout.split()])
        files.append({file.read_bytes() for file in tmp_path.rglob("*.nbc")})
    assert found[0] == pytest.approx(found[1], rel=1e-12)
    assert len(files[1]) == 2 * len(files[0]) > 0


@pytest.mark.skipif(not may_be_wide(), reason="this processor has no vectors of 512 bits")
def test_a_measurement_is_a_sensible_number():
    assert 0.2 < vector_width.faster() < 5.0
