// The numbers of a mark, beside the pointer or the finger.

const TIP = "numbers-of-a-mark";

function hideNumbers() {
  document.getElementById(TIP)?.classList.remove("visible");
}

function showNumbers(event, value) {
  if (!value) return hideNumbers();
  let tip = document.getElementById(TIP);
  if (!tip) {
    tip = document.body.appendChild(document.createElement("div"));
    tip.id = TIP;
    tip.setAttribute("role", "tooltip");
  }
  const table = document.createElement("table");
  for (const [name, text] of Object.entries(value)) {
    const row = table.insertRow();
    row.insertCell().textContent = name;
    row.insertCell().textContent = text;
  }
  tip.replaceChildren(table);
  const { width, height } = tip.getBoundingClientRect();
  const beside = (place, size, room) => (place + 12 + size > room ? place - size - 12 : place + 12);
  const within = (place, size, room) =>
    Math.max(4, Math.min(beside(place, size, room), room - size - 4));
  tip.style.left = `${within(event.clientX, width, innerWidth)}px`;
  tip.style.top = `${within(event.clientY, height, innerHeight)}px`;
  tip.classList.add("visible");
}

/** Fingers have no hover and miss small marks: a tap shows the numbers of the nearest. */
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
