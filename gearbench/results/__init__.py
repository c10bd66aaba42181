"""Results: what a solved scene answers, under which names and units, where it comes from, and files of it."""
