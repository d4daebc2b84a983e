"""Command that reports missing components."""

import typer

import mlscorr
from mlscorr.cli.terminal import Exit, Json, say
from mlscorr.cli.work import print_json

EXAMPLES = (
    "mlscorr doctor",
    "mlscorr doctor --json",
)


def doctor(as_json: Json = False) -> None:
    """List what is installed, what is missing, and the command that installs it."""
    from mlscorr.io.store import document

    installation = mlscorr.doctor()
    for part in installation.parts:
        say(f"{part.mark:7s} {part.name}: {part.state}")
    for line in installation.remedies:
        say(f"To install what is missing:  {line}")
    rows = [
        {"found" if key == "state" else key: value for key, value in vars(part).items()}
        for part in installation.parts
    ]
    print_json(document("doctor", {"findings": rows}), as_json)
    if not installation.is_complete:
        raise typer.Exit(Exit.LIBRARY_MISSING)
