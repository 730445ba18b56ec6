"""Requests that ended in internal errors: very short paths, umlauts in an old locale."""

import math
import os
import subprocess
import sys

import pytest

import harvester as hv
from tests.support.judge import refusal
from tests.support.paths import EXAMPLES, ROOT

SOFT = """
oscillator = { mass = "50 g", stiffness = "5e-4 N/m", damping_ratio = 0.02 }
piezo = { coupling = "1 mN/V", capacitance = "50 nF" }
excitation = { frequency = "10 Hz", acceleration_amplitude = "1 m/s^2" }
load = { resistance = "1 Mohm" }
"""


@pytest.mark.slow
@pytest.mark.parametrize("duration", ["0.05s", "0.02s", "0.5s", "0.001s"])
def test_a_path_shorter_than_a_reading(tmp_path, harvester, duration):
    """A soft device that is shaken fast: its readings are 0.05 of its time scale apart, 0.5 s."""
    (tmp_path / "soft.toml").write_text(SOFT)
    line = ("motion", tmp_path / "soft.toml", "--duration", duration, "--out", tmp_path / "out")
    status, out, err = harvester(*line)
    assert status == 0 or duration != "0.5s"
    if status:
        assert refusal(status, out, err) == ""
    else:
        path = hv.motion(hv.loads(SOFT), duration=duration)
        assert len(path.time) > 0
        assert math.isclose(path.shown, float(duration[:-1]), rel_tol=0.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    [
        "run {plate} --engine averaged --report ü/r.html",
        "sweep {plate} --vary load.resistance=1k:10M:3 --engine averaged --out ü/ß --report",
        "new ü.toml --mass 40g --frequency 3.2Hz --q 100 --capacitance 40nF --coupling 1mN/V",
    ],
)
def test_umlauts_in_a_locale_without_them(tmp_path, line):
    """Their bytes are surrogates in the command that reports quote, and were not written."""
    (tmp_path / "ü").mkdir()
    env = {name: text for name, text in os.environ.items() if not name.startswith("LC_")}
    env |= {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONPATH": str(ROOT)}
    words = line.format(plate=EXAMPLES / "plate.toml").encode().split()
    call = [os.fsencode(sys.executable), b"-m", b"harvester", *words]
    done = subprocess.run(
        call, cwd=tmp_path, env=env, capture_output=True, check=False, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert list(tmp_path.rglob("*.html")) or "--report" not in line
    for path in tmp_path.rglob("*.html"):
        assert "ü" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("option", ["--out", "--fmu"])
@pytest.mark.parametrize("through", ["scene.toml", "hard.toml", "./other/../scene.toml"])
def test_a_part_does_not_replace_the_scene_that_it_is_made_of(
    tmp_path, monkeypatch, harvester, option, through
):
    """`harvester export scene.toml --out scene.toml` wrote the subcircuit over the scene."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other").mkdir()
    scene = tmp_path / "scene.toml"
    scene.write_text((EXAMPLES / "plate.toml").read_text())
    (tmp_path / "hard.toml").hardlink_to(scene)
    before = scene.read_bytes()
    status, out, err = harvester("export", "scene.toml", option, through)
    assert refusal(status, out, err) == ""
    assert f"{option} must be another file than SCENE itself" in err
    assert scene.read_bytes() == before


def test_an_empty_name_of_an_fmu_is_that_of_an_fmu(harvester):
    """`--fmu ''`, as from an unset variable of a shell: the error was about --out."""
    status, out, err = harvester("export", EXAMPLES / "plate.toml", "--fmu", "")
    assert refusal(status, out, err) == ""
    assert err.startswith("harvester: --fmu must be ")
