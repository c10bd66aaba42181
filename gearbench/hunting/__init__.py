"""Contact over all mesh cycles until the same teeth meet again: sidebands of pitch errors, run-out and waviness."""
