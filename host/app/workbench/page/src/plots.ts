// uPlot with the page's colours and sizes.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
export function rem(): number {
  return parseFloat(getComputedStyle(document.documentElement).fontSize);
}

export interface Drawn { data: uPlot.AlignedData; options: Partial<uPlot.Options> }

// A plot that fills its holder and is made again where size or colours change.
export class Figure {
  plot: uPlot | null = null;
  private make: (() => Drawn | null) | null = null;
  private dragged = false;
  private late = false;
  private text = 0;  // size of its letters, px

  constructor(readonly holder: HTMLElement) {
    new ResizeObserver(() => this.resized()).observe(holder);
    // A plot that is made again under the pointer would lose the region that is being marked.
    holder.addEventListener("mousedown", () => {
      this.dragged = true;
      document.addEventListener("mouseup", () => setTimeout(() => this.released()), { once: true, capture: true });
    }, { capture: true });
    all.add(this);
  }

  show(make: () => Drawn | null): void {
    this.make = make;
    this.redraw();
  }

  redraw(): void {
    if (this.dragged) {
      this.late = true;
      return;
    }
    this.plot?.destroy();
    this.plot = null;
    const width = this.holder.clientWidth, height = this.holder.clientHeight;
    if (!this.make || width < 40 || height < 30) return;
    const drawn = this.make();
    if (!drawn) return;
    this.text = rem();
    this.plot = new uPlot({ width, height, legend: { show: false }, ...drawn.options } as uPlot.Options, drawn.data, this.holder);
  }

  private released(): void {
    this.dragged = false;
    if (this.late) {
      this.late = false;
      this.redraw();
    } else {
      this.resized();
    }
  }

  private resized(): void {
    if (this.dragged) return;
    const width = this.holder.clientWidth, height = this.holder.clientHeight;
    if (this.plot && width >= 40 && height >= 30 && this.text === rem()) {
      if (this.plot.width !== width || this.plot.height !== height) this.plot.setSize({ width, height });
    } else this.redraw();
  }
}

const all = new Set<Figure>();
export function redrawAll(): void {
  // One that is not in the page now is made when it comes back.
  for (const figure of all) figure.redraw();
}

// Those that are to be seen.
export function drawnFigures(): Figure[] {
  return [...all].filter((figure) => figure.plot && figure.holder.isConnected && figure.holder.offsetParent !== null);
}

function short(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e5 || size < 1e-3 ? value.toExponential(1).replace(/\.0e/, "e").replace("e", "·10^").replace("+", "") : String(Number(value.toPrecision(4)));
  return text.replace(/-/g, "−").replace(/\^(−?\d+)/, (_, p: string) => p.replace(/[−\d]/g, (c) => (c === "−" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)] ?? c)));
}

export function axes(x: string, y: string, more: { x?: Partial<uPlot.Axis>; y?: Partial<uPlot.Axis> } = {}): uPlot.Axis[] {
  const size = rem();
  const font = `${0.72 * size}px system-ui, "DejaVu Sans", sans-serif`;
  const common = { stroke: colour("soft"), grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("line"), width: 1, size: 4 }, font, labelFont: font, labelGap: 0, gap: 3 };
  return [
    { ...common, label: x || undefined, labelSize: 1.05 * size, size: 1.5 * size, space: 4.2 * size, values: (_: uPlot, v: number[]) => v.map(short), ...more.x } as uPlot.Axis,
    { ...common, label: y || undefined, labelSize: 1.05 * size, size: 3.5 * size, space: 1.9 * size, values: (_: uPlot, v: number[]) => v.map(short), ...more.y } as uPlot.Axis,
  ];
}

export function line(name: string, more: Partial<uPlot.Series> = {}): uPlot.Series {
  return { label: name, stroke: colour(name), width: Math.max(1.2, rem() / 11), points: { show: false }, ...more };
}
export const kHidden: uPlot.Series = { width: 0, points: { show: false }, stroke: "transparent" };

// Fills [low, high] at all x, or intervals of x at all y, under the curves.
export function shade(u: uPlot, fill: string, from: number, to: number, along: "x" | "y"): void {
  const { left, top, width, height } = u.bbox;
  const a = u.valToPos(from, along, true), b = u.valToPos(to, along, true);
  u.ctx.save();
  u.ctx.fillStyle = fill;
  if (along === "x") {
    const begin = Math.max(left, a), end = Math.min(left + width, Math.max(b, a + 2 * devicePixelRatio));
    if (end > begin) u.ctx.fillRect(begin, top, end - begin, height);
  } else {
    const low = Math.min(top + height, a), high = Math.max(top, b);
    if (low > high) u.ctx.fillRect(left, high, width, low - high);
  }
  u.ctx.restore();
}

// Velocities and travels are distinguished near zero: the axis is stretched there.
export function stretchedScale(x: number[]): Partial<uPlot.Scale> {
  const sizes = x.map(Math.abs).filter((v) => v > 0);
  const largest = Math.max(...sizes), least = Math.min(...sizes);
  if (!(largest > 0)) return { time: false };
  return { time: false, distr: 4, asinh: Math.max(least, largest / 300), range: (_u, low, high) => [low, high] };
}
export function stretchedSplits(asinh: number, low: number, high: number): number[] {
  const splits = new Set([0]);
  for (let v = 10 ** Math.ceil(Math.log10(2 * asinh)); v <= Math.max(-low, high); v *= 10) {
    if (v <= high) splits.add(v);
    if (-v >= low) splits.add(-v);
  }
  return [...splits].sort((a, b) => a - b);
}
