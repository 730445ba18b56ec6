"""The doctor reports the present and the missing parts, and how to get them; it never fails."""

import json

import pytest

from harvester.commands import doctor
from harvester.machine import provenance
from harvester.machine.provenance import PACKAGES


def lines():
    return {str(part).split()[1]: str(part) for part in doctor.examine()}


@pytest.mark.ngspice
def test_all_is_well():
    found = lines()
    assert {
        "python",
        "harvester",
        "libngspice",
        "ngspice",
        "netlists",
        "machine",
        *PACKAGES,
        *doctor.OPTIONAL,
    } == set(found)
    assert not [line for line in found.values() if line.startswith("MISSING")]
    assert "bridge" in found["netlists"]


@pytest.mark.parametrize(
    ("library", "says"),
    [("/nonexistent", "run 'unset NGSPICE_LIBRARY_PATH'"), ("/etc/passwd", "does not load")],
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


@pytest.mark.ngspice
def test_an_optional_part_that_is_absent_is_no_fault(monkeypatch, harvester):
    monkeypatch.setattr(provenance, "version", lambda package: "" if package == "panel" else "1")
    assert lines()["panel"].startswith("absent ") and "piezo-harvester[explore]" in lines()["panel"]
    monkeypatch.undo()
    status, out, _ = harvester("doctor", "--json")
    found = json.loads(out)
    assert (
        status == 0
        and found["numpy"]["found"]
        and found["panel"]["optional"]
        and not found["numba"]["optional"]
    )


def test_a_flat_netlist_needs_no_terminals(harvester, tmp_path, monkeypatch):
    """Nor those of a scene: its elements are all outside of subcircuits, whether these are called or not."""
    monkeypatch.chdir(tmp_path)
    lines = ["* a board", "D1 PZ1 OUT DX", ".subckt leak a b", "R1 a b 1Meg", ".ends"]
    lines += ["X1 OUT 0 leak", "R1 OUT 0 220k", "O1 OUT 0 PZ1 0 lossy", ".model DX D(Is=1u)"]
    (tmp_path / "board.cir").write_text("\n".join([*lines[:7], *lines[8:], ".end"]) + "\n")
    status, out, _ = harvester("doctor", "board.cir")
    assert status == 0 and "works    x1.r1" in out
    assert out.splitlines()[-1].startswith("engine 'compiled' supports 3 of 3 elements")
    (tmp_path / "board.cir").write_text("\n".join([*lines, ".end"]) + "\n")
    status, _, err = harvester("doctor", "board.cir")
    assert status == 2 and err.count("\n") == 1 and "is 'o1'" in err
