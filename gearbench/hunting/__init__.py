"""All mesh cycles until the same teeth meet again: pitch errors, run-out and waviness, with their side bands."""
