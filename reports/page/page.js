// Folds, contents, choices, and the address that holds them:
//   #SECTION?SIGNAL=VALUE&FIGURE.SIGNAL=VALUE&every=1&off=VARIANT
// SECTION is the one last acted on, or a figure of it; a choice that is the page's own is left out.

const foldOf = (section) => section.querySelector(".fold");
const ownChoice = (control) =>
  control.type === "range"
    ? valuesOf(control)[control.defaultValue]
    : [...control.options].find((option) => option.defaultSelected)?.value;

function keyOf(control) {
  const figure = control.closest("figure");
  return (figure ? `${figure.id.split("--")[1]}.` : "") + control.dataset.signal;
}

function choose(control, value) {
  const place = valuesOf(control).indexOf(value);
  if (place < 0) return;
  control.value = control.type === "range" ? place : value;
  tell(control);
}

/** A slider says the value in words. */
function tell(control) {
  if (control.type !== "range") return;
  const text = JSON.parse(control.dataset.texts)[control.value];
  control.setAttribute("aria-valuetext", text);
  control.nextElementSibling.value = text;
}

function setPressed(button, pressed) {
  button?.setAttribute("aria-pressed", String(pressed));
}

function remember(section) {
  const state = new URLSearchParams();
  for (const control of section.querySelectorAll(CHOICE)) {
    if (valueOf(control) !== ownChoice(control)) state.set(keyOf(control), valueOf(control));
  }
  if (allSeries(section)) state.set("every", "1");
  for (const button of section.querySelectorAll("[data-entry][aria-pressed=false]")) {
    state.append("off", button.dataset.entry);
  }
  const choices = state.size ? `?${state}` : "";
  history.replaceState(null, "", `#${section.id}${choices}`);
}

/** Unfolds what the address names, and chooses what it says. */
async function follow() {
  const [name, choices] = location.hash.slice(1).split("?");
  const place = document.getElementById(decodeURIComponent(name));
  const section = place?.closest("section");
  if (!section) return;
  if (choices !== undefined) restore(section, new URLSearchParams(choices));
  foldOf(section).open = true;
  for (let it = place; (it = it.closest("details")); it = it.parentElement) it.open = true;
  await updateSection(section);
  place.scrollIntoView();
}

function restore(section, state) {
  for (const control of section.querySelectorAll(CHOICE)) {
    choose(control, state.get(keyOf(control)) ?? ownChoice(control));
  }
  setPressed(section.querySelector(".every"), state.has("every"));
  const off = state.getAll("off");
  for (const button of section.querySelectorAll("[data-entry]")) {
    setPressed(button, !off.includes(button.dataset.entry));
  }
}

/** Shows the section's tables and answers that its choices ask for. */
function chooseShown(section) {
  const chosen = [...section.querySelectorAll(`.controls ${CHOICE}`)];
  for (const part of section.querySelectorAll("[data-shown]")) {
    const values = JSON.parse(part.dataset.shown);
    part.hidden = !chosen.every((control) => {
      const { signal } = control.dataset;
      return !(signal in values) || [values[signal]].flat().includes(valueOf(control));
    });
  }
}

/** Redraws what a control acts on: its figure, or all of its section. */
async function updateSection(section, figures = section.querySelectorAll("figure")) {
  chooseShown(section);
  await Promise.all([...section.querySelectorAll("figure")].map(prepare));
  trimLegend(section);
  for (const figure of figures) {
    await update(figure);
    await pause();
  }
}

function act(control) {
  const section = control.closest("section");
  remember(section);
  const figure = control.closest("figure");
  updateSection(section, figure ? [figure] : undefined);
}

/** A figure that was drawn in another width fits itself to the present one. */
function fit(section) {
  const figures = section.querySelectorAll("figure[data-drawn]");
  for (const figure of figures) figure.view.resize().runAsync();
}

async function unfolded(section) {
  await updateSection(section);
  fit(section);
}

function watchFigures() {
  const watcher = new IntersectionObserver(
    (entries) => {
      for (const { isIntersecting, target } of entries) {
        if (!isIntersecting) continue;
        watcher.unobserve(target);
        enqueue(target);
      }
    },
    { rootMargin: "200px" },
  );
  for (const figure of document.querySelectorAll("figure")) watcher.observe(figure);
}

/** The contents say where the reader is. */
function watchSections() {
  const links = new Map();
  for (const link of document.querySelectorAll(".contents a")) links.set(link.hash.slice(1), link);
  const watcher = new IntersectionObserver(
    (entries) => {
      for (const { isIntersecting, target } of entries) {
        const link = links.get(target.id);
        if (isIntersecting) link.setAttribute("aria-current", "true");
        else link.removeAttribute("aria-current");
      }
    },
    { rootMargin: "-15% 0px -80%" },
  );
  for (const section of document.querySelectorAll("section")) watcher.observe(section);
}

function foldAll(open) {
  for (const fold of document.querySelectorAll(".fold")) fold.open = open;
}

function listen() {
  for (const section of document.querySelectorAll("section")) {
    const fold = foldOf(section);
    fold.addEventListener("toggle", () => fold.open && unfolded(section));
    fold.firstElementChild.addEventListener("click", () => remember(section));
  }
  for (const control of document.querySelectorAll(CHOICE)) {
    control.addEventListener("input", () => {
      tell(control);
      act(control);
    });
  }
  for (const button of document.querySelectorAll(".controls button")) {
    button.addEventListener("click", () => {
      setPressed(button, button.getAttribute("aria-pressed") !== "true");
      act(button);
    });
  }
  for (const button of document.querySelectorAll("[data-fold]")) {
    button.addEventListener("click", () => foldAll(Boolean(button.dataset.fold)));
  }
  for (const button of document.querySelectorAll("[data-save]")) {
    button.addEventListener("click", () => save(button.closest("figure"), button.dataset.save));
  }
  const menu = document.querySelector(".contents");
  const opener = menu.querySelector("[aria-expanded]");
  const expand = (open) => opener.setAttribute("aria-expanded", String(open));
  opener.addEventListener("click", () => expand(opener.getAttribute("aria-expanded") !== "true"));
  menu.addEventListener("click", (event) => event.target.matches("a") && expand(false));
  menu.addEventListener("keydown", (event) => event.key === "Escape" && expand(false));
  document.addEventListener("click", (event) => {
    hideNumbers();
    const chart = event.target.closest(".chart");
    if (chart) showNearest(chart, event);
  });
  document.addEventListener("touchmove", hideNumbers, { passive: true });
  addEventListener("hashchange", follow);
  addEventListener("beforeprint", () => {
    foldAll(true);
    drawAllNow();
  });
}

async function start() {
  listen();
  watchSections();
  watchFigures();
  const unfolded = document.querySelectorAll("section:has(> .fold[open])");
  await Promise.all([...unfolded].map((section) => updateSection(section)));
  await follow();
  await drawer;
  performance.mark("first screen");
  document.body.dataset.drawn = "yes"; // what a test waits for
  for (const figure of document.querySelectorAll("figure")) {
    await prepare(figure); // for paper
    await pause();
  }
  document.body.dataset.ready = "yes";
}

start();
