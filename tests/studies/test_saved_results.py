"""`hv.read`: the results of a folder are those that the study returned."""

import dataclasses
import re
import subprocess
import sys

import numpy as np
import pytest

import harvester as hv
from harvester.studies.sweep.compute import compute_table
from harvester.studies.sweep.points import Axis, Points

SCENE = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
PHYSICAL = hv.Scene(
    oscillator=hv.Oscillator(mass=0.01, stiffness=100.0, damping=0.01),
    piezo=hv.Piezo(coupling=1e-3, capacitance=5e-8),
    excitation=hv.Excitation(acceleration_psd="1e-3 g^2/Hz"),
    load=hv.Load(resistance=1e5),
)


def _into(folder):
    return hv.Execution(out=folder)


def test_a_sweep_is_the_one_that_was_returned(tmp_path):
    """Values, errors, units, points and figures; the row of a point that failed states why."""
    found = hv.sweep(
        PHYSICAL,
        vary={"load.resistance": ["1 kohm", "1 Mohm"], "oscillator.cubic_stiffness": [0.0, 1e5]},
        engines=[hv.Exact(), hv.Averaged()],
        execution=_into(tmp_path),
    )
    again = hv.read(tmp_path)
    assert isinstance(again, hv.SweepTable) and again.axes == found.axes
    assert list(again.points) == list(found.points) and again.table.csv() == found.table.csv()
    assert [row.mean_power for row in again.rows] == [row.mean_power for row in found.rows]
    assert again.rows[0].mean_power is None or again.rows[0].mean_power.unit == "W"
    assert any(row.mean_power for row in again.rows) and any(row.error for row in again.rows)
    assert [row.error for row in again.rows] == [row.error for row in found.rows]
    assert len(again.plot().axes) == len(found.plot().axes)


def test_points_of_a_list_that_repeat(tmp_path):
    """Each row keeps its own point."""
    listed = {"nondimensional.mu": (0.5, 2.0, 0.5), "nondimensional.D11": (0.01, 0.02, 0.01)}
    points = Points(tuple(Axis(key, values) for key, values in listed.items()), listed=True)
    found = compute_table(SCENE, points, [hv.Averaged()], _into(tmp_path))
    again = hv.read(tmp_path / "sweep.csv")
    assert list(again.points) == list(found.points) == [0, 1, 2] and again.listed
    assert [row.varied for row in again.rows] == [row.varied for row in found.rows]


def test_a_table_has_its_values_units_and_provenance(tmp_path):
    """The columns of a value's parts are one column of values again."""
    found = hv.compare(
        PHYSICAL, engines=[hv.Exact(), hv.Ensemble(trajectories=16)], execution=_into(tmp_path)
    )
    again = hv.read(tmp_path)
    power, saved = found.table["mean_power"], again.table["mean_power"]
    for mine, its in zip(power, saved, strict=True):
        for part in dataclasses.fields(hv.Value):
            was, now = getattr(mine, part.name), getattr(its, part.name)
            assert now == (pytest.approx(was, rel=1e-8) if isinstance(was, float) else was)
    assert again.study == "compare" and again.about["seed"] == 0
    assert again.to_pandas()["mean_power_error95"][0] == pytest.approx(power[0].error95, rel=1e-8)
    assert again.to_xarray()["mean_power"].attrs["units"] == "W"


def test_arrays_of_a_path(tmp_path):
    """The heads have units, and the numbers nine digits."""
    found = hv.motion(PHYSICAL, duration=0.5, execution=_into(tmp_path))
    again = hv.read(tmp_path)
    np.testing.assert_allclose(again.table["voltage"], found.voltage, rtol=1e-8)
    head = (tmp_path / "motion.csv").read_text().splitlines()[0]
    assert head == "time (s),displacement (m),velocity (m/s),voltage (V)"
    heads = [column.head for column in again.table.columns]
    assert heads == ["time", "displacement", "velocity", "voltage"]  # not the mean time of `charge`


def test_a_provenance_without_a_scene(tmp_path):
    """Numbers have SI units then."""
    (tmp_path / "cost.csv").write_text("x (V)\n1\n")
    for scene in ("null", '"plate"', "{}"):
        (tmp_path / "provenance.json").write_text(f'{{"scene": {scene}}}')
        assert hv.read(tmp_path).physical and "V" in str(hv.read(tmp_path))


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({}, "must be a folder with one CSV file of a study.*: it has none"),
        ({"fig1.csv": "x\n1\n", "fig2.csv": "x\n1\n"}, "it has fig1.csv, fig2.csv: name one"),
        ({"cost.csv": "a,b\n1\n"}, "as many cells in each row"),
        ({"cost.csv": ""}, "must be a CSV file of a study"),
        ({"cost.csv": "x\n1\n", "provenance.json": "[1]"}, "a provenance.json that a study wrote"),
        ({"sweep.csv": "load.resistance,engine\n1,exact\n"}, "the provenance.json of its sweep"),
        (
            {"sweep.csv": "load.resistance\n1\n", "provenance.json": '{"vary": {"load.x": [1]}}'},
            "the provenance.json of its sweep",
        ),
        (
            {
                "sweep.csv": "load.resistance,engine\n2.0,exact\n",
                "provenance.json": '{"vary": {"load.resistance": [1.0]}}',
            },
            "must hold a whole sweep, but line 2",
        ),
        ({"cost.csv": "x,y,x\n1,2,3\n"}, "name each of its columns once.*has several 'x'"),
        ({"cost.csv": "x (V),x (m)\n1,2\n"}, "name each of its columns once.*has several 'x'"),
        *(
            (
                {
                    "cost.csv": ",".join(
                        f"p{end}"
                        for end in (
                            *("", "_stderr", "_dof", "_step_bias"),
                            *("_model_bias", "_error95", "_unknown"),
                        )
                    )
                    + f"\n1,{stderr},,,,,\n"
                },
                "hold numbers with their errors",
            )
            for stderr in ("nan", "-0.1")
        ),
    ],
)
def test_what_no_study_wrote_is_refused(tmp_path, files, says):
    """One line names the file and the remedy."""
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(hv.InputError, match=says) as caught:
        hv.read(tmp_path)
    assert "\n" not in str(caught.value) and re.match("`path` must", str(caught.value))


# of another process: one that computed nothing
DRAWN = """
import sys
import harvester as hv
figure = hv.read(sys.argv[1]).plot()
print(len({line.get_color() for line in figure.axes[0].get_lines() if len(line.get_xdata()) > 1}))
"""


@pytest.mark.slow
def test_curves_of_a_folder_have_the_colours_of_their_engines(tmp_path):
    """Also in a process that has used no engine."""
    hv.sweep(
        SCENE,
        vary={"nondimensional.mu": [0.5, 1.0, 2.0]},
        engines=[hv.Published(), hv.Averaged()],
        execution=_into(tmp_path),
    )
    command = [sys.executable, "-c", DRAWN, str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert run.stdout == "2\n"


@pytest.mark.parametrize("read", [hv.read, hv.load])
def test_a_path_is_a_text_or_a_path(read):
    with pytest.raises(hv.InputError, match=r"must be the path of a .*, but is 3"):
        read(3)


def test_a_missing_folder(tmp_path):
    """The argument is named."""
    with pytest.raises(hv.InputError, match="`path` must be a readable file"):
        hv.read(tmp_path / "nowhere")
