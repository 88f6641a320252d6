// A plot as it is drawn now, as a file: picture, vectors or numbers.
import type uPlot from "uplot";
import { button, el, saveAs } from "./dom";
import { colour, drawnFigures, type Figure } from "./plots";

type Numbers = ArrayLike<number | null | undefined>;
interface Curve { name: string; x: Numbers; y: Numbers; stroke: string; width: number; dash: number[] }

function hasOwnTimes(u: uPlot): boolean {
  return (u as unknown as { mode?: number }).mode === 2;
}

// Curves that share their times, or have their own (uPlot's mode 2).
function curves(u: uPlot): Curve[] {
  const own = hasOwnTimes(u);
  const data = u.data as unknown as (Numbers | [Numbers, Numbers] | null)[];
  return u.series.slice(1).flatMap((series, i): Curve[] => {
    const entry = data[i + 1];
    if (!entry || !series.show) return [];
    const [x, y] = own ? (entry as [Numbers, Numbers]) : [data[0] as Numbers, entry as Numbers];
    const stroke = typeof series.stroke === "function" ? (series.stroke as (u: uPlot, i: number) => unknown)(u, i + 1) : series.stroke;
    return [{ name: String(series.label ?? `curve ${i + 1}`), x, y, stroke: String(stroke ?? "none"), width: series.width ?? 1, dash: series.dash ?? [] }];
  });
}

function label(u: uPlot, axis: number): string {
  return String(u.axes[axis]?.label ?? "");
}

export function csvOf(u: uPlot): string {
  const all = curves(u).filter((c) => c.stroke !== "transparent");
  const quoted = (text: string) => `"${text.replace(/"/g, '""')}"`;
  const x = label(u, 0) || String(u.series[0]?.label ?? "x"), y = label(u, 1);
  const value = (v: number | null | undefined) => (v === null || v === undefined || !Number.isFinite(v) ? "" : String(v));
  if (!hasOwnTimes(u)) {
    const rows = [[x, ...all.map((c) => (y ? `${c.name}, ${y}` : c.name))].map(quoted).join(",")];
    for (let k = 0; k < (all[0]?.x.length ?? 0); ++k) rows.push([value(all[0]?.x[k]), ...all.map((c) => value(c.y[k]))].join(","));
    return rows.join("\n") + "\n";
  }
  const rows = [["curve", x, y || "y"].map(quoted).join(",")];
  for (const c of all) for (let k = 0; k < c.x.length; ++k) rows.push([quoted(c.name), value(c.x[k]), value(c.y[k])].join(","));
  return rows.join("\n") + "\n";
}

export function svgOf(u: uPlot): string {
  const ratio = devicePixelRatio, { left, top, width, height } = u.bbox;
  const [l, t, w, h] = [left, top, width, height].map((v) => v / ratio) as [number, number, number, number];
  const text = (s: string) => s.replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c] ?? c);
  const at = (v: number, scale: string) => (u.valToPos(v, scale, true) / ratio).toFixed(2);
  const parts: string[] = [];
  // uPlot stores its axis labels in fields that its type definitions do not have.
  const ticks = (axis: number) => u.axes[axis] as unknown as { _splits?: number[]; _values?: (string | null)[]; scale?: string };
  for (const axis of [0, 1]) {
    const { _splits = [], _values = [] } = ticks(axis), scale = u.axes[axis]?.scale ?? (axis === 0 ? "x" : "y");
    _splits.forEach((v, k) => {
      const p = at(v, scale);
      parts.push(axis === 0 ? `<path d="M${p} ${t}v${h}" stroke="${colour("grid")}"/><text x="${p}" y="${t + h + 14}" text-anchor="middle">${text(String(_values[k] ?? ""))}</text>`
        : `<path d="M${l} ${p}h${w}" stroke="${colour("grid")}"/><text x="${l - 5}" y="${Number(p) + 4}" text-anchor="end">${text(String(_values[k] ?? ""))}</text>`);
    });
  }
  parts.push(`<text x="${l + w / 2}" y="${u.height - 4}" text-anchor="middle">${text(label(u, 0))}</text>`,
    `<text transform="translate(12 ${t + h / 2}) rotate(-90)" text-anchor="middle">${text(label(u, 1))}</text>`);
  for (const [i, c] of curves(u).entries()) {
    const scale = u.series[i + 1]?.scale ?? "y";
    let path = "", pen = "M";
    for (let k = 0; k < c.x.length; ++k) {
      const x = c.x[k], y = c.y[k];
      if (x === null || x === undefined || y === null || y === undefined) { pen = "M"; continue; }
      path += `${pen}${at(x, "x")} ${at(y, scale)}`;
      pen = "L";
    }
    parts.push(`<path d="${path}" fill="none" stroke="${text(c.stroke)}" stroke-width="${c.width}" stroke-dasharray="${c.dash.join(" ")}" clip-path="url(#inside)"><title>${text(c.name)}</title></path>`);
  }
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${u.width}" height="${u.height}" font-family="sans-serif" font-size="11" fill="${colour("soft")}">`
    + `<rect width="100%" height="100%" fill="${colour("paper")}"/><clipPath id="inside"><rect x="${l}" y="${t}" width="${w}" height="${h}"/></clipPath>${parts.join("")}</svg>\n`;
}

function pngOf(u: uPlot): Promise<Blob | null> {
  const canvas = document.createElement("canvas");
  canvas.width = u.ctx.canvas.width;
  canvas.height = u.ctx.canvas.height;
  const c = canvas.getContext("2d");
  if (!c) return Promise.resolve(null);
  c.fillStyle = colour("paper");
  c.fillRect(0, 0, canvas.width, canvas.height);
  c.drawImage(u.ctx.canvas, 0, 0);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

async function save(figure: Figure, ending: "png" | "svg" | "csv"): Promise<void> {
  const u = figure.plot;
  if (!u) return;
  const blob = ending === "png" ? await pngOf(u) : new Blob([ending === "svg" ? svgOf(u) : csvOf(u)], { type: ending === "svg" ? "image/svg+xml" : "text/csv" });
  if (!blob) return;
  const name = (figure.holder.getAttribute("aria-label") ?? "plot").toLowerCase().replace(/[^a-z0-9.]+/g, "-").replace(/^-|-$/g, "").slice(0, 80);
  saveAs(blob, `${name}.${ending}`);
}

// All plots that are to be seen, each with the files that it may become.
export function offerPlots(): void {
  const dialog = el("dialog", { "aria-label": "Save a plot" });
  const rows = drawnFigures().map((figure) => el("div", { class: "row savable" }, el("span", { class: "grow" }, figure.holder.getAttribute("aria-label") ?? "plot"),
    (["png", "svg", "csv"] as const).map((ending) => button(ending.toUpperCase(), () => void save(figure, ending), { "data-save": ending }))));
  dialog.append(el("h2", {}, "Save a plot as it is drawn now"), ...(rows.length ? rows : [el("p", {}, "No plot is drawn.")]), button("Close", () => dialog.close()));
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}
