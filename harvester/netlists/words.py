"""The words of a line: names, numbers, pairs of a key and its text, and values with braces, with quotes or without."""

import re
from collections.abc import Set

from harvester.errors import InputError, invalid, shown, unknown
from harvester.netlists.expression import BRACES, plain_number, read
from harvester.netlists.expression_tree import Node, constant
from harvester.netlists.read_lines import Line

# A net of KiCad's may have a pair of parentheses behind a sign, Net-(D1-K), or of braces, /~{ON}.
GROUPS = r"(?:(?<=-)\([^\s()]*\)|\{[^{}\s]*\})"
_WORD = re.compile(
    r"\{(?:[^{}]|\{[^{}]*\})*\}|'[^']*'|\"[^\"]*\"|=|"
    + rf"[^\s=(),{{}}'\"]+(?:{GROUPS}[^\s=(),{{}}'\"]*)*"
)


def tokens_of(text: str) -> list[str]:
    """The words of a line, signs = and groups in braces or quotes.

    Blanks, commas and parentheses part them.
    """
    return _WORD.findall(text)


class Words:
    """The words of an element's line behind its nodes: single words, and pairs of a key and its text."""

    def __init__(self, line: Line, text: str) -> None:
        self.where = f"netlist {line.where}"
        self.text = text
        tokens = tokens_of(text)
        self.alone: list[str] = []
        self.pairs: dict[str, str] = {}
        k = 0
        while k < len(tokens):
            if k + 1 < len(tokens) and tokens[k + 1] == "=":
                if k + 2 >= len(tokens) or tokens[k + 2] == "=":
                    raise invalid(self.where, f"give a value to {tokens[k]}", text[:60])
                if tokens[k] in self.pairs:
                    raise invalid(self.where, f"give {tokens[k]} once", text[:60])
                self.pairs[tokens[k]] = tokens[k + 2]
                k += 3
            elif tokens[k] == "=":
                raise invalid(self.where, "have a name before =", text[:60])
            else:
                self.alone.append(tokens[k])
                k += 1

    def take(self, *words: str) -> bool:
        """Whether one of some words is next and single; then it is read."""
        there = bool(self.alone) and self.alone[0] in words
        if there:
            del self.alone[0]
        return there

    def next(self, what: str) -> str:
        """The next word that is single; raises InputError if there is none."""
        if not self.alone:
            raise invalid(self.where, f"have {what}", self.text[:60])
        return self.alone.pop(0)

    def pop(self, *keys: str) -> str | None:
        """The text of the first of some keys that is there."""
        return next((self.pairs.pop(key) for key in keys if key in self.pairs), None)

    def number(self, text: str) -> Node:
        """The tree of a number, of a parameter's name, or of an expression in braces or quotes."""
        if text[0] in "{'\"":
            return read(text[1:-1], self.where, BRACES)
        if (value := plain_number(text)) is not None:
            return constant(value)
        if re.fullmatch(r"[a-z_]\w*", text, re.ASCII):
            return Node("name", names=(text,))
        raise invalid(
            self.where, "have a number, a parameter's name, or an expression in braces", text[:60]
        )

    def finish(self, keys: Set[str], idle: Set[str]) -> dict[str, Node]:
        """The options that are left, whose keys are ``keys``; those of ``idle`` do nothing.

        Raises InputError for other keys, and for words that are left.
        """
        if self.alone:
            raise InputError(
                f"{self.where} must have no further word, but has {shown(self.alone[0])} in {self.text[:60]!r}"
            )
        for key in self.pairs:
            if key not in keys | idle:
                raise unknown(f"key in {self.where}", key, sorted(keys | idle) or ["none"])
        return {key: self.number(text) for key, text in self.pairs.items() if key not in idle}


def assignments(text: str, where: str) -> dict[str, Node]:
    """The trees of a .param card's values, which may have blanks, by their names.

    Raises InputError for a name that is given twice.
    """
    starts = list(re.finditer(r"([a-z_]\w*)\s*=(?!=)", text))
    starts = [
        match
        for match in starts
        if text.count("{", 0, match.start()) == text.count("}", 0, match.start())
    ]
    if not starts or text[: starts[0].start()].strip():
        must = "set parameters, as in .param a=1 b={2*a}"
        raise invalid(where, must, text.strip()[:60] or "empty")
    ends = [match.start() for match in starts[1:]] + [len(text)]
    pairs: dict[str, Node] = {}
    for match, end in zip(starts, ends, strict=True):
        value = text[match.end() : end].strip().rstrip(",").strip()
        if match[1] in pairs:
            raise invalid(where, f"give {match[1]} once", text.strip()[:60])
        if not value:
            raise invalid(where, f"give a value to {match[1]}", text.strip()[:60])
        pairs[match[1]] = parameter_value(value, where)
    return pairs


def parameter_value(text: str, where: str) -> Node:
    """A parameter's value: a number with any unit, or an expression with braces, with quotes or without."""
    if (value := plain_number(text, mil=False)) is not None:
        return constant(value)
    if re.search(r"\s", re.sub(r"[{(].*[})]|'.*'|\".*\"", "", text, flags=re.DOTALL)):
        raise invalid(where, "have braces around an expression with blanks", text[:60])
    inner = text[1:-1] if _WORD.fullmatch(text) and text[0] in "{'\"" else text
    return read(inner, where, BRACES)
