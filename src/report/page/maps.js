"use strict";
// Maps of the first screen: one load slider, linked zoom and pan, values under the pointer, and a section line.
// The data are the JSON element #maps (src/report/page/explorer.rs). Without JavaScript the drawings stay.

const node = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
const digits = (v, n = 4) => (v === 0 ? "0" : Number(v.toPrecision(n)).toString().replace("-", "−"));
const clamp = (v, low, high) => Math.min(Math.max(v, low), high);
const ink = () => getComputedStyle(document.body).color;

// Values of a packed map: see `Packed` in explorer.rs.
async function unpack(packed) {
  if (!packed) return null;
  const compressed = Uint8Array.from(atob(packed.data), c => c.charCodeAt(0));
  const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const { nx, ny, low, high } = packed;
  const n = nx * ny;
  const values = new Float32Array(n);
  if (bytes.length === n) {
    values.set(bytes);
  } else {
    for (let i = 0, last = 0; i < n; i++) {
      if (i % nx === 0) last = 0;
      last = (last + (bytes[i] << 8) + bytes[n + i]) & 0xffff;
      values[i] = low + (last * (high - low)) / 65535;
    }
  }
  return { nx, ny, values };
}

const cell = (map, u, v) =>
  clamp(Math.floor(v * map.ny), 0, map.ny - 1) * map.nx + clamp(Math.floor(u * map.nx), 0, map.nx - 1);
const at = (map, u, v) => (map ? map.values[cell(map, u, v)] : null);

function explore(root, data) {
  // Position and size of the visible square in fractions of the cell, the section, and what is shown.
  const state = { u: 0, v: 0, size: 1, section: 0.5, load: data.shown, quantity: "contact", pointer: null };
  const fields = new Map();
  const views = [...root.querySelectorAll(".view")].map((box, i) => {
    const canvas = node("canvas", { tabindex: "0", role: "application", "aria-describedby": "map-help" });
    box.querySelector("svg").before(canvas); // the drawing is for print
    return { box, canvas, title: box.querySelector(".panel-title"), ...data.views[i] };
  });
  const [length, height] = data.length;
  const aspect = height / length;
  const named = name => (name === "contact" ? "contact" : `${data[name].label} (${data[name].unit})`);

  const load = node("input", { type: "range", id: "load", min: 0, max: data.loads.length - 1, step: 1, value: state.load });
  const shown = node("output", { for: "load" });
  const section = node("input", { type: "range", id: "section", min: 0, max: 1, step: 0.002, value: 0.5 });
  const position = node("output", { for: "section" });
  const readout = node("output", { id: "readout", "aria-live": "polite" });
  const controls = node("div", { class: "controls" });
  controls.append(node("label", { for: "load" }, "load"), load, shown);
  const quantities = ["contact", "gap", "stress"].filter(q => data.layers.some(l => l[q].some(Boolean)));
  if (data.layers.length > 1) {
    const select = node("select", { id: "quantity" });
    for (const q of quantities) select.append(node("option", { value: q }, named(q)));
    select.addEventListener("change", () => ((state.quantity = select.value), draw()));
    controls.append(node("label", { for: "quantity" }, "show"), select);
  }
  controls.append(node("label", { for: "section" }, "section y"), section, position);
  for (const [text, label, act] of [
    ["+", "zoom in", () => zoom(0.5)],
    ["−", "zoom out", () => zoom(2)],
    ["whole cell", "whole cell", () => zoom(1e9)],
  ]) {
    const button = node("button", { type: "button", "aria-label": label, title: label }, text);
    button.addEventListener("click", act);
    controls.append(button);
  }
  const profile = node("canvas", { class: "profile", role: "img" });
  const help = node("p", { id: "map-help", class: "quiet hint" },
    "Wheel or +, −: zoom; drag or Shift+arrows: pan; arrows: pointer; drag the line or PageUp, PageDown: section.");
  root.querySelector(".key").after(controls, readout, profile, help);

  const map = (layer, quantity) => fields.get(`${layer} ${quantity} ${state.load}`);
  async function fetchLoad() {
    const wanted = [];
    data.layers.forEach((layer, i) => quantities.forEach(q => wanted.push([`${i} ${q} ${state.load}`, layer[q][state.load]])));
    await Promise.all(wanted.filter(([key]) => !fields.has(key)).map(async ([key, packed]) => fields.set(key, await unpack(packed))));
  }

  // Colours.
  const ramp = share => {
    const place = clamp(share, 0, 1) * (data.ramp.length - 1);
    const i = Math.min(Math.floor(place), data.ramp.length - 2);
    return data.ramp[i].map((c, k) => c + (place - i) * (data.ramp[i + 1][k] - c));
  };
  const DARKEST = 0.3; // contact is black, as in picture.rs
  const white = [255, 255, 255];
  const quantityOf = view => view.quantity ?? state.quantity;
  function colours(view) {
    const quantity = quantityOf(view);
    if (quantity === "contact" && view.over !== null) {
      const [a, b] = [map(view.layer, "contact"), map(view.over, "contact")];
      if (!a || !b || a.nx !== b.nx) return null;
      const [only, other] = [data.layers[0].colour, data.layers[view.over].colour];
      return { map: a, pick: i => (a.values[i] ? (b.values[i] ? [0, 0, 0] : only) : b.values[i] ? other : white) };
    }
    const [shownMap, contact] = [map(view.layer, quantity), map(view.layer, "contact")];
    if (!shownMap) return null;
    if (quantity === "contact") return { map: shownMap, pick: i => (shownMap.values[i] ? data.layers[view.layer].colour : white) };
    const { low, high } = data[quantity];
    const share = i => (shownMap.values[i] - low) / (high - low);
    const dark = quantity === "gap" && contact && contact.nx === shownMap.nx;
    return { map: shownMap, pick: i => (dark ? (contact.values[i] ? [0, 0, 0] : ramp(DARKEST + (1 - DARKEST) * share(i))) : ramp(share(i))) };
  }

  const LEFT = 46, BOTTOM = 30, BAR = 42, TOP = 6;
  function paint(view) {
    const { canvas, title } = view;
    const width = canvas.parentElement.clientWidth;
    const inner = [width - LEFT - 2, (width - LEFT - 2) * aspect];
    // The maps of one row have one height.
    const tall = TOP + inner[1] + BOTTOM + (views.some(v => quantityOf(v) !== "contact") ? BAR : 0);
    const ratio = window.devicePixelRatio || 1;
    canvas.width = width * ratio;
    canvas.height = tall * ratio;
    canvas.style.height = `${tall}px`;
    view.inner = inner;
    const quantity = quantityOf(view);
    const layer = data.layers[view.layer];
    const share = layer.shares[state.load];
    title.textContent = !view.quantity
      ? `${layer.title}${share ? `: ${share}` : ""}`
      : view.over !== null ? "Superposed" : named(quantity).replace(/^./, c => c.toUpperCase());
    canvas.setAttribute("aria-label", `${title.textContent}, ${data.loads[state.load]}: map of ${named(quantity)}`);
    const c = canvas.getContext("2d");
    c.scale(ratio, ratio);
    c.font = "12px system-ui, sans-serif";
    c.fillStyle = c.strokeStyle = ink();
    const found = colours(view);
    if (!found) return c.fillText("not stored", LEFT + 8, TOP + 20);
    const { nx, ny } = found.map;
    const image = new ImageData(nx, ny);
    for (let y = 0; y < ny; y++)
      for (let x = 0; x < nx; x++) {
        const [r, g, b] = found.pick(y * nx + x);
        image.data.set([r, g, b, 255], 4 * ((ny - 1 - y) * nx + x));
      }
    const whole = new OffscreenCanvas(nx, ny);
    whole.getContext("2d").putImageData(image, 0, 0);
    c.imageSmoothingEnabled = false;
    const s = state.size;
    c.drawImage(whole, state.u * nx, (1 - state.v - s) * ny, s * nx, s * ny, LEFT, TOP, ...inner);
    c.strokeRect(LEFT + 0.5, TOP + 0.5, ...inner);
    axes(c, inner);
    const y = TOP + inner[1] * (1 - (state.section - state.v) / s);
    if (y >= TOP && y <= TOP + inner[1]) {
      c.setLineDash([6, 4]);
      c.lineWidth = 2;
      c.strokeStyle = "#cc3311";
      c.beginPath(), c.moveTo(LEFT, y), c.lineTo(LEFT + inner[0], y), c.stroke();
      c.setLineDash([]);
    }
    if (state.pointer) {
      const [px, py] = [LEFT + (inner[0] * (state.pointer[0] - state.u)) / s, TOP + inner[1] * (1 - (state.pointer[1] - state.v) / s)];
      c.lineWidth = 1.5;
      c.strokeStyle = "#cc3311";
      c.beginPath(), c.arc(px, py, 5, 0, 7), c.stroke();
    }
    if (quantity !== "contact") bar(c, inner, quantity);
  }

  const step = (low, high, n) => {
    const rough = (high - low) / n, decade = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].map(m => m * decade).find(m => m >= rough) ?? rough;
  };
  const ticks = (low, high, n) => {
    const by = step(low, high, n);
    const list = [];
    for (let k = Math.ceil(low / by - 1e-9); k * by <= high + 1e-9 * by; k++) list.push(k * by);
    return list;
  };
  // A label centred at x, or as far left of it as the right end requires.
  const centred = (c, text, x, y, right) => {
    c.textAlign = "center";
    c.fillText(text, Math.min(x, right - c.measureText(text).width / 2), y);
  };
  function axes(c, inner) {
    c.fillStyle = c.strokeStyle = ink();
    c.textAlign = "center";
    const [x0, y0, span] = [state.u * length, state.v * height, state.size];
    for (const t of ticks(x0, x0 + span * length, 4)) {
      const x = LEFT + (inner[0] * (t - x0)) / (span * length);
      c.fillRect(x, TOP + inner[1], 1, 4);
      centred(c, digits(t), x, TOP + inner[1] + 15, LEFT + inner[0] + 2);
    }
    centred(c, `x (${data.unit})`, LEFT + inner[0] / 2, TOP + inner[1] + 28, Infinity);
    c.save();
    c.translate(11, TOP + inner[1] / 2);
    c.rotate(-Math.PI / 2);
    c.fillText(`y (${data.unit})`, 0, 0);
    c.restore();
    c.textAlign = "right";
    for (const t of ticks(y0, y0 + span * height, 4)) {
      const y = TOP + inner[1] * (1 - (t - y0) / (span * height));
      c.fillRect(LEFT - 4, y, 4, 1);
      c.fillText(digits(t), LEFT - 6, clamp(y + 4, TOP + 8, TOP + inner[1]));
    }
    c.textAlign = "left";
  }
  function bar(c, inner, quantity) {
    const { low, high } = data[quantity];
    const top = TOP + inner[1] + BOTTOM + 4;
    const from = quantity === "gap" ? DARKEST : 0;
    for (let x = 0; x < inner[0]; x++) {
      c.fillStyle = `rgb(${ramp(from + ((1 - from) * x) / inner[0]).map(Math.round)})`;
      c.fillRect(LEFT + x, top, 1.5, 7);
    }
    c.fillStyle = ink();
    c.fillText(digits(low, 3), LEFT, top + 19);
    centred(c, named(quantity), LEFT + inner[0] / 2, top + 32, Infinity);
    c.textAlign = "right";
    c.fillText(`≥ ${digits(high, 3)}`, LEFT + inner[0], top + 19);
    c.textAlign = "left";
  }

  // Gap and stress along the section.
  const dashes = [[7, 4], [2, 3]]; // the last layer has a solid line
  function pen(c, layer, n) {
    c.setLineDash(layer === data.layers[data.layers.length - 1] ? [] : dashes[n]);
    c.lineWidth = 1.6;
    c.strokeStyle = layer.colour.every(v => v === 0) ? ink() : `rgb(${layer.colour})`;
  }
  // Names of the sources above the first section, from the right.
  function legend(c, layers, right) {
    c.save();
    let x = right;
    for (let n = layers.length - 1; n >= 0; n--) {
      x -= c.measureText(layers[n].title).width;
      c.fillText(layers[n].title, x, 12);
      pen(c, layers[n], n);
      c.beginPath(), c.moveTo(x - 26, 8), c.lineTo(x - 4, 8), c.stroke();
      x -= 38;
    }
    c.restore();
  }
  function paintProfile() {
    const kinds = ["gap", "stress"].filter(q => quantities.includes(q));
    const ratio = window.devicePixelRatio || 1;
    const [width, tall] = [root.clientWidth, 150];
    profile.width = width * ratio;
    profile.height = tall * ratio;
    profile.style.height = `${tall}px`;
    const c = profile.getContext("2d");
    c.scale(ratio, ratio);
    c.font = "12px system-ui, sans-serif";
    profile.setAttribute("aria-label", `Gap and stress along y = ${digits(state.section * height)} ${data.unit}, ${data.loads[state.load]}`);
    kinds.forEach((quantity, k) => {
      const [left, right] = [(k * width) / kinds.length + 48, ((k + 1) * width) / kinds.length - 8];
      const [top, bottom] = [18, tall - 32];
      const lines = data.layers.map((layer, i) => [layer, map(i, quantity)]).filter(([, m]) => m);
      const points = lines.map(([, m]) => Array.from({ length: m.nx }, (_, i) => m.values[cell(m, 0, state.section) + i]));
      const all = points.flat();
      let [low, high] = [Math.min(0, ...all), Math.max(...all)];
      if (!(high > low)) high = low + 1;
      high += 0.05 * (high - low);
      c.fillStyle = c.strokeStyle = ink();
      c.fillText(named(quantity), left, 12);
      if (k === 0 && lines.length > 1) legend(c, lines.map(([layer]) => layer), right);
      c.textAlign = "right";
      for (const t of ticks(low, high, 3)) c.fillText(digits(t, 3), left - 5, bottom - ((t - low) / (high - low)) * (bottom - top) + 4);
      const [x0, x1] = [state.u * length, (state.u + state.size) * length];
      for (const t of ticks(x0, x1, 4)) centred(c, digits(t), left + ((t - x0) / (x1 - x0)) * (right - left), bottom + 14, right + 6);
      centred(c, `x (${data.unit})`, (left + right) / 2, bottom + 28, Infinity);
      c.textAlign = "left";
      c.strokeRect(left + 0.5, top + 0.5, right - left, bottom - top);
      c.save();
      c.beginPath(), c.rect(left, top, right - left, bottom - top), c.clip();
      lines.forEach(([layer, m], n) => {
        pen(c, layer, n);
        c.beginPath();
        points[n].forEach((v, i) => {
          const x = left + (((i + 0.5) / m.nx - state.u) / state.size) * (right - left);
          c[i ? "lineTo" : "moveTo"](x, bottom - ((v - low) / (high - low)) * (bottom - top));
        });
        c.stroke();
      });
      c.restore();
    });
  }

  function showValues() {
    if (!state.pointer) return (readout.textContent = "Value under the pointer: –");
    const [u, v] = state.pointer;
    const parts = [`x = ${digits(u * length)} ${data.unit}, y = ${digits(v * height)} ${data.unit}`];
    data.layers.forEach((layer, i) => {
      const values = ["gap", "stress"].filter(q => map(i, q)).map(q => `${data[q].label} ${digits(at(map(i, q), u, v), 3)} ${data[q].unit}`);
      const contact = map(i, "contact");
      if (contact) values.unshift(at(contact, u, v) ? "contact" : "no contact");
      parts.push(`${data.layers.length > 1 ? `${layer.title}: ` : ""}${values.join(", ")}`);
    });
    readout.textContent = parts.join(" · ");
  }

  async function draw() {
    await fetchLoad();
    shown.textContent = data.loads[state.load];
    load.setAttribute("aria-valuetext", data.loads[state.load]);
    position.textContent = `${digits(state.section * height, 3)} ${data.unit}`;
    section.value = state.section;
    views.forEach(paint);
    paintProfile();
    showValues();
    root.dataset.drawn = `${state.load} ${state.quantity} ${state.size} ${state.section}`;
  }

  function zoom(factor, [u, v] = [state.u + state.size / 2, state.v + state.size / 2]) {
    const size = clamp(state.size * factor, 1 / 64, 1);
    state.u = clamp(u - ((u - state.u) * size) / state.size, 0, 1 - size);
    state.v = clamp(v - ((v - state.v) * size) / state.size, 0, 1 - size);
    state.size = size;
    draw();
  }
  const pan = (du, dv) => {
    state.u = clamp(state.u + du, 0, 1 - state.size);
    state.v = clamp(state.v + dv, 0, 1 - state.size);
    draw();
  };

  const followers = [];
  function select(n) {
    state.load = n;
    load.value = n;
    draw();
    followers.forEach(follow => follow());
  }
  load.addEventListener("input", () => select(Number(load.value)));
  section.addEventListener("input", () => ((state.section = Number(section.value)), draw()));
  for (const view of views) {
    const { canvas } = view;
    const place = e => {
      const box = canvas.getBoundingClientRect();
      const [x, y] = [(e.clientX - box.left - LEFT) / view.inner[0], 1 - (e.clientY - box.top - TOP) / view.inner[1]];
      return x < 0 || x > 1 || y < 0 || y > 1 ? null : [state.u + x * state.size, state.v + y * state.size];
    };
    let drag = null;
    canvas.addEventListener("pointerdown", e => {
      const p = place(e);
      if (!p) return;
      drag = { from: p, line: Math.abs(p[1] - state.section) < 0.03 * state.size };
      canvas.setPointerCapture(e.pointerId);
    });
    canvas.addEventListener("pointermove", e => {
      const p = place(e);
      state.pointer = p;
      if (drag && p && drag.line) state.section = clamp(p[1], 0, 1);
      if (drag && p && !drag.line) return pan(drag.from[0] - p[0], drag.from[1] - p[1]);
      canvas.style.cursor = p && Math.abs(p[1] - state.section) < 0.03 * state.size ? "ns-resize" : "crosshair";
      draw();
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (drag = null));
    canvas.addEventListener("pointerleave", () => ((state.pointer = null), draw()));
    canvas.addEventListener("wheel", e => {
      const p = place(e);
      if (!p) return;
      e.preventDefault();
      zoom(e.deltaY < 0 ? 0.8 : 1.25, p);
    }, { passive: false });
    canvas.addEventListener("keydown", e => {
      const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      const by = 0.02 * state.size;
      if (moves[e.key]) {
        const [du, dv] = moves[e.key].map(m => m * by);
        if (e.shiftKey) pan(5 * du, 5 * dv);
        else {
          const [u, v] = state.pointer ?? [state.u + state.size / 2, state.v + state.size / 2];
          state.pointer = [clamp(u + du, 0, 1), clamp(v + dv, 0, 1)];
          draw();
        }
      } else if (e.key === "+" || e.key === "=") zoom(0.8, state.pointer ?? undefined);
      else if (e.key === "-") zoom(1.25, state.pointer ?? undefined);
      else if (e.key === "0") zoom(1e9);
      else if (e.key === "PageUp" || e.key === "PageDown") {
        state.section = clamp(state.section + (e.key === "PageUp" ? by : -by), 0, 1);
        draw();
      } else return;
      e.preventDefault();
    });
  }
  for (const change of ["resize", "theme"]) window.addEventListener(change, draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  // For other views of the same load: contact of a layer, load, change of the load.
  const contact = async layer => (await fetchLoad(), map(layer, "contact"));
  return draw().then(() => ({ loads: data.loads, layers: data.layers, load: () => state.load, select, contact, follow: f => followers.push(f) }));
}

const stored = document.getElementById("maps");
const explored =
  stored && "DecompressionStream" in window
    ? explore(document.getElementById("explorer"), JSON.parse(stored.textContent))
    : Promise.resolve(null);
