"""The command `harvester tour`: the commands of docs/tour.md, run one after another in a folder of their own."""

import contextlib
import shlex
import sys
from pathlib import Path

import click
import cloup

from harvester.commands.help import command
from harvester.commands.messages import coloured, complain
from harvester.errors import InputError, MissingProgramError, shown

STEPS = (  # what a command does, and the command without `harvester`
    (
        "Write the numbers of a datasheet into a scene, a text file; effects that are left out are not computed.",
        "new mine.toml --mass '40 g' --frequency '3.2 Hz' --capacitance '50.2 nF' --coupling '1e-3 N/V' "
        "--damping-ratio 0.004 --restitution 0.96 --acceleration-psd '1e-5 g^2/Hz' --resistance '1 Mohm'",
    ),
    (
        "Its mean power, with the error: the default engine simulates many random trajectories.",
        "run mine.toml",
    ),
    (
        "The same from a formula, which states a bound of its own error.",
        "run mine.toml --engine averaged",
    ),
    (
        "To an accuracy of your choice: the program chooses engine, time step and effort.",
        "run mine.toml --within 0.3%",
    ),
    (
        "The same once more with the circuit in ngspice, in lock-step with the mass.",
        "run mine.toml --engine spice --within 3%",
    ),
    (
        "The power against the load: a table, and the plot sweep/sweep.png.",
        "sweep mine.toml --vary load.resistance=1k:10M:13 --engine averaged --engine ensemble --out sweep",
    ),
    ("The best load, with its interval.", "optimise mine.toml --vary load.resistance=1k:10M"),
    ("A picture of the motion: motion/motion.png.", "motion mine.toml --out motion"),
    (
        "One page with all results: compare/report.html.",
        "compare mine.toml --within 3% --out compare --report",
    ),
)


@command("harvester tour", "harvester tour --out first")
@cloup.option_group(
    "Output",
    cloup.option(
        "--out",
        metavar="DIR",
        default="tour",
        show_default=True,
        help="A new folder for the output.",
    ),
)
def tour(out: str) -> None:
    """Run the tutorial, step by step: each command is explained, shown and run.

    On a terminal it waits for the Enter key before each step.
    """
    from harvester.machine import files

    if Path(out).exists():
        raise InputError(f"--out must be a new folder, but {shown(out)} is there")
    folder = files.folder(out)
    program = click.get_current_context().find_root().command
    for number, (text, line) in enumerate(STEPS, 1):
        click.echo(f"{'' if number == 1 else chr(10)}Step {number} of {len(STEPS)}. {text}")
        click.secho(f"$ harvester {line}", bold=True, color=coloured())
        if sys.stdin.isatty() and sys.stdout.isatty():
            click.prompt("Enter runs it, ^C ends the tour", default="", show_default=False)
        with contextlib.chdir(folder):
            try:
                program.main(
                    shlex.split(line),
                    prog_name="harvester",
                    standalone_mode=False,
                    color=coloured(),
                )
            except MissingProgramError as error:
                complain(f"this step is left out: {error}")
    click.echo(
        f"\nAll that was written is in {out}/. Next: harvester examples, harvester new, harvester COMMAND --help."
    )
