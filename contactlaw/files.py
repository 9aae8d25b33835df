"""Files that are never half-written."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`, with the same suffix; the file there replaces `path` at the end.

    Raises:
        OSError: The file cannot replace `path`. On this and any other exception `path` is left as it was.
    """
    target = path.resolve()
    part = target.with_name(f".{os.getpid()}.{target.name}")
    try:
        yield part
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
