"""The command `harvester paper`."""

from pathlib import Path

import click
import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_json
from harvester.commands.reports import report_file, save_report
from harvester.commands.study import output_options
from harvester.errors import unknown


@command("harvester paper --out paper", "harvester paper 3 7 --out paper")
@cloup.argument("figures", nargs=-1, help="1 to 9.  Default: all.")
@output_options("Folder for fig1.csv, fig1.png and so on.")
def paper(
    figures: tuple[str, ...],
    out: str | None,
    vector: tuple[str, ...],
    report: str | None,
    as_json: bool,
) -> None:
    """Figures 1 to 9 of the Entropy 2026 paper (default: all): its theory, ours and Monte Carlo, data and plots."""
    from harvester.machine.bars import Bar
    from harvester.machine.execution import Execution
    from harvester.studies import paper as study

    numbers = list(figures or study.TITLES)
    for number in numbers:
        if number not in study.TITLES:
            raise unknown("figure", number, study.TITLES)
    file = report_file(report, out)
    with Bar("paper") as bar:
        drawn = study.draw(numbers, Execution(out=out, formats=vector, progress=bar))
    if as_json:
        echo_json({"figures": [figure.as_json() for figure in drawn]})
    elif out is None:
        echo("\n".join(map(str, drawn)))
    else:
        forms = " and ".join(f".{form}" for form in ("csv", *dict.fromkeys(vector)))
        click.echo(
            f"written: {', '.join(str(Path(out) / f'fig{n}.png') for n in numbers)}, and the {forms} of each"
        )
    save_report(file, lambda report: report.of_paper(drawn), quiet=as_json)
