// The surface in three dimensions with the contact in colour: turned by pointer or keyboard, at the load of the maps. An
// orthographic projection of shaded triangles with a depth buffer, as the still picture (src/report/relief.rs). The heights
// are the JSON element #heights (src/report/page/relief.rs). Uses `node`, `clamp`, `unpack`, `cell` and `ink` of maps.js.
async function relief(root, data, maps) {
  const { nx, ny, values } = await unpack(data.heights);
  const { aspect, scale } = data;
  const z = values.map(v => v * scale);
  const high = z.reduce((a, b) => Math.max(a, b));
  const start = { azimuth: 30, elevation: 35, zoom: 1 };
  const view = { ...start, colour: "all" };
  const canvas = node("canvas", { tabindex: "0", role: "application", "aria-describedby": "relief-help" });
  const controls = node("div", { class: "controls" });
  const shown = node("output", { for: "relief-load" });
  const slider = node("input", { type: "range", id: "relief-load", min: 0, step: 1 });
  if (maps) {
    Object.assign(slider, { max: maps.loads.length - 1, value: maps.load() });
    slider.addEventListener("input", () => maps.select(Number(slider.value)));
    controls.append(node("label", { for: "relief-load" }, "load"), slider, shown);
    if (maps.layers.length > 1) {
      const select = node("select", { id: "relief-contact" });
      const choices = maps.layers.slice(0, -1).map((l, i) => [`${i}`, `${l.title} and atoms`]);
      for (const [value, text] of choices) select.append(node("option", { value }, text));
      view.colour = choices[choices.length - 1][0];
      select.value = view.colour;
      select.addEventListener("change", () => ((view.colour = select.value), draw()));
      if (choices.length > 1) controls.append(node("label", { for: "relief-contact" }, "contact of"), select);
    }
  }
  const reset = node("button", { type: "button" }, "first view");
  reset.addEventListener("click", () => (Object.assign(view, start), draw()));
  controls.append(reset);
  const help = node("p", { id: "relief-help", class: "quiet hint" }, "Drag or arrows: turn; +, −: zoom; 0: first view.");
  root.querySelector("svg").before(canvas); // the drawing is for print
  root.append(controls, help);

  // Colour of each node at the load of the maps.
  async function colours() {
    if (!maps) return () => data.ground;
    const of = async i => maps.contact(i);
    const last = maps.layers.length - 1;
    const [a, b] = await Promise.all(last ? [of(Number(view.colour)), of(last)] : [of(0), null]);
    const touches = (map, i) => map && map.values[cell(map, ((i % nx) + 0.5) / nx, (Math.floor(i / nx) + 0.5) / ny)];
    return i => {
      const [p, q] = [touches(a, i), touches(b, i)];
      if (!last) return p ? data.contact : data.ground;
      return p ? (q ? [0, 0, 0] : maps.layers[0].colour) : q ? maps.layers[last].colour : data.ground;
    };
  }

  const LIGHT = [-0.42, 0.57, 0.705], FLOOR = 0.03, PROPORTION = 0.58, FILL = 0.6;
  async function draw() {
    const pick = await colours();
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [wide, tall] = [root.clientWidth, Math.round(root.clientWidth * PROPORTION)];
    const [width, height] = [Math.round(wide * ratio), Math.round(tall * ratio)];
    canvas.width = width;
    canvas.height = height;
    canvas.style.height = `${tall}px`;
    const [a, e] = [view.azimuth, view.elevation].map(v => (v * Math.PI) / 180);
    const [sinA, cosA, sinE, cosE] = [Math.sin(a), Math.cos(a), Math.sin(e), Math.cos(e)];
    const size = (FILL * width * view.zoom) / Math.max(aspect, 1);
    const project = (x, y, up) => {
      const across = x * cosA - y * sinA, away = x * sinA + y * cosA, rise = up - high / 2;
      return [width / 2 + size * across, height / 2 - size * (rise * cosE + away * sinE), away * cosE - rise * sinE];
    };
    const place = (i, j, up) => project((i + 0.5) / nx - 0.5, ((j + 0.5) / ny - 0.5) * aspect, up);
    const points = Array.from(z, (up, k) => place(k % nx, Math.floor(k / nx), up));
    const image = new ImageData(width, height), pixels = new Uint32Array(image.data.buffer);
    const depth = new Float32Array(width * height).fill(Infinity);
    const fill = (p, q, r, rgb) => {
      const area = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
      if (area === 0) return;
      const x0 = Math.max(0, Math.ceil(Math.min(p[0], q[0], r[0]) - 0.5)), x1 = Math.min(width - 1, Math.max(p[0], q[0], r[0]) - 0.5);
      const y0 = Math.max(0, Math.ceil(Math.min(p[1], q[1], r[1]) - 0.5)), y1 = Math.min(height - 1, Math.max(p[1], q[1], r[1]) - 0.5);
      for (let y = y0; y <= y1; y++)
        for (let x = x0; x <= x1; x++) {
          const px = x + 0.5, py = y + 0.5;
          const u = ((r[0] - q[0]) * (py - q[1]) - (px - q[0]) * (r[1] - q[1])) / area;
          const v = ((p[0] - r[0]) * (py - r[1]) - (px - r[0]) * (p[1] - r[1])) / area;
          const w = 1 - u - v, far = u * p[2] + v * q[2] + w * r[2], at = y * width + x;
          if (u >= 0 && v >= 0 && w >= 0 && far < depth[at]) {
            depth[at] = far;
            pixels[at] = rgb;
          }
        }
    };
    const quad = (p, q, r, s, colour, light) => {
      const share = 0.45 + 0.55 * clamp(light, 0, 1);
      const rgb = (255 << 24) | (Math.round(colour[2] * share) << 16) | (Math.round(colour[1] * share) << 8) | Math.round(colour[0] * share);
      fill(p, q, r, rgb >>> 0);
      fill(p, r, s, rgb >>> 0);
    };
    for (let j = 0; j + 1 < ny; j++)
      for (let i = 0; i + 1 < nx; i++) {
        const k = j * nx + i;
        const slopeX = ((z[k + 1] - z[k] + z[k + nx + 1] - z[k + nx]) / 2) * nx;
        const slopeY = (((z[k + nx] - z[k] + z[k + nx + 1] - z[k + 1]) / 2) * ny) / aspect;
        const across = slopeX * cosA - slopeY * sinA, away = slopeX * sinA + slopeY * cosA;
        const light = (-across * LIGHT[0] + (cosE - away * sinE) * LIGHT[1] + (sinE + away * cosE) * LIGHT[2]) / Math.hypot(1, slopeX, slopeY);
        quad(points[k], points[k + 1], points[k + nx + 1], points[k + nx], pick(k), light);
      }
    const side = [150, 153, 158];
    const wall = (i, j, k, l, light) =>
      quad(points[j * nx + i], points[l * nx + k], place(k, l, -FLOOR), place(i, j, -FLOOR), side, light);
    for (let i = 1; i < nx; i++) wall(i - 1, 0, i, 0, 0.8), wall(i - 1, ny - 1, i, ny - 1, 0.8);
    for (let j = 1; j < ny; j++) wall(0, j - 1, 0, j, 0.4), wall(nx - 1, j - 1, nx - 1, j, 0.4);
    const c = canvas.getContext("2d");
    c.putImageData(image, 0, 0);
    c.scale(ratio, ratio);
    c.font = "13px system-ui, sans-serif";
    c.fillStyle = ink();
    c.fillText(data.labels[2], 4, 16);
    // The edges in front have the labels.
    const edge = (x, y, label) => {
      const [px, py] = project(x, y, -FLOOR);
      c.textAlign = px < width / 2 ? "right" : "left";
      c.fillText(label, px / ratio, clamp(py / ratio + 20, 12, tall - 4));
    };
    edge(0, (cosA > 0 ? -0.5 : 0.5) * aspect, data.labels[0]);
    edge(sinA > 0 ? -0.5 : 0.5, 0, data.labels[1]);
    if (maps) {
      slider.value = maps.load();
      shown.textContent = maps.loads[maps.load()];
      slider.setAttribute("aria-valuetext", shown.textContent);
    }
    canvas.setAttribute("aria-label", `Surface upside down in three dimensions, ${data.labels.join(", ")}${maps ? `, contact at ${shown.textContent}` : ""}`);
    root.dataset.drawn = `${view.azimuth} ${view.elevation} ${view.zoom} ${maps ? maps.load() : ""}`;
  }

  const turn = (across, up) => {
    view.azimuth = (view.azimuth + across + 360) % 360;
    view.elevation = clamp(view.elevation + up, 5, 90);
    draw();
  };
  let from = null;
  canvas.addEventListener("pointerdown", e => ((from = [e.clientX, e.clientY]), canvas.setPointerCapture(e.pointerId)));
  canvas.addEventListener("pointermove", e => {
    if (!from) return;
    const moved = [e.clientX - from[0], e.clientY - from[1]];
    from = [e.clientX, e.clientY];
    turn(0.4 * moved[0], 0.3 * moved[1]);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (from = null));
  canvas.addEventListener("keydown", e => {
    const turns = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[e.key];
    const zoom = { "+": 1.25, "=": 1.25, "-": 0.8 }[e.key];
    if (turns) turn(...turns);
    else if (zoom) (view.zoom = clamp(view.zoom * zoom, 0.5, 8)), draw();
    else if (e.key === "0") Object.assign(view, start), draw();
    else return;
    e.preventDefault();
  });
  for (const change of ["resize", "theme"]) window.addEventListener(change, draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  maps?.follow(draw);
  return draw();
}

{
  const heights = document.getElementById("heights");
  if (heights && "DecompressionStream" in window) explored.then(maps => relief(document.getElementById("relief"), JSON.parse(heights.textContent), maps));
}
