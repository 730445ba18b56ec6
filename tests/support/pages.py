"""The code blocks of the project's pages, and a way to run them as a reader would, in a folder of their own.

Programs of Python run in this process, which has loaded NumPy, the kernels and ngspice's processes
already.
"""

import contextlib
import importlib.metadata
import io
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from click.testing import CliRunner
from packaging.requirements import Requirement

import harvester as hv
from harvester.cli import cli
from tests.support.paths import ROOT

FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LANGUAGES = {
    "sh",
    "python",
    "toml",
    "text",
    "{include}",
    "{toctree}",
    "{eval-rst}",
    "{command-help}",
    "{gallery-wall}",
    "{container}",
    "{scene-keys}",
}  # those in braces are Sphinx's


@dataclass(frozen=True)
class Block:
    """One code block: where its first line is, its language, its text."""

    where: str
    language: str
    text: str


def blocks(page):
    """All code blocks of a page."""
    whole = (ROOT / page).read_text()
    return [
        Block(
            f"{page}:{whole[: one.start()].count(chr(10)) + 2}",
            one[1].split()[0] if one[1] else "",
            one[2],
        )
        for one in FENCE.finditer(whole)
    ]


def theory_pages():
    """The page of the theory, and the pages below it, a topic each."""
    folder = ROOT / "docs"
    below = re.search(
        r"^```\{toctree\}\n:hidden:\n\n(.*?)^```$", (folder / "theory.md").read_text(), re.M | re.S
    )[1]
    return [folder / "theory.md", *(folder / f"{name}.md" for name in below.split())]


def outside(page):
    """What of a page is not in a code block."""
    return FENCE.sub("", (ROOT / page).read_text())


def commands(text):
    """The commands of a shell block, one argument list each."""
    joined = re.sub(r"\\\n\s*", " ", text)
    return [words for line in joined.splitlines() if (words := shlex.split(line, comments=True))]


def folder(path):
    """What the commands need to be run from ``path``: copies of examples and netlists, and the script of tables."""
    for name in ("examples", "netlists"):
        shutil.copytree(ROOT / name, path / name)
    (path / "benchmarks").mkdir()
    for name in ("published.py", "predictions.py", "viaduct.py"):
        shutil.copy(ROOT / "benchmarks" / name, path / "benchmarks")
    for table in (ROOT / "benchmarks").glob("*.csv"):
        shutil.copy(table, path / "benchmarks")
    return path


def smaller(words, less):
    """The command at reduced size: ``less`` has (what a command must hold, additions, replacements in its words)."""
    whole = " ".join(words)
    words = list(words)
    for holds, additions, replaced in less:
        if holds in whole:
            for old, new in replaced.items():
                words = [re.sub(rf"{old}$", new, word) for word in words]
            words += additions
    return words


def lacks_an_extra(told):
    """Whether a message asks for an extra of this package of which a part is not installed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for extra in re.findall(r"piezo-harvester\[(\w+)\]", told):
        for line in project["optional-dependencies"][extra]:
            try:
                importlib.metadata.version(Requirement(line).name)
            except importlib.metadata.PackageNotFoundError:
                return True
    return False


def run(words, where, less=()):
    """Run one command in the present folder; its exit status must be 0, and what it states it wrote must be there.

    A command that needs an extra that is not installed here must ask for it.
    """
    program, *rest = smaller(words, less)
    if program == "make":
        return made(rest)
    if program.endswith("bin/harvester"):
        done = CliRunner().invoke(cli, rest, prog_name="harvester")
        status, out = done.exit_code, done.output
        told = f"{done.exception!r}" if done.exception is not None else ""
    elif program == ".venv/bin/python":
        status, out, told = script(rest)
    else:
        assert program == "ngspice", f"{where}: a test knows no way to run {program!r}"
        done = subprocess.run(
            [shutil.which(program), *rest], capture_output=True, text=True, check=False, timeout=120
        )
        status = done.returncode
        out = done.stdout
        told = done.stderr[-2000:]
    if status != 0 and lacks_an_extra(out + told):
        return out
    assert status == 0, f"{where}: {shlex.join(words)}\n{out[-2000:]}\n{told}"
    for line in out.splitlines():
        if line.startswith("written: "):
            for path in written(line):
                assert path.exists(), f"{where}: {shlex.join(words)} says that it wrote {path}"
    return out


def script(argv):
    """Exit status, stdout and what ended ``python argv``: a file and its arguments, which sees no difference."""
    out = io.StringIO()
    told = ""
    status = 0
    path = [str(Path(argv[0]).parent), *sys.path]
    with (
        mock.patch.object(sys, "argv", argv),
        mock.patch.object(sys, "path", path),
        contextlib.redirect_stdout(out),
    ):
        try:
            runpy.run_path(argv[0], run_name="__main__")
        except SystemExit as end:
            status = end.code or 0
            told = str(end.code)
    return status, out.getvalue(), told


def written(line):
    """Files of a line such as 'written: out/sweep.csv, sweep.png'; those without a folder are next to the first."""
    names = [name.strip() for name in line.removeprefix("written: ").split(",") if name.strip()]
    first = Path(names[0])
    return [
        first,
        *(first.parent / name for name in names[1:] if "/" not in name and " " not in name),
    ]


def made(targets):
    """What ``make TARGET`` would do, without doing it."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("MAKE")}
    done = subprocess.run(
        ["make", "-n", *targets],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def run_page(page, less=()):
    """Run all code blocks of a page in their order, in the present folder; those of Python share their names."""
    names = {"__name__": "page"}
    for block in blocks(page):
        if block.language == "sh":
            for words in commands(block.text):
                run(words, block.where, less)
        elif block.language == "python":
            try:
                exec(compile(block.text, block.where, "exec"), names)
            except hv.MissingProgramError as error:
                if not lacks_an_extra(str(error)):
                    raise
        elif block.language == "toml":
            assert hv.loads(block.text).load is not None, block.where
