"""The type of errors that the user can correct."""


class UserError(Exception):
    """A fault of the input or of the environment. Its text is one line for the user; the exit code is 2."""
