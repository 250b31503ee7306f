// Curves: values under the pointer, click or Enter on the legend hides a curve, arrows on the legend step through its
// points. The page: dark mode, date of printing. Uses `node`, `digits` and `clamp` of maps.js.
{
  const tip = node("div", { class: "tip", role: "status", hidden: "" });
  document.body.append(tip);
  const say = (text, x, y) => {
    tip.textContent = text;
    tip.hidden = false;
    tip.style.left = `${clamp(x + 14, 4, innerWidth - tip.offsetWidth - 4)}px`;
    tip.style.top = `${clamp(y - 34, 4, innerHeight - tip.offsetHeight - 4)}px`;
  };
  const hush = () => (tip.hidden = true);
  addEventListener("scroll", hush, { passive: true });

  for (const plot of document.querySelectorAll("svg.plot")) {
    const axis = text => {
      const [kind, ...numbers] = text.split(" ");
      const [low, high, from, to] = numbers.map(Number);
      return at => {
        const v = low + ((at - from) / (to - from)) * (high - low);
        return kind === "log" ? 10 ** v : v;
      };
    };
    const [x, y] = [axis(plot.dataset.x), axis(plot.dataset.y)];
    const [xLabel, yLabel] = plot.dataset.labels.split("|");
    // Points of a curve in drawing units, from its line or else its markers.
    const points = group => {
      const lines = group.querySelectorAll("path.line");
      const drawn = lines.length ? [lines[0]] : group.querySelectorAll("path.mark");
      return [...drawn].flatMap(path => {
        if (path.classList.contains("line"))
          return [...path.getAttribute("d").matchAll(/[ML](-?[\d.]+) (-?[\d.]+)/g)].map(m => [Number(m[1]), Number(m[2])]);
        const box = path.getBBox();
        return [[box.x + box.width / 2, box.y + box.height / 2]];
      });
    };
    const curves = [...plot.querySelectorAll("g.curve")].map(group => ({ group, label: group.dataset.label, points: points(group) }));
    const describe = (curve, [px, py]) =>
      `${curve.label ? `${curve.label}: ` : ""}${xLabel} ${digits(x(px), 3)}, ${yLabel} ${digits(y(py), 3)}`;
    const screen = ([px, py]) => {
      const p = new DOMPoint(px, py).matrixTransform(plot.getScreenCTM());
      return [p.x, p.y];
    };
    plot.addEventListener("pointermove", e => {
      let best = { distance: 22 };
      for (const curve of curves.filter(c => !c.group.classList.contains("off")))
        for (const point of curve.points) {
          const [sx, sy] = screen(point);
          const distance = Math.hypot(sx - e.clientX, sy - e.clientY);
          if (distance < best.distance) best = { distance, curve, point, at: [sx, sy] };
        }
      best.curve ? say(describe(best.curve, best.point), ...best.at) : hush();
    });
    plot.addEventListener("pointerleave", hush);
    const keys = [...plot.querySelectorAll("g.key")];
    if (keys.length) plot.setAttribute("role", "group");
    for (const key of keys) {
      const curve = curves[Number(key.dataset.curve)];
      key.setAttribute("tabindex", "0");
      key.setAttribute("role", "button");
      key.setAttribute("aria-pressed", "true");
      key.setAttribute("aria-label", `show ${curve.label}`);
      let at = -1;
      const toggle = () => {
        const off = curve.group.classList.toggle("off");
        key.classList.toggle("off", off);
        key.setAttribute("aria-pressed", String(!off));
      };
      key.addEventListener("click", toggle);
      key.addEventListener("blur", hush);
      key.addEventListener("keydown", e => {
        if (e.key === "Enter" || e.key === " ") toggle();
        else if (e.key === "ArrowRight" || e.key === "ArrowLeft") {
          at = clamp(at + (e.key === "ArrowRight" ? 1 : -1), 0, curve.points.length - 1);
          say(describe(curve, curve.points[at]), ...screen(curve.points[at]));
        } else if (e.key === "Escape") hush();
        else return;
        e.preventDefault();
      });
    }
  }

  const dark = () => {
    const forced = document.documentElement.style.colorScheme;
    return forced ? forced === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  };
  const button = node("button", { type: "button", class: "theme" });
  const name = () => (button.textContent = dark() ? "Light" : "Dark");
  button.addEventListener("click", () => {
    document.documentElement.style.colorScheme = dark() ? "light" : "dark";
    name();
    dispatchEvent(new Event("theme"));
  });
  name();
  document.querySelector("header").append(button);

  const printed = node("style");
  document.head.append(printed);
  addEventListener("beforeprint", () => {
    printed.textContent = `@page { @bottom-left { content: "printed ${new Date().toISOString().slice(0, 10)}"; } }`;
  });
}
