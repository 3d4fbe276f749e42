"""The licence of every installed dependency, as the table of docs/licences.md.

    python -m supply.licences docs/licences.md

What the page says above its heading "Every package" stays; the rest is written anew.
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

HEADING = "## Every package"
# From what everyone needs to what few do: a package stands with the first that needs it.
EXTRAS = ("", "export", "agents", "render", "cluster", "tables", "dev", "bench")
# What a licence asks of a work that contains it; the strictest part of an expression counts.
KINDS = {
    "copyleft": r"(?<!L)GPL|GNU General Public|Affero",
    "weak copyleft": r"LGPL|Lesser General Public|MPL|Mozilla",
    "permissive": r"MIT|BSD|Apache|ISC|PSF|Python Software Foundation|Zlib|CC0|BSL-1\.0",
}


def kind_of(licence: str) -> str:
    """What the licence asks: copyleft, weak copyleft, permissive, or "to be read"."""
    parts = re.split(r" AND | OR |; ", licence)
    kinds = [next((k for k, p in KINDS.items() if re.search(p, part)), "") for part in parts]
    if "" in kinds:
        return "to be read"
    return min(kinds, key=list(KINDS).index)


def licence_of(package: Distribution) -> str:
    """The SPDX expression, else the classifiers, else the first line of the licence field."""
    fields = package.metadata
    if expression := fields.get_all("License-Expression"):
        return expression[0]
    classifiers = fields.get_all("Classifier") or []
    named = [c.split(" :: ")[-1] for c in classifiers if c.startswith("License :: ")]
    lines = "\n".join(fields.get_all("License") or []).strip().splitlines()
    return "; ".join(named) or (lines[0] if lines else "not named")


def needed_by(project: str) -> dict[str, tuple[Distribution, str]]:
    """Every installed package below the project, with the first of its extras that needs it."""
    found: dict[str, tuple[Distribution, str]] = {}
    followed: set[tuple[str, str]] = set()

    def follow(name: str, extra: str, role: str) -> None:
        if (name, extra) in followed:
            return
        followed.add((name, extra))
        try:
            package = distribution(name)
        except PackageNotFoundError:  # of another platform, or an extra that is not installed
            return
        found.setdefault(name, (package, role))
        for need in map(Requirement, package.requires or ()):
            if need.marker is None or need.marker.evaluate({"extra": extra}):
                for further in ("", *need.extras):
                    follow(canonicalize_name(need.name), further, role)

    for extra in EXTRAS:
        follow(project, extra, extra or "core")
    del found[project]
    return found


def table(packages: dict[str, tuple[Distribution, str]]) -> str:
    """The table, the core first, then by name."""
    order = ["core", *EXTRAS[1:]]
    rows = ["| package | version | needed by | kind | licence |", "| --- | --- | --- | --- | --- |"]
    for name, (package, role) in sorted(
        packages.items(), key=lambda p: (order.index(p[1][1]), p[0])
    ):
        licence = licence_of(package).replace("|", r"\|")
        rows.append(f"| {name} | {package.version} | {role} | {kind_of(licence)} | {licence} |")
    return "\n".join(rows)


def main(page: str) -> None:
    """Write the page's table anew."""
    path = Path(page)
    kept = path.read_text(encoding="utf-8").partition(HEADING)[0]
    path.write_text(f"{kept}{HEADING}\n\n{table(needed_by('drill-env'))}\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
