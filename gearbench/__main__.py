"""``python -m gearbench``."""

from gearbench.cli import main

main()
