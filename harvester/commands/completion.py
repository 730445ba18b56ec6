"""What the shell offers after the tab key: scene files, engines, keys of a scene.

Each function has the form that click asks for: context, parameter and the word so far, to the words
that continue from it.
"""

import click
from click.shell_completion import CompletionItem

Items = list[CompletionItem]


def scene_files(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
    """Let the shell complete a file's name by itself."""
    return [CompletionItem(incomplete, type="file")]


def engines(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
    """The engines by name, with what each computes."""
    from harvester.engines.selection import ENGINES

    return _starting(
        incomplete,
        {name: (kind.__doc__ or "").partition("\n")[0] for name, kind in ENGINES.items()},
    )


def scene_keys(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
    """The keys of scene files, with what each means; after the = there is nothing to offer."""
    from harvester.scene.keys import keys

    return _starting(incomplete, {f"{key.table}.{key.name}": key.meaning for key in keys()})


def example_names(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
    """The example scenes by name."""
    from harvester.scene.example_scenes import example_scenes

    return _starting(incomplete, dict.fromkeys(example_scenes(), ""))


def _starting(incomplete: str, words: dict[str, str]) -> Items:
    """The words that continue from ``incomplete``, with a help for the shells that show one."""
    return [
        CompletionItem(word, help=text)
        for word, text in words.items()
        if word.startswith(incomplete)
    ]
