"""Where the example scenes are: in the wheel next to the modules, else in the checkout."""

from pathlib import Path


def example_scenes() -> dict[str, Path]:
    """The example scenes by name: the file's name without .toml."""
    package = Path(__file__).parents[1]
    folder = next(
        candidate
        for candidate in (package / "examples", package.parent / "examples")
        if candidate.is_dir()
    )
    return {
        path.stem: path
        for path in [*sorted(folder.glob("*.toml")), *sorted(folder.glob("published/*.toml"))]
    }
