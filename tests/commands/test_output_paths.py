"""One rule for the path of each output: its missing folder is made, and a name that no file has is refused."""

import pytest

from tests.support.judge import refusal
from tests.support.paths import EXAMPLES

PLATE = EXAMPLES / "plate.toml"
NEW = "--mass 40g --frequency 3.2Hz --q 100 --capacitance 40nF --coupling 1mN/V"
LINES = [
    f"new {{path}}.toml {NEW}",
    "examples plate --out {path}.toml",
    f"export {PLATE} --out {{path}}.lib",
    "keys --schema --out {path}.json",
    f"record {EXAMPLES / 'shake.csv'} --out {{path}}.csv",
    f"run {PLATE} --engine averaged --report {{path}}.html",
    pytest.param(
        f"identify {EXAMPLES / 'bench_impedance.csv'} --out {{path}}.toml", marks=pytest.mark.slow
    ),
]


@pytest.mark.parametrize("line", LINES)
def test_the_missing_folder_of_an_output_is_made(tmp_path, monkeypatch, harvester, line):
    """`identify`, `record` and --report made it; `new`, `examples` and `export` refused it."""
    monkeypatch.chdir(tmp_path)
    status, _, err = harvester(*line.format(path="a/b/c").split())
    assert (status, err) == (0, "")
    assert [path for path in (tmp_path / "a" / "b").iterdir() if path.stem == "c"]


@pytest.mark.parametrize("line", LINES)
def test_a_folder_that_cannot_be_made_is_one_line(tmp_path, monkeypatch, harvester, line):
    """And nothing is left."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").write_text("a file")
    status, out, err = harvester(*line.format(path="a/b/c").split())
    assert refusal(status, out, err) == ""
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_refused_measurement_leaves_no_folder(tmp_path, monkeypatch, harvester):
    """The folder was made before the file was read."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("f (Hz),|Z| (ohm)\n1,2\n")
    for line in ("identify a.csv --out b/c.toml", "record a.csv --out b/c.csv"):
        assert harvester(*line.split())[0] == 2
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


@pytest.mark.parametrize("name", ["", ".", "..", "/", "a/.."])
@pytest.mark.parametrize(
    "line",
    [
        "examples plate --out",
        f"export {PLATE} --out",
        "keys --schema --out",
        f"export {PLATE} --fmu",
        f"record {EXAMPLES / 'shake.csv'} --out",
        f"identify {EXAMPLES / 'bench_impedance.csv'} --out",
        f"adopt {EXAMPLES / 'deck.net'} --out",
        "new",
    ],
)
def test_a_name_that_no_file_has(tmp_path, monkeypatch, harvester, line, name):
    """`keys --schema --out .` was an internal error, and `examples plate --out ''` wrote plate.toml."""
    monkeypatch.chdir(tmp_path)
    status, out, err = harvester(*line.split(), name)
    assert refusal(status, out, err) == ""
    assert list(tmp_path.iterdir()) == []
