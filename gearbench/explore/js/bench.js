// Run the design bench in the browser: controls, undo, baseline, variants, numbers, files. The controls change the tables
// of a scene; every change is a question to the server.
// Everything shown is set as text; nothing that comes from a file is read as markup.
// Uses functions of compare.js and download.js, which run before.
const form = byId("controls");  // a page without a server has none
const start = question.data.scene[0];  // JSON text of the first scene
let tables = JSON.parse(start);
let committed = start;  // scene after the last finished change: a drag of a slider is one change
const earlier = [];  // scenes to go back to, the last one on top
const exampleTables = JSON.parse(examples);

// -- tables and controls ----------------------------------------------------------------------------------------------
// the table that holds the key `path`, and the last part of the key; missing tables are made if `make` is true
function parent(path, make, top = tables) {
  const parts = path.split(".");
  let table = top;
  for (const part of parts.slice(0, -1)) {
    if (!(part in table)) {
      if (!make) return [undefined, parts.at(-1)];
      table[part] = {};
    }
    table = table[part];
  }
  return [table, parts.at(-1)];
}

function get(path, top) {
  const [table, last] = parent(path, false, top);
  return table?.[last];
}

function set(path, value) {
  const [table, last] = parent(path, value !== undefined);
  if (value === undefined) {
    if (table) delete table[last];
  } else table[last] = value;
}

// value of an input; undefined if it is empty
function valueOf(input) {
  const kind = input.dataset.kind;
  if (kind === "switch") return input.checked;
  if (input.value.trim() === "") return undefined;
  if (kind === "choice") return JSON.parse(input.value);
  if (kind === "list") return input.value.split(",").map(Number);
  if (kind === "words") return input.value.split(",").map((word) => word.trim()).filter(Boolean);
  return Number(input.value);
}

// show the value of a key in its input and on its sliders
function put(input) {
  const value = get(input.dataset.path);
  if (input.dataset.kind === "switch") input.checked = value ?? false;
  else if (input.dataset.kind === "choice") {
    if (value !== undefined) input.value = JSON.stringify(value);
    else input.selectedIndex = 0;
  } else if (input !== document.activeElement) input.value = value === undefined ? "" : [value].flat().join(", ");
  const path = CSS.escape(input.dataset.path);
  for (const slider of form.querySelectorAll(`[data-slides="${path}"], [data-slides^="${path}."]`)) {
    const position = get(slider.dataset.slides) ?? slider.dataset.default;
    if (position > Number(slider.max)) slider.max = position;
    if (position < Number(slider.min)) slider.min = position;
    slider.value = position;
  }
}

function show() {
  for (const input of form.querySelectorAll("[data-path]")) put(input);
  for (const box of form.querySelectorAll("[data-table]")) box.checked = get(box.dataset.table) !== undefined;
  byId("undo").disabled = earlier.length === 0;
}

function ask() {
  question.data = { scene: [JSON.stringify(tables)], number: [question.data.number[0] + 1] };
}

// finish a change, so that it can be undone
function commit() {
  const text = JSON.stringify(tables);
  if (text === committed) return;
  earlier.push(committed);
  committed = text;
  byId("undo").disabled = false;
}

// show and solve another scene
function replace(text) {
  tables = JSON.parse(text);
  committed = text;
  show();
  ask();
}

// a table that is added begins as in the first scene, or with its example
function include(table) {
  if (get(table) === undefined) set(table, structuredClone(get(table, JSON.parse(start)) ?? exampleTables[table] ?? {}));
}

// add the optional tables that hold a key
function includeFor(key) {
  const boxes = [...form.querySelectorAll("[data-table]")].filter((box) => key.startsWith(`${box.dataset.table}.`));
  boxes.forEach((box) => include(box.dataset.table));
  if (boxes.some((box) => !box.checked)) show();
}

// set a number of a list; a list that is not given yet begins with zeros
function setItem(key, value) {
  const list = key.slice(0, key.lastIndexOf("."));
  const sliders = form.querySelectorAll(`[data-slides^="${CSS.escape(list)}."]`);
  if (get(list) === undefined) set(list, Array.from(sliders, () => 0));
  set(key, value);
  put(form.querySelector(`[data-path="${CSS.escape(list)}"]`));
}

if (form) {
  form.addEventListener("input", ({ target }) => {
    const { table, path, slides } = target.dataset;
    if (table) {
      if (target.checked) {
        include(table);
        target.parentElement.querySelector("details").open = true;
      } else set(table, undefined);
      show();
    } else {
      const key = path ?? slides;
      includeFor(key);
      if (target.validity?.badInput) {
        byId("message").textContent = `${key}: not a number`;
        document.body.classList.add("stale");
        return;
      }
      const value = slides ? Number(target.value) : valueOf(target);
      if (Number.isNaN(value) || (Array.isArray(value) && value.some(Number.isNaN))) return;
      const input = form.querySelector(`[data-path="${CSS.escape(key)}"]`);
      if (input) {
        set(key, value);
        put(input);
      } else setItem(key, value);
    }
    ask();
  });
  form.addEventListener("change", commit);
  form.addEventListener("submit", (event) => event.preventDefault());
  byId("undo").addEventListener("click", () => earlier.length && replace(earlier.pop()));
  document.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && !event.target.matches?.("input[type=text]")) {
      event.preventDefault();
      if (earlier.length) replace(earlier.pop());
    }
  });
  byId("baseline").addEventListener("click", () => {
    for (const [name, source] of Object.entries(before)) source.data = { ...now[name].data };
    numbers();
  });
  byId("variant").addEventListener("click", () => {
    const number = kept.reduce((last, gear) => Math.max(last, gear.number), 0) + 1;
    keep({ name: `variant ${number}`, number, scene: now.scene.data.tables[0] });
  });
  byId("save").addEventListener("click", () => downloadScene(now.scene.data.text[0]));
  byId("pictures").addEventListener("click", pictures);
  actions = (gear) => [["restore", () => { commit(); earlier.push(committed); replace(gear.scene); }]];
  overlay();
  show();
}

// -- warnings and errors ----------------------------------------------------------------------------------------------
function warn() {
  byId("warnings").replaceChildren(...Array.from(now.warnings.data.text, (text) => cell("li", text)));
}

// show the figures of the scatter over errors, and over a revolution, only if they have data
function showFigures() {
  for (const figure of document.querySelectorAll('[data-figure$="_density"], [data-figure="revolution"]')) {
    const { value, xs } = now[figure.dataset.figure].data;
    figure.hidden = !(value ?? xs).length;
  }
}

// -- files ------------------------------------------------------------------------------------------------------------
// Save the visible figures in one SVG file, two beside each other. They are drawn as SVG only for the file, because SVG is
// slow on the screen.
async function pictures() {
  const parts = [];
  let y = 0, x = 0, width = 0, height = 0;
  for (const plot of plots) {
    const view = Bokeh.index.find_one(plot);
    if (!view || !view.el.offsetParent) continue;
    plot.output_backend = "svg";
    await new Promise(requestAnimationFrame);
    const text = await (await Bokeh.index.find_one(plot).export("svg").to_blob()).text();
    plot.output_backend = "canvas";
    const figure = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
    figure.setAttribute("x", x);
    figure.setAttribute("y", y);
    parts.push(new XMLSerializer().serializeToString(figure));
    height = Math.max(height, y + plot.outer_height);
    width = Math.max(width, x + plot.outer_width);
    [x, y] = x ? [0, height] : [plot.outer_width, y];
  }
  const size = `width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"`;
  const whole = `<svg xmlns="http://www.w3.org/2000/svg" ${size}>${parts.join("")}</svg>`;
  download(new Blob([whole], { type: "image/svg+xml" }), "curves.svg");
}

// the server need not know of the phase
function turnTo(value) { phase.setv({ value }, { sync: false }); }

byId("phase").addEventListener("input", ({ target }) => turnTo(Number(target.value)));
const PERIOD = 6000;  // time in which the gears turn by one mesh period [ms]
byId("turn").addEventListener("change", ({ target }) => {
  let last = performance.now();
  function step(time) {
    if (!target.checked) return;
    turnTo((phase.value + Math.max(0, time - last) / PERIOD) % byId("phase").max);
    last = time;
    byId("phase").value = phase.value;
    requestAnimationFrame(step);
  }
  requestAnimationFrame(step);
});
now.warnings.connect(now.warnings.properties.data.change, warn);
now.ste_density.connect(now.ste_density.properties.data.change, showFigures);
// the cycle of a train may have several mesh periods
const setCycle = () => { byId("phase").max = now.extent?.data.cycle[0] ?? 1; };
now.extent?.connect(now.extent.properties.data.change, setCycle);
setCycle();
now.revolution?.connect(now.revolution.properties.data.change, showFigures);
warn();
showFigures();
if (form) ask();  // warnings, and curves over torque
