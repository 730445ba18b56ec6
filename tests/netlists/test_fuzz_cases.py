"""Random netlists, those that were once read otherwise than ngspice reads them, and boards as they are written.

The netlist of a seed has the fewest lines that showed the fault; a board may not be refused.
"""

import json

import pytest

from tests.support import imposed_drive
from tests.support.netlist_grammar import is_rough, netlist
from tests.support.ngspice_oracle import LONGEST_STEP, Oracle, by_program
from tests.support.paths import ROOT

FOLDER = ROOT / "tests/netlists/fuzz_cases"
CASES = json.loads((FOLDER / "answers.json").read_text())
SEEDS = range(900_001, 900_201)


def agree(text, theirs, mine):
    """Whether two powers are equal as far as two integrations can be."""
    return mine.power == pytest.approx(theirs, rel=5e-3 if is_rough(text) else 1e-3, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CASES))
def test_a_kept_netlist_is_answered_as_ngspice_does_or_refused(name):
    """A reader that falls back into one of these faults, of scopes, precedence, multiplicity, models and the like."""
    file = FOLDER / f"{name}.cir"
    known = CASES[name]
    mine = imposed_drive.answered(file, known.get("terminals"), known.get("resistor"))
    assert mine.given or not known.get("served"), mine.why
    if mine.given and "power" in known:
        assert agree(file.read_text(), known["power"], mine)


@pytest.mark.ngspice
@pytest.mark.slow
def test_the_numbers_kept_are_those_of_ngspice():
    """Numbers that no ngspice gives: the program in batch mode gives the first and last of them."""
    answered = [name for name in sorted(CASES) if "power" in CASES[name]]
    for name in (answered[0], answered[-1]):
        given = (
            (CASES[name]["terminals"], CASES[name]["resistor"])
            if "terminals" in CASES[name]
            else ()
        )
        said = by_program((FOLDER / f"{name}.cir").read_text(), *given)
        assert said.power == pytest.approx(CASES[name]["power"], rel=1e-3, abs=1e-12)


@pytest.mark.ngspice
@pytest.mark.slow
def test_random_netlists_are_answered_as_ngspice_does_or_refused(tmp_path):
    """Two readings of one text: 200 random netlists are equal, or refused by one of both."""
    file = tmp_path / "board.cir"
    wrong = []
    answered = 0
    with Oracle() as ask:
        for seed in SEEDS:
            file.write_text(netlist(seed))
            mine = imposed_drive.answered(file)
            if not mine.given:
                continue
            theirs = ask(file.read_text())
            answered += theirs.given
            if theirs.given and not agree(file.read_text(), theirs.power, mine):
                fine = ask(file.read_text(), step=LONGEST_STEP / 5.0)
                mine = imposed_drive.by_machine(imposed_drive.read(file), 1e-5, LONGEST_STEP)
                if not agree(file.read_text(), fine.power, mine):
                    wrong.append((seed, fine, mine))
    assert not wrong
    assert answered > 0.4 * len(SEEDS)
