// One design selected in the cloud becomes the pick; its line in the parallel coordinates follows.
const { indices } = designs.selected;
if (cb_obj === designs.selected) {
  const [i] = indices;
  if (indices.length === 1 && pick.data.design[0] !== i) {
    pick.data = { design: [i], x: [designs.data.x[i]], y: [designs.data.y[i]] };  // and this script runs again
  }
  return;
}
const i = pick.data.design[0];
const places = axes.map(({ key, low, high }) => (designs.data[key][i] - low) / (high - low));
line.setv({ data: { x: places.map((_, k) => k), y: places } }, { sync: false });
