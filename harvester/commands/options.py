"""Options that several commands have."""

from collections.abc import Callable
from typing import Any

import click

from harvester.commands.help import option
from harvester.errors import InputError, shown
from harvester.scene.units import fraction, seconds


def percent(text: str) -> float:
    """1% or .01."""
    return _read("`within`", fraction, text)


def duration(text: str) -> float:
    """30s, 2min, 1h or a number of seconds."""
    return _read("`budget`", seconds, text)


def _read(argument: str, reader: Callable[[str], float], text: str) -> float:
    try:
        return reader(text)
    except ValueError as error:
        raise InputError(f"{argument} {error}, but is {shown(text)}") from None


ACCURACY, EFFORT, OUTPUT = "Accuracy", "Effort by hand (engines that sample)", "Output"
WHAT, GRID, RUNNERS = "What to compute", "Where", "Who computes"
SEED = click.IntRange(min=0)
scene_argument = click.argument("scene", help="A scene file: 'harvester new FILE.toml' makes one.")
seed_option = option(
    "--seed", group=ACCURACY, type=SEED, default=0, show_default=True, help="The same seed, the same noise."
)


def sampling(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of the engines that sample."""
    for one in (
        option("--alone", is_flag=True, group=EFFORT, help="spice: ngspice runs only, not paired with a cheap model."),
        option(
            "--dt", type=float, group=EFFORT, help="Step, in s (nondimensional scene: 1/w0).  Default: from the scene."
        ),
        option("--duration", type=float, group=EFFORT, help="Of a trajectory after its burn-in, in the unit of --dt."),
        option("--trajectories", type=int, group=EFFORT, help="Independent ones.  Default: 4096 (spice: 16)."),
        option(
            "--seed", type=int, default=0, group=ACCURACY, show_default=True, help="The same seed, the same answer."
        ),
        option(
            "--budget",
            type=duration,
            metavar="TIME",
            group=ACCURACY,
            help="Time that it may take, such as 30s: the burn-in, and reaching --within.  Default: what it takes.",
        ),
        option(
            "--within",
            type=percent,
            metavar="PERCENT",
            group=ACCURACY,
            help="Error to reach in the mean power, such as 1%: sampling (95 %) plus bias.",
        ),
    ):
        command = one(command)
    return command


def as_json_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """--json."""
    made: Callable[..., Any] = option("--json", "as_json", is_flag=True, group=OUTPUT, help="Print one JSON object.")(
        command
    )
    return made


def _form(text: str) -> str:
    """A form of a figure."""
    from harvester.machine import files

    files.check_vector([text])
    return text


def _page(text: str) -> str:
    """The name of a report, or ``HERE``: beside what else is written."""
    if text != HERE and not text.endswith(".html"):
        raise InputError(
            f"--report must be followed by a name that ends in .html, or by nothing, but is followed by {shown(text)}: "
            "put --report after SCENE or give it a name"
        )
    return text


HERE = "."
vector_option = option(
    "--vector",
    group=OUTPUT,
    type=_form,
    multiple=True,
    metavar="FORM",
    help="svg or pdf: the figure in that form too; repeatable.",
)
report_option = option(
    "--report",
    group=OUTPUT,
    is_flag=False,
    flag_value=HERE,
    type=_page,
    metavar="[FILE.html]",
    help="Write a report, one HTML file with all in it.  Default: report.html in --out, or here.",
)
