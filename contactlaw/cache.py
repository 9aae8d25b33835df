"""Machine code kept on disk, so that each kernel is compiled once for all processes.

numba keeps an index beside numbered files, and writes the index first: a process that is killed in between, or two that
write at once, leave an index that names the code of another signature or of older sources; a damaged file, or a full
disk, ends in a traceback. Here a file is named by all that its code depends on, holds its own check sum, and is renamed
into place when it is whole: what cannot be read is compiled again, what cannot be written is compiled in each process.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core.caching import FunctionCache
from numba.core.serialize import dumps

from contactlaw.ending import whole

CHECK = 32  # bytes of a SHA-256
UNWRITTEN: list[str] = []
"""Why code could not be kept, once it could not."""


def lament(reason: object) -> None:
    """Say once in a process that nothing can be kept."""
    if not UNWRITTEN:
        UNWRITTEN.append(str(reason))
        print(
            f"contactlaw: machine code cannot be kept ({reason}); each process compiles its own. "
            "NUMBA_CACHE_DIR may name a folder that can be written to",
            file=sys.stderr,
        )


class CodeFiles:
    """The files of one function, in place of numba's index and numbered files.

    Args:
        folder: Where they are.
        base: How their names begin.
        stamp: What all code depends on.
    """

    def __init__(self, folder: str, base: str, stamp: str) -> None:
        self.folder, self.base = Path(folder), base
        self.stamp = hashlib.sha256(f"{stamp} {numba.__version__} {llvmlite.__version__}".encode()).hexdigest()[:12]

    def path(self, key: Any) -> Path:
        """The file of a signature and machine."""
        return self.folder / f"{self.base}.{self.stamp}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"

    def load(self, key: Any) -> Any:
        """What was saved, or None: there is none, or it is damaged."""
        try:
            data = self.path(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(data[CHECK:]).digest() != data[:CHECK]:
            return None
        return pickle.loads(data[CHECK:])

    def save(self, key: Any, data: Any) -> None:
        """Write a file, and remove those of older sources."""
        for old in [*self.folder.glob(f"{self.base}.*.nbc"), *self.folder.glob(f"{self.base}.nbi")]:
            if not old.name.startswith(f"{self.base}.{self.stamp}."):
                old.unlink(missing_ok=True)
        content = dumps(data)
        with whole(self.path(key)) as part:
            part.write_bytes(hashlib.sha256(content).digest() + content)

    def flush(self) -> None:
        """Forget all of it."""
        for path in self.folder.glob(f"{self.base}.*.nbc"):
            path.unlink(missing_ok=True)


class Cache(FunctionCache):
    """numba's cache of a function on such files; it raises nothing where these fail.

    Raises:
        RuntimeError: When it is made: there is nowhere to keep anything, a package inside a zip file say.
    """

    def __init__(self, function: Any, stamp: str) -> None:
        super().__init__(function)
        self._cache_file = CodeFiles(self.cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """As numba's; None where what is there cannot be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever is wrong with it, it can be compiled
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """As numba's; where it cannot be written that is said."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            lament(error)
            self.disable()
