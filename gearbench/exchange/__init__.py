"""Exchange with other programs: gear pairs from REXS and results back into it."""
