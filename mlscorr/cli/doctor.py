"""The command that tells what is missing."""

import json

import typer

from mlscorr.cli.terminal import Exit, Json, say


def doctor(as_json: Json = False):
    """Tell what is installed, what is missing, and the line that installs it."""
    from mlscorr.doctor import examine, remedy
    from mlscorr.io.output import document

    findings = examine()
    for finding in findings:
        mark = "ok     " if finding.ok else "MISSING" if finding.needed else "without"
        say(f"{mark} {finding.name}: {finding.found}")
    for line in remedy(findings):
        say(f"To install what is missing:  {line}")
    if as_json:
        rows = [vars(finding) for finding in findings]
        print(json.dumps(document("doctor", {"findings": rows})))
    if any(finding.needed and not finding.ok for finding in findings):
        raise typer.Exit(Exit.LIBRARY_MISSING)
