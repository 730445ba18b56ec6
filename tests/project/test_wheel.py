"""The wheel has the netlists and the example scenes inside and finds them there."""

import os
import subprocess
import sys
import zipfile

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.thorough("nothing: the wheel is built")]


def test_wheel_runs_with_its_netlists(tmp_path):
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        ".",
        "--no-deps",
        "--no-build-isolation",
        "-q",
        "-w",
        str(tmp_path),
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    wheel = next(tmp_path.glob("*.whl"))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
        assert "harvester/py.typed" in archive.namelist()
    assert (tmp_path / "installed" / "harvester" / "report" / "page.html").is_file()
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "installed")}
    (tmp_path / "empty").mkdir()
    for words in (
        ["examples", "plate_recorded"],
        ["run", "plate_recorded.toml", "--engine", "exact"],
    ):
        program = [sys.executable, "-m", "harvester", *words]
        subprocess.run(
            program,
            cwd=tmp_path / "empty",
            env=environment,
            check=True,
            capture_output=True,
            timeout=60,
        )
    assert (tmp_path / "empty" / "shake.csv").is_file()
    code = "from harvester.netlists.load_circuit import load_circuit, netlist_folder\n"
    code += "from harvester.scene.load import Load\n"
    code += "print(netlist_folder()); print(load_circuit(Load(netlist='ltc3588')).name)"
    told = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split()
    assert told == [str(tmp_path / "installed" / "harvester" / "netlists"), "ltc3588"]
