"""The conda recipe, the devcontainer and the workflows state what pyproject.toml and the Makefile state."""

import json
import re
import tomllib

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import harvester as hv
from tests.support.paths import ROOT

RECIPE = yaml.safe_load((ROOT / "packaging" / "conda" / "recipe.yaml").read_text())
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
DEVCONTAINER = ROOT / ".devcontainer" / "devcontainer.json"
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
ELSEWHERE = {"matplotlib": "matplotlib-base"}  # conda-forge's name for it without windows
ONLY_THERE = {"python", "ngspice-lib"}


def wanted(name, bounds):
    """A requirement in one spelling."""
    return canonicalize_name(name), ",".join(sorted(bounds.split(",")))


def test_conda_recipe_has_the_same_requirements():
    """Each with its range, and nothing besides."""
    pip = {wanted(ELSEWHERE.get(one.name, one.name), str(one.specifier))
           for one in map(Requirement, PROJECT["dependencies"])}  # fmt: skip
    conda = [line.partition(" ") for line in RECIPE["requirements"]["run"]]
    assert {wanted(name, bounds) for name, _, bounds in conda if name not in ONLY_THERE} == pip


def test_conda_recipe_is_of_this_version():
    assert RECIPE["context"]["version"] == hv.__version__
    assert PROJECT["requires-python"] == f">={RECIPE['context']['python_min']}"
    assert (RECIPE["package"]["name"], RECIPE["about"]["license"]) == (
        PROJECT["name"],
        PROJECT["license"],
    )
    (name, target), *_ = PROJECT["scripts"].items()
    assert RECIPE["build"]["python"]["entry_points"] == [f"{name} = {target}"]


@pytest.mark.parametrize("path", [DEVCONTAINER, *WORKFLOWS], ids=lambda path: path.name)
def test_what_it_makes_is_in_the_makefile(path):
    text = path.read_text()
    assert json.loads(text) if path == DEVCONTAINER else yaml.safe_load(text)
    targets = re.findall(r"\bmake ([\w-]+)", text)
    assert targets
    makefile = (ROOT / "Makefile").read_text()
    assert [one for one in targets if not re.search(rf"^{one}:", makefile, re.MULTILINE)] == []
