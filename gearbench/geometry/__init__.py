"""Geometry of involute gears: tools, flank and fillet, gear, pair, trains, contact lines. Nothing here knows loads."""
