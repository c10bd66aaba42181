// Turn the gears of a train to the mesh phase, each about its axis, and show the load shares there.
// rate: rotation of each gear [rad per mesh period]; angles count clockwise, because y points down (geometry/train.py)
const tau = phase.value, { xs, ys, x, y, rate, alpha } = now.gears.data;
const shapes = { xs: [], ys: [], alpha };
xs.forEach((outlineX, i) => {
  const sin = Math.sin(tau * rate[i]), cos = Math.cos(tau * rate[i]), outlineY = ys[i];
  shapes.xs.push(Float32Array.from(outlineX, (px, k) => x[i] + (px - x[i]) * cos - (outlineY[k] - y[i]) * sin));
  shapes.ys.push(Float32Array.from(outlineX, (px, k) => y[i] + (px - x[i]) * sin + (outlineY[k] - y[i]) * cos));
});
drawn.setv({ data: shapes }, { sync: false });

// value of a load share curve at the mesh phase
function shareAt(phases, shares) {
  const k = phases.findIndex((value) => value > tau);
  if (k < 1) return shares.at(k);  // before the first point, or after the last
  const part = (tau - phases[k - 1]) / (phases[k] - phases[k - 1]);
  return shares[k - 1] + part * (shares[k] - shares[k - 1]);
}

const { xs: phases, ys: curves } = now.sharing.data, { path } = now.marks.data, { colour } = now.paths.data;
// After a change of the number of planets, the quick answer has the new load shares but not yet the new gears: the circles
// stay until these come.
if (curves.length === colour.length) {
  const shares = phases.map((values, i) => shareAt(values, curves[i]));
  const of = (column) => path.map((i) => column[i]);  // from one value per load path to one per mesh
  const size = shares.map((value) => 14 * value), share = shares.map((value) => value.toFixed(2));  // 14 pixels: share 1
  labels.setv({ data: { ...now.paths.data, size, share } }, { sync: false });
  marks.setv({ data: { ...now.marks.data, size: of(size), share: of(share), colour: of(colour) } }, { sync: false });
}
const { low, high } = now.extent.data, aspect = plot.inner_width / plot.inner_height || 1;
// half the extent of the gears, and a margin of 8 %
const half = 0.54 * Math.max(high[1] - low[1], (high[0] - low[0]) / aspect);
const middle = [0, 1].map((k) => (low[k] + high[k]) / 2);
plot.x_range.setv({ start: middle[0] - half * aspect, end: middle[0] + half * aspect }, { sync: false });
plot.y_range.setv({ start: middle[1] + half, end: middle[1] - half }, { sync: false });
