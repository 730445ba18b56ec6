"""Draws docs/gallery/*.png: the figure of each example, by the command that examples/README.md names for it.

    .venv/bin/python docs/draw_gallery.py             # all, some minutes
    .venv/bin/python docs/draw_gallery.py plate_sece  # one

A figure that a command writes is made smaller, in width and colours, so that the page stays light.
"""

import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]
# width and colours; bytes
SIZES = ((720, 48), (720, 24), (640, 24), (560, 16))
MOST = 60_000


def commands() -> dict[str, list[list[str]]]:
    """The commands of each section of the page, by the name of its figure."""
    page = (ROOT / "examples" / "README.md").read_text()
    found: dict[str, list[list[str]]] = {}
    for section in re.split(r"^### ", page, flags=re.MULTILINE)[1:]:
        figure = re.search(r"\]\(\.\./docs/gallery/(\w+)\.png\)", section)
        block = re.search(r"```sh\n(.*?)```", section, re.DOTALL)
        if figure and block:
            found[figure[1]] = [shlex.split(line, comments=True) for line in block[1].splitlines()]
    return found


def draw(name: str, lines: list[list[str]]) -> None:
    """Run the commands in a folder of their own, and keep their last figure, small."""
    with tempfile.TemporaryDirectory() as folder:
        for part in ("examples", "netlists"):
            (Path(folder) / part).symlink_to(ROOT / part)
        for program, *rest in lines:
            module = ["-m", "harvester"] if program.endswith("harvester") else []
            subprocess.run(
                [sys.executable, *module, *rest], cwd=folder, check=True, capture_output=True
            )
        figure = max(Path(folder, "out").rglob("*.png"), key=lambda path: path.stat().st_mtime)
        path = ROOT / "docs" / "gallery" / f"{name}.png"
        path.parent.mkdir(exist_ok=True)
        small(Image.open(figure).convert("RGB"), path)


def small(image: Image.Image, path: Path) -> None:
    """Write the image at the first of `SIZES` that takes less than `MOST` bytes."""
    for width, colours in SIZES:
        one = image.resize(
            (width, round(image.height * width / image.width)), Image.Resampling.LANCZOS
        )
        # This method keeps a colour that few pixels have, such as that of a thin line.
        one.quantize(colours, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            path, optimize=True
        )
        if path.stat().st_size < MOST:
            return
    raise SystemExit(f"{path.name} has {path.stat().st_size} bytes, more than {MOST}")


def main() -> None:
    known = commands()
    for name in sys.argv[1:] or known:
        draw(name, known[name])
        print(name, flush=True)


if __name__ == "__main__":
    main()
