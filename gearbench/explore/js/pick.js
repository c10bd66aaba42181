// A tap picks the nearest kept design; the picked line in the parallel coordinates follows.
if (cb_obj.event_name === "tap") {
  const { x, y } = designs.data, mask = designs.explore?.mask;
  const wide = size[1] / (plot.x_range.end - plot.x_range.start);
  const high = size[0] / (plot.y_range.end - plot.y_range.start);
  let nearest = -1, least = 12;  // pixels
  for (let i = 0; i < x.length; i++) {
    if (mask && !mask[i]) continue;
    const distance = Math.hypot((x[i] - cb_obj.x) * wide, (y[i] - cb_obj.y) * high);
    if (distance < least) { least = distance; nearest = i; }
  }
  if (nearest >= 0 && pick.data.design[0] !== nearest) {
    pick.data = { design: [nearest], x: [x[nearest]], y: [y[nearest]] };  // and this script runs again
  }
  return;
}
const i = pick.data.design[0];
const places = axes.map(({ key, low, high }) => (designs.data[key][i] - low) / (high - low));
line.setv({ data: { x: places.map((_, k) => k), y: places } }, { sync: false });
