// 1. How good is it? Experiments with their errors against the noise, worst first; one of them over time.
import type { Experiment, State } from "./api";
import { bar, el, fill, fillOnce, num, times, unit, withUnit, words } from "./dom";
import { badness, inNoise, stepKey, viewChanged, view, worstBalance } from "./store";
import { TimeView } from "./time_view";

export class FitQuality {
  private readonly list = el("div", { class: "side", role: "listbox", "aria-label": "Experiments, worst first", "data-scroll": "experiments" });
  private readonly choice = el("select", { "aria-label": "Signal", "data-key": "signal" });
  private readonly overlay = el("select", { "aria-label": "Overlay another experiment", "data-key": "overlay", title: "draws another experiment into the same plots, both from their beginning" });
  private readonly head = el("div", { class: "row" });
  private readonly time = new TimeView();
  readonly element = el("section", { class: "panel good", "aria-labelledby": "q1" },
    el("h2", { id: "q1" }, el("b", {}, "1"), " How good is it?"),
    el("div", { class: "split" }, el("div", { class: "column" }, this.choice, this.list), el("div", { class: "column grow" }, this.head, this.time.element)));

  constructor() {
    this.choice.addEventListener("change", () => { view.signal = this.choice.value; viewChanged(); });
    this.overlay.addEventListener("change", () => { view.overlay = this.overlay.value; viewChanged(); });
    this.list.addEventListener("keydown", (e) => {
      const rows = Array.from(this.list.querySelectorAll<HTMLElement>("[role=option]"));
      const at = rows.indexOf(document.activeElement as HTMLElement);
      const to = e.key === "ArrowDown" ? at + 1 : e.key === "ArrowUp" ? at - 1 : -1;
      if (to < 0 || !rows[to]) return;
      e.preventDefault();
      const key = rows[to]?.dataset.key ?? "";
      rows[to]?.click();
      this.list.querySelector<HTMLElement>(`[data-key="${CSS.escape(key)}"]`)?.focus();
    });
  }

  render(state: State): void {
    const signals = new Map<string, boolean>();
    for (const e of state.experiments) for (const s of e.signals) if (!signals.has(s.signal)) signals.set(s.signal, s.free_run);
    if (!signals.has(view.signal)) view.signal = worstBalance(state.balances)?.signal ?? [...signals.keys()][0] ?? "";
    const option = ([name]: [string, boolean]) => el("option", { value: name, selected: name === view.signal }, words(name));
    const all = [...signals];
    fillOnce(this.choice, JSON.stringify(all), el("optgroup", { label: "Torque balance" }, all.filter(([, free]) => !free).map(option)),
      el("optgroup", { label: "Free run, driven by the effort alone" }, all.filter(([, free]) => free).map(option)));
    this.choice.value = view.signal;

    const those = state.experiments.filter((e) => e.signals.some((s) => s.signal === view.signal)), byNoise = inNoise(those, view.signal);
    const sorted = [...those].sort((a, b) => badness(b, view.signal, byNoise) - badness(a, view.signal, byNoise));
    if (!sorted.some((e) => e.name === view.experiment)) view.experiment = sorted[0]?.name ?? "";
    const worst = Math.max(byNoise ? 1 : 0, ...sorted.map((e) => badness(e, view.signal, byNoise)));
    fill(this.list, sorted.map((e) => this.row(e, worst, byNoise)));

    const shown = sorted.find((e) => e.name === view.experiment);
    const signal = shown?.signals.find((s) => s.signal === view.signal);
    const others = sorted.filter((e) => e.name !== view.experiment);
    if (!others.some((e) => e.name === view.overlay)) view.overlay = "";
    const over = others.find((e) => e.name === view.overlay);
    fillOnce(this.overlay, JSON.stringify([view.experiment, others.map((e) => e.name)]), el("option", { value: "" }, "Overlay …"), others.map((e) => el("option", { value: e.name }, e.name)));
    this.overlay.value = view.overlay;
    fill(this.head,
      el("strong", { class: "clip" }, shown ? shown.name : "Nothing to show"),
      shown ? el("span", { class: "soft clip" }, `${shown.role === "holdout" ? "held out" : "fitted"}, ${shown.load === "locked" ? "output locked" : "free"}, ${num(shown.end_s - shown.begin_s, 3)} s` +
        (signal && signal.rmse !== null ? `; error ${num(signal.rmse, 3)} ${unit(signal.unit)}${signal.noise_floor ? `, noise ${num(signal.noise_floor, 3)}` : ""}` : "")) : null,
      others.length ? this.overlay : null,
      el("ul", { class: "key", "aria-label": "Lines" }, el("li", { class: "measured" }, "measured"), el("li", { class: "model" }, "model"), el("li", { class: "residual" }, "error"),
        state.at > 0 && !over ? el("li", { class: "before" }, "error before") : null, over ? el("li", { class: "overlay" }, over.name) : null, signal?.noise_floor ? el("li", { class: "noise" }, "±2 noise") : null));
    if (shown)
      this.time.show({ experiment: shown.name, signal: view.signal, begin: shown.begin_s, end: shown.end_s, before: state.at > 0 && !over ? state.at - 1 : null,
        overlay: over ? { experiment: over.name, begin: over.begin_s, end: over.end_s } : null,
        stretches: view.brush?.list.find((x) => x.experiment === shown.name)?.stretches ?? [] }, [stepKey(state), shown.name, view.signal, over?.name ?? ""].join("|"));
  }

  redraw(): void { this.time.element.dispatchEvent(new Event("colours")); }

  private row(e: Experiment, worst: number, byNoise: boolean): HTMLElement {
    const s = e.signals.find((x) => x.signal === view.signal);
    const chosen = e.name === view.experiment;
    const brushed = view.brush?.list.find((x) => x.experiment === e.name);
    const excess = s?.excess ?? null;
    // By its logarithm: from the noise to the worst.
    const share = byNoise ? Math.log(Math.max(1, excess ?? 1)) / Math.log(Math.max(2, worst)) : worst > 0 ? (s?.rmse ?? 0) / worst : 0;
    const text = byNoise ? times(excess) : s && s.rmse !== null ? withUnit(s.rmse, s.unit, 3) : "";
    return el("div", { role: "option", tabindex: chosen ? 0 : -1, "aria-selected": chosen ? "true" : "false", "data-key": `experiment ${e.name}`, "data-experiment": e.name,
        click: () => { view.experiment = e.name; viewChanged(); }, keydown: ((k: KeyboardEvent) => { if (k.key === "Enter" || k.key === " ") { view.experiment = e.name; viewChanged(); } }) as (event: never) => void,
        title: excess !== null ? `error ${times(excess)} the noise` : "" },
      el("span", { class: "name" }, e.name), el("span", { class: "figure" }, text), bar(share, excess !== null && excess <= 1.3 ? "fine" : "bad"),
      el("span", { class: "marks" }, e.role === "holdout" ? el("span", { class: "mark" }, "held out") : null, brushed ? el("span", { class: "mark brushed" }, `${brushed.rows} marked`) : null));
  }
}
