"""Documents inside an FMU: a page of its variables, and the note of its licence."""

import html
from pathlib import Path

from harvester.devices.fmu.variables import Variable

PAGE = """<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{title}</title></head>
<body><h1>{title}</h1>
<p>A vibro-impact piezoelectric energy harvester, made by harvester. The inner step is {step:.6g} s;
any communication step is possible. The inputs are held over a step.</p>
<table><tr><th>variable</th><th>unit</th><th>meaning</th></tr>
{rows}
</table></body></html>
"""
ROW = "<tr><td>{name}</td><td>{unit}</td><td>{meaning}</td></tr>"
LICENCE = """\
This FMU contains machine code of the package harvester, which is under the GNU General Public
License, version 3 or later (SPDX: GPL-3.0-or-later): whoever passes it on must offer the source of
that package and of this device under the same licence. The C library and the compiler's runtime, of
which parts may be linked, have licences of their own that permit it.
"""


def icons(fmi: int) -> dict[str, bytes]:
    """The icon by file, as FMI 2 or 3 names it."""
    folder = Path(__file__).parent
    if fmi == 2:
        return {"model.png": (folder / "icon.png").read_bytes()}
    return {
        f"terminalsAndIcons/icon.{kind}": (folder / f"icon.{kind}").read_bytes()
        for kind in ("png", "svg")
    }


def documents(title: str, variables: list[Variable], step: float) -> dict[str, bytes]:
    """The page and the note, by file; ``step`` is the inner step in s."""
    rows = [
        ROW.format(
            name=html.escape(variable.name),
            unit=html.escape(variable.unit),
            meaning=html.escape(variable.meaning),
        )
        for variable in variables
    ]
    page = PAGE.format(title=html.escape(title), step=step, rows="\n".join(rows))
    return {
        "documentation/index.html": page.encode(),
        "documentation/licenses/license.txt": LICENCE.encode(),
    }
