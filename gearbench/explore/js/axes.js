// Change the quantities of the cloud's axes and colours, chosen in the page's selects; filter.js draws them.
const state = (designs.explore ??= { marks: 0 });  // what scripts have chosen, and what is drawn already; see filter.js
const chosen = ["across", "up", "colour"].map((id) => document.getElementById(id));

function range(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  const margin = 0.03 * (high - low) || 0.1 * Math.abs(high) || 1;
  return { start: low - margin, end: high + margin };
}

// colour of every design by a quantity, as an integer 0xBBGGRR; grey where the quantity is not known
function shades(values) {
  const { start, end } = range(values), result = new Uint32Array(values.length);
  for (let i = 0; i < values.length; i++) {
    const known = values[i] === values[i];  // not NaN
    const ink = known ? palette[Math.round((values[i] - start) / (end - start) * (palette.length - 1))] : "#AFAFAF";
    result[i] = (parseInt(ink.slice(5, 7), 16) << 16) | (parseInt(ink.slice(3, 5), 16) << 8) | parseInt(ink.slice(1, 3), 16);
  }
  bar.color_mapper.setv({ low: start, high: end }, { sync: false });
  return result;
}

// Set in `state` what filter.js needs: `order`, in which one pass over the designs finds all fronts; `scatter`, the
// columns of σ on both axes; `axes`, the choice itself, by which it notices a change.
function applyAxes() {
  const [across, up, colour] = chosen.map((select) => columns[select.value]);
  const { result } = designs.data;
  const x = (designs.data.x = designs.data[across.key]), y = (designs.data.y = designs.data[up.key]);
  state.order = Int32Array.from(x.keys()).sort((a, b) => result[a] - result[b] || x[a] - x[b] || y[a] - y[b]);
  state.scatter = [across.scatter, up.scatter];
  state.front = across.less && up.less;  // a front exists if less is better on both axes
  state.shade = colour ? shades(designs.data[colour.key]) : undefined;
  state.axes = chosen.map((select) => select.value).join();
  bar.visible = !!colour;
  bar.title = colour?.title ?? "";
  plot.below[0].axis_label = across.title;
  plot.left[0].axis_label = up.title;
  plot.title.text = state.front ? front_title : "All designs";
  plot.x_range.setv(range(x), { sync: false });
  plot.y_range.setv(range(y), { sync: false });
  hover.tooltips = [["design", "@number"], [across.title, "@x{0.000}"], [up.title, "@y{0.000}"]];
  const i = pick.data.design[0];
  pick.setv({ data: { design: [i], x: [x[i]], y: [y[i]] } }, { sync: false });
  refresh.execute(plot);
}

for (const select of chosen) select.addEventListener("change", applyAxes);
