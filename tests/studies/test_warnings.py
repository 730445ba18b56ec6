"""Every study of one scene warns of values that no device has, as `run` does, in its text and as JSON."""

import json

import pytest

from tests.support.paths import EXAMPLES
from tests.support.terminal import on_terminal

ODD = (EXAMPLES / "plate_harmonic.toml").read_text()
for usual, odd in (("40 g", "4e6 kg"), ("16 N/m", "1.6e9 N/m"), ("6.4e-3 N", "6.4e5 N")):
    ODD = ODD.replace(usual, odd)
STUDIES = {
    "motion": ["--duration", "1"],
    "response": ["--sweep", "3Hz:5Hz:3"],
    "stability": ["--trajectories", "2"],
}


@pytest.mark.parametrize(
    "study",
    [pytest.param(one, marks=[] if one == "stability" else [pytest.mark.slow]) for one in STUDIES],
)
def test_an_odd_value_is_doubted(study, tmp_path, harvester):
    (tmp_path / "odd.toml").write_text(ODD)
    words = [study, tmp_path / "odd.toml", *STUDIES[study]]
    out = [] if study == "stability" else ["--out", tmp_path / "out"]
    status, said, _ = harvester(*words, *out)
    assert status == 0
    assert "warning: oscillator.mass is 4e+06 kg, far outside" in said
    assert "is 4 g meant?" in said
    if study != "motion":  # whose path is a file
        assert "is 4 g meant?" in " ".join(
            json.loads(harvester(*words, *out, "--json")[1])["warnings"]
        )


@pytest.mark.slow
def test_a_terminal_is_warned_before_the_run(tmp_path):
    """Also of a run that ends in an error; a pipe has the warnings in the answer alone."""
    (tmp_path / "odd.toml").write_text(ODD)
    status, screen = on_terminal(
        "run", tmp_path / "odd.toml", "--engine", "published", env={"NO_COLOR": "1"}
    )
    first, last = (
        screen.index("warning: oscillator.mass is 4e+06 kg, far outside"),
        screen.index("harvester: "),
    )
    assert status != 0 and first < last
