"""The table of constructs: what ngspice says of each, in two versions, and what the package does.

    python benchmarks/constructs.py --newer PROGRAM      writes tests/netlists/constructs.json and docs/constructs.md
    python benchmarks/constructs.py --page               the page alone, from the numbers that are there

Each row of tests/support/constructs.py is a netlist that both versions read letter by letter, fed
by the same current.
"""

import argparse
import contextlib
import json
import os
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from harvester.errors import InputError  # noqa: E402
from tests.support import imposed_drive  # noqa: E402
from tests.support.constructs import ROWS, given_to_ngspice  # noqa: E402
from tests.support.ngspice_oracle import by_program  # noqa: E402

TABLE, PAGE = ROOT / "tests/netlists/constructs.json", ROOT / "docs/constructs.md"
HEAD = """# Constructs of netlists

A netlist is read once, and the result is the circuit that engine `compiled` solves and that engine `spice` gives to
ngspice. This table lists the constructs of netlists and their treatment by both engines: *same*, if the power equals
that of ngspice 39 on the original text within 0.1 %, or *refused*, in one line that names the construct. Powers are in
uW, for one small netlist per row, with the same current into each. A dash means that this ngspice gives no power. The
second version is a build of the sources for ngspice 47. A construct of LTspice that ngspice refuses or leaves out is
*as LTspice*, if the power equals that of ngspice 39 on the same circuit without it.

```text
python benchmarks/constructs.py --newer PROGRAM     # makes the table; with --new only rows that it lacks
python benchmarks/netlist_fuzz.py --count 1000      # compares random netlists
```

Braces `{...}` and B sources are two languages in ngspice, with different functions and precedence: `pow` and `pwr`
change places. Some constructs are refused although ngspice gives a power, because it is a surprising one: it uses the
last of two values, ignores a misspelt key of a model, or reads a line behind `.end`.
"""
KNOWN = {"39": "ngspice 39", "47": "ngspice 47", "spice": "`spice`", "compiled": "`compiled`"}


def asked(newer, rows):
    """The rows with both versions' powers (W), and the treatment by both engines."""
    table = {}
    # Commands in messages name the file as it is seen from the present folder.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        file = Path("board.cir")
        for row in rows:
            file.write_text(row.text)
            programs = {"39": "ngspice", "47": newer}
            said = {
                name: by_program(row.text, program=program, patience=20.0)
                for name, program in programs.items()
            }
            known = {name: answer.power if answer.given else None for name, answer in said.items()}
            known |= {"spice": "same", "compiled": "same", "why": ""}
            try:
                given_to_ngspice(file)
            except InputError as error:
                known |= {"spice": "refused", "compiled": "refused", "why": str(error)}
            else:
                mine = imposed_drive.answered(file)
                known |= {} if mine.given else {"compiled": "refused", "why": mine.why}
                if row.means:
                    plain = by_program(row._replace(body=row.means).text, patience=20.0).power
                    known |= {"means": plain, "spice": "as LTspice", "compiled": "as LTspice"}
            table[row.name] = known
            print(row.name, known, flush=True)
    return table


def page(table):
    """The page."""
    lines = [HEAD]
    for group in dict.fromkeys(row.group for row in ROWS):
        lines += [
            f"## {group[0].upper()}{group[1:]}",
            "",
            f"| construct | {' | '.join(KNOWN.values())} |",
            5 * "|---" + "|",
        ]
        for row in ROWS:
            if row.group == group:
                cells = [_cell(table[row.name][name]) for name in KNOWN]
                lines.append(
                    f"| {row.construct.replace('|', chr(92) + '|')} | {' | '.join(cells)} |"
                )
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def _head():
    """The head of a table."""
    return f"| construct | {' | '.join(KNOWN.values())} |"


def _cell(value):
    """A cell of the table."""
    return "-" if value is None else value if isinstance(value, str) else f"{value * 1e6:.4g}"


def main():
    """Make the table, or the page of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--newer", default="ngspice", help="the program of a newer ngspice")
    parser.add_argument("--page", action="store_true", help="only write the page anew")
    parser.add_argument("--new", action="store_true", help="only ask for rows that the table lacks")
    options = parser.parse_args()
    if not options.page:
        known = json.loads(TABLE.read_text()) if options.new else {}
        newer = options.newer
        newer = str(Path(newer).resolve()) if os.sep in newer else newer
        table = known | asked(newer, [row for row in ROWS if row.name not in known])
        table = {row.name: table[row.name] for row in ROWS}
        TABLE.write_text(json.dumps(table, indent=1) + "\n")
    PAGE.write_text(page(json.loads(TABLE.read_text())))


if __name__ == "__main__":
    main()
