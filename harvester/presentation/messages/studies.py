"""What studies say of their results."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "did_not_run": "did not run: {why}",
    "one_path": "one path is no mean: for the power and its error, harvester run",
    "smaller_step_converges": "ngspice did not converge with a step of {asked}: it is {taken}",
}
