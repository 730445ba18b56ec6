"""The files that a study writes into a folder: a table (CSV), its figure, and their provenance (provenance.json)."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harvester.cosimulation.ngspice.locate_libngspice import library_digest
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.machine import files
from harvester.machine.execution import Execution
from harvester.machine.provenance import origin
from harvester.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def provenance(scene: Scene | Problem, **extra: Any) -> dict[str, Any]:
    """The origin of a study's numbers: versions, machine, command and scene, and ``extra`` arguments of the study."""
    problem = Problem.of(scene)
    return origin() | {
        "scene": problem.scene.tables(),
        "scene_digest": problem.scene.digest,
        "netlist": problem.load.text,
        **extra,
    }


def provenance_with_engines(
    scene: Scene | Problem, engines: Sequence[Engine], **extra: Any
) -> dict[str, Any]:
    """`provenance`, with the options of engines, and the version of ngspice if one of them runs it."""
    options = {
        e.NAME: {k: v for k, v in vars(e).items() if v is not None and k != "budget"}
        for e in engines
    }
    about = provenance(scene, **extra, engines=options)
    if any(
        engine.runs_ngspice or (engine.chooses and about["netlist"] is not None)
        for engine in engines
    ):
        about["versions"]["ngspice"] = library_digest()
    return about


class OutputFolder:
    """A folder that a study writes its files into, each whole or not at all.

    ``vector`` are forms of its figures.

    Raises InputError for a form that is neither svg nor pdf, a folder that cannot be made or
    written, and a file that the disk does not accept.
    """

    def __init__(self, out: str | Path, vector: Sequence[str] = ()) -> None:
        files.check_vector(vector)
        self.path = files.folder(out)
        self.vector = vector

    @staticmethod
    def of(execution: Execution) -> "OutputFolder | None":
        """The folder of an execution; None if nothing is to be written."""
        return None if execution.out is None else OutputFolder(execution.out, execution.formats)

    def table(self, name: str, lines: str | Iterable[str]) -> None:
        """Write ``name``.csv from its text or lines."""
        files.write(
            self.path / f"{name}.csv",
            lines if isinstance(lines, str) else (line.encode() for line in lines),
        )

    def packed(self, name: str, content: bytes) -> None:
        """Write ``name``.npz from its bytes."""
        files.write(self.path / f"{name}.npz", content)

    def figure(self, name: str, figure: "Figure") -> None:
        """Write a figure as ``name``.png, and in the vector forms asked for."""
        from harvester.presentation import (
            plot,  # and with it matplotlib, which has drawn the figure
        )

        plot.save(figure, self.path, name, self.vector)

    def save(
        self, name: str, text: str, figure: "Figure", about: dict[str, Any] | None = None
    ) -> None:
        """Write a study's files: ``name``.csv, the figure, and its provenance if there is one."""
        self.table(name, text)
        self.figure(name, figure)
        if about is not None:
            self.provenance(about)

    def provenance(self, about: dict[str, Any]) -> None:
        """Write provenance.json, such as from `provenance`."""
        files.write(self.path / "provenance.json", json.dumps(about, indent=2, default=str) + "\n")
