"""The library's `name` is --name wherever a command prints it, and an option that would be ignored is an error."""

import pytest

import harvester as hv
from tests.support.datasheet import NOISE, SHEET
from tests.support.judge import refusal
from tests.support.paths import EXAMPLES

PLATE = str(EXAMPLES / "plate.toml")
FORMULA = ("--engine", "published")
NEW = [
    part
    for name, value in (SHEET | NOISE).items()
    for part in ("--" + name.replace("_", "-"), value)
]


def fail(*_, **__):
    raise hv.SimulationError("give a lower `dt_max`")


def stop(*_, **__):
    raise KeyboardInterrupt("the same command with `dt_max` goes on")


@pytest.mark.parametrize(
    ("args", "replaced", "by", "status"),
    [
        (("run", PLATE, *FORMULA), "engines.published.Published.run", fail, 3),
        (("run", PLATE, *FORMULA), "engines.published.Published.run", stop, 130),
        (
            ("sweep", PLATE, *FORMULA, "--vary", "load.resistance=1k,1M", "--out", "."),
            "engines.published.Published.run_many",
            lambda _, scenes: [hv.SimulationError("give a lower `dt_max`") for _ in scenes],
            3,
        ),
        (
            ("compare", PLATE, "--engine", "averaged", *FORMULA, "--json"),
            "engines.published.Published.run",
            fail,
            0,
        ),
        (("new", "a.toml", *NEW), "devices.interpretation.best_load", fail, 0),
        (("new", "a.toml", *NEW, "--json"), "devices.interpretation.best_load", fail, 0),
    ],
)
def test_arguments_are_printed_as_options(
    harvester, monkeypatch, tmp_path, args, replaced, by, status
):
    """In errors, answers, JSON, tables of a sweep and the text of a run that was stopped."""
    monkeypatch.chdir(tmp_path)
    for other in ("ensemble.Ensemble", "spice.spice.Spice"):
        monkeypatch.setattr(f"harvester.engines.{other}.run", fail)
    monkeypatch.setattr(f"harvester.{replaced}", by)
    code, out, err = harvester(*args)
    assert code == status
    assert "--dt-max" in out + err
    assert "`" not in out + err


def test_warnings_name_options(harvester):
    """As text and as JSON."""
    for form in ((), ("--json",)):
        out = harvester("run", PLATE, "--engine", "averaged", "--within", "0.01%", *form)[1]
        assert "--within 0.01 % cannot be guaranteed" in out
        assert "`" not in out


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (
            ("run", *FORMULA, "--trajectories", "5"),
            "--trajectories must be left out with engine 'published'",
        ),
        (
            ("run", "--engine", "ensemble", "--alone"),
            "--alone must be left out with engine 'ensemble'",
        ),
        (("run", "--within", "1%", "--alone"), "--alone must be left out with engine 'cheapest'"),
        (
            ("sweep", *FORMULA, "--vary", "load.resistance=1k,1M", "--out", "x", "--dt", "1"),
            "--dt must be left out with engine 'published'",
        ),
        (
            ("sweep", "--vary", "load.resistance=1k,1M", "--points", "x.csv", "--out", "x"),
            "either --vary or --points must be given, but both are",
        ),
        (
            (
                "sweep",
                "--vary",
                "load.resistance=1k,1M",
                "--out",
                "x",
                "--workers",
                "1",
                "--scheduler",
                "tcp://a:1",
            ),
            "--workers must be left out if --scheduler is given, but both are given",
        ),
        (
            (
                "optimise",
                "--vary",
                "load.resistance=1k:1M",
                "--engine",
                "averaged",
                "--duration",
                "1",
            ),
            "--duration must be left out with engine 'averaged'",
        ),
        (
            ("optimise", "--vary", "load.resistance=1k:1M", "--vector", "svg"),
            "--vector must be used with --out, the",
        ),
        (
            ("stability", "--vector", "svg"),
            "--vector must be used with --out, the folder of the figure, but --out is",
        ),
        (
            ("compare", "--json", "--vector", "pdf"),
            "--vector must be used with --out, the folder of the figure",
        ),
    ],
)
def test_an_option_that_would_be_ignored(harvester, monkeypatch, tmp_path, args, says):
    """Exit status 2, one line, nothing computed and nothing written; `harvester new` has its own test."""
    monkeypatch.chdir(tmp_path)
    command, *others = args
    status, out, err = harvester(command, PLATE, *others)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"harvester: {says}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["record", "identify"])
def test_errors_about_a_file_say_its_name(harvester, tmp_path, command):
    path = tmp_path / "shaker.csv"
    path.write_text("t,a\n0,1\n1,2\n2,1\n")
    status, _, err = harvester(command, path)
    assert status == 2
    assert err.startswith("harvester: FILE 'shaker.csv' ")


@pytest.mark.parametrize(
    "words",
    [
        ("keys", "x" * 100_000),
        ("run", "plate.toml", "x" * 100_000),
        ("tour", "a \u202e b"),
        ("explore", "--port", "9" * 100_000),
        ("charge", str(EXAMPLES / "plate_bridge.toml"), "--to", "1V", "--probe", "x" * 100_000),
    ],
    ids=range(5),
)
def test_an_error_is_one_line_that_can_be_read(harvester, words):
    """Odd words were repeated as they are: 100,000 letters, or characters that turn the line round."""
    assert refusal(*harvester(*words)) == ""
