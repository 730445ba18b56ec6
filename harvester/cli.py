"""The command line: the program and its help; errors in one line, exit status 0, 2, 3 or 130."""

import os
import sys
import warnings
from typing import NoReturn

import click
import cloup
from cloup.constraints import ConstraintViolated

from harvester import __version__
from harvester.commands.adopt import adopt
from harvester.commands.charge import charge
from harvester.commands.compare import compare
from harvester.commands.cost import cost
from harvester.commands.design import design
from harvester.commands.doctor import doctor
from harvester.commands.examples import examples
from harvester.commands.explore import explore
from harvester.commands.export import export
from harvester.commands.help import SETTINGS
from harvester.commands.identify import identify
from harvester.commands.keys import keys
from harvester.commands.messages import coloured, complain
from harvester.commands.motion import motion
from harvester.commands.new import new
from harvester.commands.optimise import optimise
from harvester.commands.paper import paper
from harvester.commands.record import record
from harvester.commands.response import response
from harvester.commands.run import run
from harvester.commands.stability import stability
from harvester.commands.study import study_commands
from harvester.commands.sweep import sweep
from harvester.commands.tolerance import tolerance
from harvester.commands.tour import tour
from harvester.errors import HarvesterError, InputError, named
from harvester.machine.limits import check_limits, check_streams

HELP = """How much power a vibro-impact piezoelectric harvester gives, at which load, and how sure that is.

A scene file describes the device; engines compute it, from formulas in milliseconds to ngspice in lock-step with
the mass.

\b
A first session (harvester tour runs one):
  harvester new mine.toml                                  your device, from questions; explains its numbers
  harvester run mine.toml --within 1%                      its mean power, with the error
  harvester sweep mine.toml --vary load.resistance=1k:10M:25 --out sweep          against the load, with a plot
  harvester optimise mine.toml --vary load.resistance=1k:10M                      the best load
  harvester compare mine.toml --report                     all engines side by side, and one page with all of it
"""


@cloup.group(
    help=HELP,
    sections=[
        cloup.Section("Your device", [new, keys, examples, tour, identify, record, adopt, export]),
        cloup.Section("Its power", [explore, run, sweep, optimise, tolerance, design, compare]),
        cloup.Section(
            "A closer look", [charge, cost, motion, response, stability, *study_commands()]
        ),
        cloup.Section("The paper, this machine", [paper, doctor]),
    ],
    context_settings=SETTINGS,
    epilog="""\b
Exit status: 0 done; 2 bad input, explained in one line on stderr; 3 a named simulation error;
130 interrupted.  Colours and progress are for terminals; NO_COLOR=1: no colours.
A scene file's keys, with units and examples: harvester keys.  A command's options: harvester COMMAND --help.
"The paper" is: Stochastic Dynamics of Nonlinear Piezoelectric Vibration Energy Harvesting System with Inelastic
Impact (L.L., L.T., M.S., H.Y.), Entropy, 1 April 2026.""",
)
@click.version_option(__version__, prog_name="harvester")
def cli() -> None:
    """How much power a vibro-impact piezoelectric harvester gives, at which load, and how sure that is."""


def main() -> NoReturn:
    """Run the program with the arguments of the process, and exit with its status."""
    if not sys.warnoptions:  # warnings of NumPy and the like are no answer
        warnings.simplefilter("ignore")
    sys.exit(exit_status(sys.argv[1:]))


def exit_status(arguments: list[str]) -> int:
    """Run a command line and return its exit status; any failure is one line on stderr."""
    try:
        check_streams()
        check_limits()
        cli.main(
            arguments or ["--help"], prog_name="harvester", standalone_mode=False, color=coloured()
        )
        return 0
    except HarvesterError as error:
        return _say(str(error), error.exit_status)
    except click.ClickException as error:
        if isinstance(error.__context__, InputError):  # of an option's reader: it says all of it
            return _say(str(error.__context__), 2)
        return _say(error.format_message() + _hint(error), 2)
    except (KeyboardInterrupt, click.Abort) as error:  # click's own hides the other behind it
        return _say(str(error.__cause__ or error) or "interrupted", 130)
    except SystemExit:  # click's way out when the reader of a pipe has gone
        return 0
    except Exception as error:  # still one line, with a way to see more
        if os.environ.get("HARVESTER_TRACEBACK"):
            raise
        failure = named(error)
        return _say(str(failure), failure.exit_status)


_FILL = {
    "path": "'harvester new FILE.toml' makes one",
    "file": "such as mine.toml",
    "out": "such as --out out",
}
_FILL |= {"sweep": "such as --sweep 1Hz:10Hz:61"}
_FILL |= {"varied": "such as --vary piezo.capacitance=10%"}


def _hint(error: click.ClickException) -> str:
    """The usage to type, if click only states the fault."""
    if not isinstance(error, click.UsageError) or isinstance(error, ConstraintViolated):
        return ""
    if getattr(error, "possibilities", None):  # click's own "Did you mean"
        return ""
    if (
        isinstance(error, click.MissingParameter)
        and error.param is not None
        and error.param.name in _FILL
    ):
        return f" ({_FILL[error.param.name]})"
    return f" ({error.ctx.command_path if error.ctx else 'harvester'} --help)"


def _say(text: str, status: int) -> int:
    """Print an error and return the exit status of its kind."""
    complain(text)
    return status
