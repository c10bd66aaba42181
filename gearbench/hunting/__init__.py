"""Contact over all mesh cycles until the same teeth meet again: side bands of pitch errors, run-out and waviness."""
