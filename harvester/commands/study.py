"""The common parts of all study commands: a SCENE is read, and the answer shown, saved, and made a page.

A study without a file of its own here gets its whole command from its entry in the registry.
"""

import functools
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cloup

from harvester.commands.help import Command, command
from harvester.commands.messages import echo, echo_json, echo_written
from harvester.commands.options import json_option, scene_argument, vector_needs_out, vector_option
from harvester.commands.reports import HERE, report_file, report_option, save_report
from harvester.studies.registry import STUDIES, Study

if TYPE_CHECKING:
    from harvester.machine.execution import Execution
    from harvester.machine.progress import Progress
    from harvester.report import Page
    from harvester.scene.scene import Scene


@dataclass(frozen=True)
class Output:
    """The destinations of the answer about a scene: the terminal, the folder ``out``, and the ``page`` of a report.

    ``path`` is the scene's file, and ``formats`` are forms of the figures in addition to .png.
    """

    scene: "Scene"
    path: str
    out: str | None
    formats: tuple[str, ...]
    page: Path | None
    as_json: bool

    def execution(self, progress: "Progress | None" = None, **options: Any) -> "Execution":
        """How a study is carried out that writes into the folder.

        ``options`` are the other fields of `Execution`.
        """
        from harvester.machine.execution import Execution
        from harvester.machine.progress import NO_PROGRESS

        return Execution(
            out=self.out, formats=self.formats, progress=progress or NO_PROGRESS, **options
        )

    def show(
        self,
        answer: Any,
        written: Sequence[str],
        page: "Callable[[Any], Page]",
        *,
        text: str | None = None,
        beside: Mapping[str, Any] | None = None,
    ) -> None:
        """Print an answer and the ``written`` files of the folder, a figure in all its forms, and save its page.

        ``beside`` are answers that are below it, in JSON by their names; ``text`` is printed in
        place of its own. ``page`` makes the page with `harvester.report`.
        """
        from harvester.presentation.plain import plain

        beside = beside or {}
        if self.as_json:
            echo_json(answer.as_json() | {name: plain(result) for name, result in beside.items()})
        else:
            below = (part if isinstance(part, list) else [part] for part in beside.values())
            echo(
                "\n".join(
                    [str(answer) if text is None else text, *map(str, chain.from_iterable(below))]
                )
            )
        if self.out is not None and not self.as_json:
            echo_written(self.out, *(form for name in written for form in self._forms(name)))
        save_report(self.page, page, quiet=self.as_json, scene=self.path)

    def _forms(self, name: str) -> list[str]:
        """A file, or all forms of a figure."""
        return [
            name,
            *(
                f"{name[:-3]}{form}"
                for form in dict.fromkeys(self.formats)
                if name.endswith(".png")
            ),
        ]


def output_options(out: str, *others: Any, needs_out: Sequence[str] = ()) -> Callable[..., Any]:
    """The group of options "Output": --out, whose help is ``out``, ``others``, and those that most studies have.

    --vector and ``needs_out``, options by name, are refused without --out.
    """
    options = [cloup.option("--out", help=out), *others, vector_option, report_option, json_option]
    group = cloup.option_group("Output", *options)
    return lambda command: vector_needs_out(*needs_out)(group(command))


def study_command(
    *examples: str, reported: bool = False
) -> Callable[[Callable[..., Any]], Command]:
    """Make a function of an `Output` and options a command about a SCENE, whose help ends with these examples.

    ``reported`` states that a written folder always has a page.
    """

    def decorated(study: Callable[..., Any]) -> Command:
        @functools.wraps(study)
        def called(
            path: str,
            report: str | None,
            as_json: bool,
            out: str | None = None,
            vector: tuple[str, ...] = (),
            **options: Any,
        ) -> None:
            from harvester.scene.plausibility import unusual_values
            from harvester.scene.toml import load

            scene = load(path)
            if (
                sys.stderr.isatty()
            ):  # who waits for the answer, which has them too, learns of them at once
                odd = (line for line in unusual_values(scene) if line.severity == "warning")
                echo("".join(f"warning: {line}\n" for line in odd), err=True, nl=False)
            page = report_file(
                HERE if reported and report is None and out is not None else report, out
            )
            study(Output(scene, path, out, vector, page, as_json), **options)

        return command(*examples)(scene_argument(called))

    return decorated


def page_of(scene: "Scene", study: str, result: Any) -> "Page":
    """The page of a result; its modules are loaded when there is one."""
    from harvester.report.result import of_result

    return of_result(scene, study, result)


def study_commands() -> list[Command]:
    """The commands of the studies that the registry describes."""
    return [_command(study) for study in STUDIES if study.summary]


def _command(study: Study) -> Command:
    """The command of one study: its options are the keywords of its function."""

    def compute(output: Output, **options: Any) -> None:
        from harvester.machine.bars import Bar

        function = study.run()
        has_progress = "progress" in inspect.signature(function).parameters
        with Bar(study.name, known=has_progress, shorter=study.shorter) as bar:
            result = function(
                output.scene, **options, **({"progress": bar.tell} if has_progress else {})
            )
        output.show(result, (), lambda _: page_of(output.scene, study.name, result))

    compute.__doc__, compute.__name__ = study.summary, study.name
    options = [
        cloup.option(
            "--" + option.name.replace("_", "-"),
            **{name: getattr(option, name) for name in ("type", "default", "help")},
            show_default=True,
        )
        for option in study.options
    ]
    shown = cloup.option_group("Output", report_option, json_option)(compute)
    example = f"harvester {study.name} mine.toml {study.example}".rstrip()
    return study_command(example)(cloup.option_group("Computation", *options)(shown))
