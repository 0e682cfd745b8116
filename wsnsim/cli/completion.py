"""`wsnsim completion`: what a shell needs to complete wsnsim's commands, options and scenario files."""

import click
from click.shell_completion import get_completion_class

_SHELLS = {
    "bash": ("~/.bashrc", 'eval "$(wsnsim completion bash)"'),
    "zsh": ("~/.zshrc", 'eval "$(wsnsim completion zsh)"'),
    "fish": ("~/.config/fish/completions/wsnsim.fish", "wsnsim completion fish | source"),
}


@click.command("completion", epilog="\b\n" + "\n".join(f"{file}:  {line}" for file, line in _SHELLS.values()))
@click.argument("shell", type=click.Choice(list(_SHELLS)))
def command(shell: str) -> None:
    """Print what SHELL needs to complete commands, options and scenario files.

    Put one line into the file that your shell reads at its start:
    """
    from wsnsim.cli.main import wsnsim

    script = get_completion_class(shell)
    assert script is not None  # click knows all three
    # click calls bash to learn its version; a shell that is not there is the user's affair
    click.echo(script(wsnsim, {}, "wsnsim", "_WSNSIM_COMPLETE").source())
