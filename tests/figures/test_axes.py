"""`plot(ax=)`: the main panel of a result in the user's own axes."""

from functools import cache

import pytest
from matplotlib.figure import Figure
from matplotlib.legend import Legend

import harvester as hv
from tests.support.models import Motion, Oscillator

PLATE, BRIDGE = "examples/plate_with_stop.toml", "examples/plate_bridge.toml"
LINEAR = "examples/plate.toml"
DRIVEN = "examples/plate_harmonic.toml"
LOAD = "load.resistance"
PICTURES = {
    "bar": lambda: hv.Averaged().run(hv.load(PLATE)),
    "colour bar": lambda: hv.optimise(
        LINEAR, vary={LOAD: ("10k", "10M"), "piezo.capacitance": ("10n", "1u")}, engine="exact"
    ),
    "three panels": lambda: hv.charge(BRIDGE, to="0.5 V", engine="ideal", trajectories=64),
    "two columns": lambda: hv.motion(PLATE, duration=5.0),
    "residuals": lambda: hv.identify(
        ["examples/bench_bounce.csv", "examples/bench_impedance.csv"], known={"mass": "40 g"}
    ),
    "model of one's own": lambda: hv.cosimulate(
        Oscillator(m=0.04, k=16.0, c=0.0),
        hv.Load(resistance=1e6),
        hv.Piezo(coupling="1 mN/V", capacitance="50.2 nF"),
        Motion(1e-3, 0.05),
        "0.5 s",
        "5 ms",
        compiled=False,
    ),
    "ratio": lambda: hv.sweep(
        PLATE,
        vary={LOAD: "10k:10M:5"},
        engines=["averaged", "ensemble"],
        execution=hv.Execution(workers=1),
    ),
    "percent": lambda: hv.tolerance(
        PLATE, vary={LOAD: "5%", "piezo.capacitance": "10%"}, engine="averaged", samples=256
    ),
    "labels": lambda: hv.response(DRIVEN, sweep="0.8:1.2:9", engine="exact"),
}

NAMES = [
    pytest.param(name, marks=[pytest.mark.ngspice] * (name == "model of one's own"))
    for name in PICTURES
]


@cache
def _answer(name):
    """The result of `PICTURES`, which several tests draw."""
    return PICTURES[name]()


def _mine():
    figure = Figure(figsize=(8, 4))
    left, right = figure.subplots(1, 2)
    return figure, left, right


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_has_a_main_panel(name):
    """The panel is in the axes given, with a label of each axis; the axes next to it stay empty."""
    figure, left, right = _mine()
    assert _answer(name).plot(ax=left) is figure
    figure.draw_without_rendering()
    assert left.has_data() and left.get_xlabel()
    low, high = sorted(left.get_xlim())
    shown = [tick for tick in left.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]
    assert any(tick.label1.get_visible() and tick.label1.get_text() for tick in shown)
    assert not right.has_data() and right.get_legend() is None
    # a colour bar may stand beside it
    assert len(figure.axes) <= 3


BESIDE = {
    "two columns": "Phase plane",
    "residuals": "residuals",
    "ratio": "ratio",
    "percent": "Percent",
}


@pytest.mark.parametrize("name", BESIDE)
def test_a_note_on_other_panels_is_left_out(name):
    """The figure's own note names a panel that the user's axes lack; a legend is not wider than they are."""
    answer = _answer(name)
    assert BESIDE[name] in answer.plot().legends[0].get_title().get_text()
    figure, left, _ = _mine()
    answer.plot(ax=left)
    figure.draw_without_rendering()
    legend = left.get_legend()
    if legend is not None:
        assert BESIDE[name] not in legend.get_title().get_text()
        assert legend.get_frame_on() and legend.get_frame().get_alpha() == 0.85
        assert legend.get_window_extent().width < left.bbox.width


def test_a_map_has_a_legend_at_a_fixed_place():
    """The search for the best place warns if it is slow, as over a mesh; it is left out there."""
    _, left, _ = _mine()
    _answer("colour bar").plot(ax=left)
    assert left.get_legend()._loc == Legend.codes["upper right"]


def test_two_results_in_one_figure():
    """A title is over its axes only if it is given; the scale is that of the whole figure."""
    figure, left, right = _mine()
    found = hv.sweep(PLATE, vary={LOAD: "10k:10M:5"}, engines=["published", "averaged"])
    assert found.plot(ax=left) is figure and found.plot("mine", ax=right) is figure
    assert (left.get_title(), right.get_title()) == ("", "mine")
    whole = found.plot(None).axes
    assert len(whole) == 2 and len(figure.axes) == 2
    assert left.get_xscale() == whole[0].get_xscale() == "log"
    assert left.get_xlim() == whole[0].get_xlim() and left.get_ylim() == whole[0].get_ylim()
    assert (left.get_ylabel(), left.get_xlabel()) == (whole[0].get_ylabel(), whole[1].get_xlabel())
    assert left.get_legend() is not None and not figure.legends
    lines = [line.get_xydata().tolist() for line in whole[0].lines]
    assert [line.get_xydata().tolist() for line in left.lines] == lines


def test_what_is_no_plane_is_refused():
    """One line names the argument; the next plot has its own figure again."""
    found = hv.sweep(PLATE, vary={LOAD: "10k:10M:3"}, engines=["averaged"])
    polar = Figure().add_subplot(projection="polar")
    for wrong in (polar, Figure(), 3):
        with pytest.raises(hv.InputError, match="`ax` must be the Axes of a plane"):
            found.plot(ax=wrong)
    assert len(found.plot().axes) == 1


@pytest.mark.parametrize("name", ["bar", "names of one's own"])
def test_a_curve_over_named_ticks_is_refused(name):
    """Bars at names have no scale that a sweep could share; nothing is drawn onto them."""
    found = hv.sweep(PLATE, vary={LOAD: "10k:10M:3"}, engines=["averaged"])
    _, left, right = _mine()
    if name == "bar":
        _answer(name).plot(ax=left)
    else:
        left.bar(["one", "two"], [1.0, 2.0])
    before = left.get_children(), left.get_xscale(), left.get_yscale()
    with pytest.raises(hv.InputError, match=r"`ax` must have axes of numbers, but its . axis has"):
        found.plot(ax=left)
    assert before == (left.get_children(), left.get_xscale(), left.get_yscale())
    found.plot(ax=right)


@pytest.mark.parametrize("limits", [(-10.0, 1e5), (1e5, -10.0), (0.0, 1e5), (1e5, 0.0)])
def test_limits_that_a_logarithm_lacks_are_chosen_anew(limits):
    """A range set for a linear axis may begin at 0 or below, or be reversed; the curve is seen whole."""
    found = hv.sweep(PLATE, vary={LOAD: "10k:10M:3"}, engines=["averaged"])
    figure, left, _ = _mine()
    left.plot([1e4, 1e5], [1.0, 2.0])
    left.set_xlim(limits)
    found.plot(ax=left)
    figure.draw_without_rendering()
    low, high = sorted(left.get_xlim())
    assert left.get_xscale() == "log" and 0.0 < low <= 1e4 and high >= 1e7
