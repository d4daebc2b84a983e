"""Longest time without a change on the terminal by command, during which it appears frozen.

Runs each command on the demo survey in a terminal of its own, and prints the intervals over 2 s in
which nothing was printed or redrawn, with the last line before them.

    python benchmarks/frozen_intervals.py [COMMAND ...]
"""

import errno
import os
import pty
import re
import sys
import tempfile
import time

FROZEN = 2.0  # s; longer a person takes a program without a sign of life for dead
COMMANDS = {  # in an order in which each finds what it needs
    "demo": ("demo", "-o", "{out}/demo"),
    "check": ("check", "{survey}"),
    "extract": ("extract", "{survey}", "-o", "{out}/extract"),
    "ties": ("ties", "{survey}", "-o", "{out}/ties"),
    "correct": ("correct", "{survey}", "-o", "{out}/correct"),
    "render": ("render", "{survey}", "--corrected", "{out}/demo/corrected", "-o", "{out}/render"),
    "calibrate": ("calibrate", "{survey}", "-o", "{out}/calibrate"),
    "compare": ("compare", "{survey}", "-o", "{out}/compare"),
    "plan": ("plan", "{survey}", "-o", "{out}/plan"),
    "diagnose": ("diagnose", "{survey}", "-o", "{out}/diagnose"),
    "simulate": ("simulate", "examples/scenarios/calibration.toml", "-o", "{out}/simulate"),
}
ESCAPES = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")


def record(arguments: list[str]) -> tuple[list[tuple[float, str]], float, int]:
    """Output of a command on a terminal: (time, text) of each change, its end, its exit code."""
    process, terminal = pty.fork()
    if process == 0:
        os.environ["COLUMNS"] = "120"
        os.execv(sys.executable, [sys.executable, "-m", "mlscorr", *arguments])
    start = time.monotonic()
    changes = []
    while True:
        try:
            data = os.read(terminal, 1 << 16)
        except OSError as error:
            if error.errno != errno.EIO:  # the end of a terminal's other side
                raise
            break
        if not data:
            break
        changes.append((time.monotonic() - start, data.decode(errors="replace")))
    _, status = os.waitpid(process, 0)
    return changes, time.monotonic() - start, os.waitstatus_to_exitcode(status)


def last_line(text: str) -> str:
    """The last visible line."""
    lines = [line.strip() for line in re.split(r"[\r\n]+", ESCAPES.sub("", text)) if line.strip()]
    if lines:
        return lines[-1]
    return ""


def frozen(changes: list[tuple[float, str]], end: float) -> list[tuple[float, float, str]]:
    """Start, length and last line of each interval over the limit without a change."""
    intervals = []
    before = 0.0
    line = "(nothing yet)"
    shown = ""
    for now, text in [*changes, (end, "")]:
        if now < end and ESCAPES.sub("", text).strip() in ("", shown):
            continue  # redrawn as it was
        shown = ESCAPES.sub("", text).strip()
        if now - before > FROZEN:
            intervals.append((before, now - before, line))
        before = now
        line = last_line(text) or line
    return intervals


def main() -> None:
    """Print a table of the given commands, or of all."""
    asked = sys.argv[1:] or list(COMMANDS)
    with tempfile.TemporaryDirectory() as out:
        places = {"out": out, "survey": f"{out}/demo/survey"}
        print(f"{'command':10s}{'exit':>5s}{'seconds':>9s}{'frozen':>8s}{'longest':>9s}")
        for name in dict.fromkeys(["demo", *asked]):
            arguments = [part.format(**places) for part in COMMANDS[name]]
            changes, end, code = record(arguments)
            intervals = frozen(changes, end)
            longest = max((length for _, length, _ in intervals), default=0.0)
            print(f"{name:10s}{code:5d}{end:9.1f}{len(intervals):8d}{longest:9.1f}", flush=True)
            for begin, length, line in intervals:
                print(f"    from {begin:6.1f} s for {length:5.1f} s: {line[:90]}")


if __name__ == "__main__":
    main()
