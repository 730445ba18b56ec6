"""Messages of sweeps about their rows."""

from collections.abc import Callable

from harvester.uncertainty.value import in_percent


def _check_agrees(engine: str, count: int, largest: float) -> str:
    where = "the compared point" if count == 1 else f"all {count} compared points"
    return f"agrees with {engine} at {where}: {in_percent(largest, '.1f')} apart at most"


def _check_differs(engine: str, count: int, largest: float, beyond: int) -> str:
    where = "the compared point" if count == 1 else f"{beyond} of {count} compared points"
    return (
        f"differs from {engine} beyond both errors at {where}: {in_percent(largest, '.1f')} at most"
    )


MESSAGES: dict[str, str | Callable[..., str]] = {
    "kept_from_other_versions": "kept from {before}, now {now}: last digits may differ",
    "said_by_earlier_run": "{text}",  # in sweep.csv, from which a finished sweep goes on
    "warned_at_points": "at {count} of {total} points: {first}",
    "failed_at_points": "failed at {count} of {total} points: {first}",
    "check_agrees": _check_agrees,
    "check_differs": _check_differs,
    "stands_for_formulas": "computed in place of {formulas}: formulas do not cover netlists",
    "several_responses_at_points": "several responses to the excitation at {count} of {total} points, {most} at most: "
    "a run of such a point lists each with its mean",
}
