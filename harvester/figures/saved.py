"""Writing a figure into files."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from harvester.figures.style import image
from harvester.machine import files


def save(figure: Figure, folder: Path, name: str, vector: Sequence[str] = ()) -> None:
    """Write ``name``.png, and beside it the vector forms asked for (`harvester.machine.files.VECTOR`)."""
    for form in ("png", *dict.fromkeys(vector)):
        files.write(folder / f"{name}.{form}", image(figure, form))
