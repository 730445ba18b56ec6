"""The command `harvester new`."""

import json
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import cloup

from harvester.commands.geometry import geometry_options, take
from harvester.commands.help import command
from harvester.commands.messages import echo, typed
from harvester.commands.options import json_option, pairs_of, single_points, two_nets
from harvester.devices.datasheet import FIELDS, LOAD
from harvester.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from harvester.equations.problem import Problem
    from harvester.presentation.diagnostic import Diagnostic


MOST_POINTS = 301  # of a sweep of frequencies that is proposed


def _datasheet_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add an option for each field of a datasheet to a command, in the fields' groups."""
    netlist = [
        cloup.option(
            "--netlist",
            metavar="NAME",
            help="Instead: a circuit of netlists/, such as bridge, or a path.",
        ),
        cloup.option(
            "--parameter",
            "parameters",
            multiple=True,
            metavar="NAME=VALUE",
            help="A value of it; repeatable.",
        ),
        cloup.option(
            "--terminals", metavar="A,B", help="The piezo's two nets in a flat netlist (a board)."
        ),
        cloup.option("--resistor", metavar="NAME", help="The board's load.  Default: Rload."),
        cloup.option("--store", metavar="NAME", help="Its storage capacitor.  Default: Csmooth."),
    ]
    for group in reversed(dict.fromkeys(field.group for field in FIELDS.values())):
        options = [
            cloup.option(
                "--" + field.name.replace("_", "-"), field.name, metavar="VALUE", help=field.help
            )
            for field in FIELDS.values()
            if field.group == group
        ]
        command = cloup.option_group(group, *options, *(netlist if group == LOAD else []))(command)
    return command


@command(
    "harvester new mine.toml      (asks)",
    "harvester new mine.toml --mass '40 g' --frequency '3.2 Hz' --q 125 --capacitance '50 nF' "
    "--open-circuit-frequency '4.8 Hz' --acceleration-psd '1e-5 g^2/Hz' --resistance '1 Mohm'",
    "harvester new mine.toml --bimorph --length 50.8mm --width 31.8mm --substrate-thickness 0.14mm "
    "--piezo-thickness 0.26mm --tip-mass 12g --piezo PZT-5A --substrate brass --damping-ratio 2.7%",
    "harvester new mine.toml --mass '4 g' --frequency '60 Hz' --q 60 --capacitance '30 nF' "
    "--open-circuit-voltage '21 V at 0.25 g'",
    "harvester new mine.toml --frequency '60 Hz' --open-circuit-frequency '61 Hz' --capacitance '30 nF' "
    "--open-circuit-voltage '21 V at 0.25 g' --prior bulk",
    "harvester new mine.toml --mass '40 g' --stiffness '16 N/m' --damping-ratio 0.004 --coupling '1e-3 N/V' "
    "--capacitance '50 nF' --netlist bridge --parameter R='1 Mohm' --parameter C='1 uF'",
)
@cloup.argument("file", help="The scene file to write, such as mine.toml.")
@_datasheet_options
@cloup.option_group(
    "Single points of a datasheet (each instead of a coupling, a damping or a mass; a damping "
    "that is still left out has a prior)",
    *single_points(),
)
@geometry_options
@cloup.option_group(
    "File and output",
    cloup.option("--title", help="Title of tables and plots."),
    cloup.option("--force", is_flag=True, help="Overwrite FILE."),
    json_option,
)
def new(
    file: str,
    netlist: str | None,
    parameters: tuple[str, ...],
    terminals: str | None,
    resistor: str | None,
    store: str | None,
    title: str | None,
    force: bool,
    as_json: bool,
    prior: str | None,
    **values: Any,
) -> None:
    """Write the scene FILE of your device, from options or questions, and explain its numbers.

    On a terminal, missing values are asked for.  Values carry their unit, or are in SI units.
    """
    from harvester.devices.device import missing, scene_tables
    from harvester.devices.interpretation import meaning
    from harvester.devices.scene_file import check, write
    from harvester.scene.schema import NAME

    path = Path(file)
    check(path, force)  # before anybody answers questions
    beam, modes = take(values) or (None, 1)
    texts = {name: value for name, value in values.items() if value is not None}
    made = None if beam is None else _from_geometry(beam, modes, texts)
    by_points = _from_points(texts, prior)
    if missing(texts) and sys.stdin.isatty():
        from harvester.commands.questions import ask, ask_title

        ask(texts, netlist is not None)
        title = ask_title() if title is None else title
    if netlist is not None:
        netlist = _netlist(netlist, path)
    board = _board(netlist, terminals, resistor, store)
    named = pairs_of("--parameter", parameters, "be NAME=VALUE, such as R='1 Mohm'")
    upper_modes = () if made is None else made.higher_modes
    tables = scene_tables(texts, title or "", netlist, named, upper_modes, board)
    problem = write(path, tables, force)
    interpretation = meaning(problem)
    words = _words(
        problem, [*by_points, *_on_geometry(beam, made, problem), *interpretation.remarks], file
    )
    lines = next_lines(problem, file, interpretation.facts)
    if as_json:
        numbers = {name: value for name, value, _, _ in interpretation.numbers}
        answer = {
            "file": file,
            "scene": problem.scene.tables(),
            "numbers": numbers,
            **interpretation.facts,
        }
        click.echo(json.dumps({**answer, "words": words, "next": lines}, allow_nan=False))
        return
    written = [f"written: {file}", f"written: {path.with_name(NAME)}"]
    echo(
        "\n".join(
            [
                *written,
                "",
                *interpretation.table(),
                "",
                *words,
                "",
                *(f"next: {line}" for line in lines),
            ]
        )
    )


def _from_points(texts: dict[str, str], prior: str | None) -> "list[Diagnostic]":
    """Put the values that single points and a prior give among the texts, and state them."""
    from harvester.devices.device import known_values
    from harvester.linear.single_points import POINTS, UNITS, left_out, solve
    from harvester.presentation.diagnostic import note, warning
    from harvester.studies.prediction.priors import DEFAULT_CLASS, unknown_quality

    points = {name: texts.pop(name) for name in POINTS if name in texts}
    if not points:
        if prior is not None:
            raise InputError(
                "--prior must be used with --open-circuit-voltage or --power-at-load, but there is none"
            )
        return []
    known = known_values(texts)
    left = left_out(known)
    said = []
    if "q" in left and len(left) > len(points):
        quality, spread = unknown_quality(prior or DEFAULT_CLASS)
        texts["q"] = f"{quality:.7g}"
        known["q"] = quality
        said = [note("damping_has_a_prior", "damping", quality=quality, spread=spread)]
    solved = solve(known, points)
    texts |= {name: f"{value:.7g}" for name, value in solved.values.items()}
    said += [
        note(
            "from_points", name, value=value, unit=UNITS[name], points=" and ".join(points.values())
        )
        for name, value in solved.values.items()
    ]
    if solved.ambiguous:
        said.append(warning("points_ambiguous", " and ".join(solved.values)))
    return said


def _from_geometry(beam: Any, modes: int, texts: dict[str, str]) -> Any:
    """The lumped values of a beam, which are put among the texts."""
    from harvester.devices.beam import check_alone, lumped

    check_alone(texts)
    made = lumped(beam, modes)
    texts |= {
        name: f"{getattr(made, name):.7g}"
        for name in ("mass", "stiffness", "coupling", "capacitance")
    }
    texts.setdefault("strain_per_displacement", f"{made.strain:.7g}")
    return made


def _on_geometry(beam: Any, made: Any, problem: "Problem") -> "list[Diagnostic]":
    """The lumped parameters computed from the geometry, if there is one."""
    if made is None:
        return []
    from harvester.devices.beam import remarks_on
    from harvester.studies.extremes.extremes import has_lifetime

    return remarks_on(beam, made, has_lifetime(problem))


def _words(problem: "Problem", remarks: "Sequence[Diagnostic]", file: str) -> list[str]:
    """The remarks in sentences, and how the best load is found if they do not state it."""
    words = [
        typed(f"warning: {remark}" if remark.severity == "warning" else remark.line)
        for remark in remarks
    ]
    if not any(remark.about in ("load", "best load") for remark in remarks):
        words.append(
            f"best load: not computed here; this command finds it: {_optimise(problem, file)}"
        )
    return words


def next_lines(problem: "Problem", file: str, facts: dict[str, Any]) -> list[str]:
    """The commands to type next, given the known part of the scene: the missing keys first."""
    from harvester.devices.best_load import NEARLY, load_range

    load = problem.scene.load
    eqs = problem.equations
    if not problem.equations.is_shaken:
        return [
            "harvester keys excitation   (kinds of excitation: add one to the scene, or new --force)"
        ]
    if load is None:
        return [_optimise(problem, file)]
    if eqs.drive is not None and load.netlist is None:
        f0 = problem.scales.frequency / (2.0 * math.pi)
        low = 0.7 * f0
        high = 1.3 * f0 * math.sqrt(1.0 + (eqs.beta or 0.0))
        count = 61
        drive = f0 * (eqs.drive_frequency or 1.0)
        if (
            not low <= drive <= high
        ):  # both the resonance and the drive, as closely as the resonance alone
            wide = min(low, 0.9 * drive), max(high, 1.1 * drive)
            count = min(round(60 * (wide[1] - wide[0]) / (high - low)) + 1, MOST_POINTS)
            low, high = wide
        sweep = f"harvester response {file} --sweep {low:.3g}Hz:{high:.3g}Hz:{count} --out response"
        return [f"harvester run {file}", sweep]
    run = f"harvester run {file} --within 1%"
    best = facts.get("best_load")
    if best is not None and best["share"] < NEARLY:
        return [run, _optimise(problem, file)]
    low, high = load_range(problem)
    return [
        run,
        f"harvester sweep {file} --vary {problem.load.resistance_key}={_plain(low)}:{_plain(high)}:25 --out sweep",
    ]


def _optimise(problem: "Problem", file: str) -> str:
    """The command that finds the best load."""
    from harvester.devices.best_load import load_range
    from harvester.devices.interpretation import engines
    from harvester.engines.selection import ENGINES

    low, high = load_range(problem)
    engine = next(
        (f" --engine {name}" for name in engines(problem) if ENGINES[name].needs_netlist), ""
    )
    return f"harvester optimise {file} --vary {problem.load.resistance_key}={_plain(low)}:{_plain(high)}{engine}"


def _plain(ohm: float) -> str:
    """A resistance such as 10k, as --vary reads it."""
    from harvester.uncertainty.value import Value

    return Value(ohm).format("ohm").removesuffix("ohm").replace(" ", "")


def _board(
    netlist: str | None, terminals: str | None, resistor: str | None, store: str | None
) -> dict[str, str | list[str]]:
    """The keys of [load] that name parts of a flat netlist."""
    keys: dict[str, str | list[str]] = {}
    if terminals is not None:
        keys["terminals"] = [*two_nets(terminals)]
    keys |= {} if resistor is None else {"resistor": resistor}
    keys |= {} if store is None else {"store": store}
    if keys and not netlist:
        raise InputError(f"--netlist must be given with --{next(iter(keys))}, but is left out")
    return keys


def _netlist(name: str, scene: Path) -> str:
    """The netlist as the scene file names it: a path from where the program runs becomes one from the file."""
    from harvester.scene.load import is_path

    if not is_path(name):
        return name
    path = os.path.relpath(name, scene.parent)
    return path if "/" in path else f"./{path}"
