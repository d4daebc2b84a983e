"""The command that tells what is missing."""

import typer

from mlscorr.cli.terminal import Exit, Json, say
from mlscorr.cli.work import print_json


def doctor(as_json: Json = False) -> None:
    """Tell what is installed, what is missing, and the line that installs it."""
    from mlscorr.cli.installation import examine, remedy
    from mlscorr.io.output import document

    findings = examine()
    for finding in findings:
        mark = "ok     " if finding.ok else "MISSING" if finding.needed else "without"
        say(f"{mark} {finding.name}: {finding.state}")
    for line in remedy(findings):
        say(f"To install what is missing:  {line}")
    names = {"state": "found"}
    rows = [{names.get(key, key): value for key, value in vars(part).items()} for part in findings]
    print_json(document("doctor", {"findings": rows}), as_json)
    if any(finding.needed and not finding.ok for finding in findings):
        raise typer.Exit(Exit.LIBRARY_MISSING)
