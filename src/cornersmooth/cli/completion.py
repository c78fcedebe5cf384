"""``cornersmooth completion``: what makes a shell complete words; click has no script for PowerShell."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Final

import click

from cornersmooth.cli.options import Options

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

#: variable by which a shell asks
ASKED: Final = "_CORNERSMOOTH_COMPLETE"

#: without an answer PowerShell completes files
_POWERSHELL: Final = """\
Register-ArgumentCompleter -Native -CommandName %(prog_name)s -ScriptBlock {
    param($word, $line, $cursor)
    $env:%(complete_var)s = 'powershell_complete'
    $env:COMP_WORDS = $line.ToString()
    $env:COMP_CWORD = $word
    try {
        %(prog_name)s | ForEach-Object {
            $value, $help = $_ -split "`t", 2
            [System.Management.Automation.CompletionResult]::new($value, $value, 'ParameterValue', $help)
        }
    } finally {
        Remove-Item Env:%(complete_var)s, Env:COMP_WORDS, Env:COMP_CWORD
    }
}
"""
#: a word of PowerShell: in quotes, or up to a blank; a backslash is one of a path
_WORD: Final = re.compile(r"\"[^\"]*\"?|'[^']*'?|\S+")


def add_powershell() -> None:
    """Make PowerShell known to click, which answers it where it completes."""
    from click.shell_completion import ShellComplete, add_completion_class

    class PowerShell(ShellComplete):
        name, source_template = "powershell", _POWERSHELL

        def get_completion_args(self) -> tuple[list[str], str]:
            """Words before the one that is completed, and that one, which PowerShell leaves out where it is empty."""
            words = [word.strip("\"'") for word in _WORD.findall(os.environ["COMP_WORDS"])][1:]
            begun = os.environ.get("COMP_CWORD", "").strip("\"'")
            return (words[:-1] if begun and words[-1:] == [begun] else words), begun

        def format_completion(self, item: CompletionItem) -> str:
            """Value and help with a tab between; nothing for files."""
            return "" if item.type != "plain" else f"{item.value}\t{item.help or item.value}"

        def complete(self) -> str:
            """Answers, a line each."""
            return "\n".join(line for line in super().complete().split("\n") if line)

    add_completion_class(PowerShell)


def run_completion(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from click.shell_completion import get_completion_class

    add_powershell()
    kind = get_completion_class(str(given.name))
    assert kind is not None
    group = click.get_current_context().find_root().command
    click.echo(kind(group, {}, "cornersmooth", ASKED).source().rstrip())
    return 0
