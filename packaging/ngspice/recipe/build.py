"""From the source of ngspice to the library and its code models, for any target, by Zig's C compiler."""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from recipe.apt import with_m4
from recipe.automake import sources
from recipe.targets import Target, config

_ZIG = (sys.executable, "-m", "ziglang")
# No fused multiply-add and no reordering: the numbers are those of any other compiler that keeps to
# the standard.
_FLAGS = ("-O2", "-g0", "-w", "-fPIC", "-ffp-contract=off", "-fno-strict-aliasing", "-fno-sanitize=undefined",
          "-fvisibility=default", "-std=gnu11", "-D_GNU_SOURCE")  # fmt: skip
_CODE_MODELS = ("spice2poly", "digital", "analog", "xtradev", "xtraevt", "table")


class BuildError(RuntimeError):
    """A tool failed; the text is what it said."""


def build(source: Path, work: Path, target: Target) -> list[Path]:
    """Build in the folder ``work`` and return the files for the wheel: the library, then its code models.

    Raises BuildError where a tool fails.
    """
    work.mkdir(parents=True, exist_ok=True)
    (work / "include/ngspice").mkdir(parents=True, exist_ok=True)
    (work / "include/ngspice/config.h").write_text(config(target, _version(source)))
    src = source / "src"
    library = work / target.library
    parsers = with_m4(work)
    objects = _compiled([(_parsed(one, parsers), ()) for one in sources(src)], src, work, target)
    name = () if "macos" not in target.triple else (f"-Wl,-install_name,@rpath/{target.library}",)
    _zig("c++", target, "-shared", "-s", *name, *objects, "-o", library, *target.links)
    return [library, *_code_models(src, work, target, parsers)]


def _version(source: Path) -> str:
    """The version of a source of ngspice, from what its `configure` is made of: 39, or 44.2."""
    found = re.search(
        r"ngspice_major_version\], \[([0-9.]+)", (source / "configure.ac").read_text()
    )
    if found is None:
        raise BuildError(f"{source / 'configure.ac'} names no version")
    return found[1]


def _parsed(path: Path, env: dict[str, str]) -> Path:
    """The C file of a source; that of a grammar is made by Bison, with its header."""
    if path.suffix != ".y":
        return path
    made = path.with_suffix(".c")
    _run(_tool("bison"), "-d", "-o", made, path, env=env)
    if not made.is_file():  # where m4 does not start, Bison does not always say so
        raise BuildError(f"bison made nothing of {path}: does {env.get('M4', 'm4')} run?")
    return made


def _code_models(src: Path, work: Path, target: Target, parsers: dict[str, str]) -> list[Path]:
    """Build ngspice's code models: its own preprocessor makes C of them, and runs on this machine."""
    icm = src / "xspice/icm"
    cmpp = _preprocessor(src / "xspice/cmpp", work, parsers)
    tasks: list[tuple[Path, tuple[Path, ...]]] = [(src / "misc/dstring.c", ())]
    members: dict[str, list[int]] = {}
    for name in _CODE_MODELS:
        folder = icm / name
        _preprocess(cmpp, folder, "-lst")
        files = [work / name / "dlmain.c"]
        files[0].parent.mkdir(exist_ok=True)
        shutil.copy(icm / "dlmain.c", files[0])
        for model in (folder / "modpath.lst").read_text().split():
            _preprocess(cmpp, folder / model, "-ifs")
            _preprocess(cmpp, folder / model, "-mod")
            files += [folder / model / "cfunc.c", folder / model / "ifspec.c"]
        files += [
            folder / one / "udnfunc.c" for one in (folder / "udnpath.lst").read_text().split()
        ]
        members[name] = [0, *range(len(tasks), len(tasks) + len(files))]
        tasks += [(path, (folder, icm)) for path in files]
    # One model calls free and does not include its header.
    objects = _compiled(tasks, src, work, target, "-fvisibility=hidden", "-include", "stdlib.h")
    made = []
    for name, which in members.items():
        made.append(work / f"{name}.cm")
        _zig("cc", target, "-shared", "-s", *(objects[one] for one in which), "-o", made[-1], "-lm")
    return made


def _preprocessor(cmpp: Path, work: Path, env: dict[str, str]) -> Path:
    """Build ngspice's preprocessor of code models for the machine that builds."""
    program = work / ("cmpp.exe" if os.name == "nt" else "cmpp")
    for name in ("ifs", "mod"):
        _run(_tool("bison"), "-d", "-o", cmpp / f"{name}_yacc.c", cmpp / f"{name}_yacc.y", env=env)
        _run(_tool("flex"), "-o", cmpp / f"{name}_lex.c", cmpp / f"{name}_lex.l", env=env)
    links = ("-lshlwapi",) if os.name == "nt" else ()
    flags = ("-O1", "-w", "-fno-sanitize=undefined", "-std=gnu11", f"-I{cmpp}")
    _run(*_ZIG, "cc", *flags, *cmpp.glob("*.c"), "-o", program, *links)
    return program


def _preprocess(cmpp: Path, folder: Path, option: str) -> None:
    place = {"CMPP_IDIR": str(folder), "CMPP_ODIR": str(folder)}
    _run(cmpp, option, env={**os.environ, **place})


def _compiled(
    tasks: list[tuple[Path, tuple[Path, ...]]], src: Path, work: Path, target: Target, *flags: str
) -> list[Path]:
    """The object files of C and C++ files, each with folders of its own for headers, on all cores."""
    folder = work / "objects"
    folder.mkdir(exist_ok=True)
    shared = [
        work / "include",
        src / "include",
        src / "frontend",
        src / "spicelib/devices",
        src / "maths/poly",
    ]
    shared += [src / "maths/dense", src / "include/cppduals"]

    def compiled(task: tuple[Path, tuple[Path, ...]]) -> Path:
        path, places = task
        includes = [f"-I{one}" for one in (path.parent, *places, *shared)]
        given = [*flags, *(("-DSIMULATOR",) if path.parent == src else ()), *includes, "-c", path]
        if path.suffix == ".cpp":
            plain = [one for one in _FLAGS if not one.startswith("-std")]
            given = ["c++", *plain, "-std=c++11", "-Wno-invalid-specialization", *given]
        else:
            given = ["cc", *_FLAGS, *given]
        key = hashlib.sha256(f"{target}{given}".encode()).hexdigest()[:12]
        made = folder / f"{path.stem}-{key}.o"
        if not made.is_file():  # else it is left from an earlier build of the same source
            command, *rest = given
            _zig(str(command), target, *rest, "-o", made.with_suffix(".new"))
            made.with_suffix(".new").replace(made)
        return made

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(compiled, tasks))


def _zig(command: str, target: Target, *arguments: str | Path) -> None:
    _run(*_ZIG, command, "-target", target.triple, *arguments)


def _tool(name: str) -> Path:
    """A program of a package of the index, which stands beside this Python."""
    found = shutil.which(name, path=sysconfig.get_path("scripts")) or shutil.which(name)
    if found is None:
        raise BuildError(f"{name} must be installed: pip install {name}-bin")
    return Path(found)


def _run(*command: str | Path, env: dict[str, str] | None = None) -> None:
    done = subprocess.run(
        [str(one) for one in command], check=False, capture_output=True, text=True, env=env
    )
    if done.returncode:
        raise BuildError(
            f"{' '.join(str(one) for one in command)[-2000:]}\n{done.stdout[-2000:]}{done.stderr[-4000:]}"
        )


def compiler() -> Path:
    """The folder of the compiler, with the licences of the libraries that it links."""
    import ziglang

    return Path(ziglang.__file__).parent
