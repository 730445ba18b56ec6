"""The command `harvester adopt`."""

import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_json
from harvester.commands.options import json_option, two_nets
from harvester.errors import InputError, invalid, shown

if TYPE_CHECKING:
    from harvester.netlists.adoption import Adoption
    from harvester.presentation.diagnostic import Diagnostic


@command(
    "harvester adopt deck.net --out board.cir",
    "harvester adopt deck.cir --terminals PZ1,PZ2 --load R3 --store C1 --out board.cir",
)
@cloup.argument("deck", type=cloup.Path(), help="A netlist with its own source and analyses.")
@cloup.option_group(
    "If the deck leaves it open",
    cloup.option("--terminals", metavar="A,B", help="The two nets of the piezo."),
    cloup.option("--load", metavar="NAME", help="The resistor whose power is asked for."),
    cloup.option("--store", metavar="NAME", help="The storage capacitor."),
)
@cloup.option_group(
    "Output",
    cloup.option(
        "--out", metavar="FILE", help="Board to write, such as board.cir, in the deck's folder."
    ),
    cloup.option("--force", is_flag=True, help="Overwrite it."),
    json_option,
)
def adopt(
    deck: str,
    terminals: str | None,
    load: str | None,
    store: str | None,
    out: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Make a board of DECK: without its drive, the piezo's capacitor, analyses and commands.

    Prints the lines that are left out or kept, and the scene's table [load].
    """
    from harvester.machine import files
    from harvester.netlists.adoption import adopt as read
    from harvester.netlists.deck_cards import check_form
    from harvester.presentation.diagnostic import note

    path = Path(deck)
    check_form(path)
    nets = None if terminals is None else two_nets(terminals)
    target = None if out is None else _target(Path(out), path, force)
    adoption = read(path, nets, load, store)
    board = path.with_name(f"{path.stem}_board.cir") if target is None else target
    table = _table(adoption, board)
    warned = _checked(adoption, board)
    if target is not None:
        files.write(target, adoption.text, "--out")
    remarks = (*adoption.diagnostics, *warned)
    if as_json:
        answer = {"load": table, "capacitance": adoption.capacitance, "written": out}
        echo_json({**answer, "diagnostics": [remark.as_json() for remark in remarks]})
        return
    words = ["warning: " * (remark.severity == "warning") + str(remark) for remark in remarks]
    # JSON texts and lists of them are those of TOML.
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in table.items()]
    written = (
        [note("deck_written", out=out), note("deck_new", command=_new(table, out))]
        if out
        else [note("deck_unwritten")]
    )
    ends = [*map(str, written), str(note("deck_table"))]
    echo("\n".join([*words, "", *ends, "", "[load]", *lines]))


def _new(table: "dict[str, str | list[str]]", out: str) -> str:
    """The command that writes a scene with the board."""
    words = ["harvester", "new", str(Path(out).with_suffix(".toml")), "--netlist", out]
    for key, value in table.items():
        if key != "netlist":
            words += [f"--{key}", value if isinstance(value, str) else ",".join(value)]
    return shlex.join(words)


def _target(out: Path, deck: Path, force: bool) -> Path:
    """The file of the board, which is new and in the deck's folder, with its libraries."""
    if out.resolve().parent != deck.resolve().parent:
        raise invalid(
            "--out", "be in the deck's folder, with the libraries that it includes", str(out)
        )
    if out.resolve() == deck.resolve() or (out.exists() and not (force and out.is_file())):
        is_other = out.is_file() and out.resolve() != deck.resolve()
        again = "another name, or --force" if is_other else "another name"
        raise InputError(f"--out must be new, but {shown(str(out))} is there: {again}")
    if not out.name.lower().endswith(".cir"):
        raise invalid("--out", "end in .cir", str(out))
    return out


def _table(adoption: "Adoption", board: Path) -> dict[str, str | list[str]]:
    """The table [load] of a scene."""
    table: dict[str, str | list[str]] = {
        "netlist": f"./{board.name}",
        "terminals": list(adoption.terminals),
        "resistor": adoption.resistor,
    }
    return table if adoption.store is None else {**table, "store": adoption.store}


def _checked(adoption: "Adoption", board: Path) -> "tuple[Diagnostic, ...]":
    """The warnings of the board; raises InputError for a construct that a scene refuses."""
    from harvester.netlists.load_circuit import load_circuit
    from harvester.scene.load import Load

    load = Load(
        netlist=str(board.resolve()),
        terminals=adoption.terminals,
        resistor=adoption.resistor,
        store=adoption.store,
    )
    return load_circuit(load, text=adoption.text).value_warnings
