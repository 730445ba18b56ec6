"""The questions of `harvester new`: each field that is unknown, none that is known, a gap of a stop alone."""

import click
import pytest
from click.testing import CliRunner

from harvester.commands.questions import ask
from harvester.devices.datasheet import FIELDS
from tests.support.datasheet import NOISE, SHEET

KNOWN = {**SHEET, **NOISE, "resistance": "1 Mohm"}


def asked(known, *answers):
    """The lines of the terminal on which these answers were typed, and the fields after them."""
    texts = dict(known)

    @click.command()
    def questions():
        ask(texts, netlist=False)

    result = CliRunner().invoke(questions, input="".join(f"{answer}\n" for answer in answers))
    assert result.exit_code == 0, result.output
    return result.output, texts


@pytest.mark.parametrize(
    ("restitution", "gap", "asks_for_the_gap"), [("", "1 mm", False), ("0.9", "1 mm", True)]
)
def test_a_gap_is_asked_for_if_there_is_a_stop(restitution, gap, asks_for_the_gap):
    """An empty answer means no stop, of which a gap would be refused."""
    screen, texts = asked(KNOWN, restitution, gap)
    assert (FIELDS["restitution"].question in screen, FIELDS["gap"].question in screen) == (
        True,
        asks_for_the_gap,
    )
    added = {"restitution": restitution, "gap": gap} if asks_for_the_gap else {}
    assert texts == KNOWN | added


def test_a_stop_that_is_known_is_not_asked_for():
    """Neither of its fields."""
    known = KNOWN | {"restitution": "0.9"}
    screen, texts = asked(known)
    assert texts == known
    assert not any(FIELDS[name].question in screen for name in FIELDS)


def test_the_first_line_states_how_to_leave():
    """Whoever is asked learns of units and of ^C before the first question."""
    first = asked(KNOWN, "")[0].splitlines()[0]
    assert "^C leaves without a file" in first and "unit" in first
