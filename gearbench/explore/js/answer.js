// Show an answer: tables of the gear, its summary, and where its sliders stand. Nothing of it goes back to the server.
const { now: [tables], before: [stored], summary: [text], message: [fault], controls: [places] } = answer.data;
const show = (sources, found) => {
  for (const [name, table] of Object.entries(found ?? {})) sources[name]?.setv({ data: table }, { sync: false });
};
document.getElementById("message").textContent = fault;
if (text) document.getElementById("summary").innerHTML = text;
show(sources, tables);
show(before, stored);
if (places) {
  answer.awaited = false;
  answer.placed = places;  // what ask.js tells from a move by hand: it runs later
  for (const slider of sliders) if (places[slider.name]) slider.setv(places[slider.name], { sync: false });
}
