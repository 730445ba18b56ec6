"""How long the page of `harvester explore` takes, in Chromium, from a key on a slider to the new picture.

The browser's own clock runs from the key event to the second animation frame after the curve's data have changed, when
the picture is on the screen.  Each scene is turned by one of its keys, one step at a time.
"""

import argparse
import statistics
import sys
from pathlib import Path

from common import report

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
  const times = window.__times = [];
  let begin = null;
  document.addEventListener("keydown", () => { begin = performance.now(); }, true);
  const told = () => {
    if (begin === null) return;
    const mine = begin; begin = null;
    requestAnimationFrame(() => requestAnimationFrame(() => times.push(performance.now() - mine)));
  };
  const watch = () => {
    for (const page of Bokeh.documents) {
      const source = page.get_model_by_name("curve-" + curve);
      if (source === null || source.__watched) continue;
      source.__watched = true;
      source.properties.data.change.connect(told);
    }
  };
  watch();
}"""


def measured(browser, url, key, curve, steps):
    """The milliseconds of each step of a slider."""
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


def main():
    """Print the median and the largest time of each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=30)
    steps = parser.parse_args().steps
    rows = []
    with chromium() as browser:
        for scene, key, curve in CASES:
            with serving(str(EXAMPLES / scene)) as (_, url, start):
                times = measured(browser, url, key, curve, steps)
            about = {"scene": scene, "key": key, "curve": curve, "seconds to start": start}
            spread = {"smallest ms": min(times), "median ms": statistics.median(times), "largest ms": max(times)}
            rows.append(about | spread)
            print(rows[-1], flush=True)
    report("explore", rows, ("panel", "bokeh", "playwright"))


if __name__ == "__main__":
    main()
