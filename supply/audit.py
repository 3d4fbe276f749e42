"""Known vulnerabilities of what a lock pins, by pip-audit; never clean without having asked.

    python -m supply.audit REPORT pip-audit -r supply/all.lock ...

Exit status 0: every package was looked up and none is known to be vulnerable. 1: some are. 2: at
least one could not be looked up, and nothing is claimed. pip-audit itself ends with 0 where an
index knows none of the packages, as a mirror without PyPI's advisories does.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path


def audit(report: Path, command: list[str]) -> tuple[int, str]:
    """Run pip-audit, which writes its JSON report there; the exit status and what to say."""
    report.parent.mkdir(parents=True, exist_ok=True)
    report.unlink(missing_ok=True)
    run = subprocess.run(
        [*command, "--format", "json", "--output", str(report)], capture_output=True, text=True
    )
    if not report.exists():
        cause = (run.stderr.strip().splitlines() or ["it said nothing"])[-1]
        return 2, f"audit: nothing is claimed: pip-audit wrote no report: {cause}"
    packages = json.loads(report.read_text(encoding="utf-8"))["dependencies"]
    skipped = [p["name"] for p in packages if "skip_reason" in p]
    found = [
        f"{p['name']} {p['version']}: {v['id']}, mended in {', '.join(v['fix_versions']) or 'none'}"
        for p in packages
        for v in p.get("vulns", ())
    ]
    if found:
        found.append(f"audit: {len(found)} known, {len(skipped)} packages not looked up")
        return 1, "\n".join(found)
    if skipped or not packages:
        return 2, (
            f"audit: nothing is claimed: {len(skipped)} of {len(packages)} packages could not be "
            f"looked up ({', '.join(skipped[:3])} ...); run it where PyPI's or OSV's advisories "
            f"are reached"
        )
    return 0, f"audit: none known for {len(packages)} packages"


if __name__ == "__main__":
    status, words = audit(Path(sys.argv[1]), sys.argv[2:])
    print(words)
    sys.exit(status)
