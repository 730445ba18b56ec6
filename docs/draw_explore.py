"""Draws docs/explore.png and docs/_static/explore_dark.png: the app with a bridge, in Chromium."""

import sys
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT))
from tests.support.browser import Visit, chromium, serving  # noqa: E402

SCENE = ROOT / "examples" / "plate.toml"
PICTURES = {
    "light": ROOT / "docs" / "explore.png",
    "dark": ROOT / "docs" / "_static" / "explore_dark.png",
}
COLOURS = 256
SIZE = {"width": 1280, "height": 1000}


def main() -> None:
    """Choose the bridge, let `ideal` run, and take the picture."""
    with chromium() as browser, serving(str(SCENE)) as (_, url, _):
        visit = Visit(browser, url)
        page = visit.page
        page.set_viewport_size(SIZE)
        page.locator(".circuit-bridge button").click()
        page.locator(".field.knob-load-parameters-C").wait_for()
        page.set_default_timeout(120_000)  # kernels may be compiled first
        page.locator(".run-ideal button").click()
        page.locator(".headline b", has_text="ideal").wait_for()
        page.locator(".path-told", has_text="one trajectory by").wait_for()
        page.evaluate("window.scrollTo(0, 0)")
        for theme, picture in PICTURES.items():
            page.emulate_media(color_scheme=theme)
            page.wait_for_timeout(1500)  # the last pictures are drawn
            page.screenshot(path=picture)
            Image.open(picture).convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE).save(
                picture, optimize=True
            )


if __name__ == "__main__":
    main()
