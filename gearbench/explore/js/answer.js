// Show an answer: tables of the gear, its name, and where its sliders stand. Nothing of it goes back to the server.
const { now: [tables], before: [stored], summary: [text], message: [fault], controls: [places] } = answer.data;
document.getElementById("message").textContent = fault;
if (text) document.getElementById("summary").textContent = text;
if (places) {
  answer.awaited = false;
  answer.placed = places;  // what ask.js tells from a move by hand: it runs later
  for (const slider of sliders) if (places[slider.name]) slider.setv(places[slider.name], { sync: false });
}

// One figure in each frame: drawing all of them at once would hold up what is clicked meanwhile. A newer answer takes
// the place of what still waits.
const waiting = (answer.waiting ??= new Map());
for (const name of Object.keys(sources)) {
  if (tables?.[name]) waiting.set(sources[name], tables[name]);
  if (stored?.[name] && before[name]) waiting.set(before[name], stored[name]);
}
const figures = [
  ["scene", "numbers", "warnings", "ste", "stiffness"], ["pressure"], ["ste_orders"], ["stiffness_orders"], ["ste_density"],
  ["stiffness_density"], ["pinion", "wheel", "path", "motion"],  // the last draws the teeth
  ["harris"], ["torque"],
];

function draw() {
  for (const names of figures) {
    const found = names.flatMap((name) => [sources[name], before[name]]).filter((source) => waiting.has(source));
    if (!found.length) continue;
    for (const source of found) {
      source.setv({ data: waiting.get(source) }, { sync: false });
      waiting.delete(source);
    }
    if (waiting.size) return requestAnimationFrame(draw);
  }
  answer.drawing = false;
}

if (!answer.drawing) {
  answer.drawing = true;
  draw();
}
