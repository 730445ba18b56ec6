"""The other commands: keys, paper, doctor."""

import json
from pathlib import Path

import click

from harvester.commands.help import command, option
from harvester.commands.options import OUTPUT, as_json_option, report_option, vector_option
from harvester.commands.shared import progress, report_file, save_report
from harvester.errors import unknown


@command("harvester keys", "harvester keys excitation", "harvester keys load.resistance --json")
@click.argument("what", required=False, metavar="[TABLE|KEY]", help="Such as load or load.resistance.  Default: all.")
@as_json_option
def keys(what: str | None, as_json: bool) -> None:
    """All keys of a scene file: unit, example, meaning."""
    from harvester.scene import keys as everything

    found = everything.chosen(what)
    if as_json:
        click.echo(json.dumps([vars(key) for key in found]))
        return
    click.echo(everything.text(found))


@command("harvester paper --out paper", "harvester paper 3 7 --out paper")
@click.argument("figures", nargs=-1, help="1 to 9.  Default: all.")
@option("--out", group=OUTPUT, required=True, help="Folder for fig1.csv, fig1.png and so on.")
@vector_option
@report_option
def paper(figures: tuple[str, ...], out: str, vector: tuple[str, ...], report: str | None) -> None:
    """The paper's FIGURES 1 to 9 (default: all): published theory, ours and Monte Carlo, data and plots."""
    from harvester.studies import paper as papers

    numbers = list(figures or papers.TITLES)
    for number in numbers:
        if number not in papers.TITLES:
            raise unknown("figure", number, papers.TITLES)
    page = report_file(report, out)
    with progress("paper") as bar:
        made = papers.draw(numbers, out, bar.tell, vector)
    also = " and ".join(f".{form}" for form in ("csv", *dict.fromkeys(vector)))
    click.echo(f"written: {', '.join(str(Path(out) / f'fig{n}.png') for n in numbers)}, and the {also} of each")
    save_report(page, lambda report: report.of_paper(made))


@command("harvester doctor")
def doctor() -> None:
    """What is installed, what is missing, and how to get it."""
    from harvester.commands.doctor import examine

    for line in examine():
        click.echo(line)
