"""Patterns of English and old terms to avoid, counted over documents, texts of the package, netlists and tests.

`python -m tests.support.words documents NAME` prints each place of a pattern.
"""

import ast
import io
import re
import sys
import tokenize
from functools import cache

from tests.support.pages import FENCE
from tests.support.paths import ROOT

HEADS = (
    "sources?|noises?|errors?|resonances?|steps?|densit(?:y|ies)|intervals?|currents?|voltages?|powers?|"
    "spectr(?:um|a)|records?"
)
ATTRIBUTES = (
    "steps?|sampling|model|tolerance|band|stiffness|voltage|current|wall|time|power|logger|density|shaking|averaging|"
    "rounding|phase|frequency|motion|force|stop|circuits?|settling|table|output|noise|acceleration|load|mean|integration"
)
COUNTED = "packets|samples|runs|points|times|steps|seconds|shocks|lorries|cycles|evaluations|bits"
UNITS = "second|minute|hour|day|week|step|period|point|packet|cycle|run|line"
# Good English that a pattern alone would count: see `GOOD` in tests/project/test_words.py.
PLACES = (
    "point",
    "points",
    "place",
    "places",
    "case",
    "cases",
    "side",
    "region",
    "regions",
    "from",
    "or",
)
NOT_A_PLACE = "".join(rf"(?<!\b{word} )" for word in PLACES)
LEGEND = (
    r"(?!(?:it|this|that|there|nothing|no|all|both|each)\b)"
    r"[^\s,.;:]{1,24}(?: and [^\s,.;:]{1,12})?(?:,? \([^)]*\),?)? (?:is|are)\b"
)
LASTING = (
    r"(?:place|part|precedence|effect|(?:in)?to account|(?:much )?longer|long"
    r"|(?:about |some |the )?(?:\d|an? |time\b|half an?))"
)
TAKE = rf"(?:takes?|took|taken|taking)\b(?! {LASTING})"
GO = r"(?:go|goes|went|gone|going)\b(?! (?:to (?:zero|infinity|0)\b))"
TYPED = "".join(f"(?<!{word} )" for word in ("within", "objective", "ratio", "such as", "default"))
PATTERNS = {
    "headless of": r"(?:^|(?<=[.!?:;|] )|(?<=[-*] ))[Oo]f\b|(?<![-\w])Of\b",
    "tell and say": r"\b(?:tells?|told|telling|says?|said|saying)\b",
    "too at the end": r"\btoo(?=[.,;:)|]|$| \|)",
    # a question may begin with "What", a noun must not
    "what-clauses": r"\b(?:what|What(?![^.?!|\n]*\?))\b",
    # a place, and the legend of an equation: ", where m is the mass"
    "where": rf"{NOT_A_PLACE}\b[Ww]here\b(?! {LEGEND})",
    "beside": r"\b[Bb]esides?\b",
    # "there is no stop", "is no longer", "is no more than"
    "is no": r"(?<![Tt]here )\b(?:is|are|was|were|be) (?:no|none)\b(?! (?:longer|more|less|\w+er than)\b)",
    # "takes 3 s", "takes place", "goes to zero"
    "light verbs": rf"\b(?:{TAKE}|{GO}|stands?\b|stood\b|serves?\b|served\b|serving\b)",
    "of-chains": rf"\b(?:{HEADS}) of (?:the |a |an |its |their )?(?:{ATTRIBUTES})\b",
    # not the precision of a format, and not a percentage as it is typed: key=10%, "1%", --within 1%
    "numbers": rf"(?<![\w.:+])\.\d|(?<![\w.=:\"+~-]){TYPED}\d+(?:\.\d+)?%(?![}};\"])"
    rf"|(?:\d|\b[kmun]?[sgV]|\b(?:{COUNTED})) an? (?:{UNITS})\b"
    rf"|\b[Pp]rocessor(?:'s|s')? (?:time|seconds)|of the processor\b",
}
# Old words for a thing that has a term of the field (the table of docs/developers/english.md). A word that has other
# meanings as well is counted with a neighbour that decides: "the same path", not the path of a file.
TERMS = {
    "coil": r"\b[Cc]oils?\b",
    "shaking": r"\b[Ss]haking\b",
    "store": r"\b(?:[Tt]he|[Aa]|[Ii]ts|[Ee]ach|[Ee]mpty|[Hh]eld|whose|this|on) stores?\b",
    "drive": r"\b(?:harmonic|steady|periodic) drives?\b"
    r"|\b(?:periods?|phases?|frequency|amplitude) of (?:the|an?|its) drive\b",
    "path": r"\b(?:[Oo]ne|[Ll]ong|[Ww]hole|[Ss]ame|[Cc]ounted|[Ff]urther|[Ss]everal) paths?\b"
    r"|\b[Pp]aths (?:of|with|on|part)\b",
    "record of a logger": r"\blogger'?s? records?\b|\brecords? of (?:a|the) logger\b",
    "whole error": r"\bwhole errors?\b",
    "error of the step": r"\berrors? of (?:the|a|its) (?:time )?step\b",
    "noise of a band": r"\bnoises? of (?:a|the) (?:band|stiffness)\b",
    "hop": r"\bhops?\b",
    "ledger": r"\b[Ll]edgers?\b",
    "share": r"\b[Ss]hares? of (?:the )?(?:devices|time|samples|runs|variance|possible)\b",
    "own netlist": r"\b(?:an|user's) own netlist\b|\bnetlist of (?:one|your)(?:'s)? own\b",
    "elasticity": r"\b[Ee]lasticit(?:y|ies)\b",
    "judge": r"\b(?:[Tt]he|[Aa]|[Ii]ts) judge\b",
    "dear": r"\bdear(?:er|est)?\b",
    "aim": r"\baims?\b",
    "knob": r"\b[Kk]nobs?\b",
    "turn over": r"\bturns? (?:the voltage|it) (?:over|round)\b",
    "density of an excitation": r"\b(?:tabulated|recorded|excitation's) densit(?:y|ies)\b"
    r"|\bdensit(?:y|ies) of (?:the |an? )?(?:excitation|acceleration|noise|recording)\b",
}
QUOTED = re.compile(r"`[^`\n]*`|\$\$.*?\$\$|\$[^$\n]+\$|\]\([^)\s]*\)|<[^>\n]*>", re.DOTALL)
COMMENT = re.compile(r"^\s*[*;#]\s?(.*)$|;\s(.*)$", re.MULTILINE)


def documents():
    """Each page for readers with its prose: no code, no formulas, no addresses, a cell or paragraph a line."""
    built = ROOT / "docs" / "_build"
    pages = [
        ROOT / name
        for name in (
            "README.md",
            "CONTRIBUTING.md",
            "SUPPORT.md",
            "CODE_OF_CONDUCT.md",
            "SECURITY.md",
        )
    ]
    # the style guide, which quotes what it advises against
    quoting = ROOT / "docs" / "developers" / "english.md"
    pages += [
        one
        for one in sorted((ROOT / "docs").rglob("*.md"))
        if built not in one.parents and one != quoting
    ]
    pages += [
        ROOT / name / "README.md"
        for name in ("examples", "benchmarks", "netlists", "packaging", "packaging/ngspice")
    ]
    pages += sorted((ROOT / "joss").glob("*.md"))
    for path in (one for one in pages if one.exists()):
        yield str(path.relative_to(ROOT)), prose(path.read_text())


def prose(text):
    """The sentences of a page of Markdown; `x` replaces each piece of code."""
    text = QUOTED.sub("x", FENCE.sub("\n", text))
    text = re.sub(r"[*_]{2}", "", text)
    text = re.sub(r"^(?:#+|\s*[-*]|\s*\d+\.) +", "\n", text, flags=re.MULTILINE)
    text = re.sub(r"\|", "\n\n", text)
    return "\n".join(" ".join(one.split()) for one in re.split(r"\n\s*\n", text))


def package():
    """Each file of the package with its docstrings, messages and other texts of more than one word."""
    for path in sorted((ROOT / "harvester").rglob("*.py")):
        sentences = (one for one in strings(ast.parse(path.read_text())) if " " in one)
        yield (
            str(path.relative_to(ROOT)),
            "\n".join(prose(re.sub(r"^\s*>>> .*$", "", one, flags=re.M)) for one in sentences),
        )


def strings(node):
    """The texts of a tree of code; one with braces is one text, with `x` for each value in it."""
    if isinstance(node, ast.JoinedStr):
        yield "".join(one.value if isinstance(one, ast.Constant) else "x" for one in node.values)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    else:
        for child in ast.iter_child_nodes(node):
            yield from strings(child)


def netlists():
    """Each netlist of the package with its comments."""
    for path in sorted((ROOT / "netlists").rglob("*")):
        if path.suffix in (".cir", ".lib", ".toml"):
            yield (
                str(path.relative_to(ROOT)),
                "\n".join(a or b for a, b in COMMENT.findall(path.read_text())),
            )


def tests():
    """Each file of the tests with its docstrings."""
    for path in sorted((ROOT / "tests").rglob("*.py")):
        tree = ast.parse(path.read_text())
        kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
        texts = (ast.get_docstring(node) for node in ast.walk(tree) if isinstance(node, kinds))
        yield str(path.relative_to(ROOT)), "\n".join(prose(one) for one in texts if one)


def comments():
    """Each file of the package with its comments, a block of lines as one text."""
    for path in sorted((ROOT / "harvester").rglob("*.py")):
        lines = io.StringIO(path.read_text()).readline
        found = [one for one in tokenize.generate_tokens(lines) if one.type == tokenize.COMMENT]
        text = "\n".join(
            f"{' ' if one.line.lstrip().startswith('#') else chr(10)}{one.string[1:]}"
            for one in found
        )
        yield str(path.relative_to(ROOT)), prose(text)


SETS = {
    "documents": documents,
    "package": package,
    "netlists": netlists,
    "tests": tests,
    "comments": comments,
}


@cache
def texts(which):
    """All texts of a set, by file."""
    return list(SETS[which]())


def places(which, name):
    """Each place of a pattern: its file and the words around it."""
    pattern = re.compile((PATTERNS | TERMS)[name], re.MULTILINE)
    for file, text in texts(which):
        for found in pattern.finditer(text):
            yield file, text[max(0, found.start() - 40) : found.end() + 40].replace("\n", " / ")


if __name__ == "__main__":
    which, *names = sys.argv[1:] or ["documents"]
    for name in names or PATTERNS | TERMS:
        found = list(places(which, name))
        print(f"{name}: {len(found)}")
        if names:
            for file, words in found:
                print(f"  {file}: {words}")
