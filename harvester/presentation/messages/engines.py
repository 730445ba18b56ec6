"""What engines say of their answers, and why one cannot serve a scene."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {
    "worded": "{text}",
    "open_circuit": "open circuit: V keeps the offset that it started with, and takes no power",
}
