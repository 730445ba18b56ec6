"""Pictures of the page of `harvester explore` in Chromium: four circuits, at 1280 and 390 px, in both themes.

    python benchmarks/screens.py            # into out/screens, 16 of them, some minutes
    python benchmarks/screens.py FOLDER

Each is taken when the circuit's own power stands in large letters, and printed with that headline,
beside the power that `run` gives.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT))
import harvester as hv  # noqa: E402
from harvester.explore import links  # noqa: E402
from harvester.explore.draft import Draft  # noqa: E402
from tests.support.browser import DESKTOP, PHONE, Visit, chromium, serving  # noqa: E402

# and its engine
CIRCUITS = {"bridge": "ideal", "parallel_sshi": "ideal", "sece": "ideal", "bimorph_ltc3588": "slow"}


def draft_of(name: str) -> Draft:
    """The plate with a stop and a circuit, or an example."""
    example = ROOT / "examples" / f"{name}.toml"
    draft = Draft.read(example if example.exists() else ROOT / "examples" / "plate_with_stop.toml")
    if not example.exists():
        draft.choose(name)
    return draft


def main() -> None:
    """Take them all."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/screens")
    folder.mkdir(parents=True, exist_ok=True)
    with chromium() as browser, serving() as (_, url, _):
        for name, engine in CIRCUITS.items():
            draft = draft_of(name)
            own = hv.run(draft.scene(), engine).mean_power
            print(f"{name}: run says {own}", flush=True)
            visit = Visit(browser, f"{url}?scene={links.held(draft)}")
            visit.page.set_default_timeout(120_000)  # kernels may be compiled first
            visit.page.locator(".headline b", has_text=engine).wait_for()
            visit.page.locator(".path-told", has_text="one path by").wait_for()
            for theme in ("light", "dark"):
                visit.page.emulate_media(color_scheme=theme)
                for size in (DESKTOP, PHONE):
                    visit.page.set_viewport_size(size)
                    visit.page.wait_for_timeout(1500)  # the last pictures are drawn
                    visit.page.screenshot(
                        path=folder / f"{name}_{size['width']}_{theme}.png", full_page=True
                    )
            print(f"{name}: the page says {visit.power()}", flush=True)
            visit.page.close()


if __name__ == "__main__":
    main()
