"""Each form of a file is read as the right value, and the page of the forms has the values that are read."""

import sys

import pytest

from harvester.records.current_trace import read_trace
from tests.support.file_forms import COUNT, FORMS, STEP, TRACES
from tests.support.paths import ROOT


@pytest.mark.parametrize("form", FORMS, ids=[f"{form.kind}, {form.name}" for form in FORMS])
def test_a_form_is_read_as_its_right_value(tmp_path, form):
    """An impedance without a known phase has its size alone."""
    assert form.value(tmp_path) == pytest.approx(form.right, rel=1e-6)


@pytest.mark.parametrize("name", TRACES)
def test_a_trace_keeps_its_duration_and_has_no_current_below_zero(tmp_path, name):
    (tmp_path / "a.csv").write_text(TRACES[name])
    states, notes = read_trace(str(tmp_path / "a.csv"))
    assert sum(length for _, length in states) == pytest.approx(COUNT * STEP, rel=1e-6)
    assert min(current for current, _ in states) >= 0.0
    assert "trace_below_zero" in {note.code for note in notes}


def test_the_page_has_the_forms(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "path", [str(ROOT / "benchmarks"), *sys.path])
    import file_forms

    assert (ROOT / "docs/file_forms.md").read_text() == file_forms.page(tmp_path)
