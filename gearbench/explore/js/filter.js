// Which designs keep all ranges; from them the view of the cloud, the fronts, and the parallel coordinates.
// Runs in the browser alone: nothing is sent to the server, and many changes in one frame are one.
const state = (designs.explore ??= { marks: 0 });
if (state.waiting) return;
state.waiting = true;
const count = designs.data.x.length;

function keptDesigns() {
  const mask = new Uint8Array(count).fill(1);
  for (const slider of sliders) {
    const [low, high] = slider.value;
    if (low <= slider.start && high >= slider.end) continue;  // an open range keeps what is not known, too
    const values = designs.data["c" + slider.tags[0]];
    for (let i = 0; i < count; i++) if (!(values[i] >= low && values[i] <= high)) mask[i] = 0;
  }
  return mask;
}

function fronts(mask) {
  const { x, y, study, place } = designs.data;
  const found = { x: [], y: [], sx: [], sy: [], w: [], h: [], study: [], place: [], colour: [], design: [] };
  let lowest = Infinity, current = -1;
  for (const i of order) {  // by result, then across, then up
    if (!mask[i]) continue;
    if (study[i] !== current) { current = study[i]; lowest = Infinity; }
    if (y[i] >= lowest) continue;
    lowest = y[i];
    found.x.push(x[i]); found.y.push(y[i]); found.study.push(study[i]); found.place.push(place[i]);
    found.sx.push(designs.data[scatter[0]][i]); found.sy.push(designs.data[scatter[1]][i]);
    found.colour.push(colours[study[i] % colours.length]); found.design.push(i);
  }
  // boxes of some of them, because those of neighbours hide each other
  const every = Math.ceil(found.x.length / boxes);
  found.w = found.sx.map((s, k) => (k % every === 0 ? 2 * s || 0 : 0));
  found.h = found.sy.map((s, k) => (k % every === 0 ? 2 * s || 0 : 0));
  return found;
}

function paint(source, mask, grey) {
  const data = source.data.image[0], gaps = axes.length - 1;
  data.fill(0);
  if (gaps < 1) return source.change.emit();
  const rows = up, width = gap * gaps, sums = [0, 1, 2, 3].map(() => new Float32Array(rows * width));
  const studies = grey ? 1 : colours.length, bins = new Uint32Array(rows * rows);
  const rgb = colours.map((c) => [1, 3, 5].map((k) => parseInt(c.slice(k, k + 2), 16)));
  const bin = axes.map(({ key, low, high }) => {
    const cached = (state.bins ??= {})[key];
    if (cached) return cached;
    const values = designs.data[key], places = new Int16Array(count);
    for (let i = 0; i < count; i++) {
      places[i] = values[i] === values[i] ? Math.round((values[i] - low) / (high - low) * (rows - 1)) : -1;
    }
    return (state.bins[key] = places);
  });
  const members = Array.from({ length: studies }, () => []);
  for (let i = 0; i < count; i++) if (mask[i]) members[grey ? 0 : designs.data.study[i] % studies].push(i);
  members.forEach((ours, s) => {
    if (!ours.length) return;
    for (let g = 0; g < gaps; g++) {
      bins.fill(0);
      const left = bin[g], right = bin[g + 1];
      for (const i of ours) if (left[i] >= 0 && right[i] >= 0) bins[left[i] * rows + right[i]]++;
      for (let a = 0; a < rows; a++) for (let b = 0; b < rows; b++) {
        const n = bins[a * rows + b];
        if (!n) continue;
        for (let c = 0; c < gap; c++) {
          const at = Math.round(a + (b - a) * c / (gap - 1)) * width + g * gap + c;
          sums[3][at] += n;
          for (let k = 0; k < 3; k++) sums[k][at] += n * rgb[s][k];
        }
      }
    }
  });
  let most = 0;
  for (const n of sums[3]) if (n > most) most = n;
  const scale = 1 / Math.log1p(most);
  for (let at = 0; at < data.length; at++) {
    const n = sums[3][at];
    if (!n) continue;
    const alpha = grey ? 60 : 70 + 185 * Math.log1p(n) * scale;
    const [r, g, b] = grey ? [190, 190, 190] : [sums[0][at] / n, sums[1][at] / n, sums[2][at] / n];
    data[at] = ((alpha << 24) | (b << 16) | (g << 8) | r) >>> 0;
  }
  source.change.emit();
}

function marked(mask) {  // the kept designs inside the box or lasso drawn last; all of them where there is none
  const area = state.area;
  if (!area) return mask;
  const { x, y } = designs.data, inside = new Uint8Array(count);
  for (let i = 0; i < count; i++) {
    if (!mask[i]) continue;
    if (area.type === "rect") {
      inside[i] = x[i] >= Math.min(area.x0, area.x1) && x[i] <= Math.max(area.x0, area.x1) &&
        y[i] >= Math.min(area.y0, area.y1) && y[i] <= Math.max(area.y0, area.y1) ? 1 : 0;
      continue;
    }
    let odd = false;  // edges crossed to the right
    for (let k = 0, l = area.x.length - 1; k < area.x.length; l = k++) {
      if ((area.y[k] > y[i]) !== (area.y[l] > y[i]) &&
        x[i] < area.x[k] + (y[i] - area.y[k]) / (area.y[l] - area.y[k]) * (area.x[l] - area.x[k])) odd = !odd;
    }
    inside[i] = odd ? 1 : 0;
  }
  return inside;
}

function scatterPlot(mask, drawn) {  // the cloud as an image: far below the time of as many markers
  const { x, y, study } = designs.data, [h, w] = size;
  const pixels = raster.data.image[0];
  const { start: x0, end: x1 } = plot.x_range, { start: y0, end: y1 } = plot.y_range;
  const inks = ["#D2D2D2", "#AFAFAF", ...colours].map((c) =>
    ((parseInt(c.slice(5, 7), 16) << 16) | (parseInt(c.slice(3, 5), 16) << 8) | parseInt(c.slice(1, 3), 16)) >>> 0);
  pixels.fill(0);
  for (const layer of [0, 1, 2]) {  // left out, kept but not marked, marked
    for (let i = 0; i < count; i++) {
      if (mask[i] + (mask[i] & drawn[i]) !== layer) continue;
      const column = Math.round((x[i] - x0) / (x1 - x0) * w), row = Math.round((y[i] - y0) / (y1 - y0) * h);
      if (column < 1 || row < 1 || column >= w - 1 || row >= h - 1) continue;
      const ink = inks[layer < 2 ? layer : 2 + study[i] % colours.length];
      for (let a = row - 1; a <= row + 1; a++) for (let b = column - 1; b <= column + 1; b++) {
        const at = a * w + b, alpha = layer === 2 ? ((pixels[at] & 0xffffff) === ink ? 0xff : 0xb0) : 0xa0;
        pixels[at] = (ink | (alpha << 24)) >>> 0;
      }
    }
  }
  const at = { x: x0, y: y0, dw: x1 - x0, dh: y1 - y0 };
  for (const [name, value] of Object.entries(at)) raster.data[name][0] = value;
  raster.change.emit();  // the array is the same one, only its pixels are new
}

function showRanges() {
  const shown = { x: [], bottom: [], top: [] };
  axes.forEach(({ slider, low, high }, i) => {
    if (!slider || (slider.value[0] <= slider.start && slider.value[1] >= slider.end)) return;
    const clip = (v) => Math.min(1, Math.max(0, (v - low) / (high - low)));
    shown.x.push(i); shown.bottom.push(clip(slider.value[0])); shown.top.push(clip(slider.value[1]));
  });
  ranges.setv({ data: shown }, { sync: false });
}

requestAnimationFrame(() => {
  state.waiting = false;
  const begun = performance.now();
  const mask = keptDesigns();
  let left = 0;
  for (let i = 0; i < count; i++) left += mask[i];
  const values = sliders.map((slider) => slider.value.join()).join(";");
  if (values !== state.values) {
    state.values = values;
    const found = fronts(mask);
    front.setv({ data: found }, { sync: false });
    const text = `<b>${left.toLocaleString("en")}</b> of ${count.toLocaleString("en")} designs kept, ` +
      `${found.x.length} on the fronts`;
    kept_count.setv({ text }, { sync: false });
    showRanges();
  }
  if (!state.painted) { paint(everything, new Uint8Array(count).fill(1), true); state.painted = true; }
  const drawn = marked(mask);
  const lines = values + state.marks;  // panning draws the cloud again, not the lines
  if (lines !== state.lines) { paint(kept, drawn, false); state.lines = lines; }
  scatterPlot(mask, drawn);
  state.mask = mask;
  state.kept = left;
  state.milliseconds = performance.now() - begun;
});
