"""`python -m sims`."""

from sims.cli import app

app()
