"""The report of `identify`: the parameters with their intervals, the fit, the residuals and the correlations."""

from harvester.identification.identification_result import IdentificationResult, number_words
from harvester.machine.provenance import origin
from harvester.report.numbers import signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import command_line, made_by


def of_identification(result: IdentificationResult, title: str) -> Page:
    """The page of an identified device."""
    about = origin()
    rows = [[parameter.key, *map(signs, number_words(parameter)), parameter.what] for parameter in result.parameters]
    matrix = [
        [name, *(signs(f"{v:.2f}") for v in row)] for name, row in zip(result.names, result.correlations, strict=True)
    ]
    open_ = [[key, why] for key, why in result.missing]
    figure = drawing(
        result.plot(None),
        "Each measurement with its fit, and the residuals over the noise.",
        "Points are measured, lines are the fit; below each, the residuals over the noise of that curve.",
    )
    tables = [TextTable("Parameters", ["parameter", "value", "95 % interval", "what it is"], rows, (1, 2))]
    tables += [TextTable("Not determined", ["parameter", "what would determine it"], open_)] if open_ else []
    tables.append(TextTable("Correlations of what was fitted", ["", *result.names], matrix, range(1, len(matrix) + 1)))
    residual = f"Residual: {100 * result.residual_rms:.2g} % rms of {result.points} points, {result.left_out} left out."
    texts = [residual, *(f"note: {remark}" for remark in result.diagnostics if remark.severity == "note")]
    warnings = [str(remark) for remark in result.diagnostics if remark.severity == "warning"]
    section = Section("What the measurements say", texts=texts, drawings=[figure], tables=tables, warnings=warnings)
    lead = [f"{row[0]}: {row[1]} ({row[2]}, 95 %)" for row in rows]
    return Page(title or "Identification", "identify", lead, [section], command_line(about), made_by(about))
