// Gears beside each other: a table of their numbers, and their curves over those of the gear that is shown.
// Everything is set as text; nothing that comes from a file is read as markup.
const byId = (id) => document.getElementById(id);
const kept = [...beside];  // { name, number, scene, numbers, curves, colour }
let actions = null;  // what else can be done with a gear that is kept: [label, function]; null: nothing at all

function cell(tag, text, scope) {
  const found = document.createElement(tag);
  found.textContent = text;
  if (scope) found.scope = scope;
  return found;
}

function head(name, each) {
  const th = cell("th", name, "col");
  if (!each) return th;
  th.style.borderTop = `3px solid ${each.colour}`;
  if (!actions) return th;
  for (const [label, act] of [...actions(each), ["drop", () => { kept.splice(kept.indexOf(each), 1); overlay(); }]]) {
    const button = cell("button", label);
    button.type = "button";
    button.setAttribute("aria-label", `${label} ${name}`);
    button.addEventListener("click", act);
    th.append(document.createElement("br"), button);
  }
  return th;
}

function numbers() {
  const shown = now.numbers.data, last = heads.length - 1;
  const beside_it = kept.map((each) => [each.name, each.numbers, each]);
  const columns = last
    ? [[heads[0], before.numbers.data], ...beside_it, [heads[1], shown]] : [[heads[0], shown], ...beside_it];
  const text = (values, label) => values.value[values.label.indexOf(label)] ?? "–";
  const table = byId("numbers"), [, body] = table.children;
  // while a slider moves only texts change: a table of new cells would be laid out anew
  if (same(columns)) {
    shown.label.forEach((label, i) => columns.forEach(([, values], k) => {
      const { firstChild } = body.rows[i].cells[k + 1], found = text(values, label);
      if (firstChild.data !== found) firstChild.data = found;
    }));
    return;
  }
  const top = document.createElement("tr");
  top.append(cell("td", ""), ...columns.map(([name, , each]) => head(name, each)));
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
let laid = "";
function same(columns) {
  const found = JSON.stringify([columns.map(([name, , each]) => [name, each?.colour]), now.numbers.data.label]);
  const known = found === laid;
  laid = found;
  return known;
}

// the curves of a kept gear in one figure: none where it was kept before they were computed
function linesOf(each, key) {
  const [x, y] = columns[key], data = each.curves[key], { colour, name: label } = each;
  if (!data?.[x]?.length) return [];
  if (key === "harris") return data.xs.map((one, i) => ({ x: one, y: data.ys[i], fluctuation: data.ys[i], colour, label }));
  return [{ x: data[x], y: data[y], fluctuation: data.fluctuation ?? data[y], colour, label }];
}

function overlay() {
  kept.forEach((each, i) => { each.colour = colours[i % colours.length]; });
  for (const [key, source] of Object.entries(sources)) {
    const lines = kept.flatMap((each) => linesOf(each, key));
    const column = (name) => lines.map((line) => line[name]);
    source.data = {
      xs: column("x"), ys: column("y"), fluctuations: column("fluctuation"), colour: column("colour"),
      label: column("label"),
    };
  }
  numbers();
}

// the gear that is shown, kept beside under a name
function keep(gear) {
  if (kept.length >= most) {
    byId("message").textContent = `At most ${most} gears are kept for comparison: remove one first.`;
    return;
  }
  const curves = Object.fromEntries(Object.keys(sources).map((key) => [key, now[key].data]));
  kept.push({ ...gear, numbers: { ...now.numbers.data }, curves });
  overlay();
}

// STE and stiffness as they are, or minus their means
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
