"""What studies say of their results."""

from collections.abc import Callable

MESSAGES: dict[str, str | Callable[..., str]] = {}
