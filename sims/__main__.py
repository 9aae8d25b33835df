"""`python -m sims`."""

from contactlaw import checks

checks.need("typer", "python -m sims", "all")

from sims.cli import app  # noqa: E402
from sims.ending import run  # noqa: E402

run(app)
