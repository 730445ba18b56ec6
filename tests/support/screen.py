"""What a terminal shows of a text."""


def left_on_screen(text: str) -> str:
    """The text that remains once every line was written over after its carriage returns, without blank ends."""
    lines = []
    for line in text.split("\n"):
        shown: list[str] = []
        for part in line.split("\r"):
            shown[: len(part)] = part
        lines.append("".join(shown).rstrip())
    return "\n".join(lines).strip("\n")
