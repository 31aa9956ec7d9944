"""Errors that the user can correct, and how scripts end."""

import sys
from collections.abc import Callable
from pathlib import Path

BAD_INPUT = 2
INTERRUPTED = 130


class UserError(Exception):
    """A fault of the input or of the environment. Its text is one line for the user; the exit code is 2."""


def exit_code(work: Callable[[], int], interrupted: str = "interrupted") -> int:
    """The exit code of a script: the result of `work`, or 2 for a UserError or OSError, or 130 for an interrupt.

    An error or interrupt becomes one line on stderr, which begins with the name of the script.
    """
    try:
        return work()
    except (UserError, OSError) as error:
        text, code = " ".join(str(error).split()), BAD_INPUT
    except KeyboardInterrupt:
        text, code = interrupted, INTERRUPTED
    print(f"{Path(sys.argv[0]).name}: {text}", file=sys.stderr)
    return code
