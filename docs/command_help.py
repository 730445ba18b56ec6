"""A directive for Sphinx: the help of every command, from the program itself."""

import click
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from harvester.cli import cli

WIDTH = 80  # columns that fit a page


class CommandHelp(SphinxDirective):
    """One section per command with its --help; that of the program if no part is named."""

    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """The program's own help, or that of all commands of a part of it, in its order."""
        program = _context(cli, "harvester")
        parts = {section.title: section.commands for section in cli.list_sections(program)}
        if not self.arguments:
            return [self._section("harvester", click.unstyle(program.get_help()))]
        return [
            self._section(
                f"harvester {name}",
                click.unstyle(_context(command, name, parent=program).get_help()),
            )
            for name, command in parts[self.arguments[0]].items()
        ]

    @staticmethod
    def _section(title: str, text: str) -> nodes.section:
        section = nodes.section(
            ids=[nodes.make_id(title)], names=[nodes.fully_normalize_name(title)]
        )
        section += nodes.title(text=title)
        section += nodes.literal_block(text=text, language="text")
        return section


def _context(
    command: click.Command, name: str, parent: click.Context | None = None
) -> click.Context:
    """The context in which a command prints its help, without reading any argument."""
    return command.make_context(name, [], parent, resilient_parsing=True, terminal_width=WIDTH)


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True}
