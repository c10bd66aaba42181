"""``python -m gearbench``."""

from gearbench.cli.app import main

main()
