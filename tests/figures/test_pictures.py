"""What a picture must let a reader see: stated errors, curves distinguished, one curve once, no gaps of the reading."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv, to_rgb
from matplotlib.figure import Figure

import harvester as hv
from harvester import figures
from harvester.figures import quantities
from harvester.figures.labels import Label, write_labels
from harvester.figures.motions import bins, time_spent
from harvester.figures.smoothing import smooth
from harvester.figures.sweep_curves import style
from harvester.studies.compare import Comparison, PathComparison
from harvester.studies.frequency_response.curve import FrequencyResponse
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.motion import Motion
from harvester.studies.optimum.ranges import Range
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable
from harvester.uncertainty.value import Value

R, STOP = "load.resistance", "stop.restitution"
PLATE = "examples/plate_with_stop.toml"


def row(engine, power, stderr=None, bias=None, **varied):
    return SweepRow(engine, mean_power=Value(power, stderr=stderr, bias=bias), varied=varied)


def table(axes, rows):
    return SweepTable(tuple(Axis(*axis) for axis in axes), tuple(rows), (), False, {"scene": {}})


def texts(figure):
    figure.draw_without_rendering()
    return [text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text"))]


def grid(
    restitutions=(0.8, 0.9, 0.96), loads=(1e4, 1e5, 1e6, 1e7), engines=("averaged", "published")
):
    """Rows with the restitution coefficient varied first, as the flags were given."""
    axes = ((STOP, restitutions), (R, loads))
    return table(
        axes,
        [row(e, x * r, **{STOP: r, R: x}) for r in restitutions for x in loads for e in engines],
    )


def height(band):
    """The lowest and highest place of a filled band."""
    places = np.concatenate([path.vertices[:, 1] for path in band.get_paths()])
    return places.min(), places.max()


def test_the_ratio_has_the_error_that_averaged_states():
    """A ratio of 1.01 with 5 % stated looked four standard errors off where only those of the ensemble were drawn."""
    rows = [one for x in (1e3, 1e6) for one in (row("averaged", 1.01, bias=0.05, **{R: x}),)]
    rows += [row("ensemble", 1.0, 0.002, 0.001, **{R: x}) for x in (1e3, 1e6)]
    low = table(((R, (1e3, 1e6)),), rows).plot().axes[1]
    bands = [height(band) for band in low.collections if band.get_alpha() == 0.2]
    assert bands == [pytest.approx((0.96, 1.06))]
    bars = [one.get_segments()[0][:, 1] for one in low.collections if one.get_alpha() is None]
    # sampling and step of the ensemble
    assert np.ptp(bars[0]) / 2.0 == pytest.approx(1.01 * (1.96 * 0.002 + 0.001))


def test_averaged_as_the_reference_has_its_error_around_one():
    rows = [
        one
        for x in (1e3, 1e6)
        for one in (row("averaged", 2.0, bias=0.1, **{R: x}), row("published", 3.0, **{R: x}))
    ]
    low = table(((R, (1e3, 1e6)),), rows).plot().axes[1]
    assert [height(band) for band in low.collections if band.get_alpha() == 0.2] == [
        pytest.approx((0.95, 1.05))
    ]


@pytest.mark.slow
def test_the_longest_key_is_the_axis_whatever_the_order():
    told = texts(grid().plot())
    assert "load resistance (Ω)" in told
    assert {"restitution coefficient r 0.8", "restitution coefficient r 0.96"} <= set(told)


def test_values_of_another_key_differ_in_colour_and_engines_in_their_line():
    figure = grid().plot()
    curves = [line for line in figure.axes[0].lines if len(line.get_xdata()) == 4]
    colours = {}
    for line in curves:
        colours.setdefault(line.get_marker(), set()).add(to_rgb(line.get_color()))
    assert len(curves) == 6 and len(colours) == 3
    one_each = [colour for (colour,) in colours.values()]  # both engines in the colour of the value
    hues = sorted(rgb_to_hsv(colour)[0] for colour in one_each)
    assert np.diff(hues).min() > 0.05
    assert len({str(line.get_linestyle()) for line in curves}) == 2
    grey = [np.dot(colour, (0.299, 0.587, 0.114)) for colour in one_each]
    assert np.diff(grey).min() > 0.1  # a grey print tells them apart, too


def test_numbers_in_a_legend_have_one_style():
    figure = grid(tuple(np.linspace(0.5, 0.9, 9)), (1e4, 23710.0, 133400.0, 749900.0)).plot()
    loads = {text for text in texts(figure) if text.startswith("load resistance")}
    assert loads == {f"load resistance {value} kΩ" for value in ("10", "23.71", "133.4", "749.9")}


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (23710.0, "ohm", "23.71 kΩ"),
        (0.96, "", "0.96"),
        (23710.0, "", "23710"),
        (5e-5, "(m/s^2)^2/Hz", "5·10⁻⁵ (m/s²)²/Hz"),
    ],
)
def test_amount(value, unit, text):
    assert quantities.amount(value, unit) == text


def responses(down, error=1e-9):
    points = []
    for direction, factor in (("up", 1.0), ("down", down)):
        for f in (3.0, 4.0, 5.0, 6.0, 7.0):
            power = factor * 1e-6 / (0.1 + (f - 5.0) ** 2)
            points.append(
                ResponsePoint(direction, f, Value(power), Value(power, None, error), None)
            )
    return FrequencyResponse(tuple(points), True)


@pytest.mark.slow
def test_up_and_down_alike_are_one_curve():
    figure = responses(1.0).plot()
    named = {handle.get_label() for handle in figure.legends[0].legend_handles}
    assert named == {"up and down the frequencies, alike", "half-power bandwidth"}
    assert any(
        "0.01 % of the largest power: too small to be seen" in text.replace("\n", " ")
        for text in texts(figure)
    )
    apart = responses(0.5, 1e-6).plot()
    assert len(apart.legends[0].legend_handles) == 3  # up, down, and both bandwidths in one entry
    assert any("Bars: 95 % sampling and step." in text for text in texts(apart))


def harmonic(size=1.1e-3, rest=0.0):
    """A harmonic path about ``rest`` read ten times per period: every reading at one of ten phases."""
    t = np.arange(4000) * 0.1
    x = size * np.sin(2 * np.pi * t)
    v = 2 * np.pi * size * np.cos(2 * np.pi * t)
    return Motion(t, rest + x, v, 1e3 * x, None, np.empty((0, 2)), (), 20.0, 0.1, True, "ensemble")


def test_the_density_of_a_harmonic_path_has_no_gaps():
    figure = harmonic().plot()
    density = next(
        axes for axes in figure.axes if axes.get_xlabel() == "displacement (mm)" and axes.patches
    )
    heights = density.patches[0].get_data().values
    assert heights.min() > 0.0
    edges = np.linspace(-1.0, 1.0, 81)
    fine = time_spent(np.sin(np.linspace(0.0, 2 * np.pi, 20001)), edges)
    middles = 0.5 * (edges[1:] + edges[:-1])
    # arcsine law
    assert fine[10:70] == pytest.approx(
        1.0 / (np.pi * np.sqrt(1.0 - middles[10:70] ** 2)), rel=1e-3
    )
    assert np.sum(fine * np.diff(edges)) == pytest.approx(1.0)
    # at rest
    assert np.sum(
        time_spent(np.array([0.5, 0.5]), np.array([0.0, 0.4, 0.8])) * 0.4
    ) == pytest.approx(1.0)


def test_the_phase_plane_of_a_harmonic_path_has_no_spokes():
    figure = harmonic().plot()
    plane = next(axes for axes in figure.axes if axes.get_ylabel() == "velocity (mm/s)")
    dots = next(line for line in plane.lines if line.get_marker() == ".")
    phases = np.unique(np.round(np.arctan2(2 * np.pi * dots.get_xdata(), dots.get_ydata()), 3))
    assert len(phases) > 1000  # of readings there are ten


@pytest.mark.slow
def test_ticks_have_room():
    """Two digits' width (15 pixels of 100 an inch) between the numbers of an axis, also of a path far from zero."""
    for path in (harmonic(), harmonic(4.2e-4, 0.5)):
        figure = path.plot()
        figure.draw_without_rendering()
        for axes in figure.axes:
            boxes = [text.get_window_extent() for text in axes.get_xticklabels() if text.get_text()]
            ends = sorted((box.x0, box.x1) for box in boxes)
            assert all(one[1] + 15.0 < other[0] for one, other in itertools.pairwise(ends))


def test_paths_of_a_physical_scene_are_in_volt_and_seconds():
    t = np.linspace(0.0, 5.0, 200)
    answer = hv.Averaged().run(PLATE)
    of = PathComparison("with the stop", t, t, np.sin(t), np.sin(t), 2 * np.sin(t), physical=True)
    told = texts(Comparison((answer,), {}, (of,)).plot(None))
    assert "voltage\n(V)" in told and "time (s)" in told
    assert not any("nondimensional" in text for text in told)


def test_the_map_of_an_optimum_is_smooth_and_whole():
    """A quadratic hill over the logarithm of a load and a restitution coefficient, at 200 places."""

    def hill(u):
        return 8.0 - 6.0 * (u[..., 0] - 0.5) ** 2 + 2.0 * u[..., 1]

    ranges = [Range(R, 1e4, 1e7), Range(STOP, 0.5, 0.9)]
    keys = [
        SimpleNamespace(range=one, value=one.value(0.5), low95=None, high95=None) for one in ranges
    ]
    places = np.random.default_rng(2).random((200, 2))
    points = [
        SimpleNamespace(is_sound=True, u=u, power=Value(1e-6 * hill(u), model=1e-8)) for u in places
    ]
    answer = SimpleNamespace(
        engine="averaged",
        keys=keys,
        own_points=points,
        estimate=hv.Averaged().run(PLATE),
        scanned=True,
    )
    here = figures.optimum(answer, None).axes[0]
    mesh = next(one for one in here.collections if np.ndim(one.get_array()) == 2)
    power = np.ma.filled(mesh.get_array(), np.nan)
    side = np.linspace(0.0, 1.0, len(power))
    true = hill(np.stack(np.meshgrid(side, side), axis=-1))
    values = hill(places)
    # corners included
    assert power == pytest.approx(np.clip(true, values.min(), values.max()), abs=0.15)
    assert np.abs(np.diff(power[20:100, 20:100], 2, axis=1)).max() < 0.005  # no facets


def test_the_guide_leads_through_noise():
    rng = np.random.default_rng(1)
    u = rng.random((60, 1))
    noisy = np.sin(3 * u[:, 0]) + 0.05 * rng.standard_normal(60)
    at = np.linspace(0.1, 0.9, 50)[:, None]
    found = smooth(u, noisy, np.full(60, 0.05), at)
    assert found == pytest.approx(np.sin(3 * at[:, 0]), abs=0.06)
    assert np.isnan(smooth(0.1 * u, noisy, np.full(60, 0.05), np.array([[0.9]])))[0]  # nothing near
    exact = smooth(u, np.sin(3 * u[:, 0]), np.zeros(60), at)
    assert exact == pytest.approx(np.sin(3 * at[:, 0]), abs=2e-3)


def test_a_path_from_rest_has_no_density_and_its_base_no_white_noise():
    """A beginning has not settled; the white noise of the base has no value at a time."""
    scene = hv.Scene(
        nondimensional=hv.Nondimensional(
            c1=-0.2, beta=0.1, mu=1.0, D11=0.1, drive=1.0, drive_frequency=1
        )
    )
    labels = []
    for from_rest in (True, False):
        axes = hv.motion(scene, duration=60.0, from_rest=from_rest).plot().axes
        lines = [
            line
            for one in axes
            for line in one.get_ylabel().splitlines()
            if "its white noise" in one.get_ylabel()
        ]
        assert max(map(len, lines)) <= 20  # no taller than its panel
        labels.append([one.get_ylabel().replace("\n", " ") for one in axes])
        assert any("but its white noise" in label for label in labels[-1])
    assert [any("density" in label for label in some) for some in labels] == [False, True]


def test_a_line_of_few_points_has_markers():
    """Chords between the points of a sweep are not results; a curve of many points is a line alone."""
    keys = {"along": SimpleNamespace(), "listed": False, "axes": ()}
    few, many = (style("exact", SimpleNamespace(**keys), 0, 1, points) for points in (13, 200))
    assert few["marker"]
    assert not many.get("marker")


@pytest.mark.parametrize("value", [0.0, 3.3, -2e-7])
def test_a_density_of_what_stands_still(value):
    """But for rounding: bins of a width, and all of the time in them."""
    values = value + np.array([0.0, 4e-16, -4e-16, 0.0]) * abs(value)
    edges = bins(values)
    shares = time_spent(values, edges)
    assert (np.diff(edges) > 0.0).all()
    assert (shares * np.diff(edges)).sum() == pytest.approx(1.0)


def test_a_power_of_zero_is_written():
    """An open circuit draws none, without an error: its digits had the logarithm of 0."""
    answer = hv.Exact().run(hv.loads("[nondimensional]\nc1 = -0.05\nbeta = 0.05\nD11 = 0.01\n"))
    assert "0: the parts of its error" in texts(answer.plot())
    assert "0" in texts(Comparison((answer,), {}, ()).plot("An open circuit"))


@pytest.mark.parametrize(
    ("low", "high", "digits"), [(2.0, 7.0, "234567"), (1.0, 40.0, "125"), (1.0, 2000.0, "1")]
)
def test_labels_of_a_logarithmic_axis(low, high, digits):
    """All digits in a part of a decade, 1, 2 and 5 up to two decades, then the decades alone: none, or overlaps."""
    figure = Figure()
    axes = figure.subplots()
    axes.set_xlim(low, high)
    quantities.logarithm(axes.xaxis)
    figure.draw_without_rendering()
    texts_by_tick = [
        (tick, text.get_text())
        for minor in (False, True)
        for tick, text in zip(
            axes.get_xticks(minor=minor), axes.get_xticklabels(minor=minor), strict=True
        )
    ]
    shown = {f"{tick:e}"[0] for tick, text in texts_by_tick if text and low <= tick <= high}
    assert shown == set(digits)


@pytest.mark.parametrize("edge", ["left", "right", "bottom", "top"])
def test_a_label_stays_inside_the_axes(edge):
    """Also of a mark next to an edge: the place on its other side is free."""
    figure = Figure()
    axes = figure.subplots()
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    at = {"left": (0.0, 0.5), "right": (1.0, 0.5), "bottom": (0.5, 0.0), "top": (0.5, 1.0)}[edge]
    write_labels(axes, [Label("a label", "black", np.array([at]))])
    inside = axes.get_window_extent()
    (written,) = axes.texts
    box = written.get_window_extent()
    assert inside.x0 <= box.x0 and box.x1 <= inside.x1
    assert inside.y0 <= box.y0 and box.y1 <= inside.y1
