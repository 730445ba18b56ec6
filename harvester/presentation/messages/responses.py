"""Messages of frequency responses."""

from collections.abc import Callable


def _hysteresis(low: float, high: float, unit: str) -> str:
    where = f"at {low:.5g}" if low == high else f"between {low:.5g} and {high:.5g}"
    return f"up and down differ {where}{unit}: hysteresis"


MESSAGES: dict[str, str | Callable[..., str]] = {
    "frequencies_apart": "frequencies are up to {widest:.3g}{unit} apart",
    "hysteresis": _hysteresis,
    "hysteresis_in_several": "up and down differ in {several} of {of} responses: hysteresis",
    "trajectories_differ": "trajectories differ at some points, the first at {first:.5g}{unit}, by up to {most:.0%}: several responses, or a chaotic one",
    "frequencies_failed": "failed at {failed} of {of} frequencies, as {first:.5g}{unit}: {why}",
    "peak_at_an_end": "the peak is at {at:.5g}{unit}, an end of the sweep (a higher one may lie beyond)",
    "peak_between": "the peak is the best of the sweep (the true one lies between {low:.5g} and {high:.5g}{unit})",
    "unusual_at_an_end": "at an end of `sweep`, {what}",
}
