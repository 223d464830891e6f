// Figures: unpacked when their section unfolds, drawn when they come into view, in pieces that
// leave the page free to scroll.

/** What the page carries as gzip in base64, since it would be six times as large. */
async function unpack(node) {
  const bytes = Uint8Array.from(atob(node.textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
}

/** Ends the task, so that the browser can do what is more urgent. */
const pause = () => new Promise((resolve) => setTimeout(resolve));

const once = (make) => {
  let made;
  return () => (made ??= make());
};

/** Defines vega. */
const loadBundle = once(async () => {
  const script = document.createElement("script");
  script.textContent = await unpack(document.getElementById("bundle"));
  await pause();
  document.head.append(script);
  await pause();
});

const allSeries = (section) =>
  section.querySelector(".every")?.getAttribute("aria-pressed") === "true";

// A choice is a select, or a slider over values in order.
const CHOICE = "[data-signal]";
const valuesOf = (control) =>
  control.type === "range"
    ? JSON.parse(control.dataset.values)
    : [...control.options].map((option) => option.value);
const valueOf = (control) =>
  control.type === "range" ? valuesOf(control)[control.value] : control.value;

/** The parameters that legend and choices around a figure ask for. */
function wanted(figure) {
  const section = figure.closest("section");
  const shared = section.querySelectorAll(`.controls ${CHOICE}`);
  const choices = [...shared, ...figure.querySelectorAll(CHOICE)];
  const off = [...section.querySelectorAll(".legend [data-entry][aria-pressed=false]")];
  const chosen = choices.map((control) => [control.dataset.signal, valueOf(control)]);
  const hidden = off.map((button) => button.dataset.entry);
  return { ...Object.fromEntries(chosen), hidden, every: allSeries(section) };
}

/** The rows that the chart's own filters let through. */
function shown(rows, { hidden, every, ...choices }) {
  const kept = ([name, value]) => (row) => !(name in row) || row[name] === value;
  const filters = Object.entries(choices).map(kept);
  return rows
    .filter((row) => every || !row.more)
    .filter((row) => !hidden.includes(row.variant) && !hidden.includes(row.precision))
    .filter((row) => filters.every((keeps) => keeps(row)));
}

function listNumbers(figure, rows) {
  const table = document.createElement("table");
  const add = (parent, tag, text) => {
    const cell = parent.appendChild(document.createElement(tag));
    cell.textContent = text;
    return cell;
  };
  const caption = table.createCaption();
  caption.className = "said";
  caption.textContent = figure.getAttribute("aria-label");
  const head = table.createTHead().insertRow();
  for (const title of Object.values(figure.columns)) add(head, "th", title).scope = "col";
  const body = table.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    for (const name of Object.keys(figure.columns)) add(line, "td", row[name]);
  }
  figure.querySelector(".numbers .scroll").replaceChildren(table);
}

/** Gives a figure its spec, rows, columns, and what draws and updates it. */
function prepare(figure) {
  figure.ready ??= (async () => {
    figure.spec = JSON.parse(await unpack(figure.querySelector(".spec")));
    figure.columns = JSON.parse(figure.querySelector(".columns").textContent);
    const rows = figure.spec.data.flatMap((data) => data.values ?? []);
    figure.rows = rows.filter((row) => "scene" in row);
    figure.querySelector(".numbers").addEventListener("toggle", () => update(figure));
  })();
  return figure.ready;
}

/** Takes over what legend and choices ask for. */
function ask(figure) {
  const signals = wanted(figure);
  for (const { name } of figure.spec.signals ?? []) {
    if (name in signals) figure.view.signal(name, signals[name]);
  }
  const kept = shown(figure.rows, signals);
  figure.querySelector(".nothing").hidden = kept.length > 0;
  if (figure.querySelector(".numbers").open) listNumbers(figure, kept);
}

async function update(figure) {
  if (!figure.view) return; // it will ask when it is drawn
  ask(figure);
  await figure.view.runAsync();
}

/** Draws a prepared figure; each step is short enough not to be felt. */
function* drawing(figure) {
  const runtime = vega.parse(figure.spec);
  yield;
  const view = new vega.View(runtime, {
    container: figure.querySelector(".chart"),
    hover: true,
    logLevel: vega.Error, // an empty strip of failures is no reason to warn
    renderer: "svg",
    tooltip: (_, event, __, value) => showNumbers(event, value),
  });
  yield;
  figure.view = view;
  ask(figure);
  view.run();
  figure.dataset.drawn = "yes"; // what a test waits for
}

const queue = [];
let drawer = null;

/** Draws one figure after the other. */
async function drawQueue() {
  await loadBundle();
  for (let figure; (figure = queue.shift()); ) {
    await prepare(figure);
    await pause();
    if (figure.view) continue;
    for (const _ of drawing(figure)) await pause();
    await pause();
  }
  drawer = null;
}

function enqueue(figure) {
  if (figure.view || queue.includes(figure)) return drawer;
  queue.push(figure);
  return (drawer ??= drawQueue());
}

/** All at once: paper does not wait. Specs that are not unpacked yet stay away. */
function drawAllNow() {
  for (const figure of document.querySelectorAll("figure")) {
    if (!figure.view && figure.rows && window.vega) [...drawing(figure)];
  }
}

/** The legend names what the section's figures can show now, switched off or not. */
function trimLegend(section) {
  const every = section.querySelector(".every");
  if (!every) return;
  const figures = [...section.querySelectorAll("figure")];
  const rows = (all) =>
    figures.flatMap((figure) => {
      const signals = wanted(figure);
      return shown(figure.rows, { ...signals, hidden: [], every: all || signals.every });
    });
  const present = rows(false);
  for (const button of section.querySelectorAll(".legend [data-entry]")) {
    const { entry } = button.dataset;
    button.hidden = !present.some((row) => row.variant === entry || row.precision === entry);
  }
  for (const group of section.querySelectorAll(".legend .group")) {
    group.hidden = !group.querySelector("button:not([hidden])");
  }
  const possible = rows(true);
  const count = new Set(possible.map((row) => `${row.variant} ${row.precision}`)).size;
  every.hidden = !possible.some((row) => row.more);
  every.textContent = `All ${count} series`;
}
