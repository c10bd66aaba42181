// A tap picks the nearest kept design; after a pick, its line in the parallel coordinates is drawn.
if (cb_obj.event_name === "tap") {
  const { x, y } = designs.data, mask = designs.explore?.mask;
  const perX = size[1] / (plot.x_range.end - plot.x_range.start);  // pixels per unit
  const perY = size[0] / (plot.y_range.end - plot.y_range.start);
  let nearest = -1, least = 12;  // a tap farther than 12 pixels from all designs picks none
  for (let i = 0; i < x.length; i++) {
    if (mask && !mask[i]) continue;
    const distance = Math.hypot((x[i] - cb_obj.x) * perX, (y[i] - cb_obj.y) * perY);
    if (distance < least) { least = distance; nearest = i; }
  }
  if (nearest >= 0 && pick.data.design[0] !== nearest) {
    pick.data = { design: [nearest], x: [x[nearest]], y: [y[nearest]] };  // this change runs the script again
  }
  return;
}
const i = pick.data.design[0];
const places = axes.map(({ key, low, high }) => (designs.data[key][i] - low) / (high - low));
line.setv({ data: { x: places.map((_, k) => k), y: places } }, { sync: false });
