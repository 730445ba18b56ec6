"""Each construct of a netlist is read as ngspice reads it, or refused; docs/constructs.md is the table."""

import json
import sys
from pathlib import Path

import pytest

from harvester.errors import InputError
from tests.support import imposed_drive
from tests.support.constructs import ROWS, given_to_ngspice
from tests.support.ngspice_oracle import Oracle
from tests.support.paths import ROOT

TABLE = json.loads((ROOT / "tests/netlists/constructs.json").read_text())


@pytest.fixture
def file(tmp_path, monkeypatch):
    """A file in the present folder, from which messages name it."""
    monkeypatch.chdir(tmp_path)
    return Path("board.cir")


def test_the_table_has_the_rows():
    assert [row.name for row in ROWS] == list(TABLE)


@pytest.mark.slow
@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_a_construct_is_the_same_or_refused(row, file):
    """Another power than ngspice 39's, an answer to a construct that is refused, or a message that the table lacks."""
    file.write_text(row.text)
    known = TABLE[row.name]
    if known["spice"] == "refused":
        with pytest.raises(InputError) as error:
            given_to_ngspice(file)
        assert "\n" not in str(error.value)
        assert str(error.value) == known["why"]
        return
    mine = imposed_drive.answered(file)
    assert mine.given == (known["compiled"] in ("same", "as LTspice")), mine.why
    assert mine.why == known["why"]
    if mine.given:
        assert mine.power == pytest.approx(known.get("means", known["39"]), rel=1e-3, abs=1e-10)


@pytest.mark.ngspice
@pytest.mark.slow
def test_ngspice_gets_the_circuit_that_the_text_is(file):
    """Lines written for ngspice that are another circuit than the original text; and numbers that no ngspice gave."""
    wrong = {}
    with Oracle() as ask:
        for row in ROWS:
            if TABLE[row.name]["spice"] != "refused":
                file.write_text(row.text)
                original = ask(row._replace(body=row.means or row.body).text).power
                written = ask(given_to_ngspice(file), ("p", "0"), "r.xload.rload").power
                if written != pytest.approx(original, rel=1e-3, abs=1e-10):
                    wrong[row.name] = original, written
                assert original == pytest.approx(
                    TABLE[row.name].get("means", TABLE[row.name]["39"]), rel=1e-3, abs=1e-10
                ), row.name
    assert wrong == {}


def test_the_page_is_the_table(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import constructs

    assert (ROOT / "docs/constructs.md").read_text() == constructs.page(TABLE)
    assert "constructs" in sys.modules
