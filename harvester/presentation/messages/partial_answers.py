"""What an engine says of an answer that is less than what was asked for."""

from collections.abc import Callable


def _mean_while_settling(covered: float, why: str, steady: bool) -> str:
    several = "; a periodic response takes several such runs" if steady else ""
    return f"the mean is over {covered:.3g} s of ngspice, while still settling: {why}{several}"


MESSAGES: dict[str, str | Callable[..., str]] = {
    "mean_while_settling": _mean_while_settling,
    "ngspice_left_out": "ngspice gave no answer in the `budget`, and the mean is that of {what}, without it: {why}",
}
