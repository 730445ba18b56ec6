"""The server of the page: what it reports, whom it refuses, and that it does so at once."""

import asyncio
import http.client
import json
import re
import socket
import subprocess
import sys
import time
import urllib.parse
from pathlib import Path

import pytest
import segno

import harvester as hv
from tests.support.browser import serving
from tests.support.paths import ROOT


def test_a_page_that_closes_while_it_is_drawn_is_no_fault(caplog):
    """What fails in the background is reported, but for a message to a page that is no longer there."""
    from tornado.websocket import WebSocketClosedError

    # with Panel, which no other test of this process needs
    from harvester.explore.server import report_failure

    loop = asyncio.new_event_loop()
    report_failure(loop, {"message": "of a task", "exception": WebSocketClosedError()})
    assert caplog.text == ""
    report_failure(loop, {"message": "of a task", "exception": ValueError("another fault")})
    assert "another fault" in caplog.text
    loop.close()


def ask(address, method="GET", path="", host=None, **headers):
    """The status that a request gets; its path is behind that of the address, or is whole with a slash."""
    url = urllib.parse.urlsplit(address)
    asked = http.client.HTTPConnection(url.hostname, url.port, timeout=20)
    asked.putrequest(method, path if path.startswith("/") else url.path + path, skip_host=True)
    for name, value in {"Host": host or url.netloc, **headers}.items():
        asked.putheader(name, value)
    asked.endheaders()
    with asked.getresponse() as answer:
        answer.read()
    asked.close()
    return answer.status


def memory(program):
    """MB that a program holds."""
    return (
        int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{program.pid}/status").read_text())[1]) / 1000
    )


def send(address, size):
    """Send so many bytes to a path without the token; how many were accepted until the connection was closed."""
    url = urllib.parse.urlsplit(address)
    sent = 0
    deadline = time.monotonic() + 20.0
    with socket.create_connection((url.hostname, url.port), timeout=5.0) as one:
        one.sendall(
            f"POST /x HTTP/1.1\r\nHost: {url.netloc}\r\nContent-Length: {size}\r\n\r\n".encode()
        )
        try:
            while sent < size and time.monotonic() < deadline:
                sent += one.send(b"x" * min(1_000_000, size - sent))
        except OSError:
            pass
    return sent


async def talk(address, token, message):
    """Send a message over the page's websocket, and wait until the server closes it or states something."""
    from tornado.httpclient import HTTPRequest
    from tornado.websocket import websocket_connect

    url = urllib.parse.urlsplit(address)
    request = HTTPRequest(
        f"ws://{url.netloc}{url.path}ws", headers={"Origin": f"http://{url.netloc}"}
    )
    connection = await websocket_connect(request, subprotocols=["bokeh", token])
    await connection.read_message()
    await connection.write_message(message)
    stream = connection.protocol.stream
    await asyncio.wait_for(connection.read_message(), 20)
    connection.close()
    stream.close()  # at once: the loop ends here, and would leave the socket open
    await asyncio.sleep(0)


@pytest.mark.thorough("test_live.py")
@pytest.mark.slow
def test_who_may_talk_to_the_server():
    """Nobody without the token, from another page or to another host; no body is kept; stderr never has the token."""
    with serving(str(ROOT / "examples" / "plate.toml")) as (program, address, _):
        url = urllib.parse.urlsplit(address)
        token = url.path.strip("/")
        assert ask(address) == 200
        assert ask(address, host=f"localhost:{url.port}") == 200
        assert ask(address, Origin=f"http://localhost:{url.port}") == 200
        assert [
            ask(address, path=path)
            for path in ("/", "/favicon.ico", "/ws", f"/x{token}/", f"//{token}/")
        ] == [403] * 5
        assert ask(address, host="evil.example") == 403
        assert ask(address, host="127.0.0.1:1") == 403
        assert ask(address, Origin="http://evil.example") == 403
        assert ask(address, "BREW") in (403, 405)
        assert ask(address, path="nowhere") == 404
        assert ask(address, "POST", **{"Content-Length": "79000000"}) in (400, 413)
        before = memory(program)
        assert max(send(address, 79_000_000) for _ in range(3)) < 79_000_000
        assert memory(program) < before + 30.0
        asked = http.client.HTTPConnection(url.hostname, url.port, timeout=20)
        asked.request("GET", url.path)
        with asked.getresponse() as answer:
            page = answer.read().decode()
        asked.close()
        session = json.loads(re.search(r'"token":("[^"]+")', page)[1])
        for message in ("nonsense", '{"msgid": 1}', "{" * 5000):
            asyncio.run(talk(address, session, message))
        program.terminate()
        _, err = program.communicate(timeout=20)
    assert token not in err
    assert "Traceback" not in err
    assert all(line.startswith("harvester") for line in err.splitlines()), err


@pytest.mark.slow
def test_a_host_that_is_asked_for_is_the_only_one():
    """The page then answers to that address and to no other name, with the token as ever, and comes as a QR code."""
    host = "127.0.0.2"  # another one that every Linux has
    begin = (
        sys.executable,
        "-m",
        "harvester",
        "explore",
        str(ROOT / "examples" / "plate.toml"),
        "--host",
        host,
    )
    with subprocess.Popen(
        begin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        address = program.stdout.readline().removeprefix("open ").strip()
        assert "not encrypted" in program.stdout.readline()
        url = urllib.parse.urlsplit(address)
        assert (url.hostname, len(url.path.strip("/")) >= 32) == (host, True)
        rows = read_qr([program.stdout.readline() for _ in range(18)])
        assert rows == [list(row) for row in segno.make(address, error="l", micro=False).matrix]
        assert ask(address) == ask(address, Origin=f"http://{url.netloc}") == 200
        wrong = [
            f"localhost:{url.port}",
            f"127.0.0.1:{url.port}",
            f"0.0.0.0:{url.port}",
            "evil.example",
            host,
        ]
        assert [ask(address, host=one) for one in wrong] == [403] * len(wrong)
        assert [ask(address, Origin=f"http://{one}") for one in wrong] == [403] * len(wrong)
        assert ask(address, path="/") == 403
        with pytest.raises(OSError, match="refused"):  # nothing else of this machine listens there
            socket.create_connection(("127.0.0.1", url.port), timeout=5.0)
        program.terminate()
        _, err = program.communicate(timeout=20)
    assert url.path.strip("/") not in err


@pytest.mark.thorough("test_live.py")
@pytest.mark.slow
def test_a_page_takes_little_memory_and_gives_its_folder_back(tmp_path, monkeypatch):
    """A page that nobody looks at ends after half a minute; a body that does not come is waited for 10 s at most."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with serving(str(ROOT / "examples" / "plate.toml")) as (program, address, _):
        url = urllib.parse.urlsplit(address)
        for _ in range(2):  # what is made once
            ask(address)
        before = memory(program)
        for _ in range(5):
            ask(address)
        assert memory(program) - before < 5 * 12.0
        with socket.create_connection((url.hostname, url.port), timeout=60.0) as slow:
            slow.sendall(
                f"POST {url.path} HTTP/1.1\r\nHost: {url.netloc}\r\nContent-Length: 9\r\n\r\n".encode()
            )
            begin = time.monotonic()
            while slow.recv(1000):
                pass
        assert time.monotonic() - begin > 5.0
        end = time.monotonic() + 120.0
        while (left := list(tmp_path.glob("harvester-explore-*"))) and time.monotonic() < end:
            time.sleep(0.5)
    assert left == []


def read_qr(lines):
    """The modules of a QR code of half blocks, 1 if dark, without its border of two."""
    halves = {"█": (0, 0), "▀": (0, 1), "▄": (1, 0), " ": (1, 1)}
    rows = [
        [halves[letter][half] for letter in line.rstrip("\n")]
        for line in lines
        if line.strip()
        for half in (0, 1)
    ]
    size = len(rows[0])
    return [row[2 : size - 2] for row in rows[2 : size - 2]]


@pytest.mark.parametrize(
    ("host", "why"), [("0.0.0.0", "answers to one"), ("8.8.8.8", "not one"), ("mybox", "'mybox'")]
)
def test_a_host_must_be_one_address_of_this_machine(host, why):
    from harvester.explore.server import free_port

    with pytest.raises(hv.InputError, match=f"`host` must be an IP address of this machine.*{why}"):
        free_port(0, host)
