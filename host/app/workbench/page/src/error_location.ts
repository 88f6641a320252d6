// 2. Where does it fail? The error over what it may depend on; a brushed region is shown in time.
import uPlot from "uplot";
import { get, unpack, type Experiment, type Packed, type State } from "./api";
import { announce, bar, button, el, fill, num, times, unit, withUnit, words } from "./dom";
import { axes, colour, Figure, kHidden, line, shade, stretchedScale, stretchedSplits } from "./plots";
import { badness, balanceInView, inNoise, stepKey, viewChanged, view, type Brush } from "./store";

interface Means { mean: (number | null)[]; standard_error: (number | null)[] }
interface Map1 {
  variable: string; unit: string; x: number[]; edges: number[]; noise: (number | null)[]; share_percent: number; share_with_direction_percent: number; plain: Means; with_direction: Means;
  orders: { amplitude: (number | null)[] } | null;
}
interface Loop { experiment: string; unit: string; torsion_unit: string; torsion: Packed; measured: Packed; model: Packed }
interface Maps { maps: { signal: string; unit: string; maps: Map1[] }[]; loops: Loop[] }

const kNames: Record<string, string> = { motor_angle: "motor angle (within a turn)", output_angle: "output angle", velocity: "velocity", speed: "speed", travel: "travel since reversal",
  torsion_rate: "torsion rate", time: "time", record: "record", orders: "orders of the motor's turn", loop: "hysteresis loop" };
// Map variables are named as on the axis: `axis` is the unit of the error, a force on a linear one.
const name = (variable: string, axis: string) => (axis === "N" && variable === "output_angle" ? "output position" : axis === "N" && variable === "torque" ? "force" : kNames[variable] ?? words(variable));
const share = (m: Map1) => Math.max(m.share_percent, m.share_with_direction_percent);
const kCrowded = ["velocity", "speed", "torsion_rate", "travel"];

export class ErrorLocation {
  private readonly list = el("div", { class: "side", role: "listbox", "aria-label": "What the error may depend on", "data-scroll": "variables" });
  private readonly head = el("div", { class: "row" });
  private readonly figure = new Figure(el("div", { class: "plot", role: "img", "aria-label": "Map of the error", tabindex: 0, "data-key": "map" }));
  private readonly records = el("div", { class: "records", "data-scroll": "records" });
  readonly element = el("section", { class: "panel where", "aria-labelledby": "q2" },
    el("h2", { id: "q2" }, el("b", {}, "2"), " Where does it fail?"),
    el("div", { class: "split" }, el("div", { class: "column" }, this.list), el("div", { class: "column grow" }, this.head, this.figure.holder, this.records)));
  private maps: Maps | null = null;
  private before: Maps | null = null;
  private key = "";
  private variable = "";
  private directed: boolean | null = null;
  private bin = -1;
  private state: State | null = null;
  private problem = "";
  private marks = 0;

  // `shown`: once the maps of a step are there, or cannot be.
  constructor(private readonly shown: () => void, private readonly complain: (error: Error) => void) {
    this.figure.holder.addEventListener("keydown", (e) => this.pressed(e));
    this.list.addEventListener("keydown", (e) => {
      const rows = Array.from(this.list.querySelectorAll<HTMLElement>("[role=option]"));
      const at = rows.indexOf(document.activeElement as HTMLElement);
      const row = rows[e.key === "ArrowDown" ? at + 1 : e.key === "ArrowUp" ? at - 1 : -1];
      if (!row) return;
      e.preventDefault();
      row.click();
      this.list.querySelector<HTMLElement>("[aria-selected=true]")?.focus();
    });
  }

  render(state: State): void {
    this.state = state;
    const key = stepKey(state);
    if (key !== this.key) {
      this.key = key;
      this.maps = this.before = null;
      this.problem = "";
      view.brush = null;
      void this.fetch(state, key);
    }
    this.draw();
  }

  get isShown(): boolean { return this.maps !== null || this.problem !== ""; }

  private async fetch(state: State, key: string): Promise<void> {
    try {
      const now = await get<Maps>("maps");
      if (key !== this.key) return;
      this.maps = now;
      this.draw();
      this.shown();
      if (state.at > 0) {
        const before = await get<Maps>("maps", { step: state.at - 1 });
        if (key !== this.key) return;
        this.before = before;
        this.draw();
      }
    } catch (error) {
      if (key !== this.key) return;
      this.problem = (error as Error).message;
      this.draw();
      this.shown();
    }
  }

  private draw(): void {
    const state = this.state;
    if (!state) return;
    const signal = balanceInView(state)?.signal ?? "";
    const of = this.maps?.maps.find((m) => m.signal === signal);
    if (!of) {
      fill(this.list);
      fill(this.head, el("p", { class: "empty" }, this.problem || (this.maps ? "These data have no map of this balance." : "Drawing the maps …")));
      this.figure.show(() => null);
      fill(this.records);
      return;
    }
    const angle = of.maps.find((m) => m.orders);
    const entries: [string, number | null][] = of.maps.map((m) => [m.variable, share(m)]);
    if (angle) entries.splice(entries.findIndex(([v]) => v === "motor_angle") + 1, 0, ["orders", null]);
    if (this.maps?.loops.length) entries.push(["loop", null]);
    entries.push(["record", null]);
    if (!entries.some(([v]) => v === this.variable)) this.variable = entries[0]?.[0] ?? "record";
    fill(this.list, entries.map(([v, percent]) => el("div", { role: "option", tabindex: v === this.variable ? 0 : -1, "aria-selected": v === this.variable ? "true" : "false", "data-key": `over ${v}`, "data-variable": v,
        click: () => { this.variable = v; this.directed = null; this.bin = -1; this.draw(); } },
      el("span", { class: "name" }, name(v, of.unit)), el("span", { class: "figure" }, percent === null ? "" : percent >= 0.5 ? `${num(percent, 2)} %` : "–"), percent === null ? null : bar(percent / 100, "bad"))));
    this.element.dataset.variable = this.variable;
    this.figure.holder.hidden = this.variable === "record";
    this.records.hidden = this.variable !== "record";
    if (this.variable === "record") return this.drawRecords(state, signal);
    if (this.variable === "orders" && angle) return this.drawOrders(angle, of.unit, this.before?.maps.find((m) => m.signal === signal)?.maps.find((m) => m.orders));
    if (this.variable === "loop") return this.drawLoop();
    const map = of.maps.find((m) => m.variable === this.variable);
    if (map) this.drawMap(map, of.unit, signal, this.before?.maps.find((m) => m.signal === signal)?.maps.find((m) => m.variable === this.variable));
  }

  private drawMap(map: Map1, ofUnit: string, signal: string, before?: Map1): void {
    const directed = this.directed ?? map.share_with_direction_percent > map.share_percent;
    const means = directed ? map.with_direction : map.plain;
    const toggle = (text: string, value: boolean) => button(text, () => { this.directed = value; this.draw(); }, { "aria-pressed": directed === value ? "true" : "false" });
    const brushed = view.brush?.variable === map.variable ? view.brush : null;
    fill(this.head, el("strong", {}, `Over ${name(map.variable, ofUnit)}`),
      el("span", { class: "soft clip" }, brushed ? `marked: ${num(brushed.low, 3)} to ${num(brushed.high, 3)} ${unit(map.unit)}` : share(map) >= 0.5 ? `${num(share(map), 2)} % of the squared error depends on it` : "the error does not depend on it"),
      brushed ? button("Clear", () => this.clear()) : null,
      el("span", { class: "choice" }, toggle("error", false), toggle("× direction", true)));
    const up = (m: Means, n: number) => m.mean.map((v, k) => { const s = m.standard_error[k]; return v === null || s === null || s === undefined ? null : v + n * s; });
    const noise = map.noise.map((v) => (v === null ? null : 2 * v));
    const old = before && before.x.length === map.x.length ? (directed ? before.with_direction : before.plain).mean : null;
    const scale: Partial<uPlot.Scale> = kCrowded.includes(map.variable) ? stretchedScale(map.x) : { time: false };
    const asinh = scale.distr === 4 ? scale.asinh ?? 1 : 0;
    this.figure.holder.setAttribute("aria-label", `Mean error over ${name(map.variable, ofUnit)} with its spread. Left and right mark a region, Escape clears it.`);
    this.figure.show(() => ({
      data: [map.x, noise, noise.map((v) => (v === null ? null : -v)), up(means, 2), up(means, -2), means.mean, ...(old ? [old] : [])] as uPlot.AlignedData,
      options: {
        scales: { x: scale as uPlot.Scale },
        axes: axes(`${name(map.variable, ofUnit)}${map.unit ? ` (${unit(map.unit)})` : ""}`, `error (${unit(ofUnit)})`,
          asinh ? { x: { splits: (_u, _a, low, high) => stretchedSplits(asinh, low, high), filter: (_u, splits) => splits } } : {}),
        series: [{}, kHidden, kHidden, kHidden, kHidden, line(directed ? "model" : "residual", { points: { show: true, size: 5 } }), ...(old ? [line("before", { dash: [4, 4] })] : [])],
        bands: [{ series: [1, 2], fill: colour("noise") }, { series: [3, 4], fill: colour(directed ? "modelband" : "residualband") }],
        cursor: { drag: { x: true, y: false, setScale: false }, points: { show: false }, y: false },
        hooks: {
          drawClear: [(u) => { if (brushed) shade(u, colour("brush"), brushed.low, brushed.high, "x"); shade(u, colour("line"), 0, 0, "y"); }],
          setSelect: [(u) => {
            if (u.select.width < 4) return;
            const low = u.posToVal(u.select.left, "x"), high = u.posToVal(u.select.left + u.select.width, "x");
            u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            void this.brush(map, signal, low, high);
          }],
        },
      },
    }));
  }

  private async brush(map: Map1, signal: string, low: number, high: number): Promise<void> {
    // A key that is held down marks one region after the other: the last one counts, whichever answer comes first.
    const mark = ++this.marks, key = this.key;
    let list: Brush["list"];
    try {
      list = await get<Brush["list"]>("stretches", { signal, variable: map.variable, low, high });
    } catch (error) {
      if (mark === this.marks && key === this.key) this.complain(error as Error);
      return;
    }
    if (mark !== this.marks || key !== this.key) return;
    view.brush = { variable: map.variable, low, high, unit: map.unit, list };
    view.signal = signal;
    const most = [...list].sort((a, b) => b.rows - a.rows)[0];
    if (most && !list.some((x) => x.experiment === view.experiment)) view.experiment = most.experiment;
    announce(`${list.reduce((sum, x) => sum + x.rows, 0)} samples of ${list.length} experiments marked`);
    viewChanged();
  }

  private clear(): void {
    ++this.marks;
    view.brush = null;
    this.bin = -1;
    viewChanged();
  }

  private pressed(e: KeyboardEvent): void {
    const state = this.state, signal = state ? balanceInView(state)?.signal ?? "" : "";
    const map = this.maps?.maps.find((m) => m.signal === signal)?.maps.find((m) => m.variable === this.variable);
    if (e.key === "Escape") this.clear();
    if (!map || (e.key !== "ArrowLeft" && e.key !== "ArrowRight")) return;
    e.preventDefault();
    const bins = map.edges.length - 1;
    this.bin = Math.min(bins - 1, Math.max(0, this.bin < 0 ? 0 : this.bin + (e.key === "ArrowRight" ? 1 : -1)));
    void this.brush(map, signal, map.edges[this.bin] ?? 0, map.edges[this.bin + 1] ?? 0);
  }

  private drawOrders(map: Map1, ofUnit: string, before?: Map1): void {
    const amplitude = map.orders?.amplitude ?? [];
    fill(this.head, el("strong", {}, "Waves a motor turn"), el("span", { class: "soft clip" }, "amplitude of each order in the error"));
    this.figure.holder.setAttribute("aria-label", "Amplitude of the error by order of the motor's turn");
    const bars = uPlot.paths.bars?.({ size: [0.6, 60] });
    this.figure.show(() => ({
      data: [amplitude.map((_, k) => k + 1), amplitude, ...(before?.orders ? [before.orders.amplitude] : [])] as uPlot.AlignedData,
      options: {
        scales: { x: { time: false, range: (_u, _low, high) => [0.3, high + 0.7] }, y: { range: (_u, _low, high) => [0, 1.1 * (high || 1)] } },
        axes: axes("order (per motor turn)", `amplitude (${unit(ofUnit)})`, { x: { values: (_u, v) => v.map((k) => (Number.isInteger(k) && k > 0 ? String(k) : "")) } }),
        series: [{}, { stroke: colour("residual"), fill: colour("residual"), width: 0, points: { show: false }, ...(bars ? { paths: bars } : {}) } as uPlot.Series, ...(before?.orders ? [line("before", { points: { show: true }, width: 0 })] : [])],
        cursor: { drag: { x: false, y: false }, y: false },
      },
    }));
  }

  private drawLoop(): void {
    const loop = this.maps?.loops.find((l) => l.experiment === view.experiment) ?? this.maps?.loops[0];
    if (!loop) return;
    const effort = loop.unit === "N" ? "force" : "torque";
    fill(this.head, el("strong", {}, `${effort === "force" ? "Force" : "Torque"} over torsion`), el("span", { class: "soft clip" }, loop.experiment), el("ul", { class: "key" }, el("li", { class: "measured" }, "measured"), el("li", { class: "model" }, "model")));
    this.figure.holder.setAttribute("aria-label", `Hysteresis loop of ${loop.experiment}`);
    const torsion = unpack(loop.torsion), measured = unpack(loop.measured), model = unpack(loop.model);
    this.figure.show(() => ({
      data: [null, [torsion, measured], [torsion, model]] as unknown as uPlot.AlignedData,
      options: {
        mode: 2, axes: axes(`torsion (${unit(loop.torsion_unit)})`, `${effort} (${unit(loop.unit)})`), scales: { x: { time: false }, y: {} },
        series: [{}, { ...line("measured"), facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }], paths: trace("measured") } as unknown as uPlot.Series,
          { ...line("model"), facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }], paths: trace("model", [7, 4]) } as unknown as uPlot.Series] as uPlot.Series[],
        cursor: { drag: { x: false, y: false }, points: { show: false } },
      },
    }));
  }

  private drawRecords(state: State, signal: string): void {
    const those = state.experiments.filter((e) => e.signals.some((s) => s.signal === signal)), byNoise = inNoise(those, signal);
    const of = (e: Experiment) => badness(e, signal, byNoise), unitOf = (e: Experiment) => e.signals.find((s) => s.signal === signal)?.unit ?? "";
    fill(this.head, el("strong", {}, "By record"), el("span", { class: "soft clip" }, byNoise ? "error over the noise" : "error"));
    const sorted = [...those].sort((a, b) => of(b) - of(a));
    const worst = Math.max(byNoise ? 1 : 0, ...sorted.map(of));
    fill(this.records, sorted.map((e) => el("div", { class: "record" }, el("span", { class: "name" }, e.name), bar(worst > 0 ? of(e) / worst : 0, byNoise && of(e) <= 1.3 ? "fine" : "bad"), el("span", { class: "figure" }, of(e) < 0 ? "–" : byNoise ? times(of(e)) : withUnit(of(e), unitOf(e), 3)))));
  }
}

// A curve whose x goes back and forth.
function trace(name: string, dash: number[] = []): (u: uPlot, series: number) => null {
  return (u, series) => {
    const [xs, ys] = u.data[series] as unknown as [(number | null)[], (number | null)[]];
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.clip();
    u.ctx.strokeStyle = colour(name);
    u.ctx.lineWidth = 1.4 * devicePixelRatio;
    u.ctx.setLineDash(dash.map((d) => d * devicePixelRatio));
    u.ctx.beginPath();
    let down = false;
    for (let k = 0; k < xs.length; ++k) {
      const x = xs[k], y = ys[k];
      if (x === null || y === null || x === undefined || y === undefined) { down = false; continue; }
      const px = u.valToPos(x, "x", true), py = u.valToPos(y, "y", true);
      if (down) u.ctx.lineTo(px, py); else u.ctx.moveTo(px, py);
      down = true;
    }
    u.ctx.stroke();
    u.ctx.restore();
    return null;
  };
}
