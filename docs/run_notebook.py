"""Run a notebook of these pages, and keep what its cells print and show: python docs/run_notebook.py [FILE.ipynb]

Without Jupyter: the cells run one after the other in one process, as Jupyter would run them.
"""

import ast
import base64
import contextlib
import io
import json
import sys
from pathlib import Path

TASKS = Path(__file__).with_name("tasks.ipynb")


def run_cell(source, names):
    """What a cell prints, and the value of its last line where that is an expression; None where it is none."""
    tree = ast.parse(source)
    printed = io.StringIO()
    value = None
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    return printed.getvalue(), value


def outputs(source, names, count):
    """The outputs of a cell as a notebook keeps them."""
    printed, value = run_cell(source, names)
    found = []
    if printed:
        found.append(
            {"output_type": "stream", "name": "stdout", "text": printed.splitlines(keepends=True)}
        )
    if value is not None:
        data = {"text/plain": repr(value).splitlines(keepends=True)}
        if hasattr(value, "_repr_png_"):
            data["image/png"] = base64.b64encode(value._repr_png_()).decode()
        found.append(
            {
                "output_type": "execute_result",
                "execution_count": count,
                "metadata": {},
                "data": data,
            }
        )
    return found


def run(notebook):
    """The notebook with its code cells run."""
    names = {}
    count = 0
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            count += 1
            cell |= {
                "execution_count": count,
                "outputs": outputs("".join(cell["source"]), names, count),
            }
    return notebook


def main():
    """Run the notebook in its place."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else TASKS
    found = run(json.loads(path.read_text()))
    path.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
