"""The answer of a formula, on a terminal while a slower engine compiles and computes."""

import contextlib
import sys
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from harvester.errors import HarvesterError

if TYPE_CHECKING:
    from harvester.engines.protocol import Engine
    from harvester.scene.scene import Scene

PATIENCE = 1.0  # seconds that a person waits without asking what happens


@contextlib.contextmanager
def formula_meanwhile(scene: "Scene", engine: "Engine") -> Iterator[None]:
    """Show on a terminal what a formula says of a scene, if the engine takes more than `PATIENCE`."""
    if engine.is_formula or not sys.stderr.isatty():
        yield
        return
    waiting = threading.Timer(PATIENCE, _show, (scene,))
    waiting.daemon = True
    waiting.start()
    try:
        yield
    finally:
        waiting.cancel()
        if waiting.is_alive():  # it has begun: its line does not come after the answer
            waiting.join()


def _show(scene: "Scene") -> None:
    line = formula_line(scene)
    if line:
        click.echo(line, file=sys.stderr)  # above the bar, which takes stderr while it is drawn


def formula_line(scene: "Scene") -> str:
    """The mean power by the first formula that supports the scene and knows its own error; "" if none does."""
    from harvester.engines.selection import ENGINES
    from harvester.equations.problem import Problem

    with contextlib.suppress(HarvesterError):
        problem = Problem.of(scene)
        for name, kind in ENGINES.items():
            if kind.is_formula and kind.refusal(problem) is None:
                answer = kind().run(problem)
                if answer.mean_power.error95 is not None:
                    power = answer.mean_power.format(answer.unit_names.power)
                    return f"meanwhile, by the formula of engine '{name}': mean power {power}"
    return ""
