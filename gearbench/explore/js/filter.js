// Find the designs within all ranges of the filters; from them draw the cloud, the fronts and the parallel coordinates.
// Runs in the browser alone: nothing is sent to the server, and all changes within one frame are handled once.
// Designs outside a range are left out, the others are kept; those inside a box or lasso are marked (all without one).
const state = (designs.explore ??= { marks: 0 });  // what axes.js and area.js have set, and what is drawn already
if (state.waiting) return;
state.waiting = true;
const count = designs.data.x.length;

function keptDesigns() {
  const mask = new Uint8Array(count).fill(1);
  for (const slider of sliders) {
    const [low, high] = slider.value;
    if (low <= slider.start && high >= slider.end) continue;  // an open range also keeps designs without a value (NaN)
    const values = designs.data["c" + slider.tags[0]];
    for (let i = 0; i < count; i++) if (!(values[i] >= low && values[i] <= high)) mask[i] = 0;
  }
  return mask;
}

// columns of the fronts of the kept designs, as in cloud.front_data
function fronts(mask) {
  const { x, y, result, number } = designs.data;
  const points = { x: [], y: [], sx: [], sy: [], w: [], h: [], result: [], number: [], colour: [], design: [] };
  const sigma = (state.scatter ?? scatter).map((key) => key && designs.data[key]);
  let lowest = Infinity, current = -1;
  if (state.front === false) return { ...points, label: [] };  // less of a variable is not better: no front
  for (const i of state.order ?? order) {  // by result, then across, then up
    if (!mask[i] || !(x[i] === x[i] && y[i] === y[i])) continue;
    if (result[i] !== current) { current = result[i]; lowest = Infinity; }
    if (y[i] >= lowest) continue;
    lowest = y[i];
    points.x.push(x[i]); points.y.push(y[i]); points.result.push(result[i]); points.number.push(number[i]);
    points.sx.push(sigma[0]?.[i] ?? NaN); points.sy.push(sigma[1]?.[i] ?? NaN);
    points.colour.push(colours[result[i] % colours.length]); points.design.push(i);
  }
  // not every point has a ±σ box, because boxes of neighbours hide each other
  const step = Math.ceil(points.x.length / boxes);
  points.w = points.sx.map((s, k) => (k % step === 0 ? 2 * s || 0 : 0));
  points.h = points.sy.map((s, k) => (k % step === 0 ? 2 * s || 0 : 0));
  points.label = points.number.map((n, k) => (k % (3 * step) === 0 ? `${n}` : ""));
  return points;
}

// for each axis, the row of every design in the image of the parallel coordinates; −1 if its value is not known
function imageRows() {
  return (state.rows ??= axes.map(({ key, low, high }) => {
    const values = designs.data[key], rows = new Int16Array(count);
    for (let i = 0; i < count; i++) {
      rows[i] = values[i] === values[i] ? Math.round((values[i] - low) / (high - low) * (height - 1)) : -1;
    }
    return rows;
  }));
}

// designs are sorted by result: first design, and one after the last, of each result
function rangesOfResults() {
  if (state.results) return state.results;
  const result = designs.data.result, ranges = [];
  for (let i = 0; i < count; i++) if (i === 0 || result[i] !== result[i - 1]) ranges.push([i, i]);
  ranges.forEach((range, k) => { range[1] = ranges[k + 1]?.[0] ?? count; });
  return (state.results = ranges);
}

// number of lines of the kept designs from … to − 1 through each pixel of the image; lines that share both ends are
// drawn once
function density(mask, from, to) {
  const width = gap * (axes.length - 1);
  const lines = new Float32Array(height * width), bins = new Uint32Array(height * height);
  const rows = imageRows();
  for (let g = 0; g < axes.length - 1; g++) {
    const left = rows[g], right = rows[g + 1];
    bins.fill(0);
    for (let i = from; i < to; i++) if (mask[i] && left[i] >= 0 && right[i] >= 0) bins[left[i] * height + right[i]]++;
    for (let a = 0, bin = 0; a < height; a++) for (let b = 0; b < height; b++, bin++) {  // from row a to row b
      const n = bins[bin];
      if (n === 0) continue;
      const slope = (b - a) / (gap - 1);
      for (let c = 0, row = a + 0.5; c < gap; c++, row += slope) lines[(row | 0) * width + g * gap + c] += n;
    }
  }
  return lines;
}

// paint the lines of the parallel coordinates: all in grey, or mixed from the colours of the results
function paint(source, mask, grey) {
  const data = source.data.image[0];
  data.fill(0);
  if (axes.length < 2) return source.change.emit();
  const inks = colours.map((c) => [1, 3, 5].map((k) => parseInt(c.slice(k, k + 2), 16)));
  const layers = grey ? [density(mask, 0, count)] : rangesOfResults().map((range) => density(mask, ...range));
  let most = 0;
  for (let pixel = 0; pixel < data.length; pixel++) {
    let n = 0;
    for (const layer of layers) n += layer[pixel];
    if (n > most) most = n;
  }
  const scale = 1 / Math.log1p(most);
  for (let pixel = 0; pixel < data.length; pixel++) {
    let n = 0, r = 0, g = 0, b = 0;
    layers.forEach((layer, s) => {
      const m = layer[pixel], ink = grey ? [190, 190, 190] : inks[s % inks.length];
      n += m; r += m * ink[0]; g += m * ink[1]; b += m * ink[2];
    });
    if (n === 0) continue;
    const alpha = grey ? 60 : 70 + 185 * Math.log1p(n) * scale;
    data[pixel] = ((alpha << 24) | (b / n << 16) | (g / n << 8) | r / n) >>> 0;
  }
  source.change.emit();
}

// mask of the kept designs inside the box or lasso; all of them if there is none
function marked(mask) {
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
    let odd = false;  // a point is inside if a ray to the right crosses an odd number of edges
    for (let k = 0, l = area.x.length - 1; k < area.x.length; l = k++) {
      if ((area.y[k] > y[i]) !== (area.y[l] > y[i]) &&
        x[i] < area.x[k] + (y[i] - area.y[k]) / (area.y[l] - area.y[k]) * (area.x[l] - area.x[k])) odd = !odd;
    }
    inside[i] = odd ? 1 : 0;
  }
  return inside;
}

// the middle pixel of every design in the image of the cloud; −1 if it is unknown, outside or at the edge
function pixelsOfDesigns(x0, x1, y0, y1) {
  const { x, y } = designs.data, [h, w] = size, view = [x0, x1, y0, y1, state.axes].join();
  if (state.view === view) return state.pixels;
  const pixels = (state.pixels ??= new Int32Array(count));
  const perX = w / (x1 - x0), perY = h / (y1 - y0);
  for (let i = 0; i < count; i++) {
    const column = Math.round((x[i] - x0) * perX), row = Math.round((y[i] - y0) * perY);
    const inside = column >= 1 && row >= 1 && column < w - 1 && row < h - 1;  // false for NaN
    pixels[i] = inside ? row * w + column : -1;
  }
  state.view = view;
  return pixels;
}

// paint the cloud as an image of squares of 3 × 3 pixels: much faster than that many markers
function scatterPlot(mask, drawn) {
  const { result } = designs.data, w = size[1];
  const pixels = raster.data.image[0];
  const { start: x0, end: x1 } = plot.x_range, { start: y0, end: y1 } = plot.y_range;
  const middle = pixelsOfDesigns(x0, x1, y0, y1);
  const inks = ["#D2D2D2", "#AFAFAF", ...colours].map((c) =>
    ((parseInt(c.slice(5, 7), 16) << 16) | (parseInt(c.slice(3, 5), 16) << 8) | parseInt(c.slice(1, 3), 16)) >>> 0);
  pixels.fill(0);
  for (const layer of [0, 1, 2]) {  // left out, kept but not marked, marked
    for (let i = 0; i < count; i++) {
      if (middle[i] < 0 || mask[i] + (mask[i] & drawn[i]) !== layer) continue;
      const ink = layer < 2 ? inks[layer] : state.shade?.[i] ?? inks[2 + result[i] % colours.length];
      for (let row = middle[i] - w; row <= middle[i] + w; row += w) for (let pixel = row - 1; pixel <= row + 1; pixel++) {
        const alpha = layer === 2 ? ((pixels[pixel] & 0xffffff) === ink ? 0xff : 0xb0) : 0xa0;
        pixels[pixel] = (ink | (alpha << 24)) >>> 0;
      }
    }
  }
  const place = { x: x0, y: y0, dw: x1 - x0, dh: y1 - y0 };
  for (const [name, value] of Object.entries(place)) raster.data[name][0] = value;
  raster.change.emit();  // the array is the same one, only its pixels are new
}

// show on the axes of the parallel coordinates the ranges that are not fully open
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
  const values = [...sliders.map((slider) => slider.value.join()), state.axes].join(";");
  if (values !== state.values) {
    state.values = values;
    const points = fronts(mask);
    front.setv({ data: points }, { sync: false });
    const text = `<b>${left.toLocaleString("en")}</b> of ${count.toLocaleString("en")} designs kept, ` +
      `${points.x.length} on the fronts`;
    let lacking = 0;
    const { x, y } = designs.data;
    for (let i = 0; i < count; i++) if (mask[i] && !(x[i] === x[i] && y[i] === y[i])) lacking++;
    const unknown = lacking ? `; ${lacking.toLocaleString("en")} lack a value of the axes` : "";
    document.getElementById("count").innerHTML = text + unknown;
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
