"""Design bench: a page for one gear pair, with a control for every key of its scene."""
