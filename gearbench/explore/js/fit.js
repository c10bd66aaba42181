// Fit the ranges of a figure to its columns, which may be empty. Rows of lists count as their items.
function span(columns, floor) {
  let low = floor ?? Infinity, high = -Infinity;
  for (const column of columns) for (const value of Array.from(column).flatMap((item) => item)) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (!(high > low)) return high > -Infinity && high === low ? [low - 1, high + 1] : null;
  const room = 0.06 * (high - low);
  return [floor === undefined ? low - room : floor, high + room];
}
const across = x.length ? span(sources.flatMap((source) => x.map((name) => source.data[name]))) : null;
const up = span(sources.flatMap((source) => y.map((name) => source.data[name])), floor ?? undefined);
if (across) plot.x_range.setv({ start: across[0], end: across[1] }, { sync: false });
if (up) plot.y_range.setv({ start: up[0], end: up[1] }, { sync: false });
