// The residual map of the drive: measured less modelled torque of the motor, or force of a linear axis, over velocity and motor angle.
import { get, type State } from "./api";
import { button, el, fill, num, unit, withUnit } from "./dom";

interface Row { velocity_rad_s: [number | null, number | null]; ticks: number[]; mean_nm: (number | null)[] }
interface Finding { order: number | null; velocity_rad_s: [number | null, number | null]; size_nm: number; std_nm: number; p_value: number }
interface DriveMap { problem?: string; unit: string; velocity_unit: string; model: string; started: boolean; seconds: number; angle_bins: number; rows: Row[]; verdict: string; limit_nm: number; judged_velocities: number; findings: Finding[] }

function range([low, high]: [number | null, number | null]): string {
  return low === null ? `below ${num(high, 2)}` : high === null ? `above ${num(low, 2)}` : `${num(low, 2)} to ${num(high, 2)}`;
}

function inWords(f: Finding, m: DriveMap): string {
  const size = withUnit(f.size_nm, m.unit, 3);
  const what = f.order === null ? `a ${m.unit === "N" ? "force" : "torque"} of ${size} at ${range(f.velocity_rad_s)} ${m.velocity_unit}` : `order ${f.order} of the motor's turn, ${size}`;
  return `${what} (± ${num(f.std_nm, 2)}; by chance ${f.p_value < 1e-12 ? "below 10⁻¹²" : num(f.p_value, 1)})`;
}

export class MapPanel {
  private readonly head = el("div", { class: "maphead", "data-scroll": "map", tabindex: 0, role: "region", "aria-label": "The drive's residual map" });
  private readonly grid = el("div", { class: "map", role: "img" });
  readonly actions = el("span", { class: "choice" });
  readonly element = el("div", { class: "column grow mappart" }, this.head, this.grid);
  visible = false;
  private map: DriveMap | null = null;
  private timer = 0;
  private asking = false;
  private update = () => undefined as void;

  constructor(private readonly run: (what: string, more?: Record<string, unknown>) => void) {}

  // `simulated`: the workbench moves no other drive.
  render(state: State, simulated: boolean, drive: string): void {
    this.update = () => this.renderHead(state, simulated, drive);
    this.update();
    if (this.visible && !this.timer) void this.follow();
  }

  private renderHead(state: State, simulated: boolean, drive: string): void {
    const off = state.work !== null, m = this.map;
    fill(this.actions, simulated ? [button("Move the twin", () => this.run("move"), { "data-move": "", disabled: off, title: "back and forth, fast to creeping, with feedforward of its model" }), button("Empty it", () => this.run("empty-map"), { class: "quiet", disabled: off })] : null);
    fill(this.head, this.verdict(m),
      m && !m.problem ? el("p", { class: "soft clip" }, `${num(m.seconds, 3)} s in it, of the block “${m.model}”; nothing below ${withUnit(m.limit_nm, m.unit, 2)} counts.`) : null,
      simulated ? null : el("p", { class: "soft" }, "It fills while the drive moves with feedforward of its model. Disconnect, then: ", el("code", {}, `flexspline record --compensate --drive ${drive} --plan PLAN.toml --out DIR`)));
  }

  private verdict(m: DriveMap | null): HTMLElement {
    if (!m) return el("p", { class: "empty" }, "Reading the map …");
    if (m.problem) return el("p", { class: "high" }, m.problem);
    const fits = m.verdict === "model_fits", little = m.verdict === "too_little_data";
    return el("div", { "data-map": m.verdict },
      el("p", { class: `verdict ${fits ? "fine" : little ? "open" : "bad"}` }, el("span", { class: "sign", "aria-hidden": "true" }, fits ? "✓" : little ? "?" : "!"),
        fits ? `The model on the drive fits at the ${m.judged_velocities} velocities that were seen.` : little ? "Too little data: the drive has to move." : "The model on the drive fails here:"),
      m.findings.length ? el("ul", {}, m.findings.slice(0, 2).map((f) => el("li", {}, inWords(f, m))), m.findings.length > 2 ? el("li", {}, `and ${m.findings.length - 2} more`) : null) : null);
  }

  // Repeatedly while it is shown.
  private async follow(): Promise<void> {
    this.timer = window.setTimeout(() => { this.timer = 0; if (this.visible) void this.follow(); }, 3000);
    if (this.asking) return;
    this.asking = true;
    try {
      const next = await get<DriveMap>("map");
      // While it moves the map of before stays.
      if (!next.problem || !this.map) this.map = next;
      this.update();
      this.draw();
    } catch { /* reported by the caller */ }
    this.asking = false;
  }

  forget(): void { this.map = null; fill(this.grid); }

  private draw(): void {
    const m = this.map;
    if (!m || m.problem) return fill(this.grid);
    // Values that do not matter stay pale.
    const largest = Math.max(5 * m.limit_nm, ...m.rows.map((r) => Math.max(...r.mean_nm.map((v) => Math.abs(v ?? 0)))));
    this.grid.setAttribute("aria-label", `Residual map: velocity bins by motor angle, up to ${withUnit(largest, m.unit, 3)}. The findings are listed above.`);
    this.grid.dataset.seconds = m.seconds.toFixed(2);
    const cell = (v: number | null | undefined, ticks: number) => el("i", ticks && largest > 0 ? { class: (v ?? 0) >= 0 ? "up" : "down", "--share": (Math.abs(v ?? 0) / largest).toFixed(3) } : { class: "nothing" });
    const rows = [...m.rows].reverse().filter((r) => r.ticks.some((t) => t > 0));
    if (!rows.length) return fill(this.grid);
    fill(this.grid, rows.map((r) => {
      const ticks = r.ticks.reduce((a, b) => a + b, 0), mean = ticks ? r.ticks.reduce((sum, t, k) => sum + t * (r.mean_nm[k] ?? 0), 0) / ticks : null;
      return el("div", { class: "maprow" }, el("span", { class: "figure" }, range(r.velocity_rad_s)), el("span", { class: "cells" }, r.ticks.map((t, k) => cell(r.mean_nm[k], t))), el("span", { class: "figure" }, mean === null ? "–" : num(mean, 2)));
    }), el("div", { class: "maprow soft" }, el("span", { class: "figure" }, m.velocity_unit), el("span", { class: "angles" }, el("span", {}, "0"), el("span", {}, "motor angle"), el("span", {}, "1 turn")), el("span", { class: "figure" }, unit(m.unit))));
  }
}
