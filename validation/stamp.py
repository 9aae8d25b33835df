"""Which sources a result was measured with, so that a run that was interrupted knows what is left."""

import hashlib
import inspect
from pathlib import Path

from contactlaw.jit import SOURCE_STAMP
from validation.case import Case

HERE = Path(__file__).resolve().parent
ONLY_SHOW = ("__main__.py", "report.py", "readme.py", "words.py")
"""Files of validation that measure nothing."""


def of_sources(case: Case) -> str:
    """A hash of the package, the scenes, the case's own file, and all that the cases share; not of other cases."""
    own = Path(inspect.getfile(type(case))).resolve()
    shared = [*HERE.rglob("*.py"), *(HERE / "data").glob("*.csv"), *(HERE.parent / "sims").rglob("*.py")]
    others = {HERE / name for name in ONLY_SHOW} | {path for path in shared if path.parent == HERE / "cases"}
    digest = hashlib.sha256(SOURCE_STAMP.encode())
    for path in sorted({own, *shared} - (others - {own})):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
