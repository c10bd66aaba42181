"""Accuracy and its cost: settings chosen for an accuracy, work–precision of every setting, plans, and the one clock."""
