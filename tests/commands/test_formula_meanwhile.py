"""The text on a terminal while an engine compiles and computes: the answer of a formula, where one is honest."""

import re

import pytest

import harvester as hv
from harvester.commands.run import formula_line
from tests.support.paths import EXAMPLES
from tests.support.terminal import on_terminal


def line_of(name):
    return formula_line(hv.load(EXAMPLES / f"{name}.toml"))


def test_the_line_is_the_formula_with_its_error():
    power = hv.Averaged().run(hv.load(EXAMPLES / "plate_with_stop.toml")).mean_power
    assert (
        line_of("plate_with_stop")
        == f"meanwhile, by the formula of engine 'averaged': mean power {power.format('W')}"
    )
    assert "engine 'exact'" in line_of("plate")
    # never `published`, which does not know its error
    assert "averaged" in line_of("paper_figure3")


@pytest.mark.parametrize(
    "name", ["plate_bridge", "plate_sece", "plate_harmonic_stop", "plate_coloured"]
)
def test_no_line_where_no_formula_serves(name):
    """A circuit, or a shaking that no theory knows."""
    assert line_of(name) == ""


@pytest.mark.thorough("test_the_line_is_the_formula_with_its_error")
@pytest.mark.slow
def test_on_a_terminal_only(harvester, tmp_path):
    """With an empty cache, whose kernels need seconds, it is above the answer; in a pipe there is none."""
    words = (
        "run",
        EXAMPLES / "plate_with_stop.toml",
        "--engine",
        "ensemble",
        "--trajectories",
        "64",
    )
    status, screen = on_terminal(*words, env={"NUMBA_CACHE_DIR": str(tmp_path)}, timeout=120)
    assert status == 0
    assert re.search(
        r"meanwhile, by the formula of engine 'averaged': mean power .*ensemble: .* s, ",
        screen,
        re.DOTALL,
    )
    assert "meanwhile" not in "".join(map(str, harvester(*words)))
