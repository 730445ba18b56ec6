"""The program `harvester explore` and a real browser that looks at its page."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or ""
DESKTOP, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}


@contextlib.contextmanager
def serving(*arguments, cwd=None):
    """The running program, its address and the seconds until it printed that; it is ended by ^C."""
    begin = time.monotonic()
    command = [sys.executable, "-m", "harvester", "explore", *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd
    ) as program:
        try:
            line, further = program.stdout.readline(), program.stdout.readline()
            assert further == "only this machine sees it, with that address; ^C ends it\n"
            yield program, line.removeprefix("open ").strip(), time.monotonic() - begin
        finally:
            if program.poll() is None:
                program.send_signal(signal.SIGINT)
            try:
                program.communicate(timeout=20)
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(program.pid, signal.SIGKILL)


@contextlib.contextmanager
def chromium():
    """A headless Chromium; in a container as root it runs without its sandbox."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox"] if os.getuid() == 0 else []
        )
        try:
            yield browser
        finally:
            browser.close()


class Visit:
    """A user's page: `page` is playwright's, ``faults`` what its console and network complained of."""

    def __init__(self, browser, url):
        self.page = browser.new_page(viewport=DESKTOP)
        self.faults, self.addresses = [], []
        self.page.on(
            "console",
            lambda message: self.faults.append(message.text) if message.type == "error" else None,
        )
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", lambda request: self.addresses.append(request.url))
        self.page.set_default_timeout(25_000)
        self.page.goto(url)
        self.page.wait_for_selector(".headline .power")

    def text(self, name):
        """What a part of the page states."""
        return self.page.locator(f".{name} .bk-clearfix").first.inner_text()

    def power(self):
        """The power in large letters."""
        return self.page.locator(".headline .power").inner_text()

    def until_power_changes(self, before):
        """Wait for another power than ``before``."""
        self.wait_for(
            "(before) => document.__deep('.headline .power').innerText !== before", before
        )
        return self.power()

    def wait_for(self, condition, *arguments):
        """Wait for a condition in JavaScript; ``document.__deep(selector)`` looks into shadow roots."""
        self.page.evaluate(
            """() => { document.__deep = (path) => {
                const find = (root, sel) => {
                  const hit = root.querySelector(sel); if (hit) return hit;
                  for (const one of root.querySelectorAll("*"))
                    if (one.shadowRoot) { const h = find(one.shadowRoot, sel); if (h) return h; }
                  return null; };
                let at = document;
                for (const part of path.split(" ")) {
                  at = at && (find(at.shadowRoot || at, part) || find(at, part)); }
                return at; } }"""
        )
        self.page.wait_for_function(condition, arg=arguments[0] if arguments else None)

    def write(self, key, text):
        """Type a text into the field of a key."""
        field = self.page.locator(f".field.knob-{key.replace('.', '-')} input")
        field.fill(text)
        field.press("Enter")

    def step(self, key, times=1, to="Right"):
        """Move the slider of a key to the right, or to the "Left"."""
        handle = self.page.locator(f".slider.knob-{key.replace('.', '-')} .noUi-handle")
        handle.focus()
        for _ in range(times):
            handle.press(f"Arrow{to}")
