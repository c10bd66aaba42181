"""Number of random cases of a slow test; ``CAMPAIGN=10 make test-all`` tries ten times as many."""

import os


def many(count: int) -> int:
    """``count`` times the environment variable ``CAMPAIGN``."""
    return round(count * float(os.environ.get("CAMPAIGN", "1")))
