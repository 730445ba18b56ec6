"""The reports of measurements: parameters by `identify`, and the findings of `record` in a logger's file."""

from harvester.identification.identification_result import IdentificationResult, number_words
from harvester.machine.provenance import origin
from harvester.report.numbers import signs, with_errors
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import command_line, made_by
from harvester.studies.record import RecordAnswer


def of_identification(result: IdentificationResult, title: str) -> Page:
    """The page of an identified device."""
    about = origin()
    rows = [
        [parameter.key, *map(signs, number_words(parameter)), parameter.what]
        for parameter in result.parameters
    ]
    numbers = [[signs(f"{number:.2f}") for number in row] for row in result.correlations]
    matrix = [[name, *row] for name, row in zip(result.names, numbers, strict=True)]
    open_ = [[key, why] for key, why in result.missing]
    figures = [
        drawing(
            result.plot(None),
            "Each measurement with its fit, and the residuals over the noise.",
            "Points are measured, lines are the fit; below each, the residuals over the noise of that curve.",
        )
        for _ in result.curves()[:1]
    ]
    tables = [
        TextTable("Parameters", ["parameter", "value", "95 % interval", "meaning"], rows, (1, 2))
    ]
    tables += (
        [TextTable("Not determined", ["parameter", "a measurement that would"], open_)]
        if open_
        else []
    )
    tables.append(
        TextTable(
            "Correlations of the fitted parameters",
            ["", *result.names],
            matrix,
            range(1, len(matrix) + 1),
        )
    )
    residual = f"Residual: {100 * result.residual_rms:.2g} % rms of {result.points} points, {result.left_out} left out."
    texts = [
        residual,
        *(f"note: {remark}" for remark in result.diagnostics if remark.severity == "note"),
    ]
    warnings = [str(remark) for remark in result.diagnostics if remark.severity == "warning"]
    section = Section(
        "Findings from the measurements",
        texts=texts,
        drawings=figures,
        tables=tables,
        warnings=warnings,
    )
    lead = [f"{row[0]}: {row[1]} ({row[2]}, 95 %)" for row in rows]
    return Page(
        title or "Identification", "identify", lead, [section], command_line(about), made_by(about)
    )


def of_record(answer: RecordAnswer, title: str) -> Page:
    """The page of a record."""
    about = origin()
    record = answer.record
    rows = [[f"{b.low:.3g} to {b.high:.3g} Hz", with_errors(b.rms, "m/s^2")] for b in answer.bands]
    figure = drawing(
        answer.plot(None),
        "The record over time, its density, its spectrogram and its rms by octave.",
        "Over time; Welch's density; the spectrogram; rms by octave with the sampling error, 95 %.",
    )
    section = Section(
        "The record",
        texts=[f"{what[:1].upper()}{what[1:]}." for what in map(str, record.notes)],
        drawings=[figure],
        tables=[TextTable("Rms by octave", ["octave", "rms"], rows, (1,))],
        warnings=list(map(str, record.warnings)),
    )
    lead = [
        f"Axis {record.axis}: {len(record.values)} samples at {record.rate:.6g} Hz, rms {record.rms:.4g} m/s²"
    ]
    return Page(title, "record", lead, [section], command_line(about), made_by(about))
