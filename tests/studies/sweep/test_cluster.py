"""A Dask cluster of a scheduler and a worker that speak TLS only, and a scheduler that dies."""

import contextlib
import importlib.util
import os
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

import harvester as hv
from harvester.errors import InputError
from harvester.studies.sweep.cluster import dask_client
from tests.support.judge import complaints
from tests.support.paths import EXAMPLES, ROOT
from tests.support.sweeps import swept

pytestmark = [
    pytest.mark.thorough("test_tasks_are_whole_batches"),
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("distributed") is None, reason="distributed is not installed"
    ),
]
sys.path.append(str(ROOT / "benchmarks"))
kills = importlib.import_module("kills")

PLATE = EXAMPLES / "plate.toml"
OPENSSL = shutil.which("openssl")


def sweep(points, out, address, env):
    """The program, started."""
    what = [
        PLATE,
        "--vary",
        f"load.resistance=1k:10M:{points}",
        "--engine",
        "ensemble",
        "--trajectories",
        "512",
    ]
    line = [
        sys.executable,
        "-m",
        "harvester",
        "sweep",
        *what,
        "--seed",
        "1",
        "--out",
        out,
        "--scheduler",
        address,
    ]
    return subprocess.Popen(
        line, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The scheduler's process, its address, and the environment of who may talk to it."""
    if OPENSSL is None:
        pytest.skip("openssl, which makes the certificate, is not installed")
    path = tmp_path_factory.mktemp("tls")
    make = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=harvester"
    subprocess.run(
        [OPENSSL, *make.split(), "-keyout", "key.pem", "-out", "cert.pem"],
        cwd=path,
        check=True,
        capture_output=True,
    )
    env = {**os.environ, "PYTHONSAFEPATH": "1", "PYTHONPATH": str(ROOT)}
    tls = "DASK_DISTRIBUTED__COMM__TLS__"
    cert = str(path / "cert.pem")
    key = str(path / "key.pem")
    for who in ("SCHEDULER", "WORKER", "CLIENT"):
        env |= {f"{tls}{who}__CERT": cert, f"{tls}{who}__KEY": key}
    env |= {f"{tls}CA_FILE": cert, "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "true"}
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"tls://127.0.0.1:{free.getsockname()[1]}"
    dask = Path(sys.executable).with_name("dask")
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    where = {"cwd": path, "env": env, **quiet}
    scheduler = [dask, "scheduler", "--protocol", "tls", "--no-dashboard", "--host", address]
    ran = [subprocess.Popen(scheduler, **where)]
    ran.append(
        subprocess.Popen([dask, "worker", address, "--no-dashboard", "--nthreads", "1"], **where)
    )
    end = time.monotonic() + 30
    while time.monotonic() < end:
        with (
            contextlib.suppress(OSError),
            socket.create_connection(("127.0.0.1", int(address.rpartition(":")[2]))),
        ):
            break
        time.sleep(0.1)
    yield ran[0], address, env
    for one in reversed(ran):
        one.terminate()
        one.wait(30)


def test_tls(cluster, tmp_path):
    """The same answers as from this process; without the certificates nobody is let in."""
    _, address, env = cluster
    done = sweep(4, tmp_path / "out", address, env)
    assert (complaints(done.communicate(timeout=100)[1]), done.returncode) == ("", 0)
    alone = swept(
        PLATE, {"load.resistance": "1k:10M:4"}, engines=[hv.Ensemble(trajectories=512, seed=1)]
    )
    powers = [
        line.split(",")[4] for line in (tmp_path / "out" / "sweep.csv").read_text().splitlines()
    ]
    assert powers == ["mean_power", *(f"{row.mean_power.value:.9g}" for row in alone.rows)]
    with (
        pytest.raises(
            InputError, match=r"^`scheduler` must be the address of a Dask scheduler that answers"
        ),
        dask_client(address),
    ):
        pass


def test_a_scheduler_that_dies(cluster, tmp_path):
    """One line, and the points that are done are kept."""
    scheduler, address, env = cluster
    ran = sweep(2000, tmp_path, address, env)
    end = time.monotonic() + 60
    while (kills.rows(tmp_path) or 0) < 2 and time.monotonic() < end:
        time.sleep(0.1)
    scheduler.kill()
    out, err = ran.communicate(timeout=60)
    assert (ran.returncode, out) == (3, "")
    assert (
        complaints(err)
        == f"harvester: the Dask scheduler at {address} has disappeared: start another, and --resume\n"
    )
    assert 2 <= kills.rows(tmp_path) < 2000
