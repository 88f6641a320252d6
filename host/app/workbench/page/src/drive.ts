// The drive: connect, flash, go back, and its signals live.
import type uPlot from "uplot";
import { get, type BlockChange, type BlockView, type FlashPreview, type State } from "./api";
import { announce, button, el, fill, num, relative, unit, words } from "./dom";
import { MapPanel } from "./map";
import { axes, Figure, line } from "./plots";

interface Status { status: { given: string; connected: boolean; name?: string; serial?: string; board?: string; block: BlockView | null; problem: string; moving: boolean; simulated: boolean; came_back: boolean; again: { drive: string; attempts: number; why: string } | null }; in_reach: { drive: string; what: string; usable: boolean; problem: string }[] }
interface Live { connected: boolean; problem: string; attempts: number; channels: { name: string; unit: string }[]; next: number; mode: string; samples: number[][] }

// What another block changes, with the relative change of each value.
function changes(all: BlockChange[]): HTMLElement {
  const changed = all.filter((c) => c.change !== "same");
  const value = (c: BlockChange) => `${num(c.before, 5)} → ${num(c.after, 5)} ${unit(c.unit)}`;
  return el("ul", { class: "changes" }, changed.slice(0, 12).map((c) => el("li", {}, `${c.change} ${words(c.effect)}${c.parameter ? ` ${words(c.parameter)}: ${value(c)}` : ""}`, c.parameter ? el("span", { class: "soft" }, ` (${relative(c.before, c.after)})`) : null)),
    changed.length > 12 ? el("li", {}, `and ${changed.length - 12} more`) : null, changed.length ? null : el("li", {}, "nothing: the drive has these values already"));
}

// What the model is worth on this drive, as `flexspline flash` predicts it.
function gain(p: FlashPreview): (HTMLElement | null)[] {
  const found = p.predicted;
  if (!found) return [];
  if (found.problem) return [el("p", { class: "soft" }, `The gain cannot be predicted: ${found.problem}`)];
  return [el("p", { "data-predicted": "" }, found.in_words ?? ""), found.stable === false ? el("p", { class: "high" }, "In the prediction the drive had a fault with this model.") : null];
}

export class DrivePanel {
  private readonly head = el("div", { class: "column" });
  private readonly readout = el("dl", { class: "live" });
  private readonly figure = new Figure(el("div", { class: "plot", role: "img", "aria-label": "Live signal of the drive" }));
  private readonly live = el("div", { class: "column grow" }, this.readout, this.figure.holder);
  private readonly choice = el("div", { class: "choice" });
  private readonly map: MapPanel;
  private readonly right: HTMLElement;
  readonly element: HTMLElement;
  visible = false;
  private showsMap = false;
  private status: Status | null = null;
  private samples: number[][] = [];
  private channels: { name: string; unit: string }[] = [];
  private channel = 0;
  private next = 0;
  private timer = 0;
  private works = "";  // how many were started, and whether the last one is over
  private asked = 0;
  private lost = false;
  private state: State | null = null;

  constructor(private readonly run: (what: string, more?: Record<string, unknown>) => void) {
    this.map = new MapPanel(run);
    this.right = el("div", { class: "column grow" }, this.choice, this.live, this.map.element);
    this.element = el("div", { class: "drive" }, this.head, this.right);
  }

  render(state: State): void {
    this.state = state;
    // A work that is over before the page has polled it changes the drive as well.
    const works = `${state.works_started} ${state.work === null}`;
    if (!this.status || this.works !== works) void this.refresh(state);
    this.works = works;
    this.draw(state);
    if (this.visible && !this.timer) this.listen();
  }

  // Of two pending answers the one to the last request counts, whichever comes first.
  private async refresh(state: State): Promise<void> {
    const asked = ++this.asked;
    try {
      const status = await get<Status>("drive");
      if (asked !== this.asked) return;
      const lost = status.status.again !== null;
      if (lost && !this.lost) announce("The drive was lost. It is connected again when it answers.");
      if (!lost && this.lost && status.status.connected) announce("The drive is connected again.");
      this.lost = lost;
      this.status = status;
    } catch (error) {
      if (asked !== this.asked) return;
      this.status = null;
      fill(this.head, el("p", { class: "empty" }, (error as Error).message));
      return;
    }
    this.draw(state);
  }

  private draw(state: State): void {
    const s = this.status?.status;
    if (!this.status || !s) return fill(this.head, el("p", { class: "empty" }, "Searching for drives …"));
    this.right.hidden = !s.connected;
    this.live.hidden = this.showsMap;
    this.map.element.hidden = !this.showsMap;
    this.map.visible = this.visible && this.showsMap && s.connected;
    this.element.classList.toggle("asks", s.connected && !s.again && !!state.flash_preview);
    const part = (text: string, map: boolean) => button(text, () => { this.showsMap = map; this.draw(state); }, { "aria-pressed": this.showsMap === map ? "true" : "false", "data-part": text });
    fill(this.choice, part("Live signals", false), part("Residual map", true), this.showsMap && s.connected ? this.map.actions : null);
    if (!s.connected) this.map.forget(); else if (this.showsMap) this.map.render(state, s.simulated, s.given || s.serial || "");
    const off = state.work !== null;
    if (s.again) {
      const tried = s.again.attempts ? ` Tried ${s.again.attempts} time${s.again.attempts > 1 ? "s" : ""}${s.again.why ? `, at last: ${s.again.why}` : ""}.` : "";
      fill(this.head, el("div", { "data-again": s.again.attempts }, el("p", { class: "high" }, el("strong", {}, "The drive was lost. "), s.problem),
        el("p", {}, `${s.again.drive} is connected again by itself as soon as it answers; what was being done to it is not done again.`, el("span", { class: "soft" }, tried)),
        el("div", { class: "row actions" }, button("Stop trying", () => { this.status = null; this.run("disconnect"); }, { "data-stop": "" }))));
      return;
    }
    if (!s.connected) {
      fill(this.head, el("p", {}, "No drive is connected."), s.problem ? el("p", { class: "high" }, s.problem) : null,
        el("ul", { class: "reach" }, this.status.in_reach.map((d) => el("li", {}, button(`Connect ${d.drive}`, () => this.run("connect", { drive: d.drive }), { disabled: off || !d.usable, "data-connect": d.drive }), el("span", { class: "soft" }, d.usable ? d.what : d.problem)))));
      return;
    }
    const f = s.came_back || state.flash?.drive !== s.serial ? undefined : state.flash;  // what it has in it now may be something else
    const p = state.flash_preview;  // the server flashes nothing but what it shows
    fill(this.head, el("p", {}, el("strong", {}, `${s.serial} `), el("span", { class: "soft" }, `${s.board}; ${s.block ? `block “${s.block.model}”, ${s.block.bytes} bytes` : "no block"}`)),
      el("div", { class: "row actions" }, button("Flash this model", () => this.run("preview-flash"), { class: p ? "" : "main", disabled: off, "data-flash": "" }), button("Go back to the block before", () => this.run("preview-restore"), { disabled: off, "data-restore": "" }), button("Disconnect", () => { this.status = null; this.run("disconnect"); }, { class: "quiet", disabled: off })),
      s.came_back ? el("p", { class: "soft", "data-back": "" }, "It was lost and is connected again. Nothing was done to it meanwhile: check whether its block is the right one.") : null,
      p ? el("div", { class: "preview", "data-preview": p.restores ? "restore" : "flash" }, el("p", {}, el("strong", {}, p.restores ? "Going back would change:" : "Flashing would change:"), el("span", { class: "soft" }, ` ${p.before ? `“${p.before.model}”` : "no block"} → ${p.after ? `“${p.after.model}”` : "no block"}`)),
        el("div", { class: "row actions" }, button(p.restores ? "Go back" : "Flash it", () => this.run(p.restores ? "restore" : "flash", { before: p.before?.sha256 ?? "", after: p.after?.sha256 ?? "" }), { class: "main", disabled: off, "data-confirm": "" }), button("Leave it as it is", () => this.run("dismiss-preview"), { class: "quiet", disabled: off })),
        changes(p.changes), gain(p), p.warnings.map((w) => el("p", { class: "high" }, w))) : null,
      f && !p ? el("div", { class: "done", "data-flashed": f.flashed ? "yes" : "no" }, el("p", {}, f.flashed ? "✓ flashed, read back and in use" : "The drive has this block already."), f.warnings.map((w) => el("p", { class: "high" }, w)),
        changes(f.changes)) : null);
  }

  private listen(): void {
    const round = async () => {
      this.timer = 0;
      if (!this.visible) return;
      try {
        const answer = await get<Live>("live", { since: this.next });
        if (answer.connected) this.take(answer);
        // A drive that was lost without an action of the user.
        const known = this.status?.status;
        if (this.state && known && (answer.connected !== known.connected || answer.attempts !== (known.again?.attempts ?? 0))) await this.refresh(this.state);
      } catch { /* reported by the caller */ }
      this.timer = window.setTimeout(() => void round(), 200);
    };
    this.timer = window.setTimeout(() => void round(), 0);
  }

  private take(answer: Live): void {
    this.channels = answer.channels;
    this.next = answer.next;
    this.samples.push(...answer.samples);
    const last = this.samples[this.samples.length - 1];
    this.samples = this.samples.filter((s) => last && (s[0] ?? 0) > (last[0] ?? 0) - 20 && (s[0] ?? 0) <= (last[0] ?? 0));
    fill(this.readout, el("div", {}, el("dt", {}, "mode"), el("dd", {}, answer.mode || "–")), this.channels.map((c, k) => el("div", { class: k === this.channel ? "chosen" : "" },
      el("dt", {}, el("button", { type: "button", class: "quiet", "data-key": `channel ${c.name}`, "aria-pressed": k === this.channel ? "true" : "false", click: () => { this.channel = k; } }, words(c.name))), el("dd", {}, `${num(last?.[k + 1], 3)} ${unit(c.unit)}`))));
    this.readout.dataset.samples = String(this.samples.length);
    const chosen = this.channels[this.channel];
    const data = [this.samples.map((s) => s[0] ?? 0), this.samples.map((s) => s[this.channel + 1] ?? null)] as uPlot.AlignedData;
    if (this.figure.plot && this.figure.holder.dataset.channel === chosen?.name) this.figure.plot.setData(data);
    else {
      this.figure.holder.dataset.channel = chosen?.name ?? "";
      this.figure.show(() => ({ data, options: { scales: { x: { time: false } }, axes: axes("time (s)", chosen ? unit(chosen.unit) : ""), series: [{}, line("residual")], cursor: { show: false } } }));
    }
  }
}
