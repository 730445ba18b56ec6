"""State that threads share: names of a module, or of an imported one, in which a function writes."""

import ast

WRITING = frozenset(
    (
        "append",
        "appendleft",
        "add",
        "pop",
        "popleft",
        "popitem",
        "extend",
        "update",
        "clear",
        "setdefault",
        "remove",
        "discard",
        "insert",
    )
)


def written(tree: ast.Module) -> set[str]:
    """The names of a module, or of those that it imports, in which one of its functions writes."""
    assigned, imported = _names(tree.body)
    found = set()
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef | ast.Lambda):
            found |= _written_by(function, assigned, imported)
    return found


def _names(statements: list[ast.stmt]) -> tuple[set[str], set[str]]:
    """The names that statements assign, and those that they import or define."""
    assigned = set()
    imported = set()
    for one in statements:
        match one:
            case ast.Assign() | ast.AnnAssign():
                assigned |= {
                    node.id
                    for node in ast.walk(one)
                    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
                }
            case ast.Import() | ast.ImportFrom():
                imported |= {(alias.asname or alias.name).split(".")[0] for alias in one.names}
            case ast.FunctionDef() | ast.ClassDef():
                imported.add(one.name)
    return assigned, imported


def _written_by(
    function: ast.FunctionDef | ast.Lambda, assigned: set[str], imported: set[str]
) -> set[str]:
    """The shared names in which one function writes."""
    nodes = list(ast.walk(function))
    own = {node.arg for node in nodes if isinstance(node, ast.arg)}
    own |= {
        node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    here = _names([node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)])[1]
    named = {name for node in nodes if isinstance(node, ast.Global) for name in node.names}
    found = set(named)
    for node in nodes:
        match node:
            case ast.Call(func=ast.Attribute(attr=method, value=target)) if method in WRITING:
                targets = [target]
            case ast.Assign(targets=targets) | ast.Delete(targets=targets):
                targets = [one for one in targets if not isinstance(one, ast.Name)]
            case ast.AugAssign(target=target) | ast.AnnAssign(target=target):
                targets = [] if isinstance(target, ast.Name) else [target]
            case _:
                continue
        for target in targets:
            name = _root(target)
            may = assigned | imported | here if not isinstance(target, ast.Name) else assigned
            if name in may - (own - here):
                found.add(name)
    return found


def _root(node: ast.expr) -> str | None:
    """The name at the beginning of an attribute or an item."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node.id if isinstance(node, ast.Name) else None
