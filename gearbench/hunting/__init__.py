"""All mesh cycles until the same teeth meet again: pitch errors, run-out and waves, with their side bands."""
