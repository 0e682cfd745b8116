"""The command line: one file a command, imported when it is called.

Exit codes: 0 fine, 1 a run failed, 2 usage or scenario error, 3 an `expect:` of
the scenario failed, 130 interrupted.
"""

from wsnsim.cli.main import main

__all__ = ["main"]
