// One design selected in the cloud becomes the pick; its marker and its line follow.
const { indices } = designs.selected;
let i = cb_obj === pick ? pick.data.design[0] : undefined;
if (i === undefined) {
  if (indices.length !== 1) return;
  i = indices[0];
  if (pick.data.design[0] === i) return;
  pick.data = { design: [i], x: [designs.data.x[i]], y: [designs.data.y[i]] };
  return;  // this script runs again for the pick
}
const places = axes.map(({ key, low, high }) => (designs.data[key][i] - low) / (high - low));
line.setv({ data: { x: places.map((_, k) => k), y: places } }, { sync: false });
