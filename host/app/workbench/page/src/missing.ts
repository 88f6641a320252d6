// 3. What is missing? The verdict, candidates by what they take off the error of left-out data, and what each means.
import type uPlot from "uplot";
import type { Candidate, Diagnosis, State } from "./api";
import { bar, button, el, fill, num, startOfTimes, unit, withUnit, words } from "./dom";
import { axes, colour, Figure, kHidden, line, stretchedScale, stretchedSplits } from "./plots";
import { stepKey } from "./store";

export const label = (c: { effect: string; order: number | null }) => (c.order === null ? c.effect : `${c.effect}:${c.order}`);
const inWords = (c: { effect: string; order: number | null }) => words(c.effect) + (c.order === null ? "" : `, ${c.order} per turn`);

// How sure the data are, in words: scores are twice the logarithm of a likelihood ratio, less what parameters cost.
function certainty(c: Candidate, found: Diagnosis): string {
  if (!c.admissible) return `refused: ${c.why_not ?? "its values are impossible"}`;
  const named = found.named.some((n) => label(n) === label(c));
  const score = c.score ?? 0, falls = c.chi2_fall_percent ?? 0;
  const chosen = found.resampling?.decides ? found.resampling.found.find((f) => f.effects.some((e) => label(e) === label(c))) : undefined;
  if (named && chosen) return `chosen in ${num(100 * (chosen.frequency ?? 0), 2)} of 100 subsamples` + (found.verdict === "confusable_effects" ? "; cannot be distinguished from other effects" : "");
  const open = found.possible?.find((p) => p.effects.some((e) => label(e) === label(c)));
  if (open) return `these data do not decide it: ${open.why_not}`;
  if (falls < 0 || score < 0) return "makes left-out data worse";
  if (named) return found.named.length > 1 ? "likely; cannot be distinguished from other effects" : score >= 200 ? "certain" : score >= 20 ? "sure" : "weak";
  if (score < 10) return "could be chance";
  if (falls < 0.5) return "real, but explains next to nothing";
  return found.named.length ? "helps, but explains less than the best" : score >= 20 ? "real, but not all of it" : "weak";
}

interface UnknownCurve { variable: string; variable_unit: string; unit: string; times_direction: boolean; effect: string; record_next: string; chi2_fall_percent: number | null;
  points: { at: number; value: number; interval: [number | null, number | null]; visited: boolean }[] }

export class Missing {
  private readonly body = el("div", { class: "split" });
  private readonly figure = new Figure(el("div", { class: "plot small", role: "img", "aria-label": "Where it shows" }));
  readonly element = el("section", { class: "panel missing", "aria-labelledby": "q3" }, el("h2", { id: "q3" }, el("b", {}, "3"), " What is missing?"), this.body);
  private chosen = "";
  private key = "";

  constructor(private readonly add: (effect: string) => void, private readonly search: () => void) {}

  render(state: State): void {
    const key = stepKey(state);
    if (key !== this.key) { this.key = key; this.chosen = ""; }
    const found = state.diagnosis;
    if (!found) {
      fill(this.body, state.work?.what.startsWith("Searching")
        ? el("div", { class: "waiting" }, el("p", {}, "Trying every effect of the catalogue on data that the fit did not see."), el("p", { class: "soft" }, state.work.stage || "…"), el("div", { class: "busy" }))
        : el("div", { class: "waiting" }, el("p", {}, state.work ? "Waiting for the model." : "Not searched for yet."), button("Search for what is missing", this.search, { class: "main", disabled: state.work !== null })));
      return;
    }
    const good = found.verdict === "at_noise_floor", none = found.named.length === 0;
    const unknown = found.verdict === "unknown_structure" ? (found.unknown as unknown as UnknownCurve | null) : null;
    const first = found.named[0] ? label(found.named[0]) : found.candidates[0] ? label(found.candidates[0]) : "";
    if (!found.candidates.some((c) => label(c) === this.chosen)) this.chosen = unknown ? "" : none ? "" : first;
    const chosen = found.candidates.find((c) => label(c) === this.chosen);
    const shown = found.candidates.slice(0, 12);
    const list = el("div", { class: "column candidates" },
      el("p", { class: `verdict ${good ? "fine" : none ? "open" : "bad"}`, "data-verdict": found.verdict }, el("span", { class: "sign", "aria-hidden": "true" }, good ? "✓" : none ? "?" : "!"), sentence(found)),
      found.possible?.length ? el("p", { class: "rivals", "data-possible": String(found.possible.length) }, el("strong", {}, "These data do not decide whether missing: "), found.possible.map((p) =>
        p.effects.map(inWords).join(" or ") + ` (${p.frequency === null ? "" : `chosen in ${num(100 * p.frequency, 2)} of 100 subsamples; `}${p.why_not})`).join("; "), ".") : null,
      unknown ? el("div", { class: "choice" }, button("Its shape", () => { this.chosen = ""; this.render(state); }, { "aria-pressed": chosen ? "false" : "true" })) : null,
      found.named.length > 1 ? el("p", { class: "rivals" }, el("strong", {}, "To distinguish them: "), found.candidates.find((c) => label(c) === first)?.separating_experiment ?? "flexspline plan --separate designs a motion", ".") : null,
      shown.length ? el("div", { class: "side", role: "listbox", "aria-label": "Candidates, best first", "data-scroll": "candidates",
        keydown: ((e: KeyboardEvent) => this.arrows(e)) as (event: never) => void }, shown.map((c) => this.row(c, found, state))) : null);
    fill(this.body, list, el("div", { class: "column grow details", "data-scroll": "details", tabindex: 0, role: "region", "aria-label": "What it means" },
      chosen ? this.details(chosen, found, state) : unknown ? this.unknown(unknown, state) : this.nothing(found, good, state)));
    if (chosen) this.drawEvidence(chosen); else if (unknown) this.drawUnknown(unknown);
  }

  private arrows(e: KeyboardEvent): void {
    const rows = Array.from(this.body.querySelectorAll<HTMLElement>("[role=option]"));
    const row = rows[rows.indexOf(document.activeElement as HTMLElement) + (e.key === "ArrowDown" ? 1 : e.key === "ArrowUp" ? -1 : NaN)];
    if (!row) return;
    e.preventDefault();
    row.click();
    this.body.querySelector<HTMLElement>("[role=option][aria-selected=true]")?.focus();
  }

  private row(c: Candidate, found: Diagnosis, state: State): HTMLElement {
    const choose = () => { this.chosen = name; this.render(state); };
    const name = label(c), chosen = name === this.chosen, named = found.named.some((n) => label(n) === name);
    const falls = c.rmse_cv_before && c.rmse_cv_after !== null ? 1 - c.rmse_cv_after / c.rmse_cv_before : 0;
    return el("div", { role: "option", tabindex: chosen || (!this.chosen && c.rank === 1) ? 0 : -1, "aria-selected": chosen ? "true" : "false", "data-key": `candidate ${name}`, "data-effect": name, class: named ? "named" : "",
        click: choose, keydown: ((e: KeyboardEvent) => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); choose(); } }) as (event: never) => void },
      el("span", { class: "name" }, inWords(c)), el("span", { class: "figure", title: "decrease of the error on left-out data" }, falls > 0 ? `−${num(100 * falls, 3)} %` : "0 %"), bar(falls, named ? "named" : "bad"),
      el("span", { class: "marks soft" }, certainty(c, found)));
  }

  private details(c: Candidate, found: Diagnosis, state: State): HTMLElement[] {
    const part = (title: string, text: string | null) => (text ? el("p", {}, el("strong", {}, `${title} `), text) : el("span"));
    return [
      el("div", { class: "row" }, el("strong", { class: "clip" }, inWords(c)), button(`Add ${inWords(c)}`, () => this.add(label(c)), { class: "main", "data-add": label(c), disabled: !c.admissible || (state.work !== null && !state.work.what.startsWith("Searching")) })),
      part("", c.explanation), c.equation ? el("p", { class: "equation" }, c.equation) : el("span"),
      c.evidence?.bins.length ? this.figure.holder : el("span"),
      el("p", {}, el("strong", {}, "Evidence: "), `on left-out data the error of the ${c.balance} balance decreases from ${withUnit(c.rmse_cv_before, c.unit)} to ${withUnit(c.rmse_cv_after, c.unit)}` +
        (found.base.noise_floor ? `; noise is ${withUnit(found.base.noise_floor, c.unit)}` : "") + `. ${certainty(c, found)}.`),
      part("", c.note), c.rivals.length ? part("Cannot be distinguished from:", `${c.rivals.map(words).join(", ")}. What distinguishes them: ${c.separating_experiment ?? "unknown"}.`) : el("span"),
      part("What it does:", c.consequence),
      c.order_causes?.length ? el("div", { class: "order-causes" }, el("p", {}, `On this drive ${c.order} per motor turn is the order of:`), el("ul", {}, c.order_causes.map((o) =>
        el("li", {}, el("strong", {}, `${o.cause} (${o.from}). `), `Check: ${o.check} Cure: ${o.cure}`)))) : el("span"),
      part("", c.order_hint), part("Usual causes:", c.causes), part("Check on the machine:", c.check),
    ];
  }

  private nothing(found: Diagnosis, good: boolean, state: State): HTMLElement {
    const start = (name: string) => startOfTimes(state.experiments.find((x) => x.name === name)?.begin_s ?? 0);
    return el("div", { class: "waiting" }, el("div", { class: `seal ${good ? "fine" : "open"}`, "aria-hidden": "true" }, good ? "✓" : "?"),
      el("p", {}, good ? "What the model leaves is the noise of the measurement. Save the model, or pack it for a drive." : found.verdict === "insufficient_excitation"
        ? "Record motions that reverse, that go slow and fast, and with load; flexspline plan designs them." : "No effect helps. More or other motions may show one: flexspline plan designs them."),
      found.base.noise_floor ? el("p", { class: "soft" }, `error ${withUnit(found.base.rmse, found.base.unit ?? "")}, noise ${withUnit(found.base.noise_floor, found.base.unit ?? "")}`) : null,
      found.disturbances.length ? el("p", {}, `${found.disturbances.length} disturbance(s) from outside: ${found.disturbances.slice(0, 3).map((d) => `${d.experiment} at ${num(d.from_s - start(d.experiment), 3)} s${start(d.experiment) ? " after the first sample" : ""}`).join(", ")}`) : null);
  }

  private unknown(u: UnknownCurve, state: State): HTMLElement[] {
    return [
      el("div", { class: "row" }, el("strong", {}, `Its shape over ${words(u.variable)}${u.times_direction ? ", times the direction of motion" : ""}`),
        button("Add this curve", () => this.add(u.effect), { class: "main", "data-add": u.effect, disabled: state.work !== null })),
      el("p", {}, `${num(u.chi2_fall_percent, 3)} % of the squared error on left-out data is explained by this curve. No effect of the catalogue has its shape.`),
      this.figure.holder, el("p", {}, el("strong", {}, "Record next: "), u.record_next, "."),
    ];
  }

  private drawUnknown(u: UnknownCurve): void {
    const at = u.points.map((p) => p.at), side = (k: 0 | 1) => u.points.map((p) => (p.visited ? p.interval[k] : null));
    this.figure.holder.setAttribute("aria-label", `${u.unit === "N" ? "Force" : "Torque"} over ${words(u.variable)} that no effect explains`);
    this.figure.show(() => ({ data: [at, side(1), side(0), u.points.map((p) => p.value)] as uPlot.AlignedData, options: {
      scales: { x: { time: false } }, axes: axes(`${words(u.variable)}${unit(u.variable_unit) ? ` (${unit(u.variable_unit)})` : ""}`, unit(u.unit)), series: [{}, kHidden, kHidden, line("residual", { width: 2 })],
      bands: [{ series: [1, 2], fill: colour("residualband") }], cursor: { drag: { x: false, y: false }, y: false } } }));
  }

  private drawEvidence(c: Candidate): void {
    const e = c.evidence;
    if (!e?.bins.length) return;
    const x = e.bins.map((b) => (b.low + b.high) / 2);
    this.figure.holder.setAttribute("aria-label", `What the model lacks over ${words(e.variable)}, and what ${inWords(c)} makes of it`);
    const crowded = ["velocity", "speed", "travel", "torsion_rate"].includes(e.variable);
    const scale: Partial<uPlot.Scale> = crowded ? stretchedScale(x) : { time: false };
    const asinh = scale.distr === 4 ? scale.asinh ?? 1 : 0;
    const variableUnit = (e as unknown as { variable_unit: string }).variable_unit ?? "";
    this.figure.show(() => ({ data: [x, e.bins.map((b) => b.lacking), e.bins.map((b) => b.effect)], options: {
      scales: { x: scale as uPlot.Scale }, axes: axes(`${words(e.variable)}${variableUnit ? ` (${unit(variableUnit)})` : ""}: dots lack, line makes`, unit(c.unit), asinh ? { x: { splits: (_u, _a, low, high) => stretchedSplits(asinh, low, high), filter: (_u, s) => s } } : {}),
      series: [{}, { ...line("residual"), width: 0, points: { show: true, size: 6, fill: colour("residual") } }, line("model", { width: 2 })], cursor: { drag: { x: false, y: false }, y: false } } }));
  }
}

function sentence(found: Diagnosis): string {
  return found.verdict_in_words.replace(/_/g, " ");
}
