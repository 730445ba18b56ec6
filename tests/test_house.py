"""The plan of the house: arrows point one way, and a light command loads nothing heavy."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import harvester as hv
from harvester.errors import CannotServeError

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))


def imports(part):
    """Modules that the files of a part of the package import anywhere, as (file, module)."""
    path = ROOT / "harvester" / part
    for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{file}: a relative import hides from this test"
                names = [f"{node.module}.{a.name}" for a in node.names]
            yield from ((file.relative_to(ROOT / "harvester").as_posix(), name) for name in names)


@pytest.mark.parametrize(
    ("part", "never"),
    [
        ("errors.py", ["harvester"]),
        ("quantity.py", ["harvester"]),
        ("scene.py", ["harvester.scaling", "harvester.engines", "harvester.averaging", "harvester.mechanics", "numpy"]),
        ("scaling.py", ["harvester.engines", "harvester.averaging", "harvester.mechanics", "harvester.circuit"]),
        ("averaging", ["numba", "PySpice", "harvester.mechanics", "harvester.circuit", "harvester.engines"]),
        ("mechanics", ["PySpice", "harvester.circuit", "harvester.averaging", "harvester.engines"]),
        ("circuit", ["harvester.averaging", "harvester.engines"]),
        ("engines", ["harvester.studies", "harvester.sweep", "harvester.cli", "harvester.figures"]),
        *((part, ["harvester.commands"]) for part in ("engines", "studies", "sweeps", "optimum", "figures", "report")),
        (".", ["harvester.cli"]),
    ],
)
def test_direction(part, never):
    wrong = [
        (file, name)
        for file, name in imports(part)
        if file != "__main__.py" and any(f"{name}.".startswith(f"{one}.") for one in never)
    ]
    assert wrong == []


def test_one_file_imports_pyspice():
    assert {file for file, name in imports(".") if name.startswith("PySpice")} == {"circuit/ngspice.py"}


def test_formulas_need_neither_numba_nor_pyspice():
    """In a fresh interpreter, with both made impossible to import."""
    code = f"""
import sys
sys.modules["numba"] = sys.modules["PySpice"] = None
import harvester as hv
assert hv.Published().run(hv.load({str(EXAMPLES[0])!r})).mean_power.value > 0.0
assert hv.Averaged().run(hv.load({str(EXAMPLES[0])!r})).mean_power.value > 0.0
print(sorted(m for m in sys.modules if m in ("matplotlib", "loky", "harvester.mechanics", "harvester.circuit")))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    assert (done.stdout, done.stderr) == ("[]\n", "")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_examples(path):
    """Every example loads and says what it is; those with a load resistance have a power, by a formula if it can."""
    scene = hv.load(path)
    assert scene.title
    if scene.load is None or scene.load.netlist is None:
        try:
            answer = hv.Published().run(scene)
        except CannotServeError as error:
            assert "use engine 'ensemble'" in str(error)
            answer = hv.Ensemble(trajectories=64).run(scene)
        assert answer.mean_power.value > 0.0
