"""One error for one value: what `run` states of it is what a sweep and a comparison print, write and draw."""

import csv
import io
import re

import numpy as np
import pytest
import xarray

import harvester as hv
from harvester import report
from harvester.presentation.table import error_in_percent
from harvester.report.page import TextTable
from harvester.studies.output_folder import provenance
from harvester.studies.sweep.dataset import netcdf
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable
from tests.support.paths import EXAMPLES

R = "load.resistance"
PLATE = hv.load(EXAMPLES / "plate.toml")
FEW = hv.Value(8.4e-6, stderr=1e-7, bias=1e-8, dof=2.0)  # Student's quantile: 4.3 standard errors
UNKNOWN = hv.Value(8.4e-6, stderr=1e-7, bias=1e-8, dof=2.0, unknown="the tolerance")
SAID = {FEW: "5.2 %", UNKNOWN: "at least 5.2 %"}


def estimate(power, engine="spice"):
    return hv.Estimate(engine, True, power, hv.Value(0.1), {}, (), 1.0, 10)


def table(power):
    rows = tuple(SweepRow.answered(estimate(power)).at({R: x}) for x in (1e5, 1e6))
    return SweepTable(
        (Axis(R, (1e5, 1e6)),), rows, (0, 1), False, provenance(PLATE, engines={"spice": {}})
    )


@pytest.fixture(params=SAID, ids=["Student", "a part is not known"])
def power(request):
    return request.param


def half(figure):
    """Half the height of the first error bar of a figure, in the unit of its axis."""
    bars = next(one for one in figure.axes[0].collections if hasattr(one, "get_segments"))
    return np.ptp(bars.get_segments()[0], axis=0).max() / 2.0


def test_run_and_compare(power):
    """`run` in its sentence, which names the unknown part; `compare` in its table, and in its figure."""
    assert error_in_percent(power) == SAID[power]
    whole = power.error95
    assert (whole is None) == (power is UNKNOWN)
    assert power.known_error95 == pytest.approx(0.44e-6, rel=2e-3)
    answer = str(estimate(power))
    assert ("+- 0.43 (95 %, sampling) +- 0.01 (step)" in answer) == (power is FEW)
    assert ("the error of the tolerance is not known" in answer) == (power is UNKNOWN)
    found = hv.Comparison((estimate(power), estimate(hv.Value(9e-6), "published")), {}, ())
    assert half(found.plot()) == pytest.approx(power.known_error95 * 1e6)


def test_terminal_and_notebook(power):
    shown = table(power)
    assert re.findall(r"8\.4 uW +(\S.*\S)  +1$", str(shown), re.MULTILINE) == [SAID[power]] * 2
    assert shown._repr_html_().count(f">{SAID[power]}<") == 2


def test_csv_pandas_and_json(power):
    """The number is empty if a part is not known, and the part is named next to it."""
    found = table(power)
    row = next(csv.DictReader(io.StringIO(found.text())))
    assert (row["mean_power_error95"], row["mean_power_unknown"], row["mean_power_dof"]) == (
        "" if power is UNKNOWN else f"{power.error95:.9g}",
        power.unknown,
        "2",
    )
    frame = found.to_pandas()
    assert frame["mean_power_error95"].iloc[0] == pytest.approx(
        power.error95 or np.nan, nan_ok=True
    )
    assert found.as_json()["rows"][0]["mean_power"]["error95"] == power.error95


def test_netcdf(power, tmp_path):
    found = table(power)
    (tmp_path / "sweep.nc").write_bytes(netcdf(found))
    with xarray.open_dataset(tmp_path / "sweep.nc") as data:
        for one in (data, found.to_xarray()):
            assert float(one.mean_power_error95[0, 0]) == pytest.approx(
                power.error95 or np.nan, nan_ok=True
            )
            assert str(one.mean_power_unknown.values[0, 0]) == power.unknown
            assert one.mean_power_error95.attrs == {
                "long_name": "error of the mean power at 95 %",
                "units": "W",
            }


def test_figure(power):
    """The bar is what is known of the error; the note names the engines of which not all is."""
    figure = table(power).plot()
    assert half(figure) == pytest.approx(power.known_error95 * 1e6)
    texts = " ".join(
        one.get_text() for one in figure.findobj(lambda artist: hasattr(artist, "get_text"))
    )
    assert ("The error of spice is known in part." in " ".join(texts.split())) == (power is UNKNOWN)


def test_report(power):
    page = report.of_sweep(PLATE, table(power))
    assert f"(error, 95 %: {SAID[power]})" in page.lead[0]
    tables = {one.caption: one for one in page.sections[0].tables if isinstance(one, TextTable)}
    heads = list(tables["Points"].heads)
    place = heads.index("error, 95 %")
    assert [row[place] for row in tables["Points"].rows] == [SAID[power]] * 2
    place = list(tables["Engines"].heads).index("error, 95 %, at most")
    assert tables["Engines"].rows[0][place] == SAID[power]
