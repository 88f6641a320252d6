// The closed loop: a motion on a simulated drive, without compensation, with the first step's model, with the present one's.
import type uPlot from "uplot";
import { get, unpack, type ClosedRun, type Packed, type State } from "./api";
import { button, el, fill, fillOnce, num, words } from "./dom";
import { axes, Figure, line } from "./plots";

interface Traces { time: Packed; error: Packed }

const kLines: Record<string, [string, number[]]> = { none: ["before", [2, 3]], base: ["model", [7, 4]], now: ["residual", []] };
const kModel = "a simulated drive of which the present model is true";
const kMilli = 1e3;  // rad are shown as mrad

export class ClosedLoopPanel {
  private readonly choice = el("select", { "aria-label": "Motion", "data-key": "scenario" });
  private readonly head = el("div", { class: "column closedhead" });
  private readonly figure = new Figure(el("div", { class: "plot", role: "img" }));
  readonly element = el("div", { class: "closed" }, this.head, this.figure.holder);
  private scenario = "";
  private shown = "";
  private traces: Traces[] = [];

  constructor(private readonly run: (what: string, more?: Record<string, unknown>) => void) {
    this.choice.addEventListener("change", () => { this.scenario = this.choice.value; });
  }

  render(state: State): void {
    if (!state.scenarios.includes(this.scenario)) this.scenario = state.scenarios[0] ?? "";
    const c = state.closed_loop;
    fillOnce(this.choice, state.scenarios.join(" "), state.scenarios.map((s) => el("option", { value: s }, s)));
    this.choice.value = this.scenario;
    const step = c?.step;
    const isOld = !!step && (step.at !== state.at || step.what !== state.steps[state.at]?.what || step.action !== state.steps[state.at]?.action);
    fill(this.head,
      el("div", { class: "row actions" }, this.choice, button("Run the closed loop", () => this.run("try", { scenario: this.scenario }), { class: "main", "data-try": "", disabled: state.work !== null || !state.scenarios.length })),
      el("p", { class: "soft" }, `A simulation with the drive's own firmware, on ${c?.plant ?? (state.rig || kModel)}${(c ? c.is_model : !state.rig) ? ": what compensation is worth if the model is right" : ""}.`),
      c ? [el("p", { class: "clip", title: `${c.what}; velocity loop ${num(c.gains.velocity_loop_hz, 3)} Hz, position loop ${num(c.gains.position_loop_hz, 3)} Hz` }, el("strong", {}, `${c.scenario}: `), `${num(c.seconds, 3)} s, the same loops in all runs; ${c.what}`),
        isOld ? el("p", { class: "high" }, "These runs belong to another step; run them again.") : null, this.table(c.runs, isOld)] : el("p", { class: "empty" }, "Runs a motion without compensation, with the model as it was opened, and with the present one: how far the output is from where it shall be."));
    this.figure.holder.hidden = !c;
    if (!c) return;
    const key = [c.scenario, c.step.at, c.step.what, ...c.runs.map((r) => r.rms_error_rad)].join("|");
    if (key === this.shown) return;
    this.shown = key;
    this.element.dataset.drawn = "";
    void this.fetch(c.runs, key);
  }

  private table(runs: ClosedRun[], isOld: boolean): HTMLElement {
    const head = (text: string, n = true) => el("th", { scope: "col", class: n ? "n" : "" }, text);
    const predicted = runs.some((r) => r.predicted);
    return el("table", { class: isOld ? "old" : "", "data-runs": runs.length, "data-ratio": (runs[runs.length - 1]?.ratio_to_none ?? 1).toFixed(4), "data-base": (runs[1]?.ratio_to_none ?? 1).toFixed(4) },
      el("thead", {}, el("tr", {}, head("compensation", false), head("rms error, mrad"), head("peak, mrad"), head("ratio to none"), predicted ? head("predicted") : null, head("rms current, A"), runs.some((r) => r.fault) ? head("fault", false) : null)),
      el("tbody", {}, runs.map((r) => el("tr", {}, el("th", { scope: "row", class: `line ${kLines[r.compensation]?.[0] ?? ""}` }, name(r, runs)), el("td", { class: "n" }, num(kMilli * (r.rms_error_rad ?? NaN), 3)), el("td", { class: "n" }, num(kMilli * (r.peak_error_rad ?? NaN), 3)), el("td", { class: "n" }, num(r.ratio_to_none, 3)),
        predicted ? el("td", { class: "n", title: "what was predicted before the run, with 95 %" }, r.predicted ? `${num(r.predicted.interval[0], 2)} to ${num(r.predicted.interval[1], 2)}` : "–") : null, el("td", { class: "n" }, num(r.rms_current_a, 3)),
        r.fault ? el("td", { class: "high" }, `${words(r.fault)}${r.ends_in_fault ? ", switched off" : ""}`) : null))));
  }

  private async fetch(runs: ClosedRun[], key: string): Promise<void> {
    let traces: Traces[];
    try {
      traces = await get<Traces[]>("closed_loop");
    } catch {
      return;  // traces end with the session; the table alone stays
    }
    if (key !== this.shown) return;
    this.traces = traces;
    const time = unpack(this.traces[0]?.time ?? { offset: 0, scale: 0, count: 0, codes: "" });
    // Runs are thinned by themselves: each has its own times.
    this.figure.holder.setAttribute("aria-label", "Error of the output position over time, without compensation and with each model");
    const facets = [{ scale: "x", auto: true }, { scale: "y", auto: true }];
    const end = time[time.length - 1] ?? 1;
    this.figure.show(() => ({
      data: [null, ...this.traces.map((t) => [unpack(t.time), unpack(t.error).map((e) => (e === null ? null : kMilli * e))])] as unknown as uPlot.AlignedData,
      options: { mode: 2, scales: { x: { time: false, range: () => [0, end] }, y: {} }, axes: axes("time (s)", "error (mrad)"), cursor: { show: false },
        series: [{}, ...runs.map((r) => ({ ...line(kLines[r.compensation]?.[0] ?? "residual", { dash: kLines[r.compensation]?.[1] ?? [] }), facets }))] as unknown as uPlot.Series[] },
    }));
    this.element.dataset.drawn = "yes";
  }
}

function name(run: ClosedRun, runs: ClosedRun[]): string {
  if (run.compensation === "none") return "none";
  if (run.compensation === "base") return "model as opened";
  return runs.length > 2 ? "present model" : "the model";
}
