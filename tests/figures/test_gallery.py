"""The gallery: a picture of every study that anyone can read, on a slide, on a phone and with fewer kinds of cones."""

import dataclasses
import itertools
import tempfile

import numpy as np
import pytest
from matplotlib.axis import Tick
from matplotlib.text import Text

import harvester as hv
from harvester.figures.sweep_curves import MOST_CURVES, colour
from harvester.presentation.engine_look import LOOKS
from harvester.studies.compare import Comparison, PathComparison
from harvester.studies.work_precision.cost_table import Cost, CostRow
from harvester.uncertainty.value import Value
from tests.support.colours import EYES, distance

R = "load.resistance"
STOP = "stop.restitution"
MU = "nondimensional.mu"
SENSOR = "examples/bimorph_sensor.toml"
PLATE, BRIDGE = "examples/plate_with_stop.toml", "examples/plate_bridge.toml"
DRIVEN = hv.Scene(
    nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0)
)
# points, and pixels of a phone's width
SMALL = 7.0
PHONE = 390
APART = 15.0  # in CIELAB: colours of two entries that differ in nothing else
DEVICE = "Plate (Shock and Vibration 2019, 9093605) with a stop"


def comparison():
    """All engines of the plate, and two paths: the powers differ by 5 %, the path errors by 10 000."""
    scene = hv.load(PLATE)
    answers = [hv.Published().run(scene), hv.Averaged().run(scene), hv.Density().run(scene)]
    t = [0.01 * k for k in range(500)]
    wave = [(k % 97) / 50.0 - 1.0 for k in range(500)]
    paths = [
        PathComparison(f"{w} the stop", *map(np.array, (t, t, wave, wave, wave[::-1])), True)
        for w in ("with", "no")
    ]
    return Comparison(tuple(answers), {}, tuple(paths)).plot(DEVICE)


def cost():
    """As `cost` of the plate found it: formulas alone, sampling engines on their lines, and what lacks a trick."""
    found = {
        "published": [(0.004, 0.054)],
        "averaged": [(0.007, 0.0078)],
        "density": [(17.0, 0.00078)],
        "ensemble": [(0.02, 0.05), (0.03, 0.0078), (0.03, 0.003), (0.07, 0.0018), (0.2, 0.0012)],
        "spice": [(0.3, 0.05), (0.4, 0.015), (1.0, 0.009), (1.6, 0.0026)],
        "spice alone": [(0.5, 0.11), (0.8, 0.06), (1.9, 0.07), (3.1, 0.045)],
        "ensemble, no controls": [(0.07, 0.0085), (0.6, 0.003)],
        "spice, no pairing": [(0.7, 0.018), (3.2, 0.0076)],
        "ideal": [(0.5, 0.02)],
    }
    rows = [
        CostRow(name, seconds=s, total_error=e, best=e < 0.01)
        for name, some in found.items()
        for s, e in some
    ]
    return Cost(tuple(rows), "ensemble", Value(8e-6), {}).plot(DEVICE)


def region():
    """If rest of the paper's scene is stable, which `stability` computes into a folder only."""
    with tempfile.TemporaryDirectory() as out:
        found = hv.stability(
            "examples/paper_figure3.toml", trajectories=64, execution=hv.Execution(out=out)
        )
    return found.plot(DEVICE)


PICTURES = {
    "run": lambda: hv.Averaged().run(hv.load(PLATE)).plot(DEVICE),
    "sweep": lambda: hv.sweep(PLATE, vary={R: "10k:10M:9"}, engines=["published", "averaged"]).plot(
        DEVICE
    ),
    "sweep of two keys": lambda: hv.sweep(
        PLATE,
        vary={R: "10k:10M:9", STOP: [0.5, 0.6, 0.7, 0.8, 0.9, 0.95]},
        engines=["published", "averaged"],
    ).plot(DEVICE),
    "optimise": lambda: hv.optimise(PLATE, vary={R: ("10k", "10M")}, engine="averaged").plot(
        DEVICE
    ),
    "optimise two keys": lambda: hv.optimise(
        PLATE, vary={R: ("10k", "10M"), STOP: (0.5, 0.95)}, engine="averaged"
    ).plot(DEVICE),
    "response": lambda: hv.response(
        DRIVEN, sweep=[0.7, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.3]
    ).plot(DEVICE),
    "charge": lambda: hv.charge(BRIDGE, to="0.5 V", engine="ideal", trajectories=64).plot(DEVICE),
    "tolerance of one key": lambda: hv.tolerance(
        PLATE, vary={R: "20%"}, engine="averaged", samples=256
    ).plot(DEVICE),
    "tolerance": lambda: hv.tolerance(
        PLATE,
        vary={R: "10%", STOP: "3%", "piezo.capacitance": "10%"},
        engine="averaged",
        samples=256,
    ).plot(DEVICE),
    "compare": comparison,
    "cost": cost,
    "node": lambda: hv.node("examples/bimorph_packets.toml").plot(DEVICE),
    "identify": lambda: hv.identify(
        ["examples/bench_bounce.csv", "examples/bench_impedance.csv"], known={"mass": "40 g"}
    ).plot(DEVICE),
    "densities": lambda: hv.densities(PLATE).plot(DEVICE),
    "sweep of a netlist": lambda: hv.sweep(
        BRIDGE,
        vary={"load.parameters.R": "100k:3M:4"},
        engines=[hv.Ideal(trajectories=64, duration=50.0)],
    ).plot(DEVICE),
    "compare of a netlist": lambda: hv.compare(
        BRIDGE,
        engines=[
            hv.Ideal(trajectories=64, duration=50.0),
            hv.Compiled(trajectories=64, duration=50.0),
        ],
    ).plot(DEVICE),
    "design": lambda: hv.design(
        SENSOR, needs="130 uW at 3.3 V", spread="frequency=2Hz", circuits=["bridge", "doubler"]
    ).plot(DEVICE),
    "stability": region,
    "front": lambda: hv.optimise(
        PLATE, vary={R: ("10k", "10M")}, engine="averaged", objective="voltage_rms", points=5
    ).plot(DEVICE),
    "motion": lambda: hv.motion(PLATE, duration=20.0).plot(DEVICE),
}


BY_NGSPICE = {"compare of a netlist": [pytest.mark.ngspice]}  # which judges compiled circuits


@pytest.fixture(
    scope="module", params=[pytest.param(name, marks=BY_NGSPICE.get(name, [])) for name in PICTURES]
)
def picture(request):
    """A picture as it is drawn."""
    figure = PICTURES[request.param]()
    figure.draw_without_rendering()
    return figure


def texts(figure):
    """The texts that can be seen, with their boxes in pixels; for an axis the numbers within what it shows."""
    hidden = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            for tick in axis.findobj(Tick):
                if not low <= tick.get_loc() <= high or not axes.get_visible():
                    hidden |= {tick.label1, tick.label2}
    found = [
        one
        for one in figure.findobj(Text)
        if one.get_visible() and one.get_text().strip() and one not in hidden
    ]
    return [(one, one.get_window_extent()) for one in found if one.get_window_extent().width > 0.0]


def overlaps(figure):
    """The pairs of texts of which one covers the other, and those that leave the picture."""
    whole = figure.bbox.padded(1.0)
    seen = texts(figure)
    left = [
        (one.get_text(),)
        for one, box in seen
        if not (
            whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1
        )
    ]
    pairs = itertools.combinations(seen, 2)
    over = [
        (one, other) for (one, x), (other, y) in pairs if x.padded(-0.75).overlaps(y.padded(-0.75))
    ]
    return left + [(one.get_text(), other.get_text()) for one, other in over]


def too_small(figure):
    """The texts that are below 7 points on paper, or 7 pixels on a phone."""
    shown = PHONE / (72.0 * figure.get_figwidth())  # pixels of a phone for each point
    return [
        one.get_text() for one, _ in texts(figure) if one.get_fontsize() * min(1.0, shown) < SMALL
    ]


def alike(figure):
    """The pairs of entries of a legend that some eye cannot distinguish."""
    found = []
    for legend in figure.legends:
        entries = [one for one in legend.legend_handles if hasattr(one, "get_color")]
        for one, other in itertools.combinations(entries, 2):
            if look(one) == look(other) and distance(one.get_color(), other.get_color()) < APART:
                found.append((one.get_label(), other.get_label()))
    return found


@pytest.mark.thorough("test_a_fault_that_is_put_in_is_seen")
@pytest.mark.slow
def test_no_text_covers_another_or_leaves_the_picture(picture):
    assert overlaps(picture) == []


@pytest.mark.thorough("test_a_fault_that_is_put_in_is_seen")
@pytest.mark.slow
def test_every_text_is_large_enough_on_paper_and_on_a_phone(picture):
    assert too_small(picture) == []


def test_a_fault_that_is_put_in_is_seen():
    """A sound picture passes; with a text over another, a small one, and two colours of one look, each is found."""
    figure = hv.Averaged().run(hv.load(PLATE)).plot(DEVICE)
    figure.draw_without_rendering()
    assert (overlaps(figure), too_small(figure), alike(figure)) == ([], [], [])
    (
        figure.text(0.5, 0.5, "one"),
        figure.text(0.5, 0.5, "over it"),
        figure.text(0.9, 0.02, "tiny", fontsize=6.5),
    )
    figure.text(0.99, 0.6, "beyond the edge")
    lines = [
        figure.axes[0].plot([0, 1], color=one, label=one)[0]
        for one in ("#D55E00", "#8C6D1F", "#0072B2")
    ]
    figure.legend(handles=lines)
    figure.draw_without_rendering()
    found = overlaps(figure)
    assert ("one", "over it") in found and ("beyond the edge",) in found
    assert too_small(figure) == ["tiny"]
    assert alike(figure) == [("#D55E00", "#8C6D1F")]


@pytest.mark.thorough("test_every_axis_has_a_quantity_and_a_unit")
@pytest.mark.slow
def test_no_legend_is_over_data(picture):
    assert all(axes.get_legend() is None for axes in picture.axes)
    for legend in picture.legends:
        box = legend.get_window_extent()
        assert not any(box.overlaps(axes.get_window_extent()) for axes in picture.axes)


@pytest.mark.thorough("test_every_axis_has_a_quantity_and_a_unit")
@pytest.mark.slow
def test_the_title_says_question_and_device(picture):
    question, *device = picture.get_suptitle().splitlines()
    assert " ".join(device) == DEVICE and len(question) > 8


def look(handle):
    """What tells an entry of a legend apart next to its colour."""
    if hasattr(handle, "get_marker"):
        return (
            str(handle.get_linestyle()),
            str(handle.get_marker()),
            round(handle.get_linewidth(), 1),
        )
    return (type(handle).__name__,)


@pytest.mark.thorough("test_every_axis_has_a_quantity_and_a_unit")
@pytest.mark.slow
def test_every_eye_tells_entries_of_a_legend_apart(picture):
    assert alike(picture) == []


def test_every_eye_tells_engines_and_curves_apart():
    for one, other in itertools.combinations(LOOKS, 2):
        assert distance(LOOKS[one].colour, LOOKS[other].colour) >= APART, (one, other)
    for one, other in itertools.combinations(
        [colour(n, MOST_CURVES) for n in range(MOST_CURVES)], 2
    ):
        assert distance(one, other) >= APART, (one, other)


def test_eyes_see_what_is_known_of_them():
    """Red and green of one lightness: apart to most, not to who lacks a cone; black and white are apart to all."""
    assert distance("black", "white") == pytest.approx(100.0, abs=0.1)
    assert distance("#D55E00", "#8C6D1F") < 7.0  # a pair that the figures had
    assert len(EYES) == 4


@pytest.mark.thorough("test_every_axis_has_a_quantity_and_a_unit")
@pytest.mark.slow
def test_the_picture_of_a_cost_has_six_names_at_their_marks():
    figure = PICTURES["cost"]()
    named = set(LOOKS) & {one.get_text() for one, _ in texts(figure)}
    assert len(named) == 6
    assert any("Not drawn" in one.get_text() for one, _ in texts(figure))


@pytest.mark.thorough("test_every_axis_has_a_quantity_and_a_unit")
@pytest.mark.slow
def test_the_picture_of_a_cost_has_measured_and_predicted_seconds():
    """Sampling is prolonged by the square of the errors' ratio, if not far beyond all measured."""
    rows = (
        CostRow("ensemble", seconds=0.1, sampling_error=0.2, total_error=0.2),
        CostRow("ensemble", seconds=0.5, sampling_error=0.1, total_error=0.1),
        CostRow("averaged", seconds=0.004, total_error=0.05),
    )
    figure = Cost(rows, "ensemble", Value(8e-6), {}).plot(DEVICE)
    lines = {line.get_gid(): line.get_xydata() for line in figure.axes[0].lines if line.get_gid()}
    assert [*lines] == ["predicted ensemble"]
    np.testing.assert_allclose(
        lines["predicted ensemble"], [[0.4, 10.0], [4.44, 3.0], [40.0, 1.0]], rtol=2e-3
    )
    assert any("Dotted" in one.get_text() for one, _ in texts(figure))


@pytest.mark.thorough("test_every_axis_has_a_quantity_and_a_unit")
@pytest.mark.slow
def test_the_errors_of_paths_have_one_scale():
    titles = [axes.get_title() for axes in PICTURES["compare"]().axes if axes.get_title()]
    assert all(title.count("%") == 2 for title in titles) and len(titles) == 2


@pytest.mark.slow
def test_a_charge_of_one_run_has_no_panel_of_shares():
    found = hv.charge(hv.load(BRIDGE), to="0.5 V", engine="ideal", trajectories=64)
    alone = dataclasses.replace(found, stderr=None)
    labels = [axes.get_ylabel() for axes in alone.plot().axes]
    assert len(labels) == len(found.plot().axes) - 1 and not any(
        "runs" in label for label in labels
    )


@pytest.mark.thorough("test_a_fault_that_is_put_in_is_seen")
def test_a_bar_of_the_tornado_spans_the_quantiles():
    """A load at its best value: both of its ends give less, and no device gives more than it."""
    best = hv.optimise(PLATE, vary={R: ("10k", "10M")}, engine="averaged")
    scene = hv.load(PLATE).varied({R: best.keys[0].value})
    found = hv.tolerance(
        scene, vary={R: "20%", "piezo.capacitance": "1%"}, engine="averaged", samples=512
    )
    bar = next(one for one in found.tornado if one.key == R)
    assert found.nominal is not None and bar.quantiles[1] == pytest.approx(found.nominal, rel=1e-4)
    assert bar.quantiles[0] == pytest.approx(min(bar.powers), rel=2e-3)
    assert bar.swing > 1.5 * abs(bar.powers[1] - bar.powers[0])
