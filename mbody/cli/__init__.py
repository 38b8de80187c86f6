"""The command `mbody`: analyses of model files, for people and for scripts.

Nothing is loaded here before it is needed, so that Ctrl-C is answered from the first moment on.
"""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and give its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments, by default those of the process.

    Returns
    -------
    int
        0; 1 if an analysis fails, is stopped or gives a doubtful result, or if the output cannot
        be written; 2 for bad input; 130 if Ctrl-C ended it. The reason goes to stderr as a
        sentence, or with --json to stdout as data.

    Examples
    --------
    >>> main([])  # doctest: +ELLIPSIS
    usage: mbody ...
    0
    """
    from mbody.cli.command import run_command

    return run_command(argv)
