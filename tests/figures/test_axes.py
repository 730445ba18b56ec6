"""`plot(ax=)`: the main panel of a result in the user's own axes."""

import pytest
from matplotlib.figure import Figure

import harvester as hv

PLATE, BRIDGE = "examples/plate_with_stop.toml", "examples/plate_bridge.toml"
DRIVEN = "examples/plate_harmonic.toml"
LOAD = "load.resistance"
PICTURES = {
    "bar": lambda: hv.Averaged().run(hv.load(PLATE)),
    "colour bar": lambda: hv.optimise(
        PLATE, vary={LOAD: ("10k", "10M"), "stop.gap": ("0 m", "1 mm")}, engine="averaged"
    ),
    "three panels": lambda: hv.charge(BRIDGE, to="0.5 V", engine="ideal", trajectories=64),
    "two columns": lambda: hv.motion(PLATE, duration=5.0),
    "labels": lambda: hv.response(DRIVEN, sweep="0.8:1.2:9", engine="exact"),
}


def _mine():
    figure = Figure(figsize=(8, 4))
    left, right = figure.subplots(1, 2)
    return figure, left, right


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_has_a_main_panel(name):
    """The panel is in the axes given, with a label of each axis; the axes beside it stay empty."""
    figure, left, right = _mine()
    assert PICTURES[name]().plot(ax=left) is figure
    figure.draw_without_rendering()
    assert left.has_data() and left.get_xlabel()
    assert not right.has_data() and right.get_legend() is None
    # a colour bar may stand beside it
    assert len(figure.axes) <= 3


def test_two_results_in_one_figure():
    """A title stands over its axes only if it is given; the scale is that of the whole figure."""
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
