"use strict";

const read = (node) => JSON.parse(node.textContent);

/** What the page carries as gzip in base64, since it would be six times as large. */
async function unpack(node) {
  const bytes = Uint8Array.from(atob(node.textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
}

const theme = read(document.getElementById("theme"));

/** The parameters that legend and choices around a figure ask for. */
function wanted(figure) {
  const section = figure.closest("section");
  const shared = section.querySelectorAll(".controls select");
  const choices = [...shared, ...figure.querySelectorAll("select")];
  const off = [...section.querySelectorAll(".legend [aria-pressed=false]")];
  const chosen = choices.map((select) => [select.dataset.signal, select.value]);
  return { ...Object.fromEntries(chosen), hidden: off.map((button) => button.dataset.entry) };
}

/** The rows that the chart's own filters let through. */
function shown(rows, { hidden, ...choices }) {
  const kept = ([name, value]) => (row) => !(name in row) || row[name] === value;
  const filters = Object.entries(choices).map(kept);
  return rows
    .filter((row) => !hidden.includes(row.variant) && !hidden.includes(row.precision))
    .filter((row) => filters.every((keeps) => keeps(row)));
}

function listNumbers(figure, rows, columns) {
  const table = document.createElement("table");
  const add = (parent, tag, text) => {
    const cell = parent.appendChild(document.createElement(tag));
    cell.textContent = text;
    return cell;
  };
  const head = table.createTHead().insertRow();
  for (const title of Object.values(columns)) add(head, "th", title).scope = "col";
  const body = table.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    for (const name of Object.keys(columns)) add(line, "td", row[name]);
  }
  figure.querySelector(".numbers .scroll").replaceChildren(table);
}

async function draw(figure) {
  const spec = JSON.parse(await unpack(figure.querySelector(".spec")));
  const columns = read(figure.querySelector(".columns"));
  const rows = Object.values(spec.datasets).flat().filter((row) => "scene" in row);
  const numbers = figure.querySelector(".numbers");
  const parameters = new Set((spec.params ?? []).map((parameter) => parameter.name));
  const { view } = await vegaEmbed(figure.querySelector(".chart"), spec, {
    actions: false,
    config: theme,
    logLevel: 1, // errors only: an empty strip of failures is no reason to warn
    renderer: "svg",
    tooltip: { disableDefaultStyle: true },
  });
  figure.rows = rows;
  figure.update = async () => {
    const signals = wanted(figure);
    for (const [name, value] of Object.entries(signals)) {
      if (parameters.has(name)) view.signal(name, value);
    }
    const kept = shown(rows, signals);
    figure.querySelector(".nothing").hidden = kept.length > 0;
    if (numbers.open) listNumbers(figure, kept, columns);
    await view.runAsync();
  };
  numbers.addEventListener("toggle", figure.update);
  await figure.update();
}

/** The legend names what the section's figures can show now, switched off or not. */
function trimLegend(section) {
  const figures = [...section.querySelectorAll("figure")];
  const rows = figures.flatMap((figure) => shown(figure.rows, { ...wanted(figure), hidden: [] }));
  for (const button of section.querySelectorAll(".legend button")) {
    const { entry } = button.dataset;
    button.hidden = !rows.some((row) => row.variant === entry || row.precision === entry);
  }
}

/** Shows the section's tables that its choices ask for. */
function chooseTables(section) {
  const chosen = [...section.querySelectorAll(".controls select")];
  for (const table of section.querySelectorAll("[data-shown]")) {
    const wanted = JSON.parse(table.dataset.shown);
    table.hidden = chosen.some((select) => wanted[select.dataset.signal] !== select.value);
  }
}

/** Redraws what a control acts on: its figure, or all figures and tables of its section. */
function updateAround(control) {
  chooseTables(control.closest("section"));
  const scope = control.closest("figure") ?? control.closest("section");
  const figures = scope.matches("figure") ? [scope] : scope.querySelectorAll("figure");
  for (const figure of figures) figure.update();
  trimLegend(control.closest("section"));
}

/** Fingers have no hover and miss small marks: a tap shows the numbers of the mark nearest to it. */
function showNearest(chart, { clientX, clientY }) {
  let nearest = null;
  let least = 30; // pixels
  for (const mark of chart.querySelectorAll(":is(.mark-symbol, .mark-rect) path[aria-label]")) {
    const box = mark.getBoundingClientRect();
    const reach = Math.max(0, box.width - box.height) / 2; // a bar is near all along
    const across = Math.max(0, Math.abs(box.x + box.width / 2 - clientX) - reach);
    const distance = Math.hypot(across, box.y + box.height / 2 - clientY);
    if (distance < least) [nearest, least] = [mark, distance];
  }
  nearest?.dispatchEvent(new PointerEvent("pointermove", { bubbles: true, clientX, clientY }));
}

function hideNumbers() {
  document.getElementById("vg-tooltip-element")?.classList.remove("visible");
}

/** Defines vegaEmbed. */
async function loadBundle() {
  const script = document.createElement("script");
  script.textContent = await unpack(document.getElementById("bundle"));
  document.head.append(script);
}

async function start() {
  await loadBundle();
  await Promise.all([...document.querySelectorAll("figure")].map(draw));
  document.querySelectorAll("section").forEach(trimLegend);
  for (const select of document.querySelectorAll("select")) {
    select.addEventListener("change", () => updateAround(select));
  }
  for (const button of document.querySelectorAll(".legend button")) {
    button.addEventListener("click", () => {
      button.setAttribute("aria-pressed", button.getAttribute("aria-pressed") !== "true");
      updateAround(button);
    });
  }
  document.addEventListener("click", (event) => {
    hideNumbers();
    const chart = event.target.closest(".chart");
    if (chart) showNearest(chart, event);
  });
  document.addEventListener("touchmove", hideNumbers, { passive: true });
  document.body.dataset.drawn = "yes"; // what a test waits for
}

start();
