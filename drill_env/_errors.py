"""The one error that bad input raises."""

_LONGEST = 2000


class InputError(ValueError):
    """Bad input: the message names the file, column or argument and the remedy.

    The command line turns it into one line on stderr and exit status 2.
    """

    def __init__(self, message: object) -> None:
        super().__init__(printable(message))


def printable(text: object, most: int = _LONGEST) -> str:
    """Text of a file, a name or an error as one short line that any terminal and file can hold.

    Names in hostile files and folders may hold line ends, control sequences, bytes that are no
    UTF-8, or millions of letters.

    Args:
        text: what is shown.
        most: characters that are kept.
    """
    whole = str(text)
    if not (whole.isprintable() and len(whole) <= most):
        whole = "".join(_printable(c) for c in whole[: most + 1])
    return whole if len(whole) <= most else whole[:most] + "…"


def _printable(character: str) -> str:
    if character.isprintable():
        return character
    return " " if character in "\r\n\t" else ascii(character)[1:-1]
