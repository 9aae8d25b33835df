"""How a command ends before its time: no file is left half-written, and a line says what ended it."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A file to write beside `path`, with its ending, that takes its place when all is written.

    Raises:
        OSError: It cannot; whatever is raised, what stood at `path` is left as it was.
    """
    target = path.resolve()
    part = target.with_name(f".{os.getpid()}.{target.name}")
    try:
        yield part
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)


class Ended(SystemExit):
    """A signal that ends the process, raised where it came: what is open is closed on the way out."""


def run(command: Callable[[], object]) -> None:
    """Run a command of the command line, which ends in order and with a line when it is interrupted or told to end."""
    came: list[int] = []

    def end(number: int, _: object) -> None:
        came.append(number)
        raise Ended(128 + number)

    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:  # not under nohup
            signal.signal(number, end)
    try:
        command()
    except KeyboardInterrupt:
        came.append(signal.SIGINT)
    finally:  # whatever has become of the exception on its way
        if came:
            print(f"ended by {signal.Signals(came[0]).name}; files are whole or as they were", file=sys.stderr)
            sys.exit(128 + came[0])
