// A figure as a file: SVG and PNG as they look now, CSV of the rows that they show.

/** The chart with the colours that the style sheet gives it. */
async function svgOf(figure) {
  const probe = document.body.appendChild(document.createElement("span"));
  const resolved = (colour) => {
    probe.style.color = colour === "currentColor" ? "var(--text)" : colour;
    return getComputedStyle(probe).color;
  };
  const drawn = await figure.view.toSVG();
  const style = "<style>text { paint-order: stroke }</style>";
  const page = `${style}<rect width="100%" height="100%" fill="${resolved("var(--page)")}"/>`;
  const svg = drawn
    .replace(/<svg[^>]*>/, (tag) => tag + page)
    .replace(/var\(--[\w-]+\)|currentColor/g, resolved);
  probe.remove();
  return svg;
}

async function pngOf(figure) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(await svgOf(figure))}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  const scale = 2; // sharp on paper too
  [canvas.width, canvas.height] = [scale * image.width, scale * image.height];
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}

function csvOf(figure) {
  const names = Object.keys(figure.columns);
  const cell = (value) => {
    const text = String(value ?? "");
    return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  };
  // Numbers that place the marks come after what their list shows, in full.
  const rows = shown(figure.rows, wanted(figure));
  const more = new Set(rows.flatMap(Object.keys).filter((name) => !names.includes(name)));
  for (const name of ["more", "last"]) more.delete(name);
  const head = [...Object.values(figure.columns), ...more];
  const lines = rows.map((row) => [...names, ...more].map((name) => row[name]));
  return [head, ...lines].map((line) => line.map(cell).join(",") + "\r\n").join("");
}

async function save(figure, kind) {
  await prepare(figure);
  await enqueue(figure);
  const made = {
    svg: async () => new Blob([await svgOf(figure)], { type: "image/svg+xml" }),
    png: () => pngOf(figure),
    csv: () => new Blob([csvOf(figure)], { type: "text/csv" }),
  };
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await made[kind]());
  link.download = `kalmarm-${figure.id}.${kind}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
