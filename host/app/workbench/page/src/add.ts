// 4. Add it. Steps with their errors, to be taken back and compared; parameters; files and the drive.
import { act, download, type Balance, type Parameter, type State, type Step } from "./api";
import { bar, button, el, fill, num, relative, times, unit, withUnit, words } from "./dom";
import { errorOf, excessOf, floorOf, view, worstBalance } from "./store";
import { ClosedLoopPanel } from "./closed_loop";
import { DrivePanel } from "./drive";

type Do = (what: string, more?: Record<string, unknown>) => void;

function change(state: State, p: Parameter): string {
  const before = state.parameters_before.find((b) => b.id === p.id && b.parameter === p.parameter);
  return relative(before?.value, p.value);
}

export class Add {
  private readonly tabs = el("div", { class: "tabs", role: "tablist", "aria-label": "Parts of panel 4" });
  private readonly body = el("div", { class: "tabbody", role: "tabpanel", "aria-label": "Steps, parameters, files, closed loop or drive" });
  private readonly element_ = el("section", { class: "panel add", "aria-labelledby": "q4" }, el("div", { class: "row" }, el("h2", { id: "q4" }, el("b", {}, "4"), " Add it"), this.tabs), this.body);
  private part = "Steps";
  private state: State | null = null;
  private readonly drive: DrivePanel;
  private readonly closed: ClosedLoopPanel;
  private readonly name = el("input", { type: "text", "data-key": "name", "aria-label": "Name of the file without its ending" });

  constructor(private readonly run: Do) {
    this.drive = new DrivePanel(run);
    this.closed = new ClosedLoopPanel(run);
    this.tabs.addEventListener("keydown", (e) => {
      const all = Array.from(this.tabs.querySelectorAll<HTMLElement>("[role=tab]"));
      const next = all[all.indexOf(document.activeElement as HTMLElement) + (e.key === "ArrowRight" ? 1 : e.key === "ArrowLeft" ? -1 : NaN)];
      if (next) { next.click(); this.tabs.querySelector<HTMLElement>("[aria-selected=true]")?.focus(); }
    });
  }

  get element(): HTMLElement { return this.element_; }

  render(state: State): void {
    this.state = state;
    fill(this.tabs, ["Steps", "Parameters", "Save", "Closed loop", "Drive"].map((t) => el("button", { type: "button", role: "tab", "aria-selected": t === this.part ? "true" : "false", tabindex: t === this.part ? 0 : -1, "data-key": `tab ${t}`,
      click: () => { this.part = t; if (this.state) this.render(this.state); } }, t)));
    this.drive.visible = this.part === "Drive";
    if (this.part === "Steps") fill(this.body, this.steps(state));
    else if (this.part === "Parameters") fill(this.body, this.parameters(state));
    else if (this.part === "Save") fill(this.body, this.save(state));
    else if (this.part === "Closed loop") {
      if (!this.body.contains(this.closed.element)) this.body.replaceChildren(this.closed.element);
      this.closed.render(state);
    } else {
      if (!this.body.contains(this.drive.element)) this.body.replaceChildren(this.drive.element);
      this.drive.render(state);
    }
  }

  private steps(state: State): HTMLElement {
    const about = state.steps[0]?.balances.some((b) => b.signal === view.signal) ? view.signal : worstBalance(state.steps[0]?.balances ?? [])?.signal ?? "";
    const of = (s: Step | undefined): Balance | undefined => s?.balances.find((b) => b.signal === about);
    const now = of(state.steps[state.at]), before = state.at > 0 ? of(state.steps[state.at - 1]) : undefined;
    const worst = Math.max(2, ...state.steps.map((s) => excessOf(of(s)) ?? 0));
    const largest = Math.max(...state.steps.map((s) => { const b = of(s); return b ? errorOf(b) ?? 0 : 0; }));
    // One unit for all steps of the list.
    const byNoise = state.steps.every((s) => excessOf(of(s)) !== null);
    const figure = (b: Balance | undefined) => (byNoise ? times(excessOf(b)) : b ? withUnit(errorOf(b), b.unit, 3) : "–");
    const length = (b: Balance | undefined) => { const e = byNoise ? excessOf(b) : null; return e !== null ? Math.log(Math.max(1.02, e)) / Math.log(worst) : b ? (errorOf(b) ?? 0) / (largest || 1) : 0; };
    const excess = excessOf(now);
    return el("div", { class: "steps" },
      el("div", { class: "headline" },
        el("div", { class: "big", "data-excess": excess === null ? "" : excess.toFixed(4) }, before ? el("span", { class: "was" }, excess !== null ? times(excessOf(before)) : withUnit(errorOf(before), before.unit), " → ") : null, excess !== null ? times(excess) : now ? withUnit(errorOf(now), now.unit) : "–"),
        el("p", {}, excess !== null ? "the noise: " : "", el("strong", {}, `error of the ${words(about)}`), now?.holdout !== null && now ? " on motions that the fit never saw" : " on fitted data (none are held out)",
          now ? `: ${withUnit(errorOf(now), now.unit)}${floorOf(now) ? `; noise alone ${withUnit(floorOf(now), now.unit)}` : ""}` : "")),
      el("ol", { class: "history", "data-scroll": "steps", "aria-label": "Steps" }, state.steps.map((s, k) => el("li", { class: k === state.at ? "now" : k > state.at ? "later" : "", "aria-current": k === state.at ? "step" : null },
        el("button", { type: "button", "data-key": `step ${k}`, "data-step": k, disabled: state.work !== null, click: () => this.run("go", { step: k }), title: k === state.at ? "the present model" : "go to this step" },
          el("span", { class: "name" }, title(s)), el("span", { class: "figure" }, figure(of(s))), bar(length(of(s)), (excessOf(of(s)) ?? 9) <= 1.3 ? "fine" : "bad"))))),
      el("div", { class: "row actions" }, button("Undo", () => this.run("undo"), { disabled: state.at === 0 || state.work !== null, title: "Ctrl+Z" }), button("Redo", () => this.run("redo"), { disabled: state.at + 1 >= state.steps.length || state.work !== null, title: "Ctrl+Y" }),
        button("Identify again", () => this.run("refit"), { disabled: state.work !== null })));
  }

  private parameters(state: State): HTMLElement {
    let last = "";
    return el("div", { class: "scroll", "data-scroll": "parameters", tabindex: 0, role: "region", "aria-label": "Parameters" }, el("table", {},
      el("thead", {}, el("tr", {}, ["effect", "parameter"].map((t) => el("th", { scope: "col" }, t)), ["value", ...(state.at > 0 ? ["change"] : []), "± 95 %", "spread"].map((t) => el("th", { scope: "col", class: "n" }, t)), el("th", { scope: "col" }, "unit"), el("td", {}))),
      el("tbody", {}, state.parameters.map((p) => {
        const isFirst = p.id !== last;
        last = p.id;
        const half = p.interval[0] !== null && p.interval[1] !== null ? (p.interval[1] - p.interval[0]) / 2 : null;
        return el("tr", { class: isFirst ? "first" : "" }, el("th", { scope: "row" }, isFirst ? words(p.id) : ""), el("td", {}, words(p.parameter)), el("td", { class: "n" }, num(p.value, 5)), state.at > 0 ? el("td", { class: "n soft", title: "against the step before", "data-change": "" }, change(state, p)) : null,
          el("td", { class: "n", title: half !== null && p.value ? `${num(Math.abs(100 * half / p.value), 2)} % of the value` : "" }, num(half, 2)),
          el("td", { class: `n ${p.reliable === false ? "high" : ""}`, title: p.reliable === false ? "differs too much between experiments" : "" }, p.spread_percent === null ? "–" : `${num(p.spread_percent, 3)} %${p.reliable === false ? " !" : ""}`), el("td", {}, unit(p.unit)),
          el("td", {}, isFirst ? el("button", { type: "button", class: "quiet", "data-key": `remove ${p.id}`, "aria-label": `Remove ${words(p.id)} and refit`, title: "Remove and refit", disabled: state.work !== null, click: () => this.run("remove", { effect: p.id }) }, "✕") : null));
      }))));
  }

  private save(state: State): HTMLElement {
    const input = this.name;
    if (!input.value && document.activeElement !== input) input.value = `${(state.model_file.split("/").pop() ?? "model").replace(/\.toml$/, "")}-better`;
    const kinds: [string, string, string][] = [["model", ".toml", "Save model"], ["report", ".html", "Save report"], ["block", ".block", "Save block"]];
    const p = state.pack;
    return el("div", { class: "save" },
      el("label", { class: "row" }, "Name ", input),
      el("div", { class: "row actions" }, kinds.map(([what, ending, text]) => button(text, () => void this.save_(what, `${input.value}${ending}`), { "data-save": what, disabled: state.work !== null }))),
      el("p", { class: "soft" }, `Into ${state.folder}`), state.saved ? el("p", { class: "done", "data-saved": state.saved.what }, `✓ ${state.saved.file}`) : null,
      el("div", { class: "row actions" }, "Download: ", [...kinds.map(([what]) => what), ...(state.has_dataset_text ? ["dataset"] : [])].map((what) => button(what, () => void download(what).catch((error: Error) => this.run("complain", { what: error.message })), { class: "quiet", "aria-label": `Download ${what}`, "data-key": `download ${what}`, title: what === "dataset" ? "dataset.toml: which column is which, to be kept in the folder of the recordings" : "" }))),
      el("div", { class: "row actions" }, button("Pack for a drive", () => this.run("pack"), { "data-pack": "", disabled: state.work !== null }),
        p ? el("span", { class: "done", "data-packed": "" }, `${p.bytes} bytes; fixed point is off by at most ${withUnit(p.max_error_nm, p.unit, 3)}, ${num(100 * p.max_error_share_of_rated, 2)} % of rated ${p.unit === "N" ? "force" : "torque"} (${words(p.worst_balance)} balance); ${p.bounds} bounds proven`) : null));
  }

  private async save_(what: string, name: string): Promise<void> {
    const exists = await act("save", { what, name }).then(() => null, (error: Error) => error);
    if (!exists) return;
    if (exists.message.includes("is there already")) {
      if (confirm(`${name} is there already. Replace it?`)) this.run("save", { what, name, replace: true });
    } else this.run("complain", { what: exists.message });
  }
}

function title(s: Step): string {
  switch (s.action) {
    case "open": return "as opened";
    case "identify": return "identified again";
    case "add": return `+ ${words(s.what)}`;
    case "remove": return `− ${words(s.what)}`;
    default: return `+ data: ${s.what}`;
  }
}

