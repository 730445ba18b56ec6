"""The report of `record`: what was found in a logger's file, what was mended, and its spectra."""

from harvester.machine.provenance import origin
from harvester.report.numbers import with_errors
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import command_line, made_by
from harvester.studies.record import RecordAnswer


def of_record(answer: RecordAnswer, title: str) -> Page:
    """The page of a record."""
    about, record = origin(), answer.record
    rows = [[f"{b.low:.3g} to {b.high:.3g} Hz", with_errors(b.rms, "m/s^2")] for b in answer.bands]
    figure = drawing(
        answer.plot(None),
        "The record over time, its density, its spectrogram and its rms by octave.",
        "Over time; Welch's density; the spectrogram; rms by octave with the error of sampling, 95 %.",
    )
    section = Section(
        "The record",
        texts=[f"{what[:1].upper()}{what[1:]}." for what in map(str, record.notes)],
        drawings=[figure],
        tables=[TextTable("Rms by octave", ["octave", "rms"], rows, (1,))],
        warnings=list(map(str, record.warnings)),
    )
    lead = [f"Axis {record.axis}: {len(record.values)} samples at {record.rate:.6g} Hz, rms {record.rms:.4g} m/s²"]
    return Page(title, "record", lead, [section], command_line(about), made_by(about))
