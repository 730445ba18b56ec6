"""How a study is carried out: the checks of `Execution`, and what studies report a `Progress`."""

import re

import pytest

import harvester as hv
from harvester.machine.automatic import AUTOMATIC, reporting
from harvester.machine.progress import NO_PROGRESS, CallingBack, PartOfProgress


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"workers": 0}, "`workers` must be between 1 and 1000, but is 0"),
        (
            {"workers": 2, "executor": object()},
            "`workers` must be left out if an `executor` is given",
        ),
        (
            {"resume": True},
            "`resume` must be used with `out`, the folder of the study, but there is none",
        ),
        ({"formats": ["svg"]}, "`formats` must be used with `out`"),
        ({"formats": ["eps"], "out": "a"}, "`formats` must be svg or pdf, but is 'eps'"),
        (
            {"progress": 1},
            "`progress` of an execution must be True, False or an object with the methods start, "
            "step and close, but is 1",
        ),
        ({"progress": print}, "`progress` of an execution must be True, False or an object"),
        ({"worker": 2}, "unknown argument of Execution 'worker': did you mean 'workers'?"),
    ],
)
def test_what_would_do_nothing_is_refused(fields, line):
    with pytest.raises(hv.InputError, match=f"^{re.escape(line)}"):
        hv.Execution(**fields)


@pytest.mark.parametrize("workers", [None, 1, 1000])
def test_both_ends_of_the_numbers_of_workers_are_accepted(workers):
    """One process alone, and as many as the message of a refusal names."""
    assert hv.Execution(workers=workers).workers == workers


@pytest.mark.parametrize(
    ("given", "listener"), [(None, AUTOMATIC), (True, AUTOMATIC), (False, NO_PROGRESS)]
)
def test_a_progress_is_on_by_default(given, listener):
    assert hv.Execution(progress=given).progress is listener


def test_a_progress_of_one_run_is_a_function():
    line = "`progress` must be True, False or a function of the fraction that is done, but is 'yes'"
    with pytest.raises(hv.InputError, match=f"^{re.escape(line)}$"), reporting("yes", "run"):
        pass


def test_parts_of_a_progress():
    """A part measured in rows, some of them done before, and one measured by its fraction, fill the whole."""
    told = []
    whole = CallingBack(lambda done, what: told.append((done, what)))
    rows = PartOfProgress(whole, 0.0, 0.5, "sweep")
    rest = PartOfProgress(whole, 0.5, 0.5)
    rows.start(2, "exact", done=1)
    rows.start(2, "spice")
    for engine in ("spice", "exact", "spice"):
        rows.step(1, engine)
    rest.start()
    rest.step(0.5, "paths")
    rest.step(1.0, "paths")
    expected = [(0.25, "sweep"), (0.375, "sweep"), (0.5, "sweep"), (0.75, "paths"), (1.0, "paths")]
    assert told == expected
