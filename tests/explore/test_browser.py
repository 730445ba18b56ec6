"""The page in a real browser: every control moves, nothing fails, two users at once, and nothing from elsewhere."""

import http.client
import os
import signal
import sys
import time
import urllib.parse

import pytest

from tests.support.browser import CHROMIUM, Visit, chromium, serving
from tests.support.paths import ROOT

WITHOUT = (
    "harvester: explore must have Panel, but it is not installed: python -m pip install 'piezo-harvester[explore]'\n"
)
pytestmark = [pytest.mark.slow, pytest.mark.ngspice]


@pytest.fixture(scope="module")
def url():
    """The address of a page that begins with a linear scene, whose kernels other tests compile too."""
    assert CHROMIUM, "chromium must be installed: make setup"
    with serving(str(ROOT / "examples" / "plate_with_stop.toml")) as (_, address, seconds):
        assert seconds < 30.0  # beside other tests; alone it takes 4
        yield address


@pytest.fixture(scope="module")
def browser():
    with chromium() as one:
        yield one


def settled(visit, ohms):
    """Type a resistance and wait until it stands there in normal form: what was done before has then been heard."""
    visit.page.locator(".circuit-resistor button").click()
    visit.write("load.resistance", f"{ohms}k")
    field = visit.page.locator(".field.knob-load-resistance input")
    deadline = time.monotonic() + 30.0
    while field.input_value() != f"{ohms} kohm":
        assert time.monotonic() < deadline, field.input_value()
        visit.page.wait_for_timeout(50)


@pytest.mark.parametrize("size", ["desktop", "phone"])
def test_every_control_moves(browser, url, size):
    """Each switch, slider, field, picture and card, whatever the scene becomes; no fault, nothing fetched elsewhere."""
    visit = Visit(browser, url, size)
    page, before = visit.page, visit.power()
    visit.step("load.resistance", 20)
    assert visit.until_power_changes(before) != before
    for place in range(page.locator(".switch input").count()):
        switch = page.locator(".switch input").nth(place)
        if switch.is_visible():
            switch.evaluate("one => one.scrollIntoView({block: 'end'})")  # clear of the picture, which stays on top
            switch.click()
    settled(visit, 101)
    for name in ("bridge", "sece"):
        page.locator(f".circuit-{name} button").click()
        page.locator(".field.knob-load-parameters-C").wait_for()
        visit.step("load.parameters.C")
    settled(visit, 102)
    handles = page.locator(".slider .noUi-handle")
    for place in range(handles.count()):
        if handles.nth(place).is_visible():
            handles.nth(place).press("ArrowLeft")
    fields = page.locator(".field input")
    for place in range(fields.count()):
        if fields.nth(place).is_visible():
            value = fields.nth(place).input_value()
            fields.nth(place).fill(value.replace("1", "2"))
            fields.nth(place).press("Enter")
    settled(visit, 103)
    assert not page.locator(".headline .power").inner_text().startswith("nan")
    axis = page.locator(".axis select")
    for option in axis.locator("option").all_inner_texts():
        axis.select_option(option)
    page.locator(".within select").select_option("1%")
    page.locator(".card-piezo button, .card-piezo .card-header").first.click()
    settled(visit, 104)
    assert visit.faults == []
    assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]
    ours = urllib.parse.urlsplit(url).netloc
    elsewhere = [one for one in visit.addresses if urllib.parse.urlsplit(one.removeprefix("blob:")).netloc != ours]
    assert [one for one in elsewhere if not one.startswith("data:")] == []
    page.close()


def test_wrong_input_is_one_line(browser, url):
    """It names the key and what it must be; the last good picture stays, and the next good value is taken."""
    visit = Visit(browser, url)
    good = visit.power()
    for key, text, told in (
        ("load.resistance", "many", "load.resistance must be a load resistance"),
        ("piezo.capacitance", "50 kg", "the unit 'kg' is one of another quantity"),
        ("stop.restitution", "2", "between 0 and 1"),
        ("oscillator.mass", "-1 g", "above 0"),
        ("oscillator.mass", "<img src=x onerror=alert(1)>", "oscillator.mass must be a mass"),
    ):
        visit.write(key, text)
        visit.page.locator(".error-line .error", has_text=told).wait_for()
        assert visit.page.locator(".error-line .error").count() == 1
    assert visit.power() == good
    assert visit.page.locator(".error-line img").count() == 0
    visit.write("load.resistance", "100k")
    assert "µW" in visit.until_power_changes(good)
    assert visit.faults == []
    visit.page.close()


def test_runs_pin_and_files(browser, url, tmp_path):
    """An ensemble's point with its error, a run that is cancelled, a pinned design, a record, and four files."""
    visit = Visit(browser, url)
    page = visit.page
    page.locator(".pin button").click()
    page.locator(".difference", has_text="is the pinned one").wait_for()
    page.locator(".run-ensemble button").click()
    page.locator(".headline b", has_text="ensemble").wait_for()
    assert visit.power().startswith("8.3")
    page.locator(".run-spice button").click()
    page.locator(".cancel-spice button").click()
    page.locator(".run-told", has_text="spice was cancelled").wait_for()
    visit.write("load.resistance", "200k")
    page.locator(".difference td", has_text="200 kohm").wait_for()
    starts = {"scene-toml": b"title", "figure-png": b"\x89PNG", "figure-svg": b"<?xml", "report-html": b"<!"}
    for name, start in starts.items():
        with page.expect_download() as download:
            page.locator(f".save-{name} a, .save-{name} button").first.click()
        assert (download.value.path()).read_bytes().lower().startswith(start.lower()), name
    page.locator(".open input[type=file]").set_input_files(str(ROOT / "examples" / "shake.csv"))
    page.locator(".open-told", has_text="rms").wait_for()
    page.locator(".switch-excitation-acceleration_file input:checked").wait_for()
    page.locator(".open input[type=file]").set_input_files(str(ROOT / "examples" / "paper_figure3.toml"))
    page.locator(".field.knob-nondimensional-mu").wait_for()
    page.locator(".path-told", has_text="one path by ensemble").wait_for()
    assert visit.faults == []
    page.close()


def test_two_users_at_once(browser, url):
    """Each has a scene of their own; while one keeps turning, the other is answered."""
    one, two = Visit(browser, url), Visit(browser, url)
    one.step("oscillator.mass", 25)
    begin, before = time.monotonic(), two.power()
    two.write("load.resistance", "300k")
    changed = two.until_power_changes(before)
    assert time.monotonic() - begin < 5.0
    assert one.power() != changed
    assert one.page.locator(".field.knob-load-resistance input").input_value() == "1 Mohm"
    assert two.page.locator(".field.knob-oscillator-mass input").input_value() == "40 g"
    assert one.faults + two.faults == []
    one.page.close()
    two.page.close()


def status(host, port, path, method="GET", **headers):
    connection = http.client.HTTPConnection(host, port, timeout=10)
    connection.request(method, path, headers=headers)
    try:
        return connection.getresponse().status
    finally:
        connection.close()


def test_nothing_without_the_token(url):
    """Every other path and method is 403, a websocket of another origin too; only this machine is listened to."""
    parts = urllib.parse.urlsplit(url)
    host, port, path = parts.hostname, parts.port, parts.path
    assert status(host, port, path) == 200
    wrong = path[:-2] + ("A" if path[-2] != "A" else "B") + "/"
    for other in ("/", wrong, "/static/js/bokeh.min.js", "/ws", "/autoload.js", "/metadata", path + "../", "/%2e%2e/"):
        for method in ("GET", "POST", "OPTIONS", "DELETE"):
            assert status(host, port, other, method) == 403, (method, other)
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
    upgrade |= {"Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    assert status(host, port, path + "ws", Origin="http://evil.example", **upgrade) == 403
    with open("/proc/net/tcp") as table:  # noqa: PTH123
        heard = [
            line.split()[1] for line in table if line.split()[3] == "0A" and line.split()[1].endswith(f":{port:04X}")
        ]
    assert heard == [f"0100007F:{port:04X}"]


def test_interrupted(tmp_path):
    """^C ends it at once, as it says, and without a traceback."""
    with serving() as (program, address, _):
        assert address.startswith("http://127.0.0.1:")
        begin = time.monotonic()
        os.kill(program.pid, signal.SIGINT)
        out, error = program.communicate(timeout=20)
    assert time.monotonic() - begin < 5.0
    assert (program.returncode, error) == (0, "")
    assert "^C ends it" in out


def test_without_panel(harvester, monkeypatch):
    """What is missing and how to get it, in one line; a wrong scene is told first."""
    monkeypatch.setitem(sys.modules, "panel", None)
    assert harvester("explore") == (2, "", WITHOUT)


@pytest.mark.parametrize(("arguments", "told"), [
    (["nowhere.toml"], "there is no 'nowhere.toml'"),
    (["--port", "70000"], "--port"),
    ([str(ROOT)], "is a directory"),
])  # fmt: skip
def test_wrong_arguments(harvester, arguments, told):
    done = harvester("explore", *arguments)
    assert done[0] == 2
    assert told in done[2].replace("Is a", "is a")
    assert done[2].count("\n") == 1
