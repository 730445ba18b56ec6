"""Sweeps: axes, the table, points that fail, and continuing after an interruption."""

import csv
import json
import re
from dataclasses import replace

import pytest

import harvester as hv
from harvester import engines
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, SimulationError
from harvester.presentation import plot
from harvester.presentation.diagnostic import has
from harvester.studies.sweep.points import Axis, Points, read_axis
from harvester.studies.sweep.sweep import chosen, for_circuit
from tests.support.paths import EXAMPLES
from tests.support.sweeps import swept, telling

PLATE = hv.load(EXAMPLES / "plate.toml")
FIGURE = hv.load(EXAMPLES / "paper_figure3.toml")
LOADS = read_axis("load.resistance=1k:10M:3")
COLUMNS = (
    # the contract
    "engine,mean_square_voltage,mean_square_voltage_stderr,mean_power,mean_power_stderr,seconds,error,"
    "mean_power_bias,warnings,responses"  # added
)
PARTS = ("dof", "step_bias", "model_bias", "error95", "unknown")  # of a value, behind


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("load.resistance=1k:100k:3", (1e3, 1e4, 1e5)),
        ("load.resistance=100k:1k:3", (1e5, 1e4, 1e3)),
        ("load.resistance=1k:9k:3", (1e3, 5e3, 9e3)),
        ("load.resistance=1 kohm, 2k,3e3", (1e3, 2e3, 3e3)),
        ("load.resistance=1k:10M:1", (1e3,)),
        ("oscillator.damping=-1:1:3", (-1.0, 0.0, 1.0)),
        ("stop.restitution=0:1:2", (0.0, 1.0)),
        ("load.parameters.C=1u:10u:2", (1e-6, 1e-5)),
    ],
)
def test_axis(text, values):
    axis = read_axis(text)
    assert axis.key == text.partition("=")[0]
    assert axis.values == pytest.approx(values, rel=1e-12, abs=0)


COUNT = (
    "`vary` must be KEY=FROM:TO:COUNT with a whole COUNT between 1 and 100000, spaced geometrically "
    "if FROM and TO differ tenfold or more, else linearly, but is "
)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "`vary` must be KEY=FROM:TO:COUNT or KEY=A,B,C, but is ''"),
        (
            "load.resistance",
            "`vary` must be KEY=FROM:TO:COUNT or KEY=A,B,C, but is 'load.resistance'",
        ),
        ("load.resistence=1", "unknown [load] key 'resistence': did you mean 'resistance'?"),
        ("load.netlist=1", "load.netlist must be a key with a number to be varied"),
        (
            "load.resistance=",
            "load.resistance must be a load resistance (ohm), such as '1 Mohm', above 0, but is ''",
        ),
        (
            "load.resistance=1k,,2k",
            "load.resistance must be a load resistance (ohm), such as '1 Mohm', above 0",
        ),
        (
            "load.resistance=-1:2:3",
            "load.resistance must be a load resistance (ohm), such as '1 Mohm', above 0",
        ),
        (
            "load.resistance=1:1 nF:3",
            "load.resistance must be a load resistance (ohm), such as '1 Mohm', above 0",
        ),
        (
            "stop.restitution=0:1.1:3",
            "stop.restitution must be a restitution coefficient, such as 0.96, between 0",
        ),
        *(
            (f"load.resistance=1:2{count}", COUNT)
            for count in ("", ":", ":0", ":-1", ":2.5", ":²", ":x", ":3:4")
        ),
        ("load.resistance=1:2:" + "9" * 5000, COUNT),
    ],
)
def test_what_is_no_axis(text, line):
    with pytest.raises(InputError, match=f"^{re.escape(line)}"):
        read_axis(text)


def rows(out):
    with (out / "sweep.csv").open() as file:
        return list(csv.DictReader(file))


def test_table_and_provenance(tmp_path):
    """Columns as the contract states, values as the engine gives them, and where they come from."""
    told = []
    table = swept(
        PLATE, [LOADS], engines=[hv.Published()], out=tmp_path, progress=telling(told.append)
    )
    head = (tmp_path / "sweep.csv").read_text().splitlines()[0].split(",")
    parts = [f"{name}_{part}" for name in ("mean_square_voltage", "mean_power") for part in PARTS]
    assert head == ["load.resistance", *COLUMNS.split(","), *parts, "bound"]
    assert list(csv.DictReader(table.text().splitlines())) == rows(tmp_path)
    assert told == ["published"] * 3
    for row, value in zip(rows(tmp_path), LOADS.values, strict=True):
        answer = hv.Published().run(PLATE.with_load(value))
        assert float(row["load.resistance"]) == value
        assert float(row["mean_power"]) == pytest.approx(answer.mean_power.value, rel=1e-8, abs=0)
        assert float(row["mean_square_voltage"]) == pytest.approx(
            answer.mean_square_voltage.value, rel=1e-8
        )
        assert (row["engine"], row["mean_power_stderr"], row["error"]) == ("published", "", "")
    whence = json.loads((tmp_path / "provenance.json").read_text())
    assert whence["vary"] == {"load.resistance": list(LOADS.values)}
    assert whence["engines"] == {"published": {"seed": 0}}
    assert whence["scene"] == PLATE.tables()
    assert whence["scene_digest"] == PLATE.digest
    assert whence["versions"]["harvester"] == hv.__version__
    assert {"command", "when", "machine"} <= set(whence)
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")
    assert {p.name for p in tmp_path.iterdir()} == {
        "sweep.csv",
        "sweep.nc",
        "sweep.png",
        "provenance.json",
    }


@pytest.mark.thorough("test_the_cheapest_engine_of_each_point_is_resumed")
@pytest.mark.slow
def test_two_keys_two_engines(tmp_path):
    axes = [read_axis("nondimensional.restitution=0.9,0.99"), read_axis("nondimensional.mu=0.1,1")]
    ensemble = hv.Ensemble(trajectories=64, duration=20.0, dt=0.05, seed=7)
    table = swept(FIGURE, axes, engines=[hv.Published(), ensemble], out=tmp_path)
    keys = [
        (row["nondimensional.restitution"], row["nondimensional.mu"], row["engine"])
        for row in rows(tmp_path)
    ]
    assert keys == [
        (r, mu, e)
        for r in ("0.9", "0.99")
        for mu in ("0.1", "1.0")
        for e in ("published", "ensemble")
    ]
    assert all(row.mean_power.stderr > 0.0 for row in table.of("ensemble"))
    assert table.column("mean_power", "ensemble").shape == (4,)
    whence = json.loads((tmp_path / "provenance.json").read_text())
    assert whence["engines"]["ensemble"]["seed"] == 7


MIXED = read_axis("nondimensional.c2=0.05,0.06")
UNBOUNDED = hv.loads("[nondimensional]\nc1 = 0.01\nc2 = 0.05\nbeta = 0.05\nmu = 0.05\nD11 = 0.01\n")
NO_NOISE = hv.loads("[nondimensional]\nc1 = -0.01\nbeta = 0.05\nmu = 0.05\n")


def test_a_point_that_fails_is_a_row(tmp_path):
    """Without noise the published density does not exist; the other point is not touched by that."""
    table = swept(
        NO_NOISE, [read_axis("nondimensional.D11=0,0.01")], engines=[hv.Published()], out=tmp_path
    )
    failed, fine = rows(tmp_path)
    assert "needs external noise" in failed["error"]
    assert failed["mean_power"] == failed["seconds"] == ""
    assert fine["error"] == ""
    assert float(fine["mean_power"]) > 0.0
    # nan: no answer
    assert table.column("mean_power", "published")[0] != table.column("mean_power", "published")[0]


def test_every_point_fails(tmp_path):
    with pytest.raises(SimulationError, match="grows without bound") as caught:
        swept(UNBOUNDED, [MIXED], engines=[hv.Published()], out=tmp_path)
    assert caught.value.exit_status == 3
    assert len(rows(tmp_path)) == 2
    assert all("grows without bound" in row["error"] for row in rows(tmp_path))


def test_a_sweep_may_give_the_scene_a_stop():
    """The engines are chosen for the points, not for the scene without them."""
    points = Points((Axis("stop.gap", (1e-4, 2e-4)), Axis("stop.restitution", (0.8,))))
    which = chosen(points.middle(PLATE), None)
    assert {"averaged", "ensemble"} <= {*which.engines}
    assert "exact" not in which.engines


def test_no_engine_serves(tmp_path):
    bridge = PLATE.with_load(hv.Load(netlist="bridge"))
    with pytest.raises(CannotServeError, match="use engine 'spice'") as caught:
        swept(bridge, [read_axis("load.parameters.R=1k,2k")], engines=[hv.Ensemble()], out=tmp_path)
    assert caught.value.exit_status == 2


def test_the_ideal_circuit_stands_for_formulas(harvester):
    """No formula knows a bridge: its figure has the ideal circuit beside SPICE, with its label, and
    a note states so."""
    scene = EXAMPLES / "plate_bridge.toml"
    args = (
        "--engine",
        "published",
        "--engine",
        "averaged",
        "--trajectories",
        "64",
        "--duration",
        "20",
        "--json",
    )
    status, out, _ = harvester("sweep", str(scene), "--vary", "load.parameters.R=1M,2M", *args)
    told = json.loads(out)
    assert (status, {row["engine"] for row in told["rows"]}) == (0, {"ideal"})
    assert "computed in place of published and averaged" in str(told["diagnostics"])
    table = hv.sweep(
        scene,
        vary={"load.parameters.R": [1e6, 2e6]},
        engines=["averaged", hv.Ideal(trajectories=64, duration=20.0)],
    )
    assert table.engines == ["ideal"] and has(table.diagnostics, "stands_for_formulas")
    assert "ideal circuit (ensemble)" in [
        text.get_text() for one in table.plot().legends for text in one.get_texts()
    ]


@pytest.mark.parametrize(
    ("name", "asked", "computed", "formulas"),
    [
        ("plate_bridge", ["averaged", "spice"], ["ideal", "spice"], {"ideal": ["averaged"]}),
        ("plate_bridge", ["exact", "spice", "ideal"], ["spice", "ideal"], {"ideal": ["exact"]}),
        (
            "bimorph_board",
            ["published", "spice"],
            ["compiled", "spice"],
            {"compiled": ["published"]},
        ),
        ("plate_with_stop", ["averaged", "spice"], ["averaged", "spice"], {}),
    ],
)
def test_what_stands_for_a_formula(name, asked, computed, formulas):
    assert for_circuit(Problem.of(EXAMPLES / f"{name}.toml"), asked) == (computed, formulas)


@pytest.mark.parametrize(
    ("axes", "engines", "line"),
    [
        (
            ["load.resistance=1", "load.resistance=2"],
            1,
            "`vary` must name each only once, but names 'load.resistance'",
        ),
        (
            ["load.resistance=1"],
            2,
            "`engine` must name each only once, but names 'published' twice",
        ),
        (
            ["load.resistance=1k:2k:400", "piezo.coupling=1:2:400"],
            1,
            "`vary` must make at most 100000 points, but is",
        ),
        # the last point is impossible
        (["load.resistance=1k,1", "oscillator.mass=1,1e-50"], 1, "the power scale "),
        (["nondimensional.mu=1"], 1, "[oscillator] must be left out if [nondimensional] is given"),
    ],
)
def test_refused_before_anything_is_written(tmp_path, axes, engines, line):
    with pytest.raises(InputError, match=f"^{re.escape(line)}"):
        swept(
            PLATE,
            [read_axis(a) for a in axes],
            engines=[hv.Published()] * engines,
            out=tmp_path / "out",
        )
    assert not (tmp_path / "out").exists()


@pytest.fixture
def undrawn(monkeypatch):
    """No figure: it needs 0.3 s."""
    monkeypatch.setattr(plot, "save", lambda *_: None)


@pytest.fixture
def computed(monkeypatch, undrawn):
    """The load of every point that is computed, in order."""
    points = []
    run_many = engines.Published.run_many

    def counted(self, scenes):
        points.extend(scene.load.resistance for scene in scenes)
        return run_many(self, scenes)

    monkeypatch.setattr(engines.Published, "run_many", counted)
    return points


def resumed(out, scene=PLATE, axis=LOADS, engine=None):
    return swept(scene, [axis], engines=[engine or hv.Published()], out=out, resume=True)


def test_resume_computes_what_is_missing_or_failed(tmp_path, computed):
    before = resumed(tmp_path).text()  # a first run may be asked to resume, too
    assert computed == list(LOADS.values)
    assert resumed(tmp_path).text() == before
    assert computed == list(LOADS.values)
    lines = before.splitlines()
    lines[1] = "1000.0,published,,,,,,some error" + "," * (lines[0].count(",") - 7)
    # the last row lost, shuffled
    (tmp_path / "sweep.csv").write_text("\n".join([lines[0], *lines[:0:-1][1:]]) + "\n")
    after = resumed(tmp_path)
    # the whole batch, on which an answer's last digits depend
    assert computed[3:] == list(LOADS.values)
    assert [f"{row.mean_power.value:.9g}" for row in after.rows] == [
        line.split(",")[4] for line in before.splitlines()[1:]
    ]
    assert after.text().splitlines()[2] == lines[2]  # kept to the letter, its seconds too


@pytest.mark.parametrize("cut", [1, 9, 25, 40])
def test_resume_after_a_cut_off_row(tmp_path, computed, cut):
    """However much of the last row is lost, it is computed again; the others stay."""
    text = resumed(tmp_path).text()
    (tmp_path / "sweep.csv").write_text(text.rstrip("\n")[:-cut])
    assert resumed(tmp_path).text().splitlines()[:3] == text.splitlines()[:3]  # the seconds, too
    assert computed[3:] == list(LOADS.values)


@pytest.mark.parametrize(
    "damage",
    [
        b"",
        b"\xff\x00garbage",
        b"a,b\n1,2\n",
        b"load.resistance,engine\n1000.0,published\n",
        b'"\x00"\n,,,\n',
        b"[" * 100_000,
    ],
)
@pytest.mark.parametrize("name", ["sweep.csv", "provenance.json"])
def test_resume_over_damaged_files(tmp_path, computed, name, damage):
    resumed(tmp_path)
    (tmp_path / name).write_bytes(damage)
    assert len(resumed(tmp_path).rows) == 3
    assert computed[3:] == list(LOADS.values)
    json.loads((tmp_path / "provenance.json").read_text())


def test_resume_after_an_upgrade_says_so(tmp_path, computed):
    """In the rows that are kept, and on the screen: here those of a finished sweep."""
    resumed(tmp_path)
    about = json.loads((tmp_path / "provenance.json").read_text())
    about["versions"]["harvester"] = "0.0.1"
    (tmp_path / "provenance.json").write_text(json.dumps(about))
    after = resumed(tmp_path)
    assert computed == list(LOADS.values)
    said = f"kept from harvester 0.0.1, now harvester {hv.__version__}: last digits may differ"
    assert [str(row.warnings[0]) for row in after.rows] == [said] * 3
    assert f"warning: published: at 3 of 3 points: {said}" in str(after)


def test_files_of_version_0_1_are_refused(tmp_path, computed):
    """Their rows lack parts of the errors: they are neither used nor written over."""
    lines = resumed(tmp_path).text().splitlines()
    old = "".join(",".join(line.split(",")[:11]) + "\n" for line in lines)
    (tmp_path / "sweep.csv").write_text(old)
    with pytest.raises(
        InputError, match=r"^`resume` must find a sweep.csv of this version, but version 0.1 wrote"
    ):
        resumed(tmp_path)
    assert (tmp_path / "sweep.csv").read_text() == old


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("other", "what"),
    [
        ({"scene": PLATE.vary("oscillator.mass", 0.05)}, "scene_digest"),
        ({"axis": read_axis("load.resistance=1k:1M:3")}, "vary"),
        ({"engine": hv.Ensemble(trajectories=2)}, "engines"),
    ],
)
def test_resume_refuses_another_sweep(tmp_path, other, what):
    before = resumed(tmp_path).text()
    with pytest.raises(
        InputError, match=f"^`resume` must continue the same sweep, but {what} in '.*' is another"
    ):
        resumed(tmp_path, **other)
    assert (tmp_path / "sweep.csv").read_text() == before


@pytest.mark.usefixtures("undrawn")
def test_an_interrupted_sweep_never_takes_rows_of_another(tmp_path, monkeypatch):
    """Interrupted before its first point, a new sweep in an old folder has no rows to resume from."""
    resumed(tmp_path)

    def interrupt(*_):
        raise KeyboardInterrupt

    other = PLATE.vary("oscillator.mass", 0.05)
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(engines.Published, "run_many", interrupt)
        swept(other, [LOADS], engines=[hv.Published()], out=tmp_path)
    assert rows(tmp_path) == []
    assert (
        resumed(tmp_path, scene=other).rows[0].mean_power
        != resumed(tmp_path / "a").rows[0].mean_power
    )


@pytest.mark.usefixtures("undrawn")
def test_an_interrupted_resume_keeps_later_rows(tmp_path, monkeypatch):
    """While a lost first point is computed again, the finished later ones stay on disk."""
    lines = resumed(tmp_path).text().splitlines()
    (tmp_path / "sweep.csv").write_text("\n".join([lines[0], *lines[2:]]) + "\n")

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(engines.Published, "run_many", interrupt)
    with pytest.raises(KeyboardInterrupt):
        resumed(tmp_path)
    assert (tmp_path / "sweep.csv").read_text().splitlines()[1:] == lines[2:]


@pytest.mark.statistics
@pytest.mark.usefixtures("undrawn")
def test_the_cheapest_engine_of_each_point_is_resumed(tmp_path):
    """Rows bear the name of the engine that was chosen, and are found again under it."""
    axis = read_axis("nondimensional.restitution=0.8,0.96")
    options = {"within": 0.01, "trajectories": 512}

    def table():
        return swept(
            FIGURE,
            [axis],
            engines=[engines.engine("cheapest", **options)],
            out=tmp_path,
            resume=True,
        )

    first = table()
    assert [row.engine for row in first.rows] == ["ensemble", "averaged"]
    assert table().text() == first.text()  # the seconds too
    lines = first.text().splitlines()
    (tmp_path / "sweep.csv").write_text("\n".join(lines[:2]) + "\n")
    again = table()
    assert replace(again.rows[0], warnings=()) == replace(first.rows[0], warnings=())
    assert again.rows[1].mean_power == first.rows[1].mean_power


OTHER_TEXTS = pytest.mark.thorough("test_damaged_numbers_are_computed_anew")


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "nan",
        *(
            pytest.param(one, marks=OTHER_TEXTS)
            for one in ("\x00", "--", "inf", "1e999", "9" * 400, "'")
        ),
    ],
)
def test_damaged_numbers_are_computed_anew(tmp_path, harvester, text):
    """Whatever column of sweep.csv they are in: they were an internal error, or would be kept."""
    asked = (
        "sweep",
        str(EXAMPLES / "plate.toml"),
        "--vary",
        "load.resistance=1k:10M:3",
        "--engine",
        "averaged",
        "--out",
    )
    assert harvester(*asked, str(tmp_path))[0] == 0
    table = tmp_path / "sweep.csv"
    lines = table.read_text().splitlines()
    for name in ("mean_power", "mean_square_voltage", "seconds", "responses", "mean_power_bias"):
        cells = lines[2].split(",")
        cells[lines[0].split(",").index(name)] = text
        table.write_text("\n".join([*lines[:2], ",".join(cells), *lines[3:]]) + "\n")
        status, _, err = harvester(*asked, str(tmp_path), "--resume")
        assert (status, err) == (0, ""), name
        whole = [
            {k: v for k, v in row.items() if k != "seconds"}
            for row in csv.DictReader(table.read_text().splitlines())
        ]
        assert whole == [
            {k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(lines)
        ], name


def test_a_folder_in_the_place_of_a_file(tmp_path, harvester):
    """Bad input, as for sweep.csv: exit status 2."""
    (tmp_path / "sweep.nc").mkdir()
    asked = (
        "sweep",
        str(EXAMPLES / "plate.toml"),
        "--vary",
        "load.resistance=1k:10M:3",
        "--engine",
        "averaged",
    )
    line = "harvester: --out: cannot write sweep.nc over the existing one: Is a directory\n"
    assert harvester(*asked, "--out", str(tmp_path))[::2] == (2, line)


def test_points_have_independent_noise_unless_it_is_common():
    """Two points of one value differ by noise; with common noise they are the same answer."""
    points = {"nondimensional.mu": [1.0, 1.0 + 1e-9]}
    table = hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01, restitution=0.9)
    scene = hv.Scene(nondimensional=table)

    def powers(**options):
        engines = [hv.Ensemble(within="2%")]
        return hv.sweep(scene, vary=points, engines=engines, **options).rows

    first, second = (row.mean_power for row in powers())
    z = (first.value - second.value) / (first.stderr**2 + second.stderr**2) ** 0.5
    assert 1e-3 < abs(z) < 4.0
    first, second = (row.mean_power for row in powers(common_noise=True))
    assert abs(first.value - second.value) < 1e-4 * first.stderr
    assert [row.mean_power for row in powers()] == [row.mean_power for row in powers()]
