"""The paper's figures: data and plots, ours on the Monte Carlo, the published theory off."""

import csv
from functools import cache

import numpy as np
import pytest

import harvester as hv
from harvester.cli import cli
from harvester.studies import paper

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """The folder of a figure, drawn when it is first asked for.

    At the ends of the figures; Figure 9, whose search is tested in tests/studies/stability, between
    them.
    """
    out = tmp_path_factory.mktemp("paper")
    grids = {name: grid[:: len(grid) - 1] for name, grid in paper.GRIDS.items()} | {
        "9": paper.GRIDS["9"][3:4]
    }

    @cache
    def draw(number):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(paper, "GRIDS", grids)
            if number == "1":  # whose bounds are of its own scale
                patch.setattr(paper, "_TRAJECTORIES", 2048)
            paper.draw([number], hv.Execution(out=out))
        return out

    return draw


def columns(drawn, number, panel):
    text = (drawn(number) / f"fig{number}.csv").read_text().splitlines()
    rows = [row for row in csv.DictReader(text) if row["panel"] == panel]
    return (
        np.array([float(row[name]) for row in rows])
        for name in paper.COLUMNS[2:]
        if name != "density"
    )


@pytest.mark.parametrize(
    "number",
    [
        *(pytest.param(one, marks=pytest.mark.thorough("test_data_and_plot")) for one in "14"),
        "7",
        "9",
    ],
)
def test_data_and_plot(drawn, number):
    out = drawn(number)
    assert (out / f"fig{number}.png").read_bytes().startswith(b"\x89PNG")
    assert (out / f"fig{number}.csv").read_text().splitlines()[0] == ",".join(paper.COLUMNS)


@pytest.mark.thorough("test_paper_scene_has_the_voltage_of_event_driven_monte_carlo")
@pytest.mark.parametrize("panel", ["p(amplitude A)", "p(displacement x)", "p(velocity x')"])
def test_densities_without_sampling(drawn, panel):
    """Figure 1: the solved density is the Monte Carlo's within its errors, and the formula is near it."""
    rows = csv.DictReader((drawn("1") / "fig1.csv").read_text().splitlines())
    of = ("published", "ensemble", "ensemble_stderr", "density")
    table = np.array([[float(row[name]) for name in of] for row in rows if row["panel"] == panel])
    published, ensemble, error, density = table[table[:, 3] > 0.02].T
    z = (density - ensemble) / error
    assert len(z) > 60
    assert np.sqrt(np.mean(z**2)) < 1.5
    assert abs(z).max() < 5.0
    assert abs(published - density).max() < 0.04 * density.max()


@pytest.mark.thorough("test_unknown_figure_is_one_line")
@pytest.mark.parametrize("panel", ["E[V^2] against D11", "E[P] against D11"])
def test_figure_4(drawn, panel):
    _, published, averaged, ensemble, error = columns(drawn, "4", panel)
    assert (abs(averaged / ensemble - 1) < 0.01 + 3 * error / ensemble).all()
    assert (published / ensemble > 3).all()


@pytest.mark.thorough("test_unknown_figure_is_one_line")
@pytest.mark.parametrize("panel", ["lambda against r", "lambda against D22"])
def test_figure_7(drawn, panel):
    _, published, averaged, ensemble, error = columns(drawn, "7", panel)
    assert (abs(averaged - ensemble) < 4 * error).all()
    assert (published < ensemble - 4 * error).all()


@pytest.mark.thorough("test_unknown_figure_is_one_line")
def test_figure_9(drawn):
    _, _, averaged, ensemble, error = columns(drawn, "9", "D22 against mu")
    assert (abs(averaged - ensemble) < 4 * error + 0.01 * ensemble).all()


@pytest.mark.thorough("test_unknown_figure_is_one_line")
@pytest.mark.parametrize("panel", ["p(amplitude A)", "p(displacement x)", "p(velocity x')"])
def test_figure_1(drawn, panel):
    """Densities: both theories near the Monte Carlo, each integrating to one."""
    x, published, averaged, ensemble, error = columns(drawn, "1", panel)
    for p in (published, averaged, ensemble):
        assert p.sum() * (x[1] - x[0]) == pytest.approx(3.0, rel=0.02)  # three curves
    assert np.sqrt(np.mean((averaged - ensemble) ** 2)) < 0.03 * ensemble.max()
    assert error.max() < 0.05 * ensemble.max()


def test_unknown_figure_is_one_line():
    from click.testing import CliRunner

    done = CliRunner().invoke(cli, ["paper", "10", "--out", "x"])
    assert "unknown figure '10'" in str(done.exception)


def test_a_figure_by_its_number():
    with pytest.raises(hv.InputError, match=r"figure.*10"):
        hv.paper(10)
    with pytest.raises(hv.InputError, match="did you mean 'figure'"):
        hv.paper(figur=3)


def test_the_page_warns_of_the_published_theory_above_all_figures():
    from harvester.report import of_paper
    from harvester.studies.paper import FigurePoint, PaperFigure

    points = tuple(
        FigurePoint("E[V^2]", "", x, published=2.0 * x, averaged=x, ensemble=x, ensemble_stderr=0.0)
        for x in (0.5, 1.0)
    )
    figure = PaperFigure("3", "Figure 3", points, 0.1)
    assert figure.published_off == 1.0
    first = of_paper([figure]).sections[0]
    assert "off by up to 100 %" in first.warnings[0]
