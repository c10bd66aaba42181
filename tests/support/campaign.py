"""How many random cases a slow test tries; ``CAMPAIGN=10 make test-all`` tries ten times as many."""

import os


def many(count: int) -> int:
    """So many cases, times the environment variable ``CAMPAIGN``."""
    return round(count * float(os.environ.get("CAMPAIGN", "1")))
