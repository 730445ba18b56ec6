"""How a study is carried out: the checks of `Execution`, and what studies tell a `Progress`."""

import re

import pytest

import harvester as hv
from harvester.machine.execution import as_in_version_0_1, calls_with_name
from harvester.machine.progress import CallingBack, PartOfProgress


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
            "`resume` must go with `out`, the folder of the study, but there is none",
        ),
        ({"formats": ["svg"]}, "`formats` must go with `out`"),
        ({"formats": ["eps"], "out": "a"}, "`formats` must be svg or pdf, but is 'eps'"),
        ({"worker": 2}, "unknown argument of Execution 'worker': did you mean 'workers'?"),
    ],
)
def test_what_would_do_nothing_is_refused(fields, line):
    with pytest.raises(hv.InputError, match=f"^{re.escape(line)}"):
        hv.Execution(**fields)


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


@as_in_version_0_1("engines", adapter=calls_with_name)
def study(scene, *, engines=(), execution=None):
    """A study of today."""
    execution.progress.step(1, scene)
    return engines, execution


def test_a_call_of_version_0_1_still_works_and_warns(tmp_path):
    told = []
    with pytest.warns(DeprecationWarning) as caught:
        engines, execution = study(
            "scene", ["spice"], tick=told.append, out=tmp_path, vector=["svg"], workers=2
        )
    assert (engines, told) == (["spice"], ["scene"])
    assert execution == hv.Execution(
        workers=2, out=tmp_path, formats=["svg"], progress=execution.progress
    )
    assert [str(one.message) for one in caught] == [
        "study takes `engines` by keyword only from version 0.3 on",
        "study takes `workers`, `out`, `formats`, `progress` in execution=hv.Execution(...) from version 0.3 on",
    ]
    assert {one.filename for one in caught} == {__file__}
    with (
        pytest.raises(hv.InputError, match="study must have `out` in its `execution`"),
        pytest.warns(),
    ):
        study("scene", out=tmp_path, execution=hv.Execution())
    with pytest.raises(hv.InputError, match="at most 2 arguments without a name"):
        study("scene", 1, 2)


@as_in_version_0_1(executes=False, over="vary")
def renamed(scene, *, vary):
    """A study one of whose keywords had another name."""
    return vary


def test_a_keyword_that_had_another_name():
    with pytest.warns(
        DeprecationWarning, match=r"^renamed takes `over` as `vary` from version 0\.3 on$"
    ):
        assert renamed("scene", over=1) == 1
    assert renamed("scene", vary=2) == 2
