// Compare gears that the user keeps with the gear shown: a table of their numbers, and their curves in its figures.
// Everything is set as text; nothing that comes from a file is read as markup.
const byId = (id) => document.getElementById(id);
const kept = [...variants];  // gears: { name, number, scene, numbers, curves, colour }
// function of a kept gear: its further actions besides "drop", as [label, function]; null: no actions, and no "drop"
let actions = null;

function cell(tag, text, scope) {
  const element = document.createElement(tag);
  element.textContent = text;
  if (scope) element.scope = scope;
  return element;
}

// heading of a column; that of a kept gear has its colour and its actions
function head(name, gear) {
  const th = cell("th", name, "col");
  if (!gear) return th;
  th.style.borderTop = `3px solid ${gear.colour}`;
  if (!actions) return th;
  for (const [label, act] of [...actions(gear), ["drop", () => { kept.splice(kept.indexOf(gear), 1); overlay(); }]]) {
    const button = cell("button", label);
    button.type = "button";
    button.setAttribute("aria-label", `${label} ${name}`);
    button.addEventListener("click", act);
    th.append(document.createElement("br"), button);
  }
  return th;
}

// fill the table: baseline (if the page has one), kept gears, gear shown
function numbers() {
  const shown = now.numbers.data, hasBaseline = heads.length > 1;
  const ofKept = kept.map((gear) => [gear.name, gear.numbers, gear]);
  const columns = hasBaseline
    ? [[heads[0], before.numbers.data], ...ofKept, [heads[1], shown]] : [[heads[0], shown], ...ofKept];
  const text = (values, label) => values.value[values.label.indexOf(label)] ?? "–";
  const table = byId("numbers"), [, body] = table.children;
  // while a slider moves, only texts change: the browser would lay out a table of new cells again
  if (same(columns)) {
    shown.label.forEach((label, i) => columns.forEach(([, values], k) => {
      const { firstChild } = body.rows[i].cells[k + 1], value = text(values, label);
      if (firstChild.data !== value) firstChild.data = value;
    }));
    return;
  }
  const top = document.createElement("tr");
  top.append(cell("td", ""), ...columns.map(([name, , gear]) => head(name, gear)));
  const rows = shown.label.map((label) => {
    const row = document.createElement("tr");
    row.append(cell("th", label, "row"), ...columns.map(([, values]) => cell("td", text(values, label))));
    return row;
  });
  const thead = document.createElement("thead"), tbody = document.createElement("tbody");
  thead.append(top);
  tbody.append(...rows);
  table.replaceChildren(thead, tbody);
}

// whether the table has these columns and rows already
let layout = "";
function same(columns) {
  const wanted = JSON.stringify([columns.map(([name, , gear]) => [name, gear?.colour]), now.numbers.data.label]);
  const unchanged = wanted === layout;
  layout = wanted;
  return unchanged;
}

// the curves of a kept gear in the figure `key`: none if it was kept before they were computed
function linesOf(gear, key) {
  const [x, y] = columns[key], data = gear.curves[key], { colour, name: label } = gear;
  if (!data?.[x]?.length) return [];
  if (key === "harris") return data.xs.map((xs, i) => ({ x: xs, y: data.ys[i], fluctuation: data.ys[i], colour, label }));
  return [{ x: data[x], y: data[y], fluctuation: data.fluctuation ?? data[y], colour, label }];
}

// draw the curves of all kept gears, and fill the table
function overlay() {
  kept.forEach((gear, i) => { gear.colour = colours[i % colours.length]; });
  for (const [key, source] of Object.entries(sources)) {
    const lines = kept.flatMap((gear) => linesOf(gear, key));
    const column = (name) => lines.map((line) => line[name]);
    source.data = {
      xs: column("x"), ys: column("y"), fluctuations: column("fluctuation"), colour: column("colour"),
      label: column("label"),
    };
  }
  numbers();
}

// keep the gear shown; `gear` holds its name, number and scene
function keep(gear) {
  if (kept.length >= most) {
    byId("message").textContent = `At most ${most} gears are kept for comparison: remove one first.`;
    return;
  }
  const curves = Object.fromEntries(Object.keys(sources).map((key) => [key, now[key].data]));
  kept.push({ ...gear, numbers: { ...now.numbers.data }, curves });
  overlay();
}

// show STE and stiffness as they are, or minus their means
byId("fluctuation").addEventListener("change", ({ target }) => {
  const [one, many] = target.checked ? ["fluctuation", "fluctuations"] : ["value", "ys"];
  for (const glyph of curves) {
    if (glyph.xs) glyph.ys = { field: many };
    else glyph.y = { field: one };
  }
});

now.numbers.connect(now.numbers.properties.data.change, numbers);
before.numbers.connect(before.numbers.properties.data.change, numbers);
overlay();
