
// Plots are drawn when they come into view, and again for paper and when the colours change.
const plots = [];
const kFont = 'px system-ui, "Segoe UI", Roboto, Arial, "DejaVu Sans", sans-serif';
const kPaperWidth = 690;  // of A4 between the margins, in CSS pixels
const kPaperScale = 2;    // drawn larger than it is shown, so that print is sharp

function colour(name) { return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim(); }
function faded(name) { const c = colour(name); return c.startsWith("#") ? c + "33" : c; }

// A line's sign in the key: {name, colour, dash, kind: line|band|point}.
function keyItem(item) {
  const ns = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(ns, "svg");
  const set = (e, attributes) => { for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v); return e; };
  set(svg, { width: 26, height: 12, "aria-hidden": "true" });
  const kind = item.kind || "line";
  const mark = document.createElementNS(ns, kind === "line" ? "line" : kind === "band" ? "rect" : "circle");
  const stroke = `var(--${item.colour})`;
  if (kind === "line") set(mark, { x1: 0, y1: 6, x2: 26, y2: 6, "stroke-width": 2.2, "stroke-dasharray": (item.dash || []).join(" ") });
  else if (kind === "band") set(mark, { x: 0, y: 1, width: 26, height: 10, "fill-opacity": item.opacity || 1 });
  else set(mark, { cx: 13, cy: 6, r: 3.2 });
  mark.style[kind === "line" ? "stroke" : "fill"] = stroke;
  svg.append(mark);
  return el("li", {}, svg, item.name);
}

// A figure whose plot `make(k)` gives as {data, options}; sizes in it are times k. `half`: two are side by side on
// paper.
function figure({ title, label, caption, key, height, half, make }) {
  const readout = el("div", { class: "readout", "aria-hidden": "true" });
  const holder = el("div", { class: "plot", role: "img", "aria-label": label });
  const element = el("figure", {},
    el("div", { class: "figure-head" }, title ? el("h4", {}, title) : el("span", {}), readout),
    key ? el("ul", { class: "key", "aria-label": "Lines of the plot" }, key.map(keyItem)) : null,
    holder,
    caption ? el("figcaption", {}, caption) : null);
  holder.style.minHeight = height + "px";
  const plot = { holder, readout, height, half, make, instance: null };
  plots.push(plot);
  kSeen.observe(holder);
  return element;
}

function build(plot, paper) {
  const k = paper ? kPaperScale : 1;
  const shown = paper ? (plot.half ? kPaperWidth / 2 - 12 : kPaperWidth) : plot.holder.clientWidth;
  if (!(shown > 0)) return;
  if (plot.instance) plot.instance.destroy();
  const { data, options } = plot.make(k, plot);
  plot.instance = new uPlot({ width: shown * k, height: plot.height * k, legend: { show: false }, ...options }, data, plot.holder);
  plot.holder.classList.toggle("paper", paper);
  plot.holder.style.setProperty("--ratio", `${shown} / ${plot.height}`);
}

const kSized = new ResizeObserver((entries) => {
  for (const { target } of entries) {
    const plot = plots.find((p) => p.holder === target);
    if (plot.instance && target.clientWidth > 0 && !document.documentElement.classList.contains("printing") &&
        Math.abs(plot.instance.width - target.clientWidth) > 1)
      plot.instance.setSize({ width: target.clientWidth, height: plot.height });
  }
});
const kSeen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const plot = plots.find((p) => p.holder === target);
    if (!isIntersecting || plot.instance) continue;
    build(plot, false);
    kSized.observe(target);
  }
}, { rootMargin: "400px" });

window.addEventListener("beforeprint", () => {
  document.documentElement.classList.add("printing");
  for (const plot of plots) if (plot.holder.clientWidth > 0) build(plot, true);
});
window.addEventListener("afterprint", () => {
  document.documentElement.classList.remove("printing");
  for (const plot of plots) if (plot.instance) build(plot, false);
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const plot of plots) if (plot.instance) build(plot, false);
});

function axis(label, k, side) {
  const y = side === 3;
  return {
    side, scale: y ? "y" : "x", label, stroke: colour("soft"), font: 11 * k + kFont, labelFont: 12 * k + kFont,
    labelSize: 18 * k, labelGap: 0, gap: 4 * k, size: (y ? 58 : 26) * k, space: (y ? 24 : 60) * k,
    grid: { stroke: colour("grid"), width: k }, ticks: { stroke: colour("grid"), width: k, size: 4 * k },
    values: (u, splits) => splits.map((v) => (v === null ? "" : number(v, 6))),
  };
}
function axes(xLabel, yLabel, k, ofX = {}) { return [{ ...axis(xLabel, k, 2), ...ofX }, axis(yLabel, k, 3)]; }

function line(name, k, { dash, width = 1.6, points = false, path = true } = {}) {
  const stroke = colour(name);
  return {
    stroke, width: width * k, dash: dash ? dash.map((d) => d * k) : undefined, spanGaps: false,
    points: points ? { show: true, size: 6 * k, fill: stroke, stroke, width: 0 } : { show: false },
    ...(path ? {} : { paths: () => null }),
  };
}
const kHidden = { show: true, stroke: "transparent", width: 0, points: { show: false } };

// Fills the plot between two heights, behind all lines.
function bandHook(low, high, name) {
  return (u) => {
    const top = u.valToPos(high, "y", true), bottom = u.valToPos(low, "y", true);
    const { left, width, top: t, height } = u.bbox;
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(left, t, width, height);
    u.ctx.clip();
    u.ctx.fillStyle = colour(name);
    u.ctx.fillRect(left, top, width, bottom - top);
    u.ctx.restore();
  };
}
// A fine line where y is zero.
function zeroHook(k) {
  return (u) => {
    const y = Math.round(u.valToPos(0, "y", true));
    if (y < u.bbox.top || y > u.bbox.top + u.bbox.height) return;
    u.ctx.save();
    u.ctx.fillStyle = colour("soft");
    u.ctx.fillRect(u.bbox.left, y, u.bbox.width, k);
    u.ctx.restore();
  };
}

// Plots over time that zoom and move together.
class Linked {
  constructor() { this.plots = new Set(); this.busy = false; this.range = null; }
  hook() {
    return {
      ready: [(u) => { this.plots.add(u); if (this.range) u.setScale("x", this.range); }],
      destroy: [(u) => this.plots.delete(u)],
      setScale: [(u, scale) => {
        if (scale !== "x" || this.busy || u.scales.x.min === null || !this.plots.has(u)) return;
        this.show({ min: u.scales.x.min, max: u.scales.x.max }, u);
      }],
    };
  }
  show(range, from) {
    this.busy = true;
    this.range = range;
    for (const u of this.plots) if (u !== from) u.setScale("x", range);
    // Scales move a moment later.
    queueMicrotask(() => { this.busy = false; });
  }
  // Shows a share of what is shown now, moved by another share of it.
  move(factor, by) {
    const u = this.plots.values().next().value;
    if (!u) return;
    const { min, max } = this.range ?? u.scales.x, x = u.data[0], first = x[0], last = x[x.length - 1];
    const width = Math.min((max - min) * factor, last - first);
    const start = Math.min(Math.max((min + max) / 2 + by * (max - min) - width / 2, first), last - width);
    this.show({ min: start, max: start + width }, null);
  }
  tools() {
    const button = (text, name, act) => { const b = el("button", { type: "button", "aria-label": name }, text); b.addEventListener("click", act); return b; };
    return el("div", { class: "tools" },
      button("+", "Zoom in", () => this.move(0.5, 0)), button("−", "Zoom out", () => this.move(2, 0)),
      button("←", "Earlier", () => this.move(1, -0.4)), button("→", "Later", () => this.move(1, 0.4)),
      button("all", "Show the whole record", () => this.move(1e9, 0)),
      "drag to zoom, Shift and drag to move, double click for all; the plots move together");
  }
}

// Shift and drag moves, without uPlot's own selection.
function movable(u, target, handler) {
  return (e) => {
    if (e.button !== 0 || e.target !== target) return null;
    if (!e.shiftKey) return handler(e);
    const { min, max } = u.scales.x, start = e.clientX, per = (max - min) / u.over.clientWidth;
    const move = (m) => u.setScale("x", { min: min - (m.clientX - start) * per, max: max - (m.clientX - start) * per });
    const stop = () => { removeEventListener("mousemove", move); removeEventListener("mouseup", stop); };
    addEventListener("mousemove", move);
    addEventListener("mouseup", stop);
    return null;
  };
}

// Values under the cursor, as text.
function readoutHook(plot, names, unit, xName, xUnit) {
  return (u) => {
    const k = u.cursor.idx;
    plot.readout.textContent = k === null || k === undefined ? "" :
      [`${xName} ${withUnit(u.data[0][k], xUnit, 5)}`]
        .concat(names.flatMap((name, s) => (name && u.data[s + 1][k] !== null && u.data[s + 1][k] !== undefined ? [`${name} ${withUnit(u.data[s + 1][k], unit)}`] : [])))
        .join("   ");
  };
}
