"""The one kind of error that is the user's to mend."""


class UserError(Exception):
    """A fault of the input or of the environment; its text is one line for the user, and the exit code is 2."""
