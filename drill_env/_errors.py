"""The one error that bad input raises."""


class InputError(ValueError):
    """Bad input: the message names the file, column or argument and the remedy.

    The command line turns it into one line on stderr and exit status 2.
    """
