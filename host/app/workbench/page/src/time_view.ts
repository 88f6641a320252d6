// One experiment over time: measured and model above, the error with its noise band below, zoom and pan linked.
import uPlot from "uplot";
import { get, unpack, type Packed } from "./api";
import { el, startOfTimes, timeLabel, unit, withUnit, words } from "./dom";
import { axes, colour, Figure, line, shade } from "./plots";

interface Answer { from_s: number; to_s: number; whole: boolean; time: Packed; measured: Packed; model: Packed; residual: Packed; unit: string; noise_floor: number | null }
interface Curve { time: (number | null)[]; measured: (number | null)[]; residual: (number | null)[] }
interface Chunk { from: number; to: number; whole: boolean; data: (number | null)[][]; unit: string; floor: number | null; before: (number | null)[] | null; overlay: Curve | null }
// `overlay`: another experiment, drawn from its own beginning on.
export interface Shown { experiment: string; signal: string; begin: number; end: number; stretches: [number, number][]; before: number | null; overlay: { experiment: string; begin: number; end: number } | null }

export class TimeView {
  private readonly head = el("div", { class: "readout" });
  private readonly problem = el("p", { class: "empty", hidden: true });
  private readonly upper = new Figure(el("div", { class: "plot", role: "img" }));
  private readonly lower = new Figure(el("div", { class: "plot", role: "img" }));
  readonly element = el("div", { class: "time", tabindex: 0, "data-key": "time", role: "group", "aria-label": "Signals over time. Arrow keys pan, plus and minus zoom, 0 shows all." },
    this.head, this.problem, this.upper.holder, this.lower.holder);
  private shown: Shown | null = null;
  private key = "";
  // Times here are after this one: it is subtracted from what the server has.
  private start = 0;
  private from = 0;
  private to = 1;
  private chunk: Chunk | null = null;
  private overview: Chunk | null = null;
  private asking: AbortController | null = null;
  private frame = 0;

  constructor() {
    this.element.addEventListener("keydown", (e) => this.pressed(e));
    for (const holder of [this.upper.holder, this.lower.holder]) {
      holder.addEventListener("wheel", (e) => this.wheeled(e), { passive: false });
      holder.addEventListener("pointerdown", (e) => this.dragged(e));
      holder.addEventListener("dblclick", () => this.showRange(this.shown?.begin ?? 0, this.shown?.end ?? 1));
    }
  }

  // `key` tells whether curves must be fetched again.
  show(asked: Shown, key: string): void {
    const start = (this.start = startOfTimes(asked.begin));
    const shown: Shown = { ...asked, begin: asked.begin - start, end: asked.end - start, stretches: asked.stretches.map(([from, to]) => [from - start, to - start]) };
    const same = this.shown?.experiment === shown.experiment && this.shown.begin === shown.begin && this.shown.end === shown.end;
    this.shown = shown;
    if (!same) [this.from, this.to] = [shown.begin, shown.end];
    if (key === this.key) return this.paint();
    this.key = key;
    this.chunk = this.overview = null;
    void this.fetch(true);
  }

  private columns(): number { return Math.max(300, this.upper.holder.clientWidth); }

  private async fetch(overview: boolean): Promise<void> {
    const shown = this.shown;
    if (!shown || (this.asking && !overview)) return;
    this.asking?.abort();
    const abort = (this.asking = new AbortController());
    const key = this.key;
    const span = this.to - this.from;
    const from = overview ? shown.begin : Math.max(shown.begin, this.from - span), to = overview ? shown.end : Math.min(shown.end, this.to + span);
    const start = this.start, query = { experiment: shown.experiment, signal: shown.signal, from: from + start, to: to + start, points: 2 * this.columns() * (overview ? 1 : 3) };
    try {
      const now = get<Answer>("trace", query, abort.signal);
      const before = shown.before === null ? null : get<Answer>("trace", { ...query, step: shown.before }, abort.signal).catch(() => null);
      const o = shown.overlay, shift = o ? o.begin - shown.begin : start;
      const over = o && from + shift < o.end ? get<Answer>("trace", { ...query, experiment: o.experiment, from: from + shift, to: Math.min(o.end, to + shift) }, abort.signal).catch(() => null) : null;
      const answer = await now, old = await before, other = await over;
      if (key !== this.key) return;
      const time = after(start, unpack(answer.time));
      const residual = old ? unpack(old.residual) : null;
      const chunk: Chunk = { from, to, whole: answer.whole, unit: answer.unit, floor: answer.noise_floor, data: [time, unpack(answer.measured), unpack(answer.model), unpack(answer.residual)],
        before: residual && residual.length === time.length ? residual : null,
        overlay: other ? { time: after(shift, unpack(other.time)), measured: unpack(other.measured), residual: unpack(other.residual) } : null };
      if (overview) this.overview = chunk;
      this.chunk = chunk;
      this.problem.hidden = true;
      this.build();
    } catch (error) {
      if (abort.signal.aborted) return;
      this.problem.textContent = (error as Error).message;
      this.problem.hidden = false;
      this.chunk = this.overview = null;
      this.build();
    } finally {
      if (this.asking === abort) this.asking = null;
    }
    this.wantMore();
  }

  // Finer curves where the present ones are too coarse or end within the view.
  private wantMore(): void {
    const c = this.chunk, shown = this.shown;
    if (!c || !shown) return;
    const span = this.to - this.from;
    const covers = c.from <= this.from + 1e-9 && c.to >= this.to - 1e-9;
    const fine = c.whole || c.to - c.from <= 3.2 * span || span > 0.9 * (shown.end - shown.begin);
    if (!covers && this.overview) { this.chunk = this.overview; this.build(); }
    if (!covers || !fine) void this.fetch(false);
  }

  showRange(from: number, to: number): void {
    const shown = this.shown;
    if (!shown) return;
    const whole = shown.end - shown.begin;
    const span = Math.min(whole, Math.max(to - from, 1e-5 * whole, 0.005));
    const begin = Math.min(Math.max(shown.begin, from), shown.end - span);
    [this.from, this.to] = [begin, begin + span];
    this.element.dataset.from = this.from.toFixed(4);
    this.element.dataset.to = this.to.toFixed(4);
    if (!this.frame) this.frame = requestAnimationFrame(() => { this.frame = 0; this.paint(); this.wantMore(); });
  }

  private paint(): void {
    for (const figure of [this.upper, this.lower]) figure.plot?.setScale("x", { min: this.from, max: this.to });
  }

  private build(): void {
    const c = this.chunk, shown = this.shown;
    if (!c || !shown) {
      this.upper.show(() => null);
      this.lower.show(() => null);
      return;
    }
    const options = (x: string, y: string, series: uPlot.Series[], under: (u: uPlot) => void): Partial<uPlot.Options> => ({
      scales: { x: { time: false, range: () => [this.from, this.to] } },
      axes: axes(x, y),
      series: [{ label: timeLabel(this.start) }, ...series],
      cursor: { sync: { key: "time" }, drag: { x: true, y: false, setScale: false }, points: { show: false }, y: false },
      hooks: {
        drawClear: [(u) => { for (const [from, to] of shown.stretches) shade(u, colour("brush"), from, to, "x"); under(u); }],
        setSelect: [(u) => {
          if (u.select.width < 4) return;
          const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
          this.showRange(from, to);
        }],
        setCursor: [(u) => this.read(u)],
      },
    });
    const [time, measured, model, residual] = c.data as [number[], number[], number[], number[]];
    this.upper.holder.setAttribute("aria-label", `${words(shown.signal)} of ${shown.experiment}: measured and model over time`);
    this.lower.holder.setAttribute("aria-label", `Error of ${words(shown.signal)} of ${shown.experiment} over time${c.floor ? `, noise ${withUnit(c.floor, c.unit)}` : ""}`);
    // Two experiments have times of their own: what one of them lacks there is no gap.
    const with_ = (own: (number | null)[][], other: (number | null)[] | undefined) =>
      c.overlay && other ? uPlot.join([own as uPlot.AlignedData, [c.overlay.time, other] as uPlot.AlignedData]) : (own as uPlot.AlignedData);
    const name = shown.overlay?.experiment ?? "";
    const overlaid = c.overlay ? [line("overlay", { label: name, dash: [10, 3, 2, 3] })] : [];
    this.upper.show(() => ({ data: with_([time, measured, model], c.overlay?.measured), options: options("", unit(c.unit), [line("measured"), line("model", { dash: [7, 4] }), ...overlaid], () => undefined) }));
    this.lower.show(() => ({
      data: with_(c.before ? [time, residual, c.before] : [time, residual], c.overlay?.residual),
      options: options(timeLabel(this.start), `error (${unit(c.unit)})`, [line("residual"), ...(c.before ? [line("before", { dash: [2, 3], alpha: 0.8 })] : []), ...overlaid],
        (u) => { if (c.floor) shade(u, colour("noise"), -2 * c.floor, 2 * c.floor, "y"); }),
    }));
    this.element.dataset.drawn = `${shown.experiment} ${shown.signal}`;
    this.element.dataset.overlay = c.overlay ? name : "";
  }

  private read(u: uPlot): void {
    const c = this.chunk, at_ = u.cursor.idx;
    if (!c || at_ === null || at_ === undefined || (u.cursor.left ?? -1) < 0) { this.head.textContent = ""; return; }
    const k = c.overlay ? nearest(c.data[0] as number[], Number(u.data[0][at_])) : at_;
    const at = (i: number) => withUnit(c.data[i]?.[k], c.unit, 3);
    this.head.textContent = `${withUnit(c.data[0]?.[k], "s")} · measured ${at(1)} · model ${at(2)} · error ${at(3)}`;
  }

  private wheeled(e: WheelEvent): void {
    e.preventDefault();
    const plot = this.upper.plot;
    if (!plot) return;
    const span = this.to - this.from;
    if (e.shiftKey || Math.abs(e.deltaX) > Math.abs(e.deltaY)) {
      const by = ((e.deltaX || e.deltaY) / 600) * span;
      return this.showRange(this.from + by, this.to + by);
    }
    const box = plot.over.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (e.clientX - box.left) / box.width)), factor = Math.exp(e.deltaY / 400);
    const centre = this.from + share * span;
    this.showRange(centre - share * span * factor, centre + (1 - share) * span * factor);
  }

  // With shift, or the middle button: pan. Else uPlot selects what to zoom into.
  private dragged(e: PointerEvent): void {
    if (!(e.shiftKey || e.button === 1) || !this.upper.plot) return;
    e.preventDefault();
    e.stopPropagation();
    const from = this.from, span = this.to - this.from, width = this.upper.plot.over.clientWidth, start = e.clientX;
    const move = (m: PointerEvent) => { const by = ((start - m.clientX) / width) * span; this.showRange(from + by, from + by + span); };
    const end = () => { removeEventListener("pointermove", move); removeEventListener("pointerup", end); };
    addEventListener("pointermove", move);
    addEventListener("pointerup", end);
  }

  private pressed(e: KeyboardEvent): void {
    const span = this.to - this.from, step = 0.15 * span;
    const keys: Record<string, () => void> = {
      ArrowLeft: () => this.showRange(this.from - step, this.to - step), ArrowRight: () => this.showRange(this.from + step, this.to + step),
      "+": () => this.showRange(this.from + 0.2 * span, this.to - 0.2 * span), "-": () => this.showRange(this.from - 0.35 * span, this.to + 0.35 * span),
      "0": () => this.showRange(this.shown?.begin ?? 0, this.shown?.end ?? 1),
    };
    const act = keys[e.key === "=" ? "+" : e.key];
    if (!act || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    act();
  }
}

function after(start: number, times: (number | null)[]): (number | null)[] {
  return start === 0 ? times : times.map((t) => (t === null ? null : t - start));
}

// Index of the time that is nearest, of times in order.
function nearest(times: number[], t: number): number {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? 0) < t) low = middle + 1; else high = middle;
  }
  return low > 0 && Math.abs((times[low - 1] ?? 0) - t) < Math.abs((times[low] ?? 0) - t) ? low - 1 : low;
}
