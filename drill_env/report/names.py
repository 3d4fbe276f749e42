"""Names of files and controllers inside drawings."""

from drill_env._errors import printable


def drawn(name: object) -> str:
    """A name as matplotlib draws it letter for letter: what is between dollars is no formula."""
    return printable(name, 100).replace("$", r"\$")
