"""The options of a model of `cosimulate` as an FMU."""

from collections.abc import Sequence
from typing import Any, TypedDict

from harvester.cosimulation.ports import Port
from harvester.scene.load import Load


class ModelOptions(TypedDict, total=False):
    """The options of a model's export, by keyword."""

    port: Port
    start: Any
    step: float | str
    load: Load | str | None
    inputs: Sequence[str]
