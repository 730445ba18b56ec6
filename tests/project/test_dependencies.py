"""Requirements: ranges in pyproject.toml, a tested version in constraints.txt, one name on the index."""

import re
import tomllib

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

import harvester as hv
from tests.support.paths import ROOT

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]
NAME = PROJECT["name"]
LOCK = [
    line
    for line in (ROOT / "constraints.txt").read_text().splitlines()
    if line and not line.startswith("#")
]


def requirements():
    """Every requirement of pyproject.toml, those of the build too, but for the project's own extras and packages."""
    groups = [
        PROJECT["dependencies"],
        *PROJECT["optional-dependencies"].values(),
        PYPROJECT["build-system"]["requires"],
    ]
    found = [Requirement(line) for group in groups for line in group]
    return [one for one in found if not canonicalize_name(one.name).startswith(NAME)]


def test_lock_file_pins_versions_and_nothing_else():
    """Lines NAME==VERSION, each name once: no address of a server, no path of a machine, no option of pip."""
    assert [line for line in LOCK if not re.fullmatch(r"[\w.-]+==[\w.+!]+", line)] == []
    names = [canonicalize_name(line.partition("==")[0]) for line in LOCK]
    assert len(set(names)) == len(names)
    assert NAME not in names


def test_each_dependency_is_pinned_in_its_range():
    """A dependency without a tested version, or a tested version outside the range that users get, is found."""
    pinned = {
        canonicalize_name(name): Version(version)
        for name, _, version in (line.partition("==") for line in LOCK)
    }
    assert [str(one) for one in requirements() if canonicalize_name(one.name) not in pinned] == []
    assert [
        str(one)
        for one in requirements()
        if pinned[canonicalize_name(one.name)] not in one.specifier
    ] == []


def test_dependencies_are_ranges():
    """A package that pins a dependency of its users cannot be installed beside others; each range has a lower bound."""
    users = [Requirement(line) for line in PROJECT["dependencies"]]
    assert [
        str(one) for one in users if {spec.operator for spec in one.specifier} - {">=", "<"}
    ] == []
    assert [str(one) for one in requirements() if not one.specifier] == []


def test_each_dependency_has_its_reason():
    """The line of pyproject.toml that names it states what it is for."""
    lines = (ROOT / "pyproject.toml").read_text().splitlines()
    for one in requirements():
        (line,) = {line for line in lines if re.match(rf'\s+"{one.name}[><=]', line)} or [""]
        assert "# " in line or one.name == "hatchling", one.name


def test_setup_takes_the_tested_versions():
    """`make setup` and `make bench` install under the lock file; both and pyproject.toml make the environment anew."""
    assert "--constraint constraints.txt" in (ROOT / "tools/setup.sh").read_text()
    makefile = (ROOT / "Makefile").read_text()
    assert re.search(
        r"^\.venv/\.complete: pyproject\.toml tools/setup\.sh constraints\.txt$",
        makefile,
        re.MULTILINE,
    )
    assert "--constraint constraints.txt --editable '.[bench]'" in makefile


def test_one_name_on_the_index():
    """Where pip is mentioned it gets the distribution's name: under `harvester` pip would install another project."""
    files = [
        path
        for folder in ("benchmarks", "docs", "examples", "harvester", "tests")
        for path in (ROOT / folder).rglob("*")
    ]
    for path in [*ROOT.iterdir(), *files]:
        if path.suffix in (".py", ".md", ".toml", ".sh") and "_build" not in path.parts:
            text = path.read_text()
            assert not re.search(r"(?<![\w\\-])harvester\[[a-z]", text), path
            assert not re.search(r"pip install (?:'|\")?harvester\b", text), path


def test_version_is_written_once():
    """The package states it, and the wheel reads it from there."""
    assert "version" not in PROJECT
    assert PYPROJECT["tool"]["hatch"]["version"]["path"] == "harvester/__init__.py"
    assert Version(hv.__version__) > Version("0")
