// Other quantities across, up and as colour: chosen in the page's selects, drawn by filter.js.
const state = (designs.explore ??= { marks: 0 });
const chosen = ["across", "up", "colour"].map((id) => document.getElementById(id));

function range(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  const room = 0.03 * (high - low) || 0.1 * Math.abs(high) || 1;
  return { start: low - room, end: high + room };
}

function shades(values) {
  const { start, end } = range(values), found = new Uint32Array(values.length);
  for (let i = 0; i < values.length; i++) {
    const at = values[i] === values[i] ? Math.round((values[i] - start) / (end - start) * (palette.length - 1)) : -1;
    const ink = at < 0 ? "#AFAFAF" : palette[at];
    found[i] = (parseInt(ink.slice(5, 7), 16) << 16) | (parseInt(ink.slice(3, 5), 16) << 8) | parseInt(ink.slice(1, 3), 16);
  }
  bar.color_mapper.setv({ low: start, high: end }, { sync: false });
  return found;
}

function change() {
  const [across, up, colour] = chosen.map((select) => columns[select.value]);
  const { study } = designs.data;
  const x = (designs.data.x = designs.data[across.key]), y = (designs.data.y = designs.data[up.key]);
  state.order = Int32Array.from(x.keys()).sort((a, b) => study[a] - study[b] || x[a] - x[b] || y[a] - y[b]);
  state.scatter = [across.scatter, up.scatter];
  state.front = across.less && up.less;
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

for (const select of chosen) select.addEventListener("change", change);
