"""The option --report: the path of the page, checked before anything is computed, and how it is written."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import cloup

from harvester.errors import InputError, invalid, shown

if TYPE_CHECKING:
    from harvester.report import Page

HERE = "."  # --report without a name: beside what else is written


def _name(text: str) -> str:
    """Check the name of a page."""
    if text != HERE and not text.endswith(".html"):
        raise InputError(
            f"--report must be followed by a name that ends in .html, or by nothing, but is followed by {shown(text)}: "
            "put --report after SCENE or give it a name"
        )
    return text


report_option = cloup.option(
    "--report",
    is_flag=False,
    flag_value=HERE,
    type=_name,
    metavar="[FILE.html]",
    help="Write a report, one HTML file with all results.  Default: report.html in --out, or here.",
)


def report_file(report: str | None, out: str | None) -> Path | None:
    """The file of the page, None if none is wanted.

    Raises InputError if it cannot be written.
    """
    if report is None:
        return None
    from harvester.machine import files

    path = Path("." if out is None else out) / "report.html" if report == HERE else Path(report)
    files.check_parent(path, "out" if report == HERE and out is not None else "report")
    if path.is_dir():
        raise invalid("--report", "be a file", str(path))
    files.check_regular(path, "report")  # before the computation, not after it
    return path


def save_report(
    file: Path | None, page: Callable[[Any], "Page"], quiet: bool = False, scene: str | None = None
) -> None:
    """Write the page that ``page`` makes with `harvester.report`, if wanted, and print its path unless ``quiet``.

    ``scene`` is the name of the scene's file, the title if the scene has none.
    """
    if file is None:
        return
    from harvester import report

    made = page(report)
    report.write(file, made if scene is None else report.titled(made, scene))
    if not quiet:
        click.echo(f"report: {file}")
