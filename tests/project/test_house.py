"""The plan of the house: arrows point one way, and a light command loads nothing heavy."""

import ast
import subprocess
import sys

import pytest

import harvester as hv
from harvester.errors import CannotServeError
from tests.support.paths import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))


def imports():
    """Modules that the files of the package import anywhere, as (file, module)."""
    for file in sorted((ROOT / "harvester").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [f"{node.module}.{a.name}" for a in node.names]
            yield from ((file.relative_to(ROOT / "harvester").as_posix(), name) for name in names)


def test_one_file_imports_pyspice():
    assert {file for file, name in imports() if name.startswith("PySpice")} == {"circuit/ngspice/instance.py"}


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
