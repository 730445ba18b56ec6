"""Messages of sweeps about their rows."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "kept_from_other_versions": "kept from {before}, now {now}: last digits may differ",
    "said_by_earlier_run": "{text}",  # in sweep.csv, from which a finished sweep goes on
    "warned_at_points": "at {count} of {total} points: {first}",
    "failed_at_points": "failed at {count} of {total} points: {first}",
    "check_agrees": "agrees with {engine} at the {count} points of this check: {largest:.1%} apart at most",
    "check_differs": "differs from {engine} beyond both errors at {beyond} of the {count} points of this check: "
    "{largest:.1%} at most",
    "stands_for_formulas": "computed in place of {formulas}: formulas do not cover netlists",
    "several_responses_at_points": "several responses to the excitation at {count} of {total} points, {most} at most: "
    "a run of such a point lists each with its mean",
}
