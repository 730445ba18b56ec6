"""Ports of other programs in the place of a Dask scheduler: one line, within the patience."""

import socket
import threading
import time

import pytest

from harvester.errors import InputError
from harvester.studies.sweep import cluster

pytestmark = pytest.mark.slow

BYTES = {
    "nothing": b"",
    "http": b"HTTP/1.1 400 Bad Request\r\n\r\n" * 10,
    "zeros": bytes(5000),
    "sizes": (2**60).to_bytes(8, "little") * 4,
    "noise": bytes((37 * k * k + 11) % 256 for k in range(4000)),
}
ANOTHER = "another program answers at 'tcp://127.0.0.1:"


@pytest.fixture
def port():
    """Start a server that sends some bytes to each who comes: its port."""
    listener = socket.create_server(("127.0.0.1", 0))
    held = []

    def serve(sent):
        def accept():
            while True:
                try:
                    connection, _ = listener.accept()
                    held.append(connection)
                    connection.sendall(sent)
                except OSError:
                    return

        threading.Thread(target=accept, daemon=True).start()
        return listener.getsockname()[1]

    yield serve
    listener.shutdown(socket.SHUT_RDWR)
    listener.close()
    for connection in held:
        connection.close()


@pytest.mark.parametrize("name", BYTES)
def test_another_program_at_the_port(monkeypatch, port, name):
    """A silent one was waited for without end; others were "not enough memory" and internal errors."""
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "PATIENCE", 3.0)
    begin = time.monotonic()
    address = f"tcp://127.0.0.1:{port(BYTES[name])}"
    with (
        pytest.raises(InputError, match=r"^`scheduler` must be the address") as told,
        cluster.dask_client(address),
    ):
        pass
    assert time.monotonic() - begin < 20.0
    assert "\n" not in str(told.value)
    assert (ANOTHER in str(told.value)) == (name != "nothing")


WHERE = {"host": "127.0.0.1", "protocol": "tcp://", "dashboard_address": None}


def test_a_scheduler_is_found():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(1, processes=False, **WHERE) as local,
        cluster.dask_client(local.scheduler_address) as client,
    ):
        assert client.submit(sum, [1, 2]).result() == 3


def test_a_scheduler_without_workers_is_refused(monkeypatch):
    """Its rows would wait for ever; the line names the command that starts a worker."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "PATIENCE", 3.0)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, **WHERE) as local,
        pytest.raises(InputError, match=r"^`scheduler` must have workers, but .* dask worker tcp"),
        cluster.dask_client(local.scheduler_address),
    ):
        pass
