// Turn the gears of a train to the mesh phase, each about its axis, and show the load shares there.
const tau = phase.value, { xs, ys, x, y, rate, alpha } = now.gears.data;
const shapes = { xs: [], ys: [], alpha };
xs.forEach((across, i) => {
  const sin = Math.sin(tau * rate[i]), cos = Math.cos(tau * rate[i]), down = ys[i];
  shapes.xs.push(Float32Array.from(across, (each, k) => x[i] + (each - x[i]) * cos - (down[k] - y[i]) * sin));
  shapes.ys.push(Float32Array.from(across, (each, k) => y[i] + (each - x[i]) * sin + (down[k] - y[i]) * cos));
});
drawn.setv({ data: shapes }, { sync: false });

// a curve at the mesh phase
function shareAt(phases, shares) {
  const k = phases.findIndex((each) => each > tau);
  if (k < 1) return shares.at(k);  // before the first point, or after the last
  const part = (tau - phases[k - 1]) / (phases[k] - phases[k - 1]);
  return shares[k - 1] + part * (shares[k] - shares[k - 1]);
}

const { xs: phases, ys: curves } = now.sharing.data, { path } = now.marks.data, { colour } = now.paths.data;
// the first answer after a change of the number of planets has their shares alone
if (curves.length === colour.length) {
  const shares = phases.map((each, i) => shareAt(each, curves[i])), of = (column) => path.map((i) => column[i]);
  const [size, share] = [shares.map((each) => 14 * each), shares.map((each) => each.toFixed(2))];
  labels.setv({ data: { ...now.paths.data, size, share } }, { sync: false });
  marks.setv({ data: { ...now.marks.data, size: of(size), share: of(share), colour: of(colour) } }, { sync: false });
}
const { low, high } = now.extent.data, aspect = plot.inner_width / plot.inner_height || 1;
const half = 0.54 * Math.max(high[1] - low[1], (high[0] - low[0]) / aspect);
const middle = [0, 1].map((k) => (low[k] + high[k]) / 2);
plot.x_range.setv({ start: middle[0] - half * aspect, end: middle[0] + half * aspect }, { sync: false });
plot.y_range.setv({ start: middle[1] + half, end: middle[1] - half }, { sync: false });
