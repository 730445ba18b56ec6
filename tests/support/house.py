"""How tidy the house is, in numbers that may only fall: `python -m tests.support.house` prints them.

    python -m tests.support.house                       each number
    python -m tests.support.house "words made"          and the places of those whose name has these letters

A number is the count of its places, which are lines of the package's files.  The bounds are in
tests/project/test_house.py.
"""

import ast
import io
import re
import sys
import tokenize
from collections import defaultdict
from functools import cache
from itertools import chain

from radon.complexity import cc_visit_ast

from tests.support.paths import ROOT

PACKAGE = ROOT / "harvester"
MOST_BRANCHES, MOST_PARAMETERS = 15, 12
MOST_BY_POSITION, MOST_COLUMNS = 6, 100
# between these lies the quantile that makes 95 % of a normal distribution
NORMAL_95 = (1.9599, 1.9601)

WORDS = r"(warning|note|reason|doubt|refusal|remark|advice|missed|missing|why|told|said)s?"
# names of what holds sentences for the user
OF_WORDS = re.compile(rf"(.*_)?{WORDS}", re.IGNORECASE)
# which nothing else is called
HELD = re.compile(r"(.*_)?(warning|note|reason|doubt|refusal)s?", re.IGNORECASE)
READERS = {
    "startswith",
    "endswith",
    "removeprefix",
    "removesuffix",
    "partition",
    "rpartition",
    "find",
    "index",
}
MESSAGES = re.compile(r"harvester/presentation/messages\b")
# Whose notes are below pictures and tables of a page; and what the fields of results mean.
CAPTIONS = re.compile(r"harvester/(figures/|report/|explore/|presentation/glossary\b)")
# Names that fit anything, or that a reader would not look for: the thing itself is named instead.
VAGUE = re.compile(
    "_*(amiss|aim|along|apart|asked|borrowed|doubts?|features|found|freedom|further|kicks|lacking|lacks|lanes|lent|"
    "one|own|places?|plainly|play|prepared?|pursu(e|it)|readings|sampled|settle|tells|ticks?|told|usual|wanted)_*",
    re.IGNORECASE,
)


def parsed(folder=None):
    """Every Python file of the package, or below a folder: its path from the project's root, and its syntax tree."""
    return syntax_trees(folder or PACKAGE)


@cache
def syntax_trees(folder):
    """Every Python file below a folder: its path from the project's root, and its syntax tree.

    That needs two seconds, which those processes do not spend that run other tests.
    """
    return {
        file.relative_to(ROOT).as_posix(): ast.parse(file.read_text())
        for file in sorted(folder.rglob("*.py"))
    }


@cache
def nodes(folder):
    """Every syntax node of the files below a folder, with its file, by the node's type."""
    found = defaultdict(list)
    for name, tree in parsed(folder).items():
        waiting = [tree]
        while waiting:  # in half the time of ast.walk
            node = waiting.pop()
            found[type(node)].append((name, node))
            for part in vars(node).values():
                if isinstance(part, list):
                    waiting += [one for one in part if isinstance(one, ast.AST)]
                elif isinstance(part, ast.AST):
                    waiting.append(part)
    return found


def walked(*types, folder=None):
    """File and node of each syntax node of these types in the package, or in the files below a folder."""
    return chain.from_iterable(nodes(folder or PACKAGE)[one] for one in types)


def place(name, node, text=""):
    """A place as editors find it."""
    return f"{name}:{node.lineno}: {text or ast.unparse(node)[:100]}"


def functions_of_many_branches():
    """Functions and methods with a cyclomatic complexity above 15, as radon counts it."""
    for name, tree in parsed().items():
        for block in cc_visit_ast(tree):
            if block.letter != "C" and block.complexity > MOST_BRANCHES:
                yield f"{name}:{block.lineno}: {block.fullname} has {block.complexity}"


def functions_of_many_parameters():
    """Functions with more than 12 parameters, `self` among them."""
    for name, node in walked(ast.FunctionDef, ast.AsyncFunctionDef):
        a = node.args
        count = len([*a.posonlyargs, *a.args, *a.kwonlyargs]) + sum(
            one is not None for one in (a.vararg, a.kwarg)
        )
        if count > MOST_PARAMETERS:
            yield place(name, node, f"{node.name} has {count}")


# Rooms whose files bear the name of what they serve: the command, figure, page or messages of the
# study of that name.
NAMED_AFTER = re.compile(r"harvester/(commands|figures|report|presentation/messages)/")


def names_of_several_files():
    """Base names that more than one file has for things of its own, each with its files."""
    files = defaultdict(list)
    for name in parsed():
        if not NAMED_AFTER.match(name):
            files[name.rpartition("/")[2]].append(name)
    for base, several in sorted(files.items()):
        if len(several) > 1 and base != "__init__.py":
            yield f"{base}: {', '.join(several)}"


@cache
def engines():
    """Classes of engines and their names, as `harvester/engines` writes them: {"Spice": "spice", ...}."""
    found = {}
    for file, node in walked(ast.ClassDef):
        if file.startswith("harvester/engines/"):
            for line in node.body:
                target = (
                    line.target
                    if isinstance(line, ast.AnnAssign)
                    else getattr(line, "targets", [None])[0]
                )
                value = getattr(line, "value", None)
                if (
                    isinstance(target, ast.Name)
                    and target.id == "NAME"
                    and isinstance(value, ast.Constant)
                ):
                    found[node.name] = value.value
    return found


def tests_of_engines():
    """Questions of which engine it is, outside harvester/engines: by `isinstance`, by class, or by name."""

    def about(node):
        if isinstance(node, ast.Tuple | ast.List | ast.Set):
            return any(map(about, node.elts))
        if isinstance(node, ast.Attribute):
            return node.attr in engines() or (node.attr == "NAME" and about(node.value))
        return (isinstance(node, ast.Name) and node.id in engines()) or (
            isinstance(node, ast.Constant) and node.value in engines().values()
        )

    for name, node in walked(ast.Call, ast.Compare):
        if name.startswith("harvester/engines/"):
            continue
        if isinstance(node, ast.Compare):
            asked = any(map(about, [node.left, *node.comparators]))
        else:
            asked = isinstance(node.func, ast.Name) and node.func.id in ("isinstance", "issubclass")
            asked = asked and any(map(about, node.args[1:]))
        if asked:
            yield place(name, node)


def normal_quantiles():
    """The number 1.96 outside harvester/uncertainty, also under the name that it has there."""

    def is_it(node):
        return (
            isinstance(node, ast.Constant) and isinstance(node.value, float) and inside(node.value)
        )

    def inside(value):
        return NORMAL_95[0] < value < NORMAL_95[1]

    named = {
        target.id
        for _, node in walked(ast.Assign)
        if is_it(node.value)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for name, node in walked(ast.Constant, ast.Name, ast.Attribute):
        used = getattr(node, "id", "") in named or getattr(node, "attr", "") in named or is_it(node)
        if used and not name.startswith("harvester/uncertainty/"):
            yield place(name, node)


def is_sentence(node):
    """Whether a string, or an f-string, has a space between words."""
    if isinstance(node, ast.JoinedStr):
        text = "".join(
            part.value if isinstance(part, ast.Constant) else "x" for part in node.values
        )
        return is_sentence(ast.Constant(text))
    return (
        isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and bool(re.search(r"\w \w", node.value))
    )


def sentences(node):
    """The outermost sentences in an expression."""
    if is_sentence(node):
        yield node
    else:
        for part in ast.iter_child_nodes(node):
            yield from sentences(part)


@cache
def names_of_sentences():
    """Names that files give to sentences, and to nothing else: SPENT = "the budget is spent"."""
    given = defaultdict(list)
    for _, node in walked(ast.Assign):
        for target in node.targets:
            given[getattr(target, "id", "")].append(is_sentence(node.value))
    return {name for name, several in given.items() if name.isupper() and all(several)}


def name_of(node):
    """The last name of an expression: `warnings` of `answer.warnings` and of `warnings[0]`."""
    while isinstance(node, ast.Subscript | ast.Call | ast.Starred):
        node = node.func if isinstance(node, ast.Call) else node.value
    return getattr(node, "attr", None) or getattr(node, "id", "")


def sentences_read():
    """Tests of what a sentence states: it is compared, searched, or what holds sentences is."""
    for name, node in walked(ast.Call, ast.Compare):
        if MESSAGES.match(name):
            continue
        if isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
            texts = [
                one
                for one in parts
                if isinstance(one, ast.Constant) and isinstance(one.value, str) and one.value
            ]
            held = [
                one
                for one in parts
                if HELD.fullmatch(name_of(one)) and not isinstance(one, ast.Call)
            ]
        elif isinstance(node.func, ast.Attribute) and node.func.attr in READERS and node.args:
            parts = texts = node.args
            held = [node.func.value] if HELD.fullmatch(name_of(node.func.value)) else []
        else:
            continue
        known = any(is_sentence(one) or name_of(one) in names_of_sentences() for one in parts)
        if known or (texts and held):
            yield place(name, node)


# what has or takes words
GIVING = ast.keyword, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.Call, ast.FunctionDef


def words_made():
    """Sentences for warnings, notes, reasons and refusals that are written outside presentation/messages.

    Such a sentence is given to an argument or a name that is called so, or added to it, or is in a function that
    is called so, or begins with "warning:".  What is raised is not such a sentence, nor is a caption of a page.
    """
    raised = {id(part) for _, one in walked(ast.Raise) for part in ast.walk(one)}
    found = {}
    for name, node in walked(*GIVING, ast.Constant, ast.JoinedStr):
        if MESSAGES.match(name) or CAPTIONS.match(name):
            continue
        given = []
        if isinstance(node, ast.keyword) and node.arg and OF_WORDS.fullmatch(node.arg):
            given = [node.value]
        elif isinstance(node, ast.Assign | ast.AugAssign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            given = (
                [node.value]
                if node.value and any(OF_WORDS.fullmatch(name_of(one)) for one in targets)
                else []
            )
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            adds = node.func.attr in ("append", "extend", "insert", "add")
            given = node.args if adds and OF_WORDS.fullmatch(name_of(node.func.value)) else []
        elif isinstance(node, ast.FunctionDef) and OF_WORDS.fullmatch(node.name):
            given = node.body[1:] if ast.get_docstring(node) else node.body
        elif is_sentence(node) and re.match(r"'(warning|note): ", ast.unparse(node).lstrip("f")):
            given = [node]
        spoken = (one for value in given for one in sentences(value) if id(one) not in raised)
        found |= {(name, one.lineno, one.col_offset): one for one in spoken}
    yield from (place(where[0], found[where]) for where in sorted(found))


def vague_names():
    """Variables, arguments, attributes, functions and classes whose name does not state what they hold or do."""
    kinds = ast.Name, ast.Attribute, ast.arg, ast.FunctionDef, ast.ClassDef
    for file, node in walked(*kinds):
        if isinstance(getattr(node, "ctx", None), ast.Load | ast.Del):
            continue
        name = next(
            getattr(node, field) for field in ("id", "attr", "arg", "name") if hasattr(node, field)
        )
        if VAGUE.fullmatch(name):
            yield place(file, node, name)


def blank(node):
    """The shape of an expression, in which every name and constant is the same."""
    node = ast.parse(ast.unparse(node), mode="eval").body
    for one in ast.walk(node):
        if isinstance(one, ast.Name):
            one.id = "name"
        elif isinstance(one, ast.Attribute):
            one.attr = "name"
        elif isinstance(one, ast.Constant):
            one.value = type(one.value).__name__
    return ast.dump(node)


def tuple_assignments():
    """Assignments of three values or more to as many names, or of two whose expressions have another shape."""
    for name, node in walked(ast.Assign):
        target = node.targets[0]
        if not (isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)):
            continue
        values = node.value.elts
        if any(isinstance(one, ast.Starred) for one in (*target.elts, *values)):
            continue
        if len(values) > 2 or blank(values[0]) != blank(values[1]):
            yield place(name, node)


@cache
def own_functions():
    """Names of functions and classes that the package defines."""
    return {node.name for _, node in walked(ast.FunctionDef, ast.ClassDef)}


@cache
def functions_of_any_number():
    """Names of functions of the package that accept any number of arguments, as `print` does."""
    kinds = walked(ast.FunctionDef, ast.AsyncFunctionDef)
    return {node.name for _, node in kinds if node.args.vararg is not None}


@cache
def names_of_libraries():
    """For each file, the names under which it imports modules of other projects: np, pn."""
    found = defaultdict(set)
    for name, node in walked(ast.Import):
        for alias in node.names:
            if not alias.name.startswith("harvester"):
                found[name].add(alias.asname or alias.name.partition(".")[0])
    return found


def packed_calls():
    """Calls of the package's own functions with arguments that another line packed: f(*packed).

    Neither a function of any number of arguments, nor one that a function passes its own
    ``*arguments`` on to, has a parameter each that a reader looks for.
    """
    passed_on = {
        id(star)
        for _, function in walked(ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
        if function.args.vararg is not None
        for star in ast.walk(function)
        if isinstance(star, ast.Starred) and name_of(star.value) == function.args.vararg.arg
    }
    for name, node in walked(ast.Call):
        packed = [
            one
            for one in node.args
            if isinstance(one, ast.Starred)
            and isinstance(one.value, ast.Name | ast.Attribute)
            and id(one) not in passed_on
        ]
        called = name_of(node.func)
        if not packed or called not in own_functions() - functions_of_any_number():
            continue
        owner = getattr(node.func, "value", None)
        if not (isinstance(owner, ast.Name) and owner.id in names_of_libraries()[name]):
            yield place(name, node)


def calls_by_position():
    """Calls with seven positional arguments or more."""
    for name, node in walked(ast.Call):
        if len([one for one in node.args if not isinstance(one, ast.Starred)]) > MOST_BY_POSITION:
            yield place(name, node)


KINDS_OF_LOADS = {"IdealCircuit", "CompiledCircuit", "ModalCircuit", "ModalMotion", "CircuitMotion"}
ASKS_FOR_LOADS = {"own_circuit", "circuit", "ideal_circuit", "modes", "netlist"}


def questions_of_kind():
    """Places in mechanics, engines and studies that ask which load a device has, or how many modes."""
    for name, node in walked(ast.Call, ast.Compare):
        if isinstance(node, ast.Call):
            asked = node.args[1:] if name_of(node.func) == "isinstance" else []
            found = any(name_of(part) in KINDS_OF_LOADS for one in asked for part in ast.walk(one))
        else:
            against_none = isinstance(node.ops[0], ast.Is | ast.IsNot)
            found = against_none and name_of(node.left) in ASKS_FOR_LOADS
        if found:
            yield place(name, node)


def one_importer_modules():
    """Modules that one module alone imports, which is in the same folder."""
    importers = defaultdict(set)
    known = {name.removesuffix(".py").replace("/", ".") for name in parsed()}
    for name, node in walked(ast.Import, ast.ImportFrom):
        if isinstance(node, ast.ImportFrom) and node.module:
            whole = [node.module, *(f"{node.module}.{one.name}" for one in node.names)]
        else:
            whole = [one.name for one in node.names]
        for one in whole:
            if one in known:
                importers[one].add(name.removesuffix(".py").replace("/", "."))
    for one, several in sorted(importers.items()):
        if len(several) == 1 and next(iter(several)).rpartition(".")[0] == one.rpartition(".")[0]:
            yield f"{one.replace('.', '/')}.py: imported by {next(iter(several))}"


def long_lines():
    """Lines of more than 100 columns; most of them open a docstring."""
    for name in parsed():
        for number, line in enumerate((ROOT / name).read_text().splitlines(), 1):
            if len(line) > MOST_COLUMNS:
                yield f"{name}:{number}: {line.strip()[:80]}"


def tokens():
    """Thousands of tokens of code, without comments and docstrings."""
    quiet = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    count = 0
    for name in parsed():
        text = (ROOT / name).read_text()
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            is_docstring = token.type == tokenize.STRING and token.line.lstrip().startswith('"""')
            count += token.type not in quiet and not is_docstring
    yield from (f"thousand {k}" for k in range(1, count // 1000 + 1))


MEASURES = {
    "functions above 15 branches": functions_of_many_branches,
    "functions above 12 parameters": functions_of_many_parameters,
    "base names of several files": names_of_several_files,
    "tests of engines outside engines": tests_of_engines,
    "1.96 outside uncertainty": normal_quantiles,
    "sentences read by code": sentences_read,
    "words made outside messages": words_made,
    "vague names": vague_names,
    "tuple assignments of unlike things": tuple_assignments,
    "calls f(*packed)": packed_calls,
    "calls with seven positional arguments": calls_by_position,
    "questions of which load or how many modes": questions_of_kind,
    "one-importer modules": one_importer_modules,
    "lines above 100 columns": long_lines,
    "thousands of tokens": tokens,
}


def main():
    """Print the numbers, and the places of those whose name has the letters of an argument."""
    parts = sys.argv[1:]
    unknown = [part for part in parts if not any(part in title for title in MEASURES)]
    if unknown:
        sys.exit(
            f"no measure has {unknown[0]!r} in its name, which is one of: {', '.join(MEASURES)}"
        )
    for title, places in MEASURES.items():
        found = list(places())
        print(f"{len(found):6d}  {title}")
        if any(part in title for part in parts):
            print("\n".join(f"        {line}" for line in found))


if __name__ == "__main__":
    main()
