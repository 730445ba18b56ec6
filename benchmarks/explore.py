"""How long the page of `harvester explore` takes, in Chromium, from a key on a slider to the new picture.

The browser's own clock runs from the key event to the second animation frame after the curve's data have changed, or
the place of the working point where the key is the axis itself, when the picture is on the screen.  Each scene is
turned by one of its keys, one step at a time.  Beside the whole stand its shares: until the answer is in the browser
(the formula itself takes the processor time that is printed; the rest are Panel and the server), until Bokeh has taken
it, and the two frames in which it is drawn.  At last the time
until a circuit's own power stands in large letters: at a step of its resistance, and where it is chosen after a rest.
"""

import argparse
import statistics
import sys
import time
from pathlib import Path

from common import report

from harvester.explore import links
from harvester.explore.draft import Draft
from harvester.explore.live import live
from harvester.explore.slider_scale import slide

sys.path.append(str(Path(__file__).resolve().parents[1]))
from tests.support.browser import Visit, chromium, serving

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
CASES = (  # scene, key that is turned, curve that is watched
    ("plate.toml", "load.resistance", "exact"),
    ("plate.toml", "piezo.coupling", "exact"),
    ("plate_with_stop.toml", "load.resistance", "averaged"),
    ("plate_with_stop.toml", "oscillator.mass", "averaged"),
    ("paper_figure3.toml", "nondimensional.restitution", "averaged"),
)
WATCH = """(curve) => {
  const times = window.__times = [], parse = JSON.parse;
  let begin = null, arrived = null;
  JSON.parse = (...all) => { arrived = performance.now(); return parse(...all); };
  document.addEventListener("keydown", () => { begin = performance.now(); }, true);
  const told = () => {
    if (begin === null) return;
    const [key, came, drawn] = [begin, arrived, performance.now()]; begin = null;
    const frames = () => times.push([came - key, drawn - came, performance.now() - drawn]);
    requestAnimationFrame(() => requestAnimationFrame(frames));
  };
  for (const page of Bokeh.documents) {
    for (const [name, what] of [["curve-" + curve, "data"], ["here", "location"]]) {
      const model = page.get_model_by_name(name);
      if (model !== null) model.properties[what].change.connect(told);
    }
  }
}"""
CHIPS = ("bimorph_ltc3588",)
CIRCUITS = ("bridge", "parallel_sshi", "sece", *CHIPS)
CHOICES = {
    "plate_with_stop": ("bridge", "parallel_sshi", "sece"),
    "bimorph_ltc3588": ("bridge", "ltc3588"),
}
RESTED = 20.0  # seconds: kernels of all circuits are compiled and their powers known
HEADLINE = """([at, text]) => {  // another place's; or, where a text is given, another text too, such as a circuit's
  const now = document.__deep(".headline .power");
  const other = now && (now.dataset.at !== at || (text !== undefined && now.innerText !== text));
  return other && !now.classList.contains("none") && performance.now() - window.__key;
}"""
SHOWN = "() => { const now = document.__deep('.headline .power'); return [now.dataset.at, now.innerText]; }"
REPEATS = 10
SHARES = ("until the answer comes", "Bokeh takes it", "two frames")


def measured(browser, url, key, curve, steps):
    """The milliseconds of each step of a slider: its `SHARES`."""
    visit = Visit(browser, url)
    visit.page.wait_for_timeout(6000)  # the first path is there
    visit.page.evaluate(WATCH, curve)
    for count in range(1, steps + 1):
        visit.step(key, to="Left")
        visit.page.wait_for_function("(count) => window.__times.length >= count", arg=count)
        visit.page.wait_for_timeout(150)
    times = visit.page.evaluate("window.__times")
    assert visit.faults == []
    visit.page.close()
    return times


def headlines(browser, url, name, steps):
    """The milliseconds from each step of a circuit's resistance to its own power in large letters."""
    draft = Draft.read(EXAMPLES / (f"{name}.toml" if name in CHIPS else "plate_with_stop.toml"))
    if name not in CHIPS:
        draft.choose(name)
    visit = Visit(browser, f"{url}?scene={links.held(draft)}")
    visit.wait_for("() => document.__deep('.headline b')?.innerText.match(/ideal|slow/)")
    visit.page.wait_for_timeout(8000)  # kernels are loaded, and the first finer power is there
    visit.page.evaluate(
        "addEventListener('keydown', () => { window.__key = performance.now(); }, true)"
    )
    times = []
    for _ in range(steps):
        # the text changes with a finer power of the last step, too
        before = visit.page.evaluate(SHOWN)[:1]
        visit.step("load.parameters.R", to="Left")
        times.append(visit.page.wait_for_function(HEADLINE, arg=before).json_value())
    visit.page.close()
    return times


def choices(browser, url, scene, names):
    """The milliseconds from the click on each circuit's picture to its power in large letters."""
    visit = Visit(browser, f"{url}?scene={links.held(Draft.read(EXAMPLES / f'{scene}.toml'))}")
    visit.wait_for("() => document.__deep('.headline .power')")
    visit.page.wait_for_timeout(1e3 * RESTED)
    visit.page.evaluate(
        "addEventListener('pointerdown', () => { window.__key = performance.now(); }, true)"
    )
    for name in names:
        before = visit.page.evaluate(SHOWN)  # its text and place: a chip's power hardly changes
        visit.page.locator(f".circuit-{name}").click()
        yield name, visit.page.wait_for_function(HEADLINE, arg=before).json_value()
        visit.page.wait_for_timeout(4000)  # its finer power is there
    visit.page.close()


def formula(scene, axis, moved):
    """The milliseconds of processor time of our part: the first formula's curve, or its point on a known one."""
    draft = Draft.read(EXAMPLES / scene)
    at = draft.value(axis)
    where = draft.scene(), axis, at, slide(axis, at), False
    curves = live(*where).curves if moved else None
    begin = time.process_time()
    for _ in range(REPEATS):
        live(*where, curves=curves, first=True)
    return 1e3 * (time.process_time() - begin) / REPEATS


def main():
    """Print the median and the largest time of each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=30)
    steps = parser.parse_args().steps
    rows = []
    with chromium() as browser:
        for scene, key, curve in CASES:
            with serving(str(EXAMPLES / scene)) as (_, url, start):
                shares = measured(browser, url, key, curve, steps)
            axis = "load.resistance" if "nondimensional" not in key else "nondimensional.mu"
            times = [sum(one) for one in shares]
            about = {"scene": scene, "key": key, "curve": curve, "seconds to start": start}
            spread = {
                "smallest ms": min(times),
                "median ms": statistics.median(times),
                "largest ms": max(times),
            }
            medians = map(statistics.median, zip(*shares, strict=True))
            parts = {f"{name}, median ms": one for name, one in zip(SHARES, medians, strict=True)}
            rows.append(
                about
                | spread
                | {"formula, processor ms": formula(scene, axis, key == axis)}
                | parts
            )
            print(rows[-1], flush=True)
        with serving() as (_, url, _):
            for name in CIRCUITS:
                times = headlines(browser, url, name, steps)
                spread = {
                    "smallest ms": min(times),
                    "median ms": statistics.median(times),
                    "largest ms": max(times),
                }
                rows.append({"headline of": name} | spread)
                print(rows[-1], flush=True)
            for scene, names in CHOICES.items():
                for name, time_ in choices(browser, url, scene, names):
                    rows.append({"chosen": name, "scene": scene, "ms": time_})
                    print(rows[-1], flush=True)
    report("explore", rows, ("panel", "bokeh", "playwright"))


if __name__ == "__main__":
    main()
