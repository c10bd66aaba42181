// Fit the ranges of a figure to what its glyphs draw, if they draw anything.
// ends of all values of the named glyph properties, with a margin; a column may hold numbers or lists of numbers
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
  const margin = 0.06 * (high - low);
  return [floor === null ? low - margin : floor, high + margin];
}
const width = across ? span(["x", "xs"], null) : null, height = span(["y", "ys", "y2", "top"], floor);
if (width) plot.x_range.setv({ start: width[0], end: width[1] }, { sync: false });
if (height) plot.y_range.setv({ start: height[0], end: height[1] }, { sync: false });
