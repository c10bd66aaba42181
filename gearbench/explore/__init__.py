"""The explorer: a local web page, or a single HTML file, over stored results."""
