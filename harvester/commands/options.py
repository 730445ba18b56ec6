"""The options that several commands have, and how their values are read."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click
import cloup
from cloup.constraints import If, mutually_exclusive, require_all

from harvester.commands.completion import engines, scene_files, scene_keys
from harvester.errors import InputError, invalid, named_once, reading, shown
from harvester.quantities.units import fraction, seconds, time


def percent(text: str) -> float:
    """Read a share such as 1% or 0.01."""
    return reading("`within`", fraction, text)


def duration(text: str) -> float:
    """Read a time such as 30s, 2min, 1h or a number of seconds."""
    return reading("`budget`", seconds, text)


def time_of(name: str) -> Callable[[str], float]:
    """A reader of a time with or without a unit, such as 1ms or 0.001, for the option of that name."""
    return lambda text: reading(f"`{name}`", time, text)


def pairs_of(option: str, texts: Sequence[str], must: str) -> dict[str, str]:
    """The values by name of texts NAME=VALUE, the form that each ``must`` have.

    InputError for a name given twice.
    """
    pairs = [tuple(part.strip() for part in text.partition("=")) for text in texts]
    for text, (name, equals, value) in zip(texts, pairs, strict=True):
        if not (name and equals and value):
            raise invalid(option, must, text)
    named_once([name for name, _, _ in pairs], option)
    return {name: value for name, _, value in pairs}


def two_nets(text: str) -> tuple[str, str]:
    """The nets of `--terminals A,B`."""
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2 or not all(names):
        raise invalid("--terminals", "be two nets, such as PZ1,PZ2", text)
    return names[0], names[1]


def another_file(option: str, out: str | Path, source: str, what: str) -> None:
    """Refuse an output that is the file which the command reads, ``what``, also through a link."""
    path = Path(out)
    try:
        is_source = path.samefile(source)
    except (OSError, ValueError):  # one of them is absent, which reading or writing refuses
        return
    if is_source:
        raise InputError(
            f"{option} must be another file than {what} itself, but is {shown(str(out))}"
        )


def _form(text: str) -> str:
    """Check the form of a figure."""
    from harvester.machine import files

    files.check_vector([text])
    return text


scene_argument = cloup.argument(
    "path",
    metavar="SCENE",
    help="A scene file: 'harvester new FILE.toml' makes one.",
    shell_complete=scene_files,
)
seed_option = cloup.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Random seed (same seed, same noise).",
)
probe_option = cloup.option(
    "--probe",
    multiple=True,
    metavar="NAME",
    help="store (the capacitor Csmooth), v(NODE), v(NODE,NODE), i(ELEMENT) or p(ELEMENT) of the netlist; repeatable.",
)
json_option = cloup.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
vector_option = cloup.option(
    "--vector",
    type=_form,
    multiple=True,
    metavar="FORM",
    help="Also save the figure as svg or pdf; repeatable.",
)


def engine_option(help_: str) -> Callable[..., Any]:
    """The option --engine of a command for one engine."""
    return cloup.option("--engine", shell_complete=engines, help=help_)


def engines_option(help_: str) -> Callable[..., Any]:
    """The option --engine of a command for several engines."""
    return cloup.option("--engine", "engines", shell_complete=engines, multiple=True, help=help_)


def keys_option(*names: str, help_: str, metavar: str | None = None) -> Callable[..., Any]:
    """An option that names a scene key, again and again for several of them."""
    return cloup.option(
        *names, shell_complete=scene_keys, multiple=True, metavar=metavar, help=help_
    )


def vector_needs_out(*others: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Refuse --vector without --out, if ``others``, options by name, are also set: no figure would be written."""
    error = "--vector must be used with --out, the folder of the figure, but --out is left out"
    return cloup.constraint(
        If(["vector", *others], then=require_all).rephrased(error=error), ["out"]
    )


def who_computes(resume: str, workers: str) -> Callable[..., Any]:
    """The group of options "Who computes": --resume and --workers, with these helps, and --scheduler."""
    one_of = mutually_exclusive.rephrased(
        error="--workers must be left out if --scheduler is given, but both are given"
    )
    return cloup.option_group(
        "Workers",
        cloup.option("--resume", is_flag=True, help=resume),
        one_of(
            cloup.option("--workers", type=int, metavar="N", help=workers),
            cloup.option(
                "--scheduler",
                metavar="ADDRESS",
                help="A Dask scheduler instead, such as tcp://host:8786.",
            ),
        ),
    )


def sampling(
    command: Callable[..., Any], whole: str = "", unset: str = "unlimited"
) -> Callable[..., Any]:
    """Add the options of the engines that sample to a command.

    ``whole`` names the object of a budget, if not a run; ``unset`` is the budget if none is given.
    """
    accuracy = cloup.option_group(
        "Accuracy",
        cloup.option(
            "--within",
            type=percent,
            metavar="PERCENT",
            help="Target mean-power error, such as 1%: sampling (95 %) plus bias.",
        ),
        cloup.option(
            "--budget",
            type=duration,
            metavar="TIME",
            help=f"Time limit for {whole or 'the run'}, such as 30s, including burn-in.  Default: {unset}.",
        ),
        cloup.option(
            "--seed",
            type=int,
            default=0,
            show_default=True,
            help="Random seed (same seed and effort, same answer; a budget's effort depends on the machine's speed).",
        ),
    )
    effort = cloup.option_group(
        "Manual effort (sampling engines)",
        cloup.option(
            "--trajectories",
            type=int,
            help="Number of trajectories.  Default: 4096, with --within at least 256 (spice: 16 and 8).",
        ),
        cloup.option(
            "--duration",
            type=time_of("duration"),
            metavar="TIME",
            help="Time of a trajectory after burn-in, as --dt.",
        ),
        cloup.option(
            "--dt",
            type=time_of("dt"),
            metavar="TIME",
            help="Time step, such as 1ms or 0.001 (nondimensional scene: a number of 1/w0).  Default: from the scene.",
        ),
        cloup.option(
            "--alone",
            is_flag=True,
            default=None,
            help="spice: mean of plain ngspice runs from rest.",
        ),
    )
    return accuracy(effort(command))


def single_points() -> list[Callable[..., Any]]:
    """The options of a voltage without load and of a power at a load, as datasheets have them."""
    return [
        cloup.option(
            "--open-circuit-voltage",
            metavar="POINT",
            help="Largest voltage without load, such as '21 V at 0.25 g'; peaks, or with 'rms' "
            "or 'pp'.",
        ),
        cloup.option(
            "--power-at-load",
            metavar="POINT",
            help="Mean power at the best frequency, such as '1.2 mW at 15 kohm and 0.25 g'.",
        ),
        cloup.option(
            "--prior",
            metavar="CLASS",
            help="Class of the device, for a damping that is left out: bulk (default), composite, "
            "film or polymer.",
        ),
    ]
