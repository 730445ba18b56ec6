"""Limits of the page for links and sessions, and the headers of its answers."""

import asyncio
import base64
import http.client
import time
import urllib.parse
import zlib
from pathlib import Path

import pytest
from tornado.httpclient import AsyncHTTPClient
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application

import harvester as hv
from harvester.explore import links
from harvester.explore.guard import FULL, Guard
from tests.support.browser import serving
from tests.support.paths import EXAMPLES, ROOT

BRIDGE = (EXAMPLES / "plate_bridge.toml").read_text()


def link(text):
    return base64.urlsafe_b64encode(zlib.compress(text.encode(), 9)).decode()


def with_parameters(count):
    """The plate with a bridge and so many parameters that nobody has heard of."""
    head = BRIDGE[: BRIDGE.index("[load]")]
    made_up = ", ".join(f"P{k} = {k}" for k in range(count))
    return f'{head}[load]\nnetlist = "bridge"\nparameters = {{ R = 1e6, {made_up} }}\n'


@pytest.mark.parametrize("count", [60, 900])
def test_a_link_has_no_more_parameters_than_an_upload(count):
    """900 sliders were made in the server's own thread: it was deaf for five minutes."""
    begin = time.monotonic()
    with pytest.raises(hv.InputError) as told:
        links.opened(link(with_parameters(count)))
    assert "\n" not in str(told.value)
    assert time.monotonic() - begin < 5.0


@pytest.mark.parametrize(
    "text", ["x = 1\n" * 10_000, BRIDGE + "#" + "x" * 30_000], ids=["keys", "comment"]
)
def test_a_link_that_is_too_long_is_not_read_in_part(text):
    """Its first 20,000 letters became the scene."""
    with pytest.raises(
        hv.InputError, match=r"^the link must hold a scene of at most 20000 letters"
    ):
        links.opened(link(text))


def test_a_link_that_is_cut_off_or_a_bomb():
    """A link of 100 kB that holds 100 MB is unpacked no further than the limit."""
    with pytest.raises(hv.InputError, match=r"^the link must hold a scene"):
        links.opened(link(BRIDGE)[:-20])
    with pytest.raises(hv.InputError, match=r"^the link must hold a scene"):
        links.opened(link("\0" * 100_000_000))
    assert links.opened(link(BRIDGE)).scene() == hv.loads(BRIDGE)


def answer(address, path=""):
    """Status and headers of an answer."""
    url = urllib.parse.urlsplit(address)
    asked = http.client.HTTPConnection(url.hostname, url.port, timeout=60)
    asked.request("GET", path if path.startswith("/") else url.path + path)
    with asked.getresponse() as got:
        got.read()
        found = got.status, dict(got.getheaders())
    asked.close()
    return found


def state(program):
    """Memory (MB), threads, and child processes of a program."""
    text = Path(f"/proc/{program.pid}/status").read_text()
    values = dict(line.split(":\t", 1) for line in text.splitlines() if ":\t" in line)
    tasks = Path(f"/proc/{program.pid}/task").glob("*/children")
    children = sum(len(one.read_text().split()) for one in tasks)
    return int(values["VmRSS"].split()[0]) / 1000.0, int(values["Threads"]), children


@pytest.mark.slow
def test_headers_of_each_answer():
    """The page, its scripts, a missing one and a refusal: no frame, no sniffing, no other page."""
    with serving(str(ROOT / "examples" / "plate.toml")) as (_, address, _):
        paths = {"": 200, "static/js/bokeh.min.js": 200, "nowhere": 404, "/": 403}
        paths["autoload.js?bokeh-autoload-element=1"] = 200
        for path, status in paths.items():
            got, headers = answer(address, path)
            assert got == status, path
            policy = headers["Content-Security-Policy"]
            assert "frame-ancestors 'none'" in policy
            assert "default-src 'self'" in policy
            assert headers["X-Content-Type-Options"] == "nosniff"
            assert headers["X-Frame-Options"] == "DENY"
            assert not [name for name in headers if name.startswith("Access-Control-")]


@pytest.mark.parametrize("is_full", [False, True])
def test_a_page_too_many_is_refused(is_full):
    """In one line, while the parts of open pages still have an answer."""

    async def statuses():
        (listener,) = bind_sockets(0, "127.0.0.1")
        host = f"127.0.0.1:{listener.getsockname()[1]}"
        server = HTTPServer(Guard(Application(), "token", (host,), lambda: is_full))
        server.add_socket(listener)
        paths = ("token/", "token/static/a.js", "")
        got = [
            await AsyncHTTPClient().fetch(f"http://{host}/{path}", raise_error=False)
            for path in paths
        ]
        server.stop()
        return [answer.code for answer in got], got[0].body

    codes, body = asyncio.run(statuses())
    assert codes == [503 if is_full else 404, 404, 403]
    assert (body == FULL) is is_full
