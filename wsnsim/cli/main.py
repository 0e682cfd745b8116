"""The `wsnsim` command and what all commands share: exit codes and how errors are shown."""

import sys
from importlib import import_module

import click

from wsnsim.errors import OutputFolderError, ScenarioError, WsnsimError

FINE, FAILED, USAGE, EXPECTATION, INTERRUPTED = 0, 1, 2, 3, 130
_NOBODY_READS = 141  # 128 + SIGPIPE, what other tools leave with

_COMMANDS = {
    "init": "Make a folder with a scenario to begin with.",
    "run": "Run a scenario and write its results into a folder.",
    "sweep": "Run a study: scenarios, what is varied, seeds; resumes by default.",
    "validate": "Check a scenario without running it.",
    "schema": "Write the JSON Schema of scenarios, for editors.",
    "completion": "Print what a shell needs to complete commands.",
    "bench": "Time the vision kernels beside plain twins and peers.",
}


class _LazyGroup(click.Group):
    """Knows its commands by name; imports one when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        command: click.Command = import_module(f"wsnsim.cli.{cmd_name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            from difflib import get_close_matches

            close = get_close_matches(args[0], _COMMANDS, n=1)
            hint = f" Did you mean {close[0]!r}?" if close else ""
            raise click.UsageError(error.message + hint, ctx) from None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))


@click.group(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(None, "--version", package_name="wsnsim", message="wsnsim %(version)s")
def wsnsim() -> None:
    """Simulate wireless camera networks: pixels, trackers, packets and joules in one run.

    Results go to files and to stdout, progress and messages to stderr. Exit
    codes: 0 fine, 1 a run failed, 2 usage or scenario error, 3 an expectation
    of the scenario was not met, 130 interrupted.
    """


def main() -> None:
    """Run the command line and leave with its exit code."""
    try:
        code = wsnsim.main(standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(USAGE)
    except (click.Abort, KeyboardInterrupt):
        _say("Interrupted.")
        sys.exit(INTERRUPTED)
    except ScenarioError as error:
        _say(str(error))
        count = len(error.problems)
        _say(f"{count} problem{'s' if count > 1 else ''} in the scenario; nothing was run.")
        sys.exit(USAGE)
    except WsnsimError as error:
        _say(f"Error: {error}")
        sys.exit(USAGE if isinstance(error, OutputFolderError) else FAILED)
    except OSError as error:
        # nobody reads our output any more, or it has nowhere to go: no traceback on the way out
        sys.stdout = None
        if isinstance(error, BrokenPipeError):
            sys.exit(_NOBODY_READS)
        _say(f"Error: {error}")
        sys.exit(FAILED)
    # click hands back what a command or `ctx.exit` returned
    sys.exit(code if isinstance(code, int) else FINE)


def _say(text: str) -> None:
    click.echo(text, err=True)
