// Show an answer: tables of the gear, and its name. Nothing of it goes back to the server.
// The server sends packed JSON; a single file holds columns.
function array(_key, value) {
  if (value?.float32 === undefined) return value;
  const bytes = Uint8Array.from(atob(value.float32), (letter) => letter.charCodeAt(0));
  const flat = new Float32Array(bytes.buffer);
  if (value.shape.length === 1) return flat;
  const Image = sources.pressure.data.image[0].constructor;  // arrays of Bokeh know their shape
  return new Image(flat, value.shape);
}
const said = answer.data.packed ? JSON.parse(answer.data.packed[0], array) : answer.data;
const { now: [tables], summary: [text], message: [fault] } = said;
document.getElementById("message").textContent = fault;
// the page then still shows the last gear that could be computed
document.body.classList.toggle("stale", Boolean(fault));
if (text) document.getElementById("summary").textContent = text;

// Curves at once, the other figures ten times a second at most: drawing all of them would make
// the sliders lag. A newer answer takes the place of what still waits.
const PAUSE = 100;
const waiting = (answer.waiting ??= new Map());
for (const name of Object.keys(sources)) if (tables?.[name]) waiting.set(sources[name], tables[name]);
const first = ["scene", "numbers", "warnings", "ste", "stiffness", "sharing"];
const figures = [
  ["pressure", "ste_orders", "stiffness_orders"], ["revolution"],
  ["sharing_density", "stiffness_density", "ste_density"],  // set last: it makes the figures visible
  ["pinion", "wheel", "path", "motion"], ["marks", "paths", "extent", "gears"],  // set last: it draws the gears
  ["harris"], ["torque"],
];

// draw these; return whether any was waiting
function draw(names) {
  const found = names.map((name) => sources[name]).filter((source) => waiting.has(source));
  for (const source of found) {
    source.setv({ data: waiting.get(source) }, { sync: false });
    waiting.delete(source);
  }
  return found.length > 0;
}

function others() {
  answer.drawn = performance.now();
  figures.some(draw);
  if (waiting.size) requestAnimationFrame(others);
  else answer.drawing = false;
}

draw(first);
if (waiting.size && !answer.drawing) {
  answer.drawing = true;
  setTimeout(() => requestAnimationFrame(others), Math.max(0, (answer.drawn ?? 0) + PAUSE - performance.now()));
}
