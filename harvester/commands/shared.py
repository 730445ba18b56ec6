"""What several commands do: read a scene, choose an engine, print an answer, name the files."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from harvester.commands.help import echo, typed
from harvester.commands.options import HERE
from harvester.errors import InputError, invalid

if TYPE_CHECKING:
    from harvester.commands.progress import Bar, Rows
    from harvester.report import Page
    from harvester.scene.scene import Scene


def drawn(name: str, vector: tuple[str, ...]) -> str:
    """The files of a figure."""
    return ", ".join(f"{name}.{form}" for form in ("png", *dict.fromkeys(vector)))


def need_out(vector: tuple[str, ...], out: str | None) -> None:
    """An option that would be ignored is refused."""
    if vector and out is None:
        raise InputError("--vector must go with --out, where the figure is written, but --out is left out")


def report_file(report: str | None, out: str | None) -> Path | None:
    """Where the report goes, checked before anything is computed."""
    if report is None:
        return None
    from harvester.machine import files

    path = Path("." if out is None else out) / "report.html" if report == HERE else Path(report)
    files.folder(path.parent, "out" if report == HERE and out is not None else "report")
    if path.is_dir():
        raise invalid("--report", "be a file", str(path))
    return path


def save_report(page: Path | None, made: Callable[[Any], "Page"], quiet: bool = False) -> None:
    """Where a report is wanted, write what is ``made`` by `harvester.report`, and say where it is unless ``quiet``."""
    if page is None:
        return
    from harvester import report

    report.write(page, made(report))
    if not quiet:
        click.echo(f"report: {page}")


def loaded(path: str) -> "Scene":
    """The scene of a file."""
    from harvester.scene.toml import load

    return load(path)


def given_options(options: dict[str, Any]) -> dict[str, Any]:
    """Those of a command's options for engines that were given."""
    return {name: value for name, value in options.items() if value is not None and value is not False}


def print_answer(answer: Any, as_json: bool) -> None:
    """As text, or as one JSON object."""
    if as_json:
        click.echo(typed(json.dumps(answer.as_json(), allow_nan=False)))
    else:
        echo(str(answer))


def progress(what: str, known: bool = True, most: bool = False) -> "Bar":
    """A progress bar on a terminal, and none in a pipe."""
    from harvester.commands.progress import Bar

    return Bar(what, known=known, most=most)


def progress_of_rows(what: str, rows: dict[str, int]) -> "Rows":
    """The same for rows of several engines."""
    from harvester.commands.progress import Rows

    return Rows(what, rows)
