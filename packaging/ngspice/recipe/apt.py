"""Downloads from where this machine gets its packages, by apt, which needs no root for it and changes nothing of it."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path


def download(wanted: str, *command: str, to: Path, source_lines: bool = False) -> None:
    """Run ``apt-get command`` in a folder of its own, and copy what it brings that matches the pattern ``wanted``.

    ``source_lines`` names the sources of packages, which most machines leave out.  Without apt nothing is done.
    """
    if shutil.which("apt-get") is None:
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for one in ("lists/partial", "cache/archives/partial"):
            (folder / one).mkdir(parents=True)
        options = {
            "Dir::State::lists": folder / "lists",
            "Dir::Cache": folder / "cache",
            "APT::Sandbox::User": "root",
        }
        if source_lines:
            (folder / "sources.list").write_text("\n".join(_sources()) + "\n")
            options |= {
                "Dir::Etc::sourcelist": folder / "sources.list",
                "Dir::Etc::sourceparts": "/dev/null",
            }
        given = [f"-o{name}={value}" for name, value in options.items()]
        for each in (("update", "-qq"), command):
            subprocess.run(
                ["apt-get", *given, *each],
                cwd=folder,
                check=False,
                capture_output=True,
                timeout=300,
            )
        for path in folder.glob(wanted):
            shutil.copy(path, to / path.name)


def _sources() -> list[str]:
    """Lines for the sources of the packages that this machine knows."""
    command = [
        "apt-get",
        "indextargets",
        "--no-release-info",
        "--format",
        "$(SITE) $(RELEASE) $(COMPONENT)",
    ]
    command += ["Created-By: Packages"]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    return [
        f"deb-src {line}"
        for line in dict.fromkeys(done.stdout.splitlines())
        if line.startswith("http")
    ]


def with_m4(work: Path) -> dict[str, str]:
    """The environment of Bison, which runs GNU m4: this machine's, else Debian's, unpacked in ``work`` without root."""
    if os.environ.get("M4") or shutil.which("m4"):
        return dict(os.environ)
    folder = (work / "m4").absolute()
    program = folder / "usr/bin/m4"
    if not program.is_file() and shutil.which("dpkg-deb"):
        folder.mkdir(parents=True, exist_ok=True)
        download("*.deb", "download", "-qq", "m4", "libsigsegv2", to=folder)
        for package in folder.glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", package, folder], check=True, timeout=60)
    libraries = ":".join(str(path) for path in folder.glob("usr/lib/*") if path.is_dir())
    return (
        {**os.environ, "M4": str(program), "LD_LIBRARY_PATH": libraries}
        if program.is_file()
        else dict(os.environ)
    )
