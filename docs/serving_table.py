"""The table of which.md: which engines serve which scene, made from the list of engines that commands ask.

`python docs/serving_table.py` writes it anew into the page; a test compares.
"""

import dataclasses
import re
from pathlib import Path

from harvester.engines.selection import serving
from harvester.equations.problem import Problem
from harvester.scene.load import Load
from harvester.scene.physical import Excitation
from harvester.scene.scene import Scene
from harvester.scene.toml import load, loads
from harvester.studies.extremes.extremes import has_lifetime

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "which.md"
EXAMPLES = ROOT / "examples"
STOPS = {  # rows of the page, and the example whose mechanics they are
    "linear, no stop": "plate",
    "rigid stop at rest": "plate_with_stop",
    "preloaded rigid stop, or rigid stop at a gap": "plate_preloaded",
    "two rigid stops": "plate_two_stops",
    "compliant stop": "plate_compliant_stop",
    "bistable (two wells)": "plate_bistable",
}
SHAKING = {
    "white noise": "plate",
    "band-limited noise": "plate_coloured",
    "sinusoid": "plate_harmonic",
    "recording": "plate_recorded",
    "shocks": "plate_shock",
}
MARK = re.compile(r"(<!-- table -->\n).*?(<!-- end -->)", re.DOTALL)


def scene(stop: str, excitation: Excitation, bridge: bool) -> Scene:
    """The mechanics of an example, shaken otherwise, with a resistor or a diode bridge as its load."""
    found = load(EXAMPLES / f"{stop}.toml")
    chosen = (
        Load(netlist="bridge", parameters={"R": "1 Mohm"})
        if bridge
        else load(EXAMPLES / "plate.toml").load
    )
    return dataclasses.replace(found, excitation=excitation, load=chosen)


def shakings() -> dict[str, Excitation]:
    """The kinds of shaking by their names on the page."""
    found = {name: load(EXAMPLES / f"{path}.toml").excitation for name, path in SHAKING.items()}
    text = (EXAMPLES / "plate.toml").read_text()
    head, _ = text.split("[excitation]")
    end = text[text.index("[load]") :]
    table = '[excitation]\nacceleration_psd_file = "mil_std_810_minimum_integrity.csv"\n'
    found["tabulated power spectral density"] = loads(head + table + end, EXAMPLES).excitation
    found["coloured noise"] = dataclasses.replace(found["white noise"], correlation_time=0.002)
    found["white noise with parametric noise"] = dataclasses.replace(
        found["white noise"], stiffness_noise=0.01
    )
    return found


def table() -> str:
    """The Markdown of the table; shakings that the same engines serve share a row."""
    every = shakings()
    alike = dict[tuple[str, ...], list[str]]()
    for stop, path in STOPS.items():
        for shaking, excitation in every.items():
            cells = [
                ", ".join(f"`{one}`" for one in serving(scene(path, excitation, bridge)))
                for bridge in (0, 1)
            ]
            lifetime = "yes" if has_lifetime(Problem(scene(path, excitation, False))) else "no"
            alike.setdefault((stop, *cells, lifetime), []).append(shaking)
    rows = [
        "| mechanics | excitation | resistor, or none | diode bridge | `--lifetime` |",
        "|---|---|---|---|---|",
    ]
    rows += [
        f"| {stop} | {'; '.join(some)} | {' | '.join(cells)} |"
        for (stop, *cells), some in alike.items()
    ]
    return "\n".join(rows) + "\n"


def page() -> str:
    """The page with its table as it is today."""
    return MARK.sub(lambda found: f"{found[1]}{table()}{found[2]}", PAGE.read_text())


if __name__ == "__main__":
    PAGE.write_text(page())
