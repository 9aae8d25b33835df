"""Cache of machine code on disk, shared by all processes, so that each kernel is compiled once.

numba keeps an index file beside numbered data files and writes the index first. A process that is killed in between, or
two processes that write at once, leave an index that points to the code of another signature or of older sources; a
damaged file or a full disk ends in a traceback. Here the name of a file is a hash of all that its code depends on, the
file begins with its own check sum, and it is renamed into place once it is complete. A file that cannot be read is
compiled again; where files cannot be written, each process compiles for itself.
"""

import hashlib
import pickle
import sys
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core.caching import FunctionCache
from numba.core.serialize import dumps

from contactlaw.files import whole

CHECK = 32  # bytes of the SHA-256 digest that begins a file
REPORTED: list[str] = []
"""The reason why code cannot be cached, once it has been reported."""


def report_no_cache(reason: object) -> None:
    """Report on stderr, once a process, that machine code cannot be cached."""
    if not REPORTED:
        REPORTED.append(str(reason))
        print(
            f"contactlaw: machine code cannot be kept ({reason}); each process compiles its own. "
            "NUMBA_CACHE_DIR may name a folder that can be written to",
            file=sys.stderr,
        )


class CodeFiles:
    """Files of one function, one for each signature, in place of numba's index and data files.

    base: prefix of their names. stamp: hash or text that changes with everything that the code depends on.
    """

    def __init__(self, folder: str, base: str, stamp: str) -> None:
        self.folder, self.base = Path(folder), base
        self.stamp = hashlib.sha256(f"{stamp} {numba.__version__} {llvmlite.__version__}".encode()).hexdigest()[:12]

    def path(self, key: Any) -> Path:
        """Path of the file for a key: signature and machine."""
        return self.folder / f"{self.base}.{self.stamp}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"

    def load(self, key: Any) -> Any:
        """Return what was saved under a key, or None if there is no file or the file is damaged."""
        try:
            data = self.path(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(data[CHECK:]).digest() != data[:CHECK]:
            return None
        return pickle.loads(data[CHECK:])

    def save(self, key: Any, data: Any) -> None:
        """Write the file of a key and delete the files of older sources."""
        for old in [*self.folder.glob(f"{self.base}.*.nbc"), *self.folder.glob(f"{self.base}.nbi")]:
            if not old.name.startswith(f"{self.base}.{self.stamp}."):
                old.unlink(missing_ok=True)
        content = dumps(data)
        with whole(self.path(key)) as part:
            part.write_bytes(hashlib.sha256(content).digest() + content)


class Cache(FunctionCache):
    """numba's cache of a function, with `CodeFiles`; reading and writing raise nothing when files fail.

    The constructor raises a RuntimeError if no folder for the cache exists (a package inside a zip file, for example).
    """

    def __init__(self, function: Any, stamp: str) -> None:
        super().__init__(function)
        self._cache_file = CodeFiles(self.cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code of a signature as numba does, or None if the file cannot be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever the fault, the function can be compiled again
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save the code of a signature as numba does; report once if it cannot be written."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            report_no_cache(error)
            self.disable()
