"""The page in a real browser: every control moves, nothing fails, two users at once, and nothing from elsewhere."""

import contextlib
import http.client
import os
import re
import signal
import sys
import time
import urllib.parse

import pytest
from playwright import sync_api as playwright

import harvester as hv
from harvester.explore import links
from harvester.explore.draft import Draft
from tests.support.browser import CHROMIUM, PHONE, Visit, chromium, serving
from tests.support.paths import ROOT

WITHOUT = (
    "harvester: explore must have Panel, but it is not installed: "
    "python -m pip install 'piezo-harvester[explore]'\n"
)
# how many were turned
TURN = "all => all.filter(one => one.checkVisibility()).map(one => one.click()).length"
# Each slider there is a step to the left, and each field another number: what they were, and what
# they are now.
PULL = """all => all.filter(one => one.checkVisibility()).map(one => {
    const before = one.ariaValueNow
    one.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowLeft', bubbles: true}))
    return [before, one.ariaValueNow] })"""
FILL = """all => all.filter(one => one.checkVisibility() && !one.disabled).map(one => {
    const before = one.value
    one.value = before.replace(/[1-9]/, digit => digit === '9' ? '8' : +digit + 1)
    one.dispatchEvent(new Event('change', {bubbles: true}))
    return [before, one.value] })"""
pytestmark = [pytest.mark.thorough("test_server.py"), pytest.mark.slow, pytest.mark.ngspice]


@pytest.fixture(scope="module")
def served():
    """The program and the address of its page, which begins with a linear scene, whose kernels other tests compile."""
    assert CHROMIUM, "chromium must be installed: make setup"
    with serving(str(ROOT / "examples" / "plate_with_stop.toml")) as (program, address, seconds):
        assert seconds < 30.0  # beside other tests; alone it takes 4
        yield program, address


@pytest.fixture(scope="module")
def url(served):
    return served[1]


@pytest.fixture(scope="module")
def browser():
    with chromium() as one:
        yield one


@pytest.fixture(scope="module")
def other(browser, url):
    """The page of another user, whose scene may become any."""
    return Visit(browser, url)


@pytest.fixture(scope="module")
def visit(browser, url):
    """A page for several tests: each but the last one leaves it with the scene that it found."""
    return Visit(browser, url)


def settled(visit, ohms):
    """Type a resistance and wait until it is there in normal form: what was done before has then been heard."""
    visit.page.locator(".circuit-resistor button").click()
    visit.write("load.resistance", f"{ohms}k")
    field = visit.page.locator(".field.knob-load-resistance input")
    deadline = time.monotonic() + 30.0
    while field.input_value() != f"{ohms} kohm":
        assert time.monotonic() < deadline, field.input_value()
        visit.page.wait_for_timeout(50)


def test_every_control_moves(other, url):
    """Each switch, slider, field, picture and card, whatever the scene becomes; no fault, nothing fetched elsewhere.

    Then the page is as narrow as a phone, with all its parts below one another: they fit, and can
    be reached.
    """
    page = other.page
    before = other.power()
    other.step("load.resistance", 3)
    assert other.until_power_changes(before) != before
    switches = page.locator(".switch input")
    assert switches.evaluate_all(TURN) > 5
    settled(other, 101)
    page.locator(".circuit-sece button").click()
    page.locator(".field.knob-load-parameters-C").wait_for()
    other.step("load.parameters.C")
    settled(other, 102)
    for where, turned in ((".slider .noUi-handle", PULL), (".field input", FILL)):
        pairs = page.locator(where).evaluate_all(turned)
        assert len(pairs) > 10
        assert [before for before, after in pairs if before == after] == []
    settled(other, 103)
    axis = page.locator(".axis select")
    for option in axis.locator("option").all_inner_texts():
        axis.select_option(option)
    assert not page.locator(".headline .power").inner_text().startswith("nan")
    fits(page)
    page.set_viewport_size(PHONE)
    page.locator(".headline .power").wait_for()
    for place in range(0, switches.count(), 4):
        clicked(switches.nth(place))
    page.locator(".circuit-bridge button").click()
    page.locator(".field.knob-load-parameters-C").wait_for()
    page.locator(".within select").select_option("1%")
    page.locator(".card-piezo button, .card-piezo .card-header").first.click()
    settled(other, 104)
    fits(page)
    assert other.faults == []
    ours = urllib.parse.urlsplit(url).netloc
    elsewhere = [
        one
        for one in other.addresses
        if urllib.parse.urlsplit(one.removeprefix("blob:")).netloc != ours
    ]
    assert [one for one in elsewhere if not one.startswith("data:")] == []


def clicked(switch):
    """Click a switch that is there to be seen, unless what was clicked before removes it meanwhile."""
    if switch.is_visible():
        # clear of the picture, which stays on top
        switch.evaluate("one => one.scrollIntoView({block: 'end'})")
        try:
            switch.click(timeout=5_000)
        except playwright.TimeoutError:
            assert not switch.is_visible()


def fits(page):
    """Nothing is wider than the window."""
    assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]


def test_wrong_input_is_one_line(visit):
    """It names the key and the expected value; the last good picture stays, and the next good value is accepted."""
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
    changed = visit.until_power_changes(good)
    assert "µW" in changed
    visit.write("oscillator.mass", "40 g")
    visit.write("load.resistance", "1M")
    assert visit.until_power_changes(changed) == good
    assert visit.faults == []


def test_two_users_at_once(other, visit):
    """Each has a scene of their own; while one keeps turning, the other is answered."""
    one, two = other, visit
    theirs = one.page.locator(".field.knob-oscillator-mass input")
    begin = time.monotonic()
    before = two.power()
    mass = theirs.input_value()
    one.step("oscillator.mass", 10)
    two.write("load.resistance", "300k")
    changed = two.until_power_changes(before)
    assert time.monotonic() - begin < 10.0
    assert one.power() != changed
    assert theirs.input_value() != mass
    assert one.page.locator(".field.knob-load-resistance input").input_value() != "300 kohm"
    assert two.page.locator(".field.knob-oscillator-mass input").input_value() == "40 g"
    assert one.faults + two.faults == []
    one.page.close()
    two.write("load.resistance", "1M")
    two.until_power_changes(changed)


def test_a_circuit_has_its_own_power_in_large_letters(visit):
    """Never that of a resistor in its place: until it is known, the page states that it is computed.

    The power along the axis follows, as points that are joined, and a link opens the page with this
    very design.
    """
    page = visit.page
    page.locator(".circuit-bridge button").click()
    page.locator(".headline b", has_text="ideal").wait_for()
    draft = Draft.read(ROOT / "examples" / "plate_with_stop.toml")
    draft.choose("bridge")
    assert "µW" in visit.power() and "resistor" not in page.locator(".headline").inner_text()
    shown = float(visit.power().split()[0])
    own = hv.Ideal(within="1%").run(draft.scene()).mean_power.value * 1e6
    assert shown == pytest.approx(own, rel=0.05)  # either is a sample, to 2 % and to 1 %
    joined = """() => Bokeh.documents.some((one) => [...one._all_models.values()].some(
        (model) => model.name === 'joined-ideal' && model.data.x.length >= 5))"""
    page.wait_for_function(joined)
    link = page.locator(".link a").get_attribute("href")
    assert Draft.tables(links.opened(link.removeprefix("?scene=")))["load"]["netlist"] == "bridge"
    page.locator(".why-not summary").click()
    page.locator(".why-not li", has_text="netlist").first.wait_for()
    settled(visit, 300)
    page.locator(".headline b", has_text="averaged").wait_for()
    before = visit.power()
    visit.write("load.resistance", "2M")  # other than both that may stand there
    before = visit.until_power_changes(before)
    visit.write("load.resistance", "1M")
    visit.until_power_changes(before)
    assert visit.faults == []


@pytest.mark.parametrize("circuit", ["parallel_sshi", "sece"])
def test_the_headline_of_a_switched_circuit_is_what_run_says(visit, circuit):
    page = visit.page
    draft = Draft.read(ROOT / "examples" / "plate_with_stop.toml")
    draft.choose(circuit)
    own = hv.Ideal(within="1%").run(draft.scene()).mean_power
    page.locator(f".circuit-{circuit} button").click()
    page.locator(".headline b", has_text="ideal").wait_for()
    near = 2.0 * own.known_error95 * 1e6  # either is a sample, both to 1 % or better once refined
    visit.wait_for(
        "([own, near]) => Math.abs(parseFloat(document.__deep('.headline .power').innerText) - own) < near",
        [own.value * 1e6, near],
    )
    assert "µW" in visit.power() and near < 0.1 * own.value * 1e6
    page.locator(".circuit-resistor button").click()
    page.locator(".headline b", has_text="averaged").wait_for()


def test_a_chip_has_its_power_and_its_thresholds(browser, url):
    """By a link, from a scene of its own: as `run` states, with the fraction of the time that its load is on."""
    draft = Draft.read(ROOT / "examples" / "bimorph_ltc3588.toml")
    own = hv.run(draft.scene())
    one = Visit(browser, f"{url}?scene={links.held(draft)}")
    one.page.locator(".headline b", has_text="slow").wait_for()
    on = f"{100.0 * own.details['load_on']:.3g} %"
    refined = (
        "own => Math.abs(parseFloat(document.__deep('.headline .power').innerText) - own) < 0.06"
    )
    one.wait_for(refined, own.mean_power.value * 1e6)  # what came at once is refined to this
    one.page.locator("table.life", has_text=on).wait_for()
    told = one.page.locator("table.life").inner_text()
    assert "5.05 V" in told and "3.67 V" in told
    assert f"duty cycle of the output {on}" in one.page.locator(".headline .by").inner_text()
    assert one.faults == []
    one.page.close()


def test_the_interval_of_a_real_device_is_a_line_of_its_own(browser, url):
    """None until a class is selected; a slider that moves brings another; the computed power stays above it."""
    draft = Draft.read(ROOT / "examples" / "plate_harmonic.toml")
    one = Visit(browser, f"{url}?scene={links.held(draft)}")
    line = one.page.locator(".real-device")
    before = one.power()
    real = line.locator("div.by", has_text=re.compile("^a real device: .* next$"))
    assert line.locator("div.by").count() == 0
    one.page.locator(".device-class select").select_option("composite")
    real.wait_for()
    assert line.locator("div.by").count() == 2
    own = hv.predict(draft.scene(), prior="composite").power
    interval = f"{1e6 * own.low:.4g} µW to {1e6 * own.high:.4g} µW"
    assert interval in real.inner_text() and one.power() == before
    one.write("load.resistance", "300k")
    one.until_power_changes(before)
    real.filter(has_not_text=interval).wait_for()
    one.page.set_viewport_size(PHONE)
    fits(one.page)
    assert one.faults == []
    one.page.close()


def test_runs_pin_and_files(visit):
    """An ensemble's point with its error, a run that is cancelled, a pinned design, a record, and four files."""
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
    starts = {
        "scene-toml": b"title",
        "figure-png": b"\x89PNG",
        "figure-svg": b"<?xml",
        "report-html": b"<!",
    }
    for name, start in starts.items():
        with page.expect_download() as download:
            page.locator(f".save-{name} a, .save-{name} button").first.click()
        assert (download.value.path()).read_bytes().lower().startswith(start.lower()), name
    lost = (ROOT / "examples" / "plate.toml").read_text().partition("[load]")[
        0
    ] + '[load]\nnetlist = "lost.cir"\n'
    given = {"name": "a.toml", "mimeType": "text/plain", "buffer": lost.encode()}
    page.locator(".open input[type=file]").set_input_files(given)
    page.locator(
        ".open-told", has_text="but 'lost.cir' is not"
    ).wait_for()  # without the folder where it was looked for
    page.locator(".open input[type=file]").set_input_files(str(ROOT / "examples" / "shake.csv"))
    page.locator(".open-told", has_text="rms").wait_for()
    page.locator(".switch-excitation-acceleration_file input:checked").wait_for()
    page.locator(".open input[type=file]").set_input_files(
        str(ROOT / "examples" / "paper_figure3.toml")
    )
    page.locator(".field.knob-nondimensional-mu").wait_for()
    page.locator(".path-told", has_text="one trajectory by ensemble").wait_for()
    assert visit.faults == []
    page.close()


def status(host, port, path, method="GET", **headers):
    connection = http.client.HTTPConnection(host, port, timeout=10)
    connection.request(method, path, headers=headers)
    try:
        return connection.getresponse().status
    finally:
        connection.close()


def test_nothing_without_the_token(url):
    """Every other path and method is 403, a websocket of another origin as well; only this machine is listened to."""
    parts = urllib.parse.urlsplit(url)
    host = parts.hostname
    port = parts.port
    path = parts.path
    assert status(host, port, path) == 200
    wrong = path[:-2] + ("A" if path[-2] != "A" else "B") + "/"
    for other in (
        "/",
        wrong,
        "/static/js/bokeh.min.js",
        "/ws",
        "/autoload.js",
        "/metadata",
        path + "../",
        "/%2e%2e/",
    ):
        for method in ("GET", "POST", "OPTIONS", "DELETE"):
            assert status(host, port, other, method) == 403, (method, other)
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
    upgrade |= {"Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    assert status(host, port, path + "ws", Origin="http://evil.example", **upgrade) == 403
    with open("/proc/net/tcp") as table:  # noqa: PTH123
        heard = [
            line.split()[1]
            for line in table
            if line.split()[3] == "0A" and line.split()[1].endswith(f":{port:04X}")
        ]
    assert heard == [f"0100007F:{port:04X}"]


def test_without_panel(harvester, monkeypatch):
    """The missing parts and how to get them, in one line; a wrong scene is reported first."""
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


def test_interrupted_while_kernels_are_compiled(browser, tmp_path, monkeypatch):
    """^C does not wait for the work of the pages that are open: without a kernel on the disk that takes 40 seconds."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with serving(str(ROOT / "examples" / "plate_with_stop.toml")) as (program, address, _):
        visit = Visit(browser, address)
        visit.page.locator(".circuit-sece button").click()
        visit.page.wait_for_timeout(300)
        os.kill(program.pid, signal.SIGINT)
        program.communicate(timeout=18)
        assert program.returncode == 0
        visit.page.close()


def test_interrupted(served):
    """^C ends it at once, as it states, and without a traceback.  The last test here: no page is there after it."""
    program, address = served
    assert address.startswith("http://127.0.0.1:")
    os.set_blocking(program.stderr.fileno(), False)
    with contextlib.suppress(BlockingIOError):
        # what it stated of the pages that were closed, and refused
        while os.read(program.stderr.fileno(), 65536):
            pass
    os.set_blocking(program.stderr.fileno(), True)
    begin = time.monotonic()
    os.kill(program.pid, signal.SIGINT)
    _, error = program.communicate(timeout=20)
    assert time.monotonic() - begin < 18.0  # beside other tests: 10.5 were seen; alone it takes 1
    assert (program.returncode, error) == (0, "")
