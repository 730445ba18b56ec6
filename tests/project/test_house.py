"""The plan of the house: layers, small rooms, one name a thing, docstrings, and tests that use what users use."""

import ast
import re
import subprocess
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

import harvester as hv
from harvester.errors import CannotServeError
from tests.support import house
from tests.support.house import PACKAGE, parsed, walked
from tests.support.paths import ROOT

# What may only fall: a number of tests/support/house.py, the most that it may be today, and what it
# is to become. Whoever lowers a number writes it here; `python -m tests.support.house NAME` prints
# the places.
BOUNDS = [
    ("functions above 15 branches", 0, 0),
    ("functions above 12 parameters", 0, 0),
    ("base names of several files", 8, 8),
    ("tests of engines outside engines", 0, 0),
    ("1.96 outside uncertainty", 0, 0),
    ("sentences read by code", 0, 0),
    ("words made outside messages", 0, 0),
    ("vague names", 0, 0),
    ("tuple assignments of unlike things", 0, 0),
    ("calls f(*packed)", 1, 0),
    ("calls with seven positional arguments", 7, 7),
    ("questions of which load or how many modes", 67, 60),
    ("one-importer modules", 87, 25),
    ("lines above 100 columns", 2605, 0),
    ("thousands of tokens", 633, 445),
]

EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))
PAPER = ROOT / "examples" / "paper_figure3.toml"
TESTS = ROOT / "tests"
LONGEST = 350  # lines of a file that does not state why it has more
MOST = 8  # files in the package's root


def imported(folder):
    """Each file below a folder with a name that it imports anywhere, whole: `from a.b import c` is a.b.c."""
    for file, node in walked(ast.Import, ast.ImportFrom, folder=folder):
        before = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
        yield from ((file, before + alias.name) for alias in node.names)


def documented(tree):
    """Modules, classes and functions of a file, but for functions inside functions, with their docstrings."""
    yield tree.body[0].lineno if tree.body else 1, ast.get_docstring(tree)
    waiting = [tree]
    while waiting:
        for node in waiting.pop().body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                yield node.lineno, ast.get_docstring(node)
            if isinstance(node, ast.ClassDef):
                waiting.append(node)


@pytest.mark.parametrize(("name", "most", "target"), BOUNDS, ids=[name for name, *_ in BOUNDS])
def test_what_may_only_fall(name, most, target):
    """A number above its bound is a step back, whose places `python -m tests.support.house` prints."""
    assert target <= most
    assert len(list(house.MEASURES[name]())) <= most


def test_every_measure_has_a_bound():
    assert list(house.MEASURES) == [name for name, *_ in BOUNDS]


def test_places_of_a_measure_by_its_name(monkeypatch, capsys):
    """A name represents itself: its parentheses and its star are letters."""
    name = "calls f(*packed)"
    monkeypatch.setattr(house, "MEASURES", {name: lambda: ["a.py:1: f(*x)"], "other": list})
    monkeypatch.setattr(sys, "argv", ["house", name])
    house.main()
    assert capsys.readouterr().out.splitlines() == [
        f"     1  {name}",
        "        a.py:1: f(*x)",
        "     0  other",
    ]
    monkeypatch.setattr(sys, "argv", ["house", "nothing"])
    with pytest.raises(SystemExit, match="no measure has 'nothing' in its name"):
        house.main()


FAULTS = """
import numpy as np
SPENT = "the budget is spent"
def a(p1, p2, p3, p4, p5, p6, p7, p8, p9, p10, p11, p12, p13):
    found = other.warnings.append(f"{p1} is too large")
    return Answer(value, reason="nobody knows it", low=value - 1.96 * stderr)
def why(answer):
    if answer.warnings[0].startswith(SPENT) or isinstance(engine, Spice) or engine == "spice":
        return "it was slow"
    raise InputError("`within` must be a number")
from harvester.studies import two
def packed(device, values):
    low, high = 0.0, why(device)
    if device.circuit is None or isinstance(device.circuit, IdealCircuit):
        return a(1, 2, 3, 4, 5, 6, 7)
    def several(*items):
        return a(*items) + several(*values) + np.a(*values)
    return a(*values)  # a comment that is so long that its line has more columns than a hundred, as few have
"""


def test_each_measure_finds_what_it_counts(tmp_path, monkeypatch):
    """The places in small files are known; a sentence of an error of bad input counts nowhere."""
    texts = {
        "engines/spice.py": 'class Spice:\n    NAME = "spice"\n',
        "studies/one.py": FAULTS,
        "studies/two.py": "",
        "averaging/one.py": "",
    }
    for name, text in texts.items():
        (tmp_path / "harvester" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "harvester" / name).write_text(text)
    for name, folder in [("ROOT", tmp_path), ("PACKAGE", tmp_path / "harvester")]:
        monkeypatch.setattr(house, name, folder)
    cached = (
        "engines",
        "names_of_sentences",
        "own_functions",
        "functions_of_any_number",
        "names_of_libraries",
    )
    for name in cached:
        monkeypatch.setattr(house, name, cache(getattr(house, name).__wrapped__))
    monkeypatch.setattr(house, "MOST_BRANCHES", 3)
    found = {name: len(list(places())) for name, places in house.MEASURES.items()}
    assert found == {
        "functions above 15 branches": 1,
        "functions above 12 parameters": 1,
        "base names of several files": 1,
        "tests of engines outside engines": 2,
        "1.96 outside uncertainty": 1,
        "sentences read by code": 1,
        "words made outside messages": 3,
        "vague names": 1,
        "tuple assignments of unlike things": 1,
        "calls f(*packed)": 1,
        "calls with seven positional arguments": 1,
        "questions of which load or how many modes": 2,
        "one-importer modules": 1,
        "lines above 100 columns": 1,
        "thousands of tokens": 0,
    }


def test_layers_and_no_circles():
    """Import-linter's contracts in pyproject.toml: arrows point one way, for annotations as well."""
    done = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout
    assert "0 broken" in done.stdout


def test_few_files_in_the_root():
    assert len([path for path in PACKAGE.iterdir() if path.is_file()]) <= MOST


# What Windows lacks, and how the others differ: harvester/machine/system/ has it, and its tests for
# each system.
OF_ONE_SYSTEM = {
    "import": {"fcntl", "grp", "msvcrt", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty", "winreg"},
    "os": {"O_CLOEXEC", "O_NONBLOCK", "O_PATH", "chroot", "fchdir", "fork", "geteuid", "getpgid", "getuid", "killpg",
           "mkfifo", "name", "nice", "register_at_fork", "setsid", "sysconf", "uname", "wait", "waitpid"},
    "signal": {"SIGKILL", "SIGHUP", "SIGPIPE", "SIGALRM", "alarm", "pthread_sigmask", "setitimer", "sigwait"},
    "sys": {"platform", "getwindowsversion"},
    "platform": {"system"},
    "ctypes": {"WinDLL", "windll"},
}  # fmt: skip
FOLDERS = re.compile(r"/(proc|dev/shm|sbin|usr|opt|tmp)\b")


def of_one_system():
    """Each file with what it names that not every operating system has: modules, their members, folders in strings."""
    yield from (
        one for one in imported(PACKAGE) if one[1].partition(".")[0] in OF_ONE_SYSTEM["import"]
    )
    for file, node in walked(ast.Attribute):
        if isinstance(node.value, ast.Name) and node.attr in OF_ONE_SYSTEM.get(node.value.id, ()):
            yield file, f"{node.value.id}.{node.attr}"
    texts = {id(node.body[0].value) for _, node in walked(ast.Module, ast.ClassDef, ast.FunctionDef)
             if ast.get_docstring(node, clean=False)}  # fmt: skip
    for file, node in walked(ast.Constant):
        if isinstance(node.value, str) and id(node) not in texts:
            yield from ((file, folder) for folder in FOLDERS.findall(node.value))
    for file, node in walked(ast.keyword):
        if node.arg in ("start_new_session", "preexec_fn", "creationflags"):
            yield file, node.arg


def test_one_room_knows_operating_systems():
    """Elsewhere nothing asks which system it is, and nothing is used that one of them lacks."""
    faults = set(of_one_system())
    inside = {name for name, _ in faults if name.startswith("harvester/machine/system/")}
    assert inside == {
        f"harvester/machine/system/{name}.py" for name in ("__init__", "posix", "windows")
    }
    assert {(name, found) for name, found in faults if name not in inside} == set()


@pytest.mark.slow
@pytest.mark.thorough("test_one_room_knows_operating_systems")
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_types_hold_on_other_systems(system):
    """Mypy reads the standard library as that system has it: what it lacks there is an error."""
    command = [sys.executable, "-m", "mypy", "--platform", system]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=900
    )
    assert done.returncode == 0, done.stdout


def test_files_are_short():
    """A file above 350 lines states in its docstring why: "long because ..."."""
    whole = {name: (ROOT / name).read_text() for name in parsed()}
    long = [name for name, text in whole.items() if text.count("\n") > LONGEST]
    assert [
        name
        for name in long
        if "long because" not in " ".join(ast.get_docstring(parsed()[name]).split()).lower()
    ] == []


def test_one_class_a_name():
    """Whoever reads a class's name in an error or a signature finds one place."""
    names = Counter(node.name for _, node in walked(ast.ClassDef) if not node.name.startswith("_"))
    assert [name for name, times in names.items() if times > 1] == []


def test_docstrings_open_with_a_sentence():
    """The first line starts with a capital and ends with a period, in private functions too where they have any.

    That all public ones have a docstring is ruff's to state.
    """
    sentence = re.compile(r"[A-Z0-9`\"'(*].*[.?!:]\)?$")
    faults = [
        f"{name}:{line}: {text.splitlines()[0]}"
        for name, tree in parsed().items()
        for line, text in documented(tree)
        if text
        and (not sentence.match(text.splitlines()[0]) or len(text.splitlines()[0].split()) < 2)
    ]
    assert faults == []


def test_no_test_file_imports_another():
    """What two files of tests need is in tests/support."""
    assert [
        (name, what)
        for name, what in imported(TESTS)
        if re.match(r"tests\.(?!support\b)|test_|.*\.test_", what) or what.startswith("None.")
    ] == []


def test_tests_use_no_private_name():
    """A private name may change without a test: none is imported, and none is imported from a module or the package."""
    modules = {(file, alias.asname or alias.name.partition(".")[0])
               for file, node in walked(ast.Import, ast.ImportFrom, folder=TESTS) for alias in node.names
               if (getattr(node, "module", None) or alias.name).startswith("harvester")}  # fmt: skip
    private = [
        (file, what)
        for file, what in imported(TESTS)
        if re.search(r"\._(?!_)", what) and what.startswith("harvester")
    ]
    taken = [
        (file, f"{node.value.id}.{node.attr}")
        for file, node in walked(ast.Attribute, folder=TESTS)
        if isinstance(node.value, ast.Name)
        and (file, node.value.id) in modules
        and re.match(r"_(?!_|repr_)", node.attr)
    ]
    assert private + taken == []


def test_public_names_are_written_once():
    """One line of __init__.pyi each, in alphabetical order of rooms; nothing else lists them."""
    lines = (PACKAGE / "__init__.pyi").read_text().splitlines()
    names = [
        found[2]
        for line in lines
        if (found := re.fullmatch(r"from \.[\w.]+ import (\w+) as (\w+)", line))
    ]
    assert sorted(names) == sorted(hv.__all__)
    assert len(set(names)) == len(names)
    text = (PACKAGE / "__init__.py").read_text().partition('"""\n')[2].rpartition('"""')[2]
    assert [name for name in names if re.search(rf"\b{name}\b", text)] == []


def test_one_file_imports_pyspice():
    files = {file for file, name in imported(PACKAGE) if name.startswith("PySpice")}
    assert files == {"harvester/cosimulation/ngspice/instance.py"}


@pytest.mark.slow
def test_formulas_need_neither_numba_nor_pyspice():
    """In a fresh interpreter, with both made impossible to import."""
    code = f"""
import sys
sys.modules["numba"] = sys.modules["PySpice"] = None
import harvester as hv
assert hv.Published().run(hv.load({str(PAPER)!r})).mean_power.value > 0.0
assert hv.run({str(ROOT / "examples" / "plate.toml")!r}).engine == "exact"
assert hv.Averaged().run(hv.load({str(PAPER)!r})).mean_power.value > 0.0
print(sorted(m for m in sys.modules if m in ("matplotlib", "loky", "harvester.mechanics", "harvester.cosimulation")))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.stdout, done.stderr) == ("[]\n", "")


@pytest.mark.thorough("test_a_scene_stays_itself")
@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_examples(path):
    """Every example loads and states what it is; those with a load resistance have a power, by a formula if it can."""
    scene = hv.load(path)
    assert scene.title
    if scene.load is None or scene.load.netlist is None:
        try:
            answer = hv.Published().run(scene)
        except CannotServeError as error:
            assert "use engine 'ensemble'" in str(error)
            answer = hv.Ensemble(trajectories=64).run(scene)
        assert answer.mean_power.value > 0.0
