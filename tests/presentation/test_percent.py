"""A percentage is printed with a space, as "0.5 %", in every sentence."""

import ast

from harvester.presentation.messages import catalogue, sentence
from tests.support.paths import ROOT


def test_a_sentence_has_a_space_before_the_sign():
    """One of a text, one with its sign, and one of a function."""
    text = sentence("netlist_gives", {"share": 0.5})
    assert text == "the netlist supplies 50 % of the load power: that fraction is not harvested"
    assert "changes E[V^2] by 1.2 %" in sentence("record_join", {"change": 0.0123})
    numbers = {"engine": "spice", "count": 1, "largest": 0.004}
    assert sentence("check_agrees", numbers).endswith("at the compared point: 0.4 % apart at most")


def test_no_code_formats_a_percentage_without_it():
    """The format "%" of Python has none; `in_percent` and a text of the catalogue have."""
    assert sum("%}" in text for text in catalogue().values() if isinstance(text, str)) > 10
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sorted((ROOT / "harvester").rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FormattedValue)
        and node.format_spec is not None
        and ast.unparse(node.format_spec).strip("'").endswith("%")
    ]
    assert found == []
