"""The report of `paper`."""

import numpy as np

from harvester import figures
from harvester.machine.provenance import origin
from harvester.report.numbers import share, signs
from harvester.report.page import Page, Section, TextTable, drawing
from harvester.report.scenes import coefficients, command_line, made_by
from harvester.studies.paper import RESPONSE, STABILITY, Drawn, FigurePoint
from harvester.uncertainty.value import NORMAL_QUANTILE


def of_paper(drawn: list[Drawn]) -> Page:
    """The page of the paper's figures: each one, how far both theories are from the Monte Carlo, and all parameters."""
    about = origin()
    sections = [_section(one) for one in drawn]
    parameters = Section(
        "Parameters",
        texts=["As the paper's text prints them. What it leaves open is assumed, and stands in each figure's title."],
        tables=[coefficients("Figures 1 to 6", RESPONSE), coefficients("Figures 7 to 9", STABILITY)],
    )
    return Page(
        title="The paper's figures: its theory, ours, and Monte Carlo of the coupled equations",
        kind="paper",
        lead=[f"{one.title}: {one.seconds:.2g} s" for one in drawn],
        sections=[*sections, parameters],
        command=command_line(about),
        about=made_by(about, seed="fixed for each figure"),
    )


def _section(one: Drawn) -> Section:
    rows = []
    for panel in dict.fromkeys(p.panel for p in one.points):
        points = [p for p in one.points if p.panel == panel]
        theories = (_off(points, name) for name in ("published", "averaged"))
        rows.append([signs(panel), str(len(points)), *theories, _noise(points)])
    heads = ["panel", "points", "published off by", "averaged off by", "Monte Carlo, 95 %"]
    note = (
        "Largest differences from the Monte Carlo, and its widest 95 % half-interval, relative to the largest"
        " value of the panel."
    )
    summary = "; ".join(f"{row[0]}: published off by up to {row[2]}, averaged by {row[3]}" for row in rows)
    figure = drawing(figures.paper(one.points, None), f"{one.title}. {summary}.", one.title)
    table = TextTable("How far the theories are off", heads, rows, range(1, 5), note)
    return Section(f"Figure {one.number}", drawings=[figure], tables=[table])


def _size(points: list[FigurePoint]) -> float:
    return float(np.max(np.abs([p.ensemble for p in points]))) or 1.0


def _off(points: list[FigurePoint], name: str) -> str:
    far = np.max(np.abs([getattr(p, name) - p.ensemble for p in points]))
    return share(float(far), _size(points))


def _noise(points: list[FigurePoint]) -> str:
    return share(NORMAL_QUANTILE * max(p.ensemble_stderr for p in points), _size(points))
