"""The doctor tells what is there, what is missing, and how to get it; it never fails."""

import pytest

from harvester.commands import doctor
from harvester.machine.provenance import PACKAGES


def lines():
    return {line.split()[1]: line for line in doctor.examine()}


@pytest.mark.ngspice
def test_all_is_well():
    found = lines()
    assert {"python", "harvester", "libngspice", "ngspice", "netlists", "machine", *PACKAGES} == set(found)
    assert not [line for line in found.values() if line.startswith("MISSING")]
    assert "bridge" in found["netlists"]


@pytest.mark.parametrize(
    ("library", "says"),
    [("/nonexistent", "run 'make setup' or 'apt-get install libngspice0 ngspice'"), ("/etc/passwd", "does not load")],
)
def test_no_ngspice(monkeypatch, library, says):
    monkeypatch.setenv("NGSPICE_LIBRARY_PATH", library)
    if library == "/etc/passwd":  # the workers keep the environment that they started with

        def refuse():
            raise OSError("cannot load library")

        monkeypatch.setattr("harvester.cosimulation.runs.ngspice_version", refuse)
    line = lines()["libngspice"]
    assert line.startswith("MISSING")
    assert says in line


@pytest.mark.ngspice
def test_a_package_that_is_missing(monkeypatch):
    monkeypatch.setattr("harvester.machine.provenance.versions", lambda: {"numba": ""})
    assert lines()["numba"] == "MISSING  numba            run 'make setup'"
