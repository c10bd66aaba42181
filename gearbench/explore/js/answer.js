// Show an answer: tables of the gear, and its name. Nothing of it goes back to the server.
// The server sends packed JSON; a page without a server supplies columns.
function array(_key, value) {
  if (value?.float32 === undefined) return value;
  const bytes = Uint8Array.from(atob(value.float32), (letter) => letter.charCodeAt(0));
  const flat = new Float32Array(bytes.buffer);
  if (value.shape.length === 1) return flat;
  const Image = sources.pressure.data.image[0].constructor;  // Bokeh's class of arrays with a shape, from the last image
  return new Image(flat, value.shape);
}
const unpacked = answer.data.packed ? JSON.parse(answer.data.packed[0], array) : answer.data;
const { now: [tables], summary: [text], message: [fault] } = unpacked;
document.getElementById("message").textContent = fault;
// after a fault the page still shows the last gear that could be computed
document.body.classList.toggle("stale", Boolean(fault));
if (text) document.getElementById("summary").textContent = text;

// The curves are drawn at once, the other figures at most ten times a second: more would make the sliders lag.
// Tables of a newer answer replace those that still wait to be drawn.
const PAUSE = 100;  // ms
const waiting = (answer.waiting ??= new Map());
for (const name of Object.keys(sources)) if (tables?.[name]) waiting.set(sources[name], tables[name]);
const atOnce = ["scene", "numbers", "warnings", "ste", "stiffness", "sharing"];
const figures = [
  ["pressure", "ste_orders", "stiffness_orders"], ["revolution"],
  ["sharing_density", "stiffness_density", "ste_density"],  // ste_density last: its change makes the figures visible
  ["pinion", "wheel", "path", "motion"], ["marks", "paths", "extent", "gears"],  // the last one draws the gears
  ["harris"], ["torque"],
];

// draw the sources with these names that wait; return whether any did
function draw(names) {
  const ready = names.map((name) => sources[name]).filter((source) => waiting.has(source));
  for (const source of ready) {
    source.setv({ data: waiting.get(source) }, { sync: false });
    waiting.delete(source);
  }
  return ready.length > 0;
}

// draw one group of the other figures in each frame
function drawOthers() {
  answer.drawn = performance.now();
  figures.some(draw);
  if (waiting.size) requestAnimationFrame(drawOthers);
  else answer.drawing = false;
}

draw(atOnce);
if (waiting.size && !answer.drawing) {
  answer.drawing = true;
  setTimeout(() => requestAnimationFrame(drawOthers), Math.max(0, (answer.drawn ?? 0) + PAUSE - performance.now()));
}
