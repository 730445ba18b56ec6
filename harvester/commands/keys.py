"""The command `harvester keys`."""

import json
from pathlib import Path

import click
import cloup

from harvester.commands.help import command
from harvester.commands.options import json_option
from harvester.errors import InputError


@command(
    "harvester keys",
    "harvester keys excitation",
    "harvester keys load.resistance --json",
    "harvester keys profile",
    "harvester keys board.toml    (the parts of its netlist that vary)",
    "harvester keys --schema --out harvester.schema.json",
)
@cloup.argument(
    "what",
    required=False,
    metavar="[TABLE|KEY|SCENE]",
    help="Such as load, load.resistance, profile, or a scene with a netlist.  Default: all.",
)
@cloup.option_group(
    "Output",
    json_option,
    cloup.option(
        "--schema",
        is_flag=True,
        help="Print the JSON schema of scenes, by which editors complete them.",
    ),
    cloup.option(
        "--out",
        metavar="FILE",
        help="With --schema: write it to this file, such as harvester.schema.json.",
    ),
)
def keys(what: str | None, as_json: bool, schema: bool, out: str | None) -> None:
    """List the keys of a scene file: unit, example, meaning.

    With 'profile' the vibration profiles and sources.
    """
    from harvester.scene import keys as scene_keys

    if schema:
        if what is not None or as_json:
            raise InputError(
                f"{'--json' if as_json else 'TABLE|KEY'} must be left out with --schema, but is given"
            )
        _schema(out)
        return
    if out is not None:
        raise InputError("--out must be used with --schema, but --schema is left out")
    if what in ("profile", "excitation.profile"):
        from harvester.records.profiles import catalogue

        click.echo(json.dumps(catalogue.listed()) if as_json else catalogue.text())
        return

    if what is not None and what.endswith(".toml"):
        parts = _parts(what)
        lines = [f"{key} = {value:.6g}" for key, value in parts.items()]
        click.echo(json.dumps(parts) if as_json else "\n".join(lines))
        return
    chosen = scene_keys.chosen(what)
    click.echo(json.dumps([vars(key) for key in chosen]) if as_json else scene_keys.text(chosen))


def _parts(file: str) -> dict[str, float]:
    """The keys and values of all parts of a scene's netlist that vary, in SI units."""
    from harvester.equations.problem import Problem
    from harvester.netlists.flat import ROLES

    problem = Problem.of(file)
    circuit = problem.circuit
    if not (circuit and problem.netlist):
        raise InputError(f"SCENE must have a netlist, whose parts vary, but {file} has none")
    letters = {ROLES.get(role) for role in circuit.renamed.values()}  # of parts with a name
    plain = {name: value for name, value in circuit.values.items() if name not in letters}
    every = plain | circuit.elements
    return {f"load.parameters.{name}": value for name, value in every.items()}


def _schema(out: str | None) -> None:
    """Print the schema, or write it to a file."""
    from harvester.machine import files
    from harvester.scene.schema import text

    if out is None:
        click.echo(text(), nl=False)
        return
    files.write(Path(out), text())
    click.echo(f"written: {out}")
