"""The docstrings of public names: parameters, returned values, errors and fields are there, and names are public."""

import dataclasses
import inspect
import re

import pytest

import harvester as hv
from harvester.presentation.result import Result

PUBLIC = {name: getattr(hv, name) for name in hv.__all__}
FUNCTIONS = [name for name, one in PUBLIC.items() if inspect.isfunction(one)]
CLASSES = [name for name, one in PUBLIC.items() if dataclasses.is_dataclass(one)]
# Names that docstrings write between backticks beside those of the package: of Python and of its
# libraries.
OTHERS = {"concurrent.futures"}


def section(text, title):
    """The lines of a section of a docstring; none where there is no such section."""
    found = re.search(
        rf"^{title}\n-+\n(.*?)(?=\n\n|\n\w+\n---|\Z)",
        inspect.cleandoc(text),
        re.MULTILINE | re.DOTALL,
    )
    return found[1].splitlines() if found else []


def entries(text, title):
    """The names that a section explains."""
    return {name for names, _ in described(text, title) for name in names.split(", ")}


def described(text, title):
    """The names of each entry of a section, and their type in words."""
    lines = [line for line in section(text, title) if line[:1].strip()]
    return [(names, kind) for names, _, kind in (line.partition(" : ") for line in lines)]


def docstrings(name):
    """The docstrings of a public name: its own, and those of its public methods."""
    one = PUBLIC[name]
    yield inspect.getdoc(one)
    if inspect.isclass(one):
        for key, part in inspect.getmembers(one):
            if not key.startswith("_") and (inspect.isfunction(part) or isinstance(part, property)):
                yield inspect.getdoc(part) or ""


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_explains_what_it_takes_gives_and_raises(name):
    text = PUBLIC[name].__doc__
    assert entries(text, "Parameters") == set(inspect.signature(PUBLIC[name]).parameters)
    assert section(text, "Returns")
    for error in entries(text, "Raises"):
        assert issubclass(PUBLIC[error], hv.HarvesterError)
    assert section(text, "Raises")


@pytest.mark.parametrize("name", [*FUNCTIONS, *CLASSES])
def test_a_parameter_has_its_type(name):
    """`help()` shows the docstring alone; options that a function hands on are listed where they belong."""
    for title in ("Parameters", "Attributes"):
        entry = described(PUBLIC[name].__doc__, title)
        assert [names for names, kind in entry if not kind and names != "options"] == []


@pytest.mark.parametrize("name", hv.__all__)
def test_an_example_has_a_heading(name):
    """Else napoleon reads it as a part of the section before, such as Raises."""
    before, found, _ = (inspect.getdoc(PUBLIC[name]) or "").partition(">>>")
    assert not found or re.search(r"^Examples\n-+\n(?:.+\n|\n)*\Z", before, re.MULTILINE)


@pytest.mark.parametrize("name", CLASSES)
def test_a_class_explains_its_fields(name):
    """The names of a result but for inner ones, under Attributes; else those that it is made of, under Parameters."""
    one = PUBLIC[name]
    fields = {field.name for field in dataclasses.fields(one)}
    inner = {"samples", "power_samples", "tornado", "nominal", "spreads"} & fields
    told = entries(one.__doc__, "Attributes" if issubclass(one, Result) else "Parameters")
    assert (fields - told - inner, told - fields) == (set(), set())


@pytest.mark.parametrize("name", hv.__all__)
def test_names_in_docstrings_are_public(name):
    """What is between backticks can be had from `harvester`, or is an attribute of the class itself."""
    for text in docstrings(name):
        prose = re.sub(r"^>>>.*?(?=\n\n|\Z)", "", text, flags=re.MULTILINE | re.DOTALL)
        for written in re.findall(r"(?<!`)`([A-Za-z_][\w.]*)`(?!`)", prose):
            whole = written.removeprefix("harvester.").removeprefix("hv.")
            first, _, rest = whole.partition(".")
            own = hasattr(PUBLIC[name], whole) or whole in getattr(
                PUBLIC[name], "__dataclass_fields__", ()
            )
            public = first in PUBLIC and (not rest or hasattr(PUBLIC[first], rest))
            assert own or public or written in OTHERS, (
                f"{name}: `{written}` in {text.splitlines()[0]!r}"
            )
