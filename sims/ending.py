"""Orderly ends of a command that is interrupted: a line names the signal, and files are whole (`contactlaw.files`)."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable


class Ended(SystemExit):
    """Raised by the handler of a signal that ends the process, so that open files are closed on the way out."""


def run(command: Callable[[], object]) -> None:
    """Run a command; on SIGINT, SIGTERM or SIGHUP print a line on stderr and exit with 128 + the signal's number."""
    received: list[int] = []

    def end(number: int, _: object) -> None:
        received.append(number)
        raise Ended(128 + number)

    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:  # not under nohup
            signal.signal(number, end)
    try:
        command()
    except KeyboardInterrupt:
        received.append(signal.SIGINT)
    finally:  # the command may have replaced the exception by another
        if received:
            print(f"ended by {signal.Signals(received[0]).name}; files are whole or as they were", file=sys.stderr)
            sys.exit(128 + received[0])
