// Where there is no model yet, and where recordings with names of their own are added: which column is which, with
// pictures of the signals, and the facts of the drive that the files do not give.
import type { PageChoices, Proposal, ProposedColumn, State } from "./api";
import { button, el, fill, num, unit, words } from "./dom";

type Do = (what: string, more?: Record<string, unknown>) => void;
interface Chosen { source: string | null; unit: string }

const kLabels: Record<string, string> = {
  time_s: "time", current_a: "current of the motor", motor_torque_nm: "torque of the motor", motor_position_rad: "position, motor side", motor_velocity_rad_s: "velocity, motor side",
  output_position_rad: "position, output side", output_velocity_rad_s: "velocity, output side", torque_nm: "torque at the output", temperature_c: "temperature", load_torque_nm: "external load torque",
};
// Always shown; others where they have a source, or on request.
const kMain = ["time_s", "current_a", "motor_torque_nm", "motor_position_rad", "motor_velocity_rad_s", "output_position_rad"];

const kFacts: Record<string, string> = { gear_ratio: "Gear ratio", pitch_m: "Pitch", torque_constant_nm_a: "Torque constant", encoder_counts: "Encoder counts", pole_pairs: "Pole pairs" };
const kWhole = ["encoder_counts", "pole_pairs"];
function numberOf(text: string | undefined): number { return Number((text ?? "").trim() || NaN); }

export class NewProject {
  private readonly body = el("div", { class: "begin" });
  readonly element = el("section", { class: "panel beginning", "aria-labelledby": "q0", hidden: true }, this.body);
  private readonly chosen = new Map<string, Chosen>();
  private readonly facts: Record<string, string> = {};  // as they are typed or chosen
  private readonly tolerated = new Set<string>();
  private readonly turned = new Set<string>();
  private showsAll = false;
  private isShown = false;
  private state: State | null = null;
  private timer = 0;

  constructor(private readonly run: Do, private readonly pick: () => void) {}

  // Whether it is what the page shows now.
  render(state: State): boolean {
    this.state = state;
    const shown = state.steps.length === 0 || !!state.proposal;
    this.element.hidden = !shown;
    if (!shown) {
      this.forget();
      return false;
    }
    const p = state.proposal;
    if (p && !this.isShown) this.take(p.choices?.page);
    this.isShown = !!p;
    const typing = document.activeElement instanceof HTMLInputElement && this.body.contains(document.activeElement) ? document.activeElement : null;
    const at = typing?.type === "text" ? typing.selectionStart : null;
    fill(this.body, p ? this.proposal(state, p) : this.invitation(state));
    if (at !== null && document.activeElement instanceof HTMLInputElement) document.activeElement.setSelectionRange(at, at);
    this.element.dataset.can = p ? (p.can_begin ? "yes" : "no") : "";
    return true;
  }

  // What the page had sent before it was loaded again.
  private take(page: PageChoices | undefined): void {
    if (!page || this.chosen.size || Object.keys(this.facts).length || this.turned.size || this.tolerated.size) return;
    for (const [column, chosen] of page.chosen) this.chosen.set(column, chosen);
    for (const kind of page.tolerated) this.tolerated.add(kind);
    for (const column of page.turned) this.turned.add(column);
    Object.assign(this.facts, page.facts);
    this.left = page.left;
  }

  private forget(): void {
    this.chosen.clear();
    this.tolerated.clear();
    this.turned.clear();
    this.left = [];
    for (const key of Object.keys(this.facts)) delete this.facts[key];
    this.showsAll = false;
  }

  private invitation(state: State): HTMLElement {
    return el("div", { class: "invitation" }, el("h2", { id: "q0" }, "Begin with recordings of your drive"),
      el("p", {}, "Drop them anywhere on this page: CSV and other text, MAT, HDF5, NumPy, ROS bags, MCAP. Time, current or torque, and a position or velocity are enough."),
      el("p", {}, button("Choose files", this.pick, { class: "main", "data-pick": "", disabled: state.work !== null })),
      el("p", { class: "soft" }, "Nothing leaves this machine."));
  }

  private proposal(state: State, p: Proposal): (HTMLElement | null)[] {
    const off = state.work !== null;
    const rows = p.columns.filter((c) => this.showsAll || c.source !== null || this.chosen.get(c.column)?.source || kMain.includes(c.column));
    return [
      el("div", { class: "row" }, el("h2", { id: "q0" }, p.adds ? "Which column is which in the new recordings?" : "Which column is which?"),
        el("span", { class: "soft clip" }, p.files.length > 3 ? `${p.files.length} files` : p.files.join(", "))),
      this.verdict(p, off),
      this.drive(p),
      p.has_dataset_toml ? el("p", { class: "soft" }, "Columns are as in the dataset.toml of these recordings.") : null,
      el("div", { class: "scroll", "data-scroll": "columns" }, el("table", { class: "columns" },
        el("thead", {}, el("tr", {}, ["signal", "column of the file", "unit", "sign", "as recorded", "from … to"].map((t) => el("th", { scope: "col" }, t)))),
        el("tbody", {}, rows.map((c) => this.row(p, c))))),
      el("div", { class: "row actions" }, this.showsAll ? null : button("Show all signals", () => { this.showsAll = true; if (this.state) this.render(this.state); }, { class: "quiet" })),
      p.notes.length ? el("details", { "data-key": "notes" }, el("summary", { "data-key": "notes summary" }, `What was guessed or decided (${p.notes.length})`), el("ul", {}, p.notes.map((n) => el("li", {}, n.replace(/; give --pitch-m METRES, or write pitch_m under \[drive\]/, "; type it above"))))) : null,
      p.warnings.length ? el("details", { open: true, "data-key": "warnings" }, el("summary", { "data-key": "warnings summary" }, `Warnings (${p.warnings.length})`), el("ul", {}, p.warnings.map((n) => el("li", {}, this.inPageWords(n))))) : null,
    ];
  }

  private verdict(p: Proposal, off: boolean): HTMLElement {
    const tolerable = [...new Set(p.findings.map((f) => f.tolerate).filter((k): k is string => k !== null))];
    const others = [...this.tolerated].filter((k) => !tolerable.includes(k));
    return el("div", { class: "outlook" },
      p.can_begin ? el("p", { class: "verdict fine" }, el("span", { class: "sign", "aria-hidden": "true" }, "✓"), `A first model can be identified: ${p.effects.map(words).join(", ")}.`)
        : el("p", { class: "verdict bad" }, el("span", { class: "sign", "aria-hidden": "true" }, "!"), this.inPageWords(p.why_not)),
      p.findings.length ? el("ul", { class: "findings" }, p.findings.slice(0, 6).map((f) => el("li", {}, `${f.column && f.column !== "time_s" ? `${f.column}: ` : ""}${f.what}${f.line ? ` (${f.file}, line ${f.line})` : ""}`))) : null,
      [...tolerable, ...others].length ? el("p", { class: "row actions" }, [...tolerable, ...others].map((kind) => el("label", {},
        el("input", { type: "checkbox", checked: this.tolerated.has(kind), "data-key": `tolerate ${kind}`, change: ((e: Event) => { if ((e.target as HTMLInputElement).checked) this.tolerated.add(kind); else this.tolerated.delete(kind); this.ask(); }) as (event: never) => void }), ` use them all the same: ${words(kind)}`))) : null,
      el("div", { class: "row actions" }, button(p.adds ? "Add these recordings" : "Identify a first model", () => this.send("begin"), { class: "main", "data-begin": "", disabled: off || !p.can_begin }),
        button(p.adds ? "Leave them out" : "Other recordings", () => { this.dropTimer(); this.forget(); this.run("forget"); }, { class: "quiet", disabled: off, "data-forget": "" })));
  }

  // Options of the command line are fields here.
  private inPageWords(text: string): string {
    return (text.charAt(0).toUpperCase() + text.slice(1)).replace(/; give --position-side motor or --position-side link/, ": choose below on which side they are measured").replace(/; name the columns with --map/, "; choose the columns below")
      .replace(/write scale = -1 under \[columns\.(\w+)\] in dataset\.toml, or give flexspline new --turn \w+/, (_, column: string) => `turn the sign of the ${kLabels[column] ?? words(column)} below`);
  }

  private drive(p: Proposal): HTMLElement {
    const field = (key: string, label: string, title: string, value: number | null) => el("label", { title }, `${label} `,
      el("input", { type: "text", inputmode: "decimal", class: "short", "data-key": `fact ${key}`, "data-fact": key, value: String(this.facts[key] ?? value ?? ""),
        input: ((e: Event) => this.typed(key, (e.target as HTMLInputElement).value)) as (event: never) => void }));
    const choice = (key: string, label: string, options: [string, string][], now: string) => el("label", {}, `${label} `,
      el("select", { "data-key": `fact ${key}`, "data-fact": key, change: ((e: Event) => { this.facts[key] = (e.target as HTMLSelectElement).value; this.ask(); }) as (event: never) => void },
        options.map(([value, text]) => el("option", { value, selected: value === now }, text))));
    const side = String(this.facts["position_side"] ?? p.position_side ?? "");
    return el("div", { class: "facts" },
      p.axis === "linear" ? null : field("gear_ratio", "Gear ratio", "motor turns for one turn of the output", p.gear_ratio),
      p.axis === "linear" ? field("pitch_m", "Pitch, m", "travel for one turn of the motor; empty for a linear motor", p.pitch_m) : null,
      p.axis === "linear" ? field("torque_constant_nm_a", "Force constant, N/A", "force of the motor for one ampere; without it forces come out in amperes", p.torque_constant_nm_a)
        : field("torque_constant_nm_a", "Torque constant, N·m/A", "torque of the motor for one ampere; without it torques come out in amperes", p.torque_constant_nm_a),
      side || p.question ? choice("position_side", "Position and velocity are of the", [["", "? (choose one)"], ["motor", "motor"], ["link", "link (output)"]].filter(([v]) => v || !side || side === "open") as [string, string][], side === "open" ? "" : side) : null,
      p.joints.length > 1 ? choice("joint", "Joint", p.joints.map((j) => [String(j), String(j)]), String(this.facts["joint"] ?? p.joint ?? "")) : null,
      p.needs_pole_pairs ? field("pole_pairs", "Pole pairs of the motor", `${p.needs_pole_pairs} counts electrical turns`, null) : null,
      this.hasCounts(p) ? field("encoder_counts", p.axis === "linear" ? "Encoder counts a metre" : "Encoder counts a motor turn", p.axis === "linear" ? "to turn counts into metres" : "to turn counts into angles", p.encoder_counts) : null);
  }

  private hasCounts(p: Proposal): boolean {
    return p.columns.some((c) => (this.chosen.get(c.column)?.unit ?? c.unit ?? "").startsWith("counts")) || "encoder_counts" in this.facts || p.encoder_counts !== null;
  }

  private row(p: Proposal, c: ProposedColumn): HTMLElement {
    const own = this.chosen.get(c.column);
    const source = own ? own.source : c.source, ofUnit = own ? own.unit : c.unit ?? "";
    const fixed = p.has_dataset_toml || (c.source === c.column && !own);
    const signal = p.signals.find((s) => s.name === source);
    const factor = c.units.find((u) => u.unit === ofUnit) ?? (ofUnit === "" ? c.units[0] : undefined);
    const si = c.units[0]?.unit ?? "";
    const scale = c.source === source ? c.scale ?? 1 : 1;
    const at = (v: number | null | undefined) => (v === null || v === undefined || !factor || factor.factor === null ? null : (v * factor.factor + factor.offset) * scale);
    const [low, high] = [at(signal?.least), at(signal?.largest)];
    const range = low === null || high === null ? "" : `${num(Math.min(low, high), 3)} … ${num(Math.max(low, high), 3)} ${unit(si)}`;
    const rotary = kLabels[c.column] ?? words(c.column.replace(/_(rad_s|rad|a|nm|c|s)$/, ""));
    const label = p.axis === "linear" ? rotary.replace("torque", "force") : rotary;
    return el("tr", { "data-column": c.column, class: source === null ? "absent" : "" }, el("th", { scope: "row", title: c.column }, label),
      el("td", {}, fixed ? el("code", {}, String(source ?? "")) : el("select", { "aria-label": `Column of ${label}`, "data-key": `source ${c.column}`,
        change: ((e: Event) => this.choose(c, (e.target as HTMLSelectElement).value || null, "")) as (event: never) => void },
        el("option", { value: "", selected: source === null }, "– not recorded –"), p.signals.map((s) => el("option", { value: s.name, selected: s.name === source }, s.unit ? `${s.name} [${s.unit}]` : s.name)))),
      el("td", {}, source === null ? "" : fixed ? unit(si) : el("select", { "aria-label": `Unit of ${label}`, "data-key": `unit ${c.column}`, change: ((e: Event) => this.choose(c, source, (e.target as HTMLSelectElement).value)) as (event: never) => void },
        c.units.map((u, k) => el("option", { value: u.unit, selected: u.unit === ofUnit || (k === 0 && ofUnit === "") }, unit(u.unit))))),
      el("td", {}, source === null || c.column === "time_s" || p.has_dataset_toml ? "" : el("button", { type: "button", class: "sign", "data-key": `turn ${c.column}`, "aria-pressed": this.turned.has(c.column) ? "true" : "false", "aria-label": `Turn the sign of ${label}`, title: "turns the sign; a positive current accelerates positively",
        click: () => { if (!this.turned.delete(c.column)) this.turned.add(c.column); this.ask(); } }, this.turned.has(c.column) ? "−" : "+")),
      el("td", {}, signal?.low ? sparkline(signal.low, signal.high ?? [], `${label} as recorded`) : ""),
      el("td", { class: "n" }, range, Math.abs(scale) !== 1 ? el("span", { class: "soft" }, ` (×${num(scale, 4)})`) : null, c.why && !own ? el("span", { class: "mark", title: c.why }, "guess") : null));
  }

  private choose(c: ProposedColumn, source: string | null, ofUnit: string): void {
    this.chosen.set(c.column, { source, unit: ofUnit });
    // One column is one signal.
    if (source) for (const [other, chosen] of this.chosen) if (other !== c.column && chosen.source === source) this.chosen.set(other, { source: null, unit: "" });
    this.ask();
  }

  private typed(key: string, value: string): void {
    this.facts[key] = value;
    this.dropTimer();
    this.timer = window.setTimeout(() => this.ask(), 400);
  }

  private choices(): Record<string, unknown> {
    const p = this.state?.proposal;
    const map: string[] = [], without: string[] = [];
    for (const [column, { source, unit: ofUnit }] of this.chosen) {
      const guessed = p?.columns.find((c) => c.column === column);
      if (source) map.push(`${column}=${source}${ofUnit ? `:${ofUnit}` : ""}`);
      else if (guessed?.source && ![...this.chosen.values()].some((c) => c.source === guessed.source)) without.push(guessed.source);
    }
    for (const name of this.left) if (!without.includes(name) && ![...this.chosen.values()].some((c) => c.source === name)) without.push(name);
    this.left = without;
    const number = (key: string) => { const v = numberOf(this.facts[key]); return Number.isFinite(v) ? v : undefined; };
    const page: PageChoices = { chosen: [...this.chosen], facts: { ...this.facts }, tolerated: [...this.tolerated], turned: [...this.turned], left: this.left };
    // What was mapped by hand is of the same side as what was guessed.
    const side = this.facts["position_side"] ?? (map.length && p?.position_side === "link" ? "link" : undefined);
    return { map, without, turned: [...this.turned].filter((column) => p?.columns.some((c) => c.column === column && c.source !== null)), gear_ratio: number("gear_ratio"), torque_constant_nm_a: number("torque_constant_nm_a"), encoder_counts: number("encoder_counts"), pitch_m: p?.axis === "linear" ? number("pitch_m") : undefined, joint: number("joint"), pole_pairs: number("pole_pairs"),
      position_side: side && side !== "open" ? side : undefined, tolerate: [...this.tolerated], page };
  }
  private left: string[] = [];

  // The next request sends all choices; a delayed request after it would find no recordings any more.
  private dropTimer(): void {
    clearTimeout(this.timer);
    this.timer = 0;
  }

  private ask(): void { this.send("propose"); }

  // A fact that is no number is not left out silently.
  private send(what: "propose" | "begin"): void {
    this.dropTimer();
    const wrong = Object.keys(kFacts).find((key) => {
      const value = numberOf(this.facts[key]);
      return (this.facts[key] ?? "").trim() && !(value > 0 && Number.isFinite(value) && (!kWhole.includes(key) || Number.isInteger(value)));
    });
    // A comma stands for thousands in one country, for the decimal point in the next.
    const remedy = wrong && this.facts[wrong]?.includes(",") ? " Type it without a comma, as 1000 or 0.05." : "";
    if (wrong) this.run("complain", { what: `${kFacts[wrong]}: “${this.facts[wrong]}” is not a ${kWhole.includes(wrong) ? "whole number" : "number"} above zero.${remedy}` });
    else this.run(what, { choices: this.choices() });
  }
}

// A signal as a sparkline: the range of each interval of time.
function sparkline(low: (number | null)[], high: (number | null)[], label: string): SVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const all = [...low, ...high].filter((v): v is number => v !== null);
  const least = Math.min(...all), span = Math.max(...all) - least || 1;
  const at = (v: number) => (26 - (24 * (v - least)) / span).toFixed(1);
  let path = "", pen = "M";
  low.forEach((v, k) => {
    const top = high[k], x = ((150 * (k + 0.5)) / low.length).toFixed(1);
    if (v === null || top === null || top === undefined) { pen = "M"; return; }
    path += `${pen}${x} ${at(v)}L${x} ${at(top)}`;
    pen = "L";
  });
  svg.setAttribute("viewBox", "0 0 150 28");
  svg.setAttribute("class", "sparkline");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", label);
  const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
  line.setAttribute("d", path);
  svg.append(line);
  return svg;
}
