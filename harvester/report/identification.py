"""The report of `identify`: the parameters with their intervals, the fit, the residuals and the correlations."""

from harvester.identification.identification_result import IdentificationResult, number_words
from harvester.machine.provenance import origin
from harvester.report.numbers import signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import command_line, made_by


def of_identification(found: IdentificationResult, title: str) -> Page:
    """The page of an identified device."""
    about = origin()
    rows = [[one.key, *map(signs, number_words(one)), one.what] for one in found.parameters]
    matrix = [
        [name, *(signs(f"{v:.2f}") for v in row)] for name, row in zip(found.names, found.correlations, strict=True)
    ]
    open_ = [[key, why] for key, why in found.missing]
    figure = drawing(
        found.plot(None),
        "Each measurement with its fit, and the residuals over the noise.",
        "Points are measured, lines are the fit; below each, the residuals over the noise of that curve.",
    )
    tables = [TextTable("Parameters", ["parameter", "value", "95 % interval", "what it is"], rows, (1, 2))]
    tables += [TextTable("Not determined", ["parameter", "what would determine it"], open_)] if open_ else []
    tables.append(TextTable("Correlations of what was fitted", ["", *found.names], matrix, range(1, len(matrix) + 1)))
    residual = f"Residual: {100 * found.residual_rms:.2g} % rms of {found.points} points, {found.left_out} left out."
    texts = [residual, *(f"note: {one}" for one in found.diagnostics if one.severity == "note")]
    doubts = [str(one) for one in found.diagnostics if one.severity == "warning"]
    section = Section("What the measurements say", texts=texts, drawings=[figure], tables=tables, warnings=doubts)
    lead = [f"{row[0]}: {row[1]} ({row[2]}, 95 %)" for row in rows]
    return Page(title or "Identification", "identify", lead, [section], command_line(about), made_by(about))
