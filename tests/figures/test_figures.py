"""The figures: one look, units on every axis, odd data, vector files that come out the same twice."""

import ast
import dataclasses
import math
import re
import warnings

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.text import Text

import harvester as hv
from harvester import figures
from harvester.answers.estimate import Estimate
from harvester.errors import InputError
from harvester.figures import quantities, style
from harvester.presentation.drawing import drawing_of
from harvester.presentation.engine_look import LOOKS
from harvester.presentation.plot import image, save, styled
from harvester.studies.frequency_response.curve import FrequencyResponse
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.motion import Motion
from harvester.studies.optimum.optimum_result import Optimum
from harvester.studies.optimum.under_limits import RobustOptimum
from harvester.studies.paper import FigurePoint, PaperFigure
from harvester.studies.stability.exponent import Stability
from harvester.studies.stability.region import Edge
from harvester.studies.stationary_densities import Densities
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.studies.work_precision.cost_table import Cost, CostRow
from harvester.uncertainty.value import Value
from tests.support.paths import ROOT

R, MU = "load.resistance", "nondimensional.mu"


def row(power, engine="averaged", varied=None, **errors):
    """A row of a sweep; a power of None is a point that failed."""
    if power is None:
        return SweepRow(engine, error="it failed", varied=varied)
    return SweepRow(engine, Value(1.0), Value(power, **errors), 1.0, varied=varied)


def table(axes, rows, listed=False, physical=True):
    about = {"scene": {"title": "A title"} | ({} if physical else {"nondimensional": {}})}
    return SweepTable(
        tuple(Axis(key, tuple(values)) for key, values in axes.items()),
        tuple(rows),
        (),
        listed,
        about,
    )


def line(powers, engine="averaged", key=R, values=None, **errors):
    values = np.geomspace(1e3, 1e7, len(powers)) if values is None else values
    return [row(p, engine, {key: float(x)}, **errors) for x, p in zip(values, powers, strict=True)]


def drawn(figure):
    """All texts of a figure that is drawn; no warning (glyphs, layout, empty data) is let pass."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.draw_without_rendering()
    return [text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text"))]


def shown(axis):
    return [text for text in axis.get_ticklabels() if text.get_visible()]


def labels(figure):
    """The limits of all axes that have numbers of their own."""
    drawn(figure)
    told = [(a.get_xlabel(), a.xaxis) for a in figure.axes] + [
        (a.get_ylabel(), a.yaxis) for a in figure.axes
    ]
    return [
        label for label, axis in told if any(re.match(r"\W?\d", t.get_text()) for t in shown(axis))
    ]


def motion(physical):
    t = np.linspace(0.0, 10.0, 2000)
    x = 1e-4 * np.abs(np.sin(7 * t))
    return Motion(
        t,
        x,
        np.gradient(x, t),
        3 * x,
        x,
        np.array([[9.0, 1.0]]),
        (0.0,),
        3.0,
        0.01,
        physical,
        "ensemble",
    )


def response(physical):
    points = [
        ResponsePoint(
            direction,
            f,
            Value(1e-4 * f, None, 1e-6),
            Value(1e-6 / (0.1 + (f - 5) ** 2), 1e-8, 0.0),
            None,
        )
        for direction in ("up", "down")
        for f in (3.0, 4.0, 5.0, 6.0)
    ]
    return FrequencyResponse(tuple(points), physical)


def paper_figure(panel):
    points = [
        FigurePoint(panel, curve, x, 2e-4, 1e-4, 1e-4, 1e-6)
        for curve in ("r = 1", "r = 2")
        for x in (0.1, 1.0)
    ]
    return PaperFigure(1, "A figure", tuple(points), 1.0)


EDGES = (Edge(0.1, 0.2, 0.1, 0.1, 0.01), Edge(1.0, np.inf, 0.2, 0.2, np.inf))
STABILITY = Stability(False, 0.1, 0.1, None, Value(0.1), None)


@pytest.mark.slow
@pytest.mark.parametrize(
    "figure",
    [
        lambda: table({R: np.geomspace(1e3, 1e7, 5)}, line([1e-6, 2e-6, 9e-6, 2e-6, 1e-7])).plot(),
        lambda: table(
            {MU: (1.0, 2.0)}, line([1e-4, 2e-4], key=MU, values=(1.0, 2.0)), physical=False
        ).plot(),
        lambda: motion(True).plot(),
        lambda: motion(False).plot(),
        lambda: response(True).plot(),
        lambda: response(False).plot(),
        lambda: paper_figure("E[V^2] against mu").plot("Figure"),
        lambda: paper_figure("p(displacement x)").plot("Figure"),
        lambda: dataclasses.replace(STABILITY, region=EDGES).plot("A title"),
        lambda: hv.Averaged().run(hv.load("examples/plate_with_stop.toml")).plot(),
        lambda: hv.Averaged().run(hv.load("examples/paper_figure3.toml")).plot(),
    ],
    ids=range(11),
)
def test_every_axis_has_a_quantity_and_a_unit(figure):
    found = labels(figure())
    assert found
    for label in found:
        if label not in ("power over\nthat of ensemble",):
            assert label.endswith(")") and "(" in label, label


def test_power_is_read_in_microwatt_and_the_load_in_kiloohm():
    figure = table({R: np.geomspace(1e3, 1e7, 5)}, line([1e-6, 2e-6, 9e-6, 2e-6, 1e-7])).plot()
    texts = drawn(figure)
    assert {"mean power (µW)", "load resistance (Ω)", "1 k", "100 k", "10 M"} <= set(texts)
    assert "Mean power against load resistance\nA title" in texts
    assert not any("$" in text or "1e" in text for text in texts)


@pytest.mark.parametrize(
    ("name", "unit", "values", "factor", "label"),
    [
        ("mean power", "W", [3.1e-6, 1e-9], 1e-6, "mean power (µW)"),
        ("mean power", "W", [0.0, 0.0], 1.0, "mean power (W)"),
        ("mean power", "", [2.2e-4], 1e-4, "mean power (10⁻⁴, nondimensional)"),
        ("mean power", "", [0.2, np.nan], 1.0, "mean power (nondimensional)"),
        ("density", "(m/s^2)^2/Hz", [2e-5], 1e-5, "density (10⁻⁵ (m/s²)²/Hz)"),
        ("resistance", "ohm", [2e6], 1e6, "resistance (MΩ)"),
    ],
)
def test_scale(name, unit, values, factor, label):
    found = quantities.scale(name, unit, values)
    assert found.factor == pytest.approx(factor, rel=1e-12)
    assert found.label == label


ODD = {
    "one point": line([1e-6]) + line([2e-6], "published"),
    "errors missing": line([1e-6, 2e-6], "ensemble"),
    "no power": line([0.0, 0.0], "ensemble", stderr=0.0) + line([0.0, 0.0]),
    "a failed point in between": line([1e-6, None, 3e-6, None], "ensemble", stderr=1e-8),
    "of one engine all failed": line([1e-6, 2e-6]) + line([None, None], "spice"),
    "powers that rounding left": line([1e-32, 1e-4, 2e-4], "ensemble"),
    "1000 points": line(list(np.linspace(1e-6, 2e-6, 1000)), "ensemble", stderr=1e-8),
    "an engine unknown to the styles": line([1e-6, 2e-6], "another"),
}


@pytest.mark.thorough("test_every_axis_has_a_quantity_and_a_unit")
@pytest.mark.slow
@pytest.mark.parametrize("name", ODD)
def test_odd_sweeps(name):
    values = sorted({float(one.varied[R]) for one in ODD[name]})
    figure = table({R: values}, ODD[name]).plot()
    drawn(figure)
    assert image(figure, "png").startswith(b"\x89PNG")


def test_points_stand_at_their_resistances():
    """In the unit of the axis."""
    values = [1e6, 2e6, 4e6]
    figure = table({R: values}, line([1e-6, 2e-6, 3e-6], values=values)).plot()
    (axes,) = figure.axes
    assert "MΩ" in axes.get_xlabel()
    assert axes.lines[0].get_xdata() == pytest.approx([1.0, 2.0, 4.0])


def test_a_point_alone_is_a_marker_and_a_failed_one_a_cross():
    powers = [1e-6, None, 3e-6, None]
    figure = table({R: np.geomspace(1e3, 1e7, 4)}, line(powers, "ensemble")).plot()
    marks = {
        str(one.get_marker()): one
        for one in figure.axes[0].lines
        if str(one.get_marker()) not in ("None", "")
    }
    assert len(marks["x"].get_xdata()) == 2
    assert len(marks["s"].get_xdata()) == 2  # the line has nothing to join
    assert any("2 of 4 rows failed" in text for text in drawn(figure))


def test_error_bars_are_of_95_percent():
    figure = table(
        {R: (1.0, 2.0)}, line([1e-6, 2e-6], "ensemble", values=(1.0, 2.0), stderr=1e-7)
    ).plot()
    bars = next(c for c in figure.axes[0].collections if len(c.get_segments()) == 2)
    low, high = bars.get_segments()[0][:, 1]
    assert high - low == pytest.approx(2 * 1.96 * 0.1)
    assert any("95 %" in text for text in drawn(figure))


def test_several_values_of_another_key_differ_in_marker_and_the_rest_is_told():
    rows = [
        row(1e-6 * (k + 1), varied={R: x, "stop.restitution": r})
        for k, r in enumerate(np.linspace(0.1, 0.9, 8))
        for x in np.geomspace(1e3, 1e5, 9)
    ]
    axes = {
        R: tuple(np.geomspace(1e3, 1e5, 9)),
        "stop.restitution": tuple(np.linspace(0.1, 0.9, 8)),
    }
    figure = table(axes, rows).plot()
    assert len({str(one.get_marker()) for one in figure.axes[0].lines}) == 6
    assert any("The first 6 of 8" in text for text in drawn(figure))


def test_a_list_of_points_is_no_line():
    rows = [
        row(1e-6, varied={R: 1e3, "stop.restitution": 0.5}),
        row(2e-6, varied={R: 1e5, "stop.restitution": 0.9}),
    ]
    figure = table({R: (1e3, 1e5), "stop.restitution": (0.5, 0.9)}, rows, listed=True).plot()
    assert figure.axes[0].lines[0].get_linestyle() == "None"


def test_titles_and_keys_are_text():
    """A dollar sign is not a formula, a letter that the font lacks no warning, a long title no overflow."""
    title = "$x^2$ costs \\$5 & \\frac{1} " + "漢" + " and goes on" * 30
    rows = line([1e-6, 2e-6], key="load.parameters.R_$1$", values=(1.0, 2.0))
    figure = table({"load.parameters.R_$1$": (1.0, 2.0)}, rows).plot(title)
    texts = drawn(figure)
    assert any("$x^2$" in text for text in texts)
    own = [text for text in figure.findobj(Text) if "$" in text.get_text()]
    assert not any(text.get_parse_math() for text in own)
    heading = figure.get_suptitle()
    assert heading.count("\n") == 2
    box = next(text for text in figure.texts if text.get_text() == heading).get_window_extent()
    assert box.x0 >= 0.0 and box.x1 <= figure.bbox.width


@pytest.mark.slow
def test_the_legend_covers_no_axes():
    rows = line([1e-6, 2e-6], "ensemble") + line([1e-6, 2e-6]) + line([3e-6, 4e-6], "published")
    figure = table({R: (1e3, 1e7)}, rows).plot()
    drawn(figure)
    box = figure.legends[0].get_window_extent()
    assert all(box.y1 <= axes.get_tightbbox().y0 for axes in figure.axes)


def test_engines_are_told_apart_without_colour():
    styles = {name: one.style() for name, one in LOOKS.items()}
    looks = [
        (str(s.get("linestyle")), s.get("linewidth", 1.4), s.get("marker", ""))
        for s in styles.values()
    ]
    assert len(set(looks)) == len(looks)
    assert len({one.marker for one in LOOKS.values()}) == len(LOOKS)
    assert {name: s["color"] for name, s in styles.items()} == {
        "exact": "#000000",
        "published": "#D55E00",
        "averaged": "#009E73",
        "density": "#661100",
        "ensemble": "#666666",
        "ideal": "#CC79A7",
        "compiled": "#E69F00",
        "slow": "#8C6D31",
        "spice": "#0072B2",
        "spice alone": "#56B4E9",
    }
    assert to_rgb(style.paler("#000000", 0.5)) == pytest.approx((0.5, 0.5, 0.5))


@pytest.mark.thorough("test_save")
@pytest.mark.slow
@pytest.mark.parametrize("form", ["png", "svg", "pdf"])
def test_the_same_figure_is_the_same_file(form):
    first, second = (image(motion(True).plot("A title"), form) for _ in range(2))
    assert first == second
    assert first.lstrip().startswith({"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[form])


@pytest.mark.slow
def test_many_points_are_pixels_in_a_vector_file():
    long = np.linspace(0.0, 10.0, 20_000)
    path = dataclasses.replace(
        motion(True),
        time=long,
        displacement=np.sin(long),
        velocity=np.cos(long),
        voltage=long,
        acceleration=None,
    )
    svg = image(path.plot(), "svg")
    assert b"data:image/png" in svg
    assert len(svg) < 1_000_000


@pytest.mark.slow
def test_save(tmp_path):
    save(motion(True).plot(), tmp_path, "motion", ("svg", "pdf", "svg"))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["motion.pdf", "motion.png", "motion.svg"]


def test_another_form_is_refused_before_anything_is_computed(tmp_path):
    with pytest.raises(InputError, match="`formats` must be svg or pdf, but is 'eps'"):
        hv.sweep(
            "examples/plate.toml",
            vary={R: "1k"},
            execution=hv.Execution(out=tmp_path, formats=["eps"]),
        )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_figure_keeps_its_look_and_shows_itself(tmp_path):
    assert motion(True).plot()._repr_png_().startswith(b"\x89PNG")
    motion(True).plot().savefig(tmp_path / "mine.svg")
    assert (tmp_path / "mine.svg").read_bytes() == image(motion(True).plot(), "svg")


@pytest.mark.slow
def test_cost_without_a_known_error():
    for known in ({}, {"total_error": 0.1, "best": True}):
        rows = (CostRow("ensemble", seconds=1.0, **known),)
        drawn(Cost(rows, "ensemble", Value(1.0), {}).plot("A title"))


def test_an_error_that_is_not_known_is_no_bar():
    answer = Estimate("published", True, Value(0.0), Value(1.0), {}, (), 0.1, 0)
    figure = answer.plot()
    assert drawn(figure).count("none, or not known") == 3
    assert not figure.axes[0].patches


@pytest.mark.slow
def test_every_result_that_plots_finds_its_drawing():
    """By the name of its class, or of one that it derives from; and no drawing is without a result."""
    classes = [
        one
        for file in sorted((ROOT / "harvester").rglob("*.py"))
        for one in ast.parse(file.read_text()).body
        if isinstance(one, ast.ClassDef)
    ]
    drawn_by_name = {
        one.name
        for one in classes
        for line in one.body
        if isinstance(line, ast.FunctionDef) and "drawing.draw(self" in ast.unparse(line)
    }
    assert drawn_by_name == set(figures.DRAWINGS)
    assert set(figures.DRAWINGS.values()) == set(figures.__all__) - {"new"}
    assert drawing_of(RobustOptimum) is drawing_of(Optimum) is figures.optimum


def test_paper_markers_stand_for_curves():
    figure = paper_figure("lambda against mu").plot("Figure 8")
    assert {"r = 1", "r = 2", "published averaging"} <= set(drawn(figure))
    handles = {handle.get_label(): handle for handle in figure.legends[0].legend_handles}
    assert handles["r = 1"].get_marker() != handles["r = 2"].get_marker()


@pytest.mark.slow
def test_an_optimum_of_one_evaluation():
    """The budget ended after the first evaluation: the axis is the range that was to be searched, not of zero width."""
    best = hv.optimise(
        "examples/plate_with_stop.toml", vary={R: ("10k", "10M")}, engine="averaged", within="5%"
    )
    place = next(p for p in best.points if p.u == pytest.approx(best.points[0].u))
    key = dataclasses.replace(
        best.keys[0], value=best.keys[0].range.value(float(place.u[0])), low95=None, high95=None
    )
    figure = dataclasses.replace(best, keys=(key,), points=(place,)).plot()
    image(figure, "png")  # a layout that collapses is a warning, and so an error here
    assert np.divide(*figure.axes[0].get_xlim()) == pytest.approx(1e-3)


@pytest.mark.parametrize("place", [0.31622776601683783, -2.0])
def test_an_axis_of_one_place_has_a_width(place):
    """Found where AVX-512 rounds a logarithm by one unit: the layout divided by the width of nothing."""
    with styled():
        figure, here = style.new(1, 1, (4.0, 3.0))
        here.plot([place, place], [1.0, 2.0])
        here.set_xlim(place, np.nextafter(place, 9.0))
    assert image(figure, "png").startswith(b"\x89PNG")
    low, high = here.get_xlim()
    assert low < place < high


def test_a_density_is_drawn_from_its_foot_over_its_peak():
    """Its largest value and its width are on the picture; the rest of the axis, next to nothing, is not."""
    path = motion(True)
    at = np.linspace(-1e-3, 1e-3, 401)
    bell = np.exp(-0.5 * (at / 1e-4) ** 2) / (1e-4 * math.sqrt(2.0 * math.pi))
    known = Value(1e-4, bias=1e-6)
    plane = np.outer(bell[::4], bell[::4])
    result = Densities(
        engine="density",
        displacement_mean=known,
        displacement_rms=known,
        velocity_rms=known,
        voltage_rms=known,
        impact_rate=None,
        hop_rate=None,
        level=None,
        first_passage_time=None,
        displacement=at,
        displacement_density=bell,
        velocity=at,
        velocity_density=bell,
        voltage=at,
        voltage_density=bell,
        phase_plane=plane,
        impact_speed=None,
        impact_density=None,
        largest_error=1e-3,
        path=path,
        seconds=0.1,
        physical=True,
    )
    for panel in result.plot().axes[:2]:
        (line,) = panel.lines
        x, y = line.get_data()
        assert np.trapezoid(y, x) == pytest.approx(1.0, rel=1e-3)
        assert y.min() < 1e-3 * y.max() and len(x) < 0.6 * len(at)
