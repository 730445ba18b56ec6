"""On a terminal, a study's warnings of unusual values are there before its answer."""

import contextlib
import io

import click

from harvester import cli
from harvester.devices.device import scene_tables
from harvester.devices.scene_file import text
from harvester.scene.plausibility import unusual_values
from harvester.scene.toml import load
from tests.support.datasheet import SHEET

ODD = SHEET | {
    "acceleration_amplitude": "0.5 g",
    "drive_frequency": "50000 Hz",
    "resistance": "200 kohm",
}


class Terminal(io.StringIO):
    """A stream that claims to be a terminal."""

    def isatty(self):
        """Return True, as of one."""
        return True


def test_warnings_and_they_alone_are_printed_at_once(tmp_path):
    """Neither left out nor the notes instead; whoever waits for minutes reads them first."""
    path = tmp_path / "odd.toml"
    path.write_text(text(scene_tables(ODD)))
    warnings = [
        f"warning: {line}" for line in unusual_values(load(path)) if line.severity == "warning"
    ]
    screen = Terminal()
    with contextlib.redirect_stderr(screen), contextlib.redirect_stdout(io.StringIO()):
        assert cli.exit_status(["motion", str(path), "--duration", "1ms"]) == 0
    lines = click.unstyle(screen.getvalue()).splitlines()
    printed = [line for line in lines if line.startswith("warning: ")]
    assert printed == warnings and warnings
