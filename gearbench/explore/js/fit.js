// Fit the ranges of a figure to all that its glyphs draw, which may be nothing. Columns of lists count as their items.
function span(names, floor) {
  let low = floor ?? Infinity, high = -Infinity;
  for (const { glyph, data_source } of plot.renderers) for (const name of names) {
    const column = data_source.data[glyph[name]?.field] ?? [];
    const rows = typeof column[0] === "object" ? column : [column];
    for (const row of rows) for (const value of row) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!(high > low)) return high > -Infinity && high === low ? [low - 1, high + 1] : null;
  const room = 0.06 * (high - low);
  return [floor === null ? low - room : floor, high + room];
}
const wide = across ? span(["x", "xs"], null) : null, up = span(["y", "ys", "y2", "top"], floor);
if (wide) plot.x_range.setv({ start: wide[0], end: wide[1] }, { sync: false });
if (up) plot.y_range.setv({ start: up[0], end: up[1] }, { sync: false });
