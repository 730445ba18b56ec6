"""The command of a study that has no file of its own: made from the study's entry in the registry."""

from typing import Any

import cloup

from harvester.commands.help import Command
from harvester.commands.messages import echo_answer
from harvester.commands.options import json_option, scene_argument
from harvester.commands.reports import report_file, report_option, save_report
from harvester.studies.registry import STUDIES, Study


def study_commands() -> list[Command]:
    """The commands of the studies that say in the registry what theirs is."""
    return [_command(study) for study in STUDIES if study.summary]


def _command(study: Study) -> Command:
    """The command of one study: its options are the keywords of its function."""

    def compute(path: str, report: str | None, as_json: bool, **options: Any) -> None:
        from harvester.commands.progress import Bar
        from harvester.report.result import of_result
        from harvester.scene.toml import load

        scene, file = load(path), report_file(report, None)
        with Bar(study.name, known=False):
            found = study.run()(scene, **options)
        echo_answer(found, as_json)
        picture = found.plot(None) if hasattr(found, "plot") else None
        save_report(file, lambda _: of_result(scene, study.name, found, picture), quiet=as_json, scene=path)

    compute.__doc__ = study.summary
    asked = [
        cloup.option(
            "--" + one.name.replace("_", "-"), type=one.type, default=one.default, show_default=True, help=one.help
        )
        for one in study.options
    ]
    decorated = scene_argument(
        cloup.option_group("What to compute", *asked)(cloup.option_group("Output", report_option, json_option)(compute))
    )
    examples = [f"harvester {study.name} mine.toml {study.example}".rstrip()]
    return cloup.command(study.name, cls=Command, examples=examples)(decorated)
