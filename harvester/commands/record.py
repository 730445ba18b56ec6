"""The command `harvester record`."""

from collections.abc import Callable
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import click
import cloup

from harvester.commands.help import command
from harvester.commands.messages import echo, echo_answer, naming
from harvester.commands.options import another_file, json_option
from harvester.commands.reports import report_file, report_option, save_report
from harvester.errors import invalid, reading


def _sized(argument: str, kind: str) -> Callable[[str], float]:
    """The reader of a value such as 1kHz or 10g, for a kind by its name."""

    def read(text: str) -> float:
        from harvester.quantities import kinds

        return reading(argument, partial(kinds.with_prefix, kind=getattr(kinds, kind)), text)

    return read


def _seconds(text: str) -> float:
    """Read a time such as 30, 30s or 2min."""
    from harvester.quantities.kinds import Kind, with_prefix

    return reading(
        "`from` and `to`", partial(with_prefix, kind=Kind("a time (s)", "s", "'30 s'")), text
    )


@command(
    "harvester record logger.csv --axis z --out clean.csv --report",
    "harvester record logger.csv --axis 'Acc Z (g)' --from 30 --to 2min --longest --out clean.csv",
    "harvester record one_column.csv --rate 1kHz --unit mg --out clean.csv",
    "harvester record clean.csv --mass 10g --stroke 2mm",
)
@cloup.argument("file", help="A CSV file of a logger, with a unit behind the name of each axis.")
@cloup.option_group(
    "Selection",
    cloup.option(
        "--axis", help="x, y or z, or the whole name of a column.  Default: the only one."
    ),
    cloup.option(
        "--where", metavar="COLUMN=WORD", help="Select the rows of one sensor, such as sensor=A."
    ),
    cloup.option(
        "--from", "begin", type=_seconds, metavar="S", help="Start, in s from the first row."
    ),
    cloup.option("--to", "end", type=_seconds, metavar="S", help="End, in s from the first row."),
    cloup.option(
        "--longest",
        is_flag=True,
        help="Select the longest part without a gap that is too long to fill.",
    ),
    cloup.option(
        "--join", is_flag=True, help="Join the parts between gaps that are too long to fill."
    ),
    cloup.option(
        "--recording", type=int, metavar="N", help="Select the N-th recording of a file of several."
    ),
)
@cloup.option_group(
    "Facts that the file does not state",
    cloup.option(
        "--unit",
        metavar="UNIT",
        help="Unit of the axis: g, mg, m/s^2, or the size of one count or volt: '0.488 mg'.",
    ),
    cloup.option(
        "--time-unit",
        metavar="UNIT",
        help="Unit of the times: s, ms, us, ns or day.  Default: the only possible one.",
    ),
    cloup.option(
        "--rate",
        type=_sized("`rate`", "FREQUENCY"),
        metavar="HZ",
        help="Without a time column: the sampling rate, in Hz if it has no unit.  With one: resample "
        "to this rate (anti-aliased).",
    ),
)
@cloup.option_group(
    "Upper bound of the power of any device",
    cloup.option(
        "--mass",
        type=_sized("`mass`", "MASS"),
        metavar="KG",
        help="Mass of the device, such as 10g.",
    ),
    cloup.option(
        "--stroke",
        type=_sized("`stroke`", "GAP"),
        metavar="M",
        help="Maximum travel in each direction.",
    ),
)
@cloup.option_group(
    "Output",
    cloup.option(
        "--out", metavar="CSV", help="The clean recording, such as clean.csv, and clean.png."
    ),
    report_option,
    json_option,
)
def record(
    file: str,
    mass: float | None,
    stroke: float | None,
    out: str | None,
    report: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Clean a logger recording; report gaps, drift, clipping, power spectral density and rms per octave."""
    from harvester.machine import files
    from harvester.records.cleaning import Part, clean
    from harvester.records.record_facts import RecordFacts
    from harvester.studies.record import record_spectra

    path = None if out is None else Path(out)
    if path is not None:
        if path.suffix != ".csv":
            raise invalid("--out", "be a file that ends in .csv", out)
        files.check_parent(path)
        another_file("--out", path, file, "the record")
    page = report_file(report, None if path is None else str(path.parent))
    with naming(file):
        part = Part(**{field.name: options.pop(field.name) for field in fields(Part)})
        answer = record_spectra(clean(file, RecordFacts(**options), part), mass, stroke)
    text = "" if path is None else answer.text()
    title = f"{Path(file).name}, axis {answer.record.axis}"
    echo_answer(answer, as_json)
    if path is not None:
        files.write(path, text)
        plot = answer.plot(title)
        from harvester.presentation.plot import save  # and with it matplotlib, which has drawn it

        save(plot, path.parent, path.stem)
        if not as_json:
            click.echo(f"written: {path}, {path.with_suffix('.png').name}")
            echo(f'next: [excitation] acceleration_file = "{path.name}" in a scene file next to it')
    save_report(page, lambda report: report.of_record(answer, title), quiet=as_json)
