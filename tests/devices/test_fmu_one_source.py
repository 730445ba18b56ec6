"""The physics of an FMU is written once: its steps call the kernels' own functions, and none is a copy."""

import ast
import re
from pathlib import Path

import pytest

import harvester
from harvester.circuits import circuit_part, circuit_path, newton, substeps
from harvester.cosimulation.lockstep import any_mechanics
from harvester.cosimulation.part import model_part, port_circuits
from harvester.mechanics.kernels import (
    driver,
    equation_of_motion,
    ideal_circuit,
    intervals,
    offset_stops,
    one_mode,
    shaking,
    stored_energy,
)
from harvester.mechanics.kernels.compiled import strict
from harvester.mechanics.part import gridded, located, outside_forces, part_noise, part_state

PACKAGE = Path(harvester.__file__).parent
OF_FMU = ("mechanics/part", "devices/fmu", "cosimulation/part")
# Who steps in an FMU, and the one place of each function that it calls
CALLED = [
    (gridded, "drifted", driver),
    (gridded, "kick", equation_of_motion),
    (gridded, "carried", equation_of_motion),
    (gridded, "friction", equation_of_motion),
    (gridded, "spring", equation_of_motion),
    (gridded, "kick_at_stops", offset_stops),
    (gridded, "interval", intervals),
    (located, "kick_at_stops", offset_stops),
    (outside_forces, "kick", equation_of_motion),
    (outside_forces, "drift", equation_of_motion),
    (outside_forces, "interval", intervals),
    (part_noise, "shake", shaking),
    (part_state, "spring_energy", stored_energy),
    (part_state, "contact_energy", stored_energy),
    (port_circuits, "carried", equation_of_motion),
    (port_circuits, "dissipated", outside_forces),
    (port_circuits, "advance_load", circuit_path),
    (one_mode, "fly", ideal_circuit),
    (one_mode, "move", offset_stops),
]


def functions(paths):
    """The functions of files, by file and name: their statements as text, without docstrings."""
    found = {}
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                found[f"{path.relative_to(PACKAGE)}:{node.name}"] = "\n".join(
                    map(ast.unparse, body)
                )
    return found


@pytest.mark.parametrize(("where", "name", "home"), CALLED)
def test_a_step_calls_the_kernels_own_function(where, name, home):
    assert getattr(where, name) is getattr(home, name)
    source = Path(where.__file__).read_text()
    assert re.search(rf"\b{name}\(", source)
    assert not re.search(rf"^def {name}\(", source, re.MULTILINE)


@pytest.mark.slow
def test_no_function_of_an_fmu_is_a_copy():
    """No function of more than one line has the statements of a function elsewhere in the package."""
    own = functions(path for room in OF_FMU for path in (PACKAGE / room).rglob("*.py"))
    others = functions(
        path
        for path in PACKAGE.rglob("*.py")
        if not path.relative_to(PACKAGE).as_posix().startswith(OF_FMU)
    )
    bodies = {text: name for name, text in others.items() if text.count("\n") > 0}
    copies = {name: bodies[text] for name, text in own.items() if text in bodies}
    assert len(own) > 100
    assert copies == {}


def test_the_circuit_of_an_fmu_is_that_of_the_engine():
    """The compiled functions of a netlist are `follow` and the solver's source, as engine `compiled` calls them."""
    source = Path(circuit_part.__file__).read_text()
    assert "follow.function" in source
    assert circuit_part.follow is substeps.follow
    assert circuit_part.compiled_source is newton.compiled_source


def test_a_model_has_the_lock_step_of_cosimulate():
    """The state machine that the callbacks of ngspice call, compiled alike."""
    assert port_circuits.accept is strict(any_mechanics.accept_model)
    assert port_circuits.port_voltage is strict(any_mechanics.port_voltage)
    assert model_part.begin_part is strict(any_mechanics.begin_part)


def test_the_program_in_c_has_no_physics():
    """It calls the compiled part, and computes units and ranges alone."""
    for name in ("part.h", "instances.h", "fmi2.c", "fmi3.c"):
        text = (PACKAGE / "devices/fmu" / name).read_text()
        called = set(re.findall(r"\b(exp|sin|cos|tan|tanh|cosh|expm1|log1p|sqrt|pow)\(", text))
        assert called <= {"pow", "sqrt"}
        written = re.findall(r"\bw\[([\w ]+)\] *[-+*/]?= ", text)
        assert set(written) <= {"W_X", "W_SPEED", "W_VOLTAGE", "W_STORE", "W_FOLLOWER"}
