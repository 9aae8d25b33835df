"""`python -m validation.calibrate_table`: the same as `python -m contactlaw calibrate`."""

from __future__ import annotations

import sys

from contactlaw.__main__ import main

if __name__ == "__main__":
    sys.exit(main(["calibrate", *sys.argv[1:]]))
