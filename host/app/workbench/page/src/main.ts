// The page: four panels draw the server's state; the user's actions are sent to the server.
import { act, get, openTab, Refusal, sendFiles, type Problem, type State } from "./api";
import { Add } from "./add";
import { NewProject } from "./new_project";
import { announce, button, el, fill, fillOnce, words } from "./dom";
import { droppedFiles, kEndings } from "./dropped";
import { FitQuality } from "./fit_quality";
import { Missing } from "./missing";
import { redrawAll } from "./plots";
import { offerPlots } from "./plot_files";
import { onViewChange, stepKey, view } from "./store";
import "./style.css";
import { ErrorLocation } from "./error_location";

const top_ = document.getElementById("top") as HTMLElement;
const panels = document.getElementById("panels") as HTMLElement;
const drop = document.getElementById("drop") as HTMLElement;
const note = el("div", { class: "note", role: "alert", hidden: true });
const help = el("dialog", { "aria-label": "Keys" });

let state: State | null = null;
let local: Problem | null = null;  // reported by a request, not by work
let wasDiagnosing = "";
let shownAt = -1;

function complain(error: Error): void {
  local = { during: "", what: error.message, findings: [] };
  render();
}

function run(what: string, more: Record<string, unknown> = {}): void {
  local = null;
  if (what === "complain") return complain(new Error(String(more["what"])));
  // A search for what is missing is cancelled by what the user starts, and begins again where the model is the same then.
  const searching = state?.work?.what.startsWith("Searching") && !["cancel", "diagnose", "dismiss", "disconnect", "empty-map"].includes(what);
  if (what === "propose") proposed = proposed.then(() => act("cancel")).then(() => act(what, more)).finally(again).catch(complain);
  else (searching ? act("cancel").then(() => act(what, more)).finally(again) : act(what, more)).catch(complain);
}
// Choices may follow each other before the page knows that the last one is being read: each is sent after the one before.
let proposed: Promise<void> = Promise.resolve();

// The search uses all cores, so the first panels are drawn before it begins.
const good = new FitQuality(), where = new ErrorLocation(() => setTimeout(() => { if (state) searchAutomatically(state); }, 50), complain);
const missing = new Missing((effect) => run("add", { effect }), () => run("diagnose"));
const add = new Add(run);
const beginning = new NewProject(run, () => picker.click());

// Parts that stay: the progress of work changes many times a second, and its button must stay in place.
const title = el("p", { class: "about clip" }), warned = el("span"), stage = el("span", { class: "clip" });
const working = el("div", { class: "work", role: "status" }, el("span", { class: "busy" }), stage, button("Cancel", () => run("cancel")));

function header(s: State): void {
  if (!title.isConnected)
    fill(top_, el("h1", {}, "Flexspline"), title, warned, el("label", { class: "file" }, "Add files", filePicker()), button("Save plots", offerPlots, { class: "quiet" }), button("Light or dark", toggleTheme, { class: "quiet", title: "Light or dark" }), button("Keys", () => help.showModal(), { class: "quiet", title: "?" }));
  if (s.steps.length) fill(title, el("strong", {}, s.model_name || s.model_file), el("span", { class: "soft" }, ` on ${s.data_name}: ${s.experiments.length} experiments, ${s.experiments.filter((e) => e.role === "holdout").length} held out`));
  else fill(title, el("span", { class: "soft" }, "no model yet"));
  if (s.work) {
    stage.textContent = `${words(s.work.what)}${s.work.stage ? `: ${words(s.work.stage)}` : ""}`;
    working.dataset.work = s.work.what;
    if (!working.isConnected) title.after(working);
  } else working.remove();
  const count = s.warnings?.length ?? 0;
  fillOnce(warned, String(count), count ? button(`${count} warning${count > 1 ? "s" : ""}`, () => showMessages("Warnings", state?.warnings ?? []), { class: "quiet" }) : null);
}

const picker = el("input", { type: "file", multiple: true, accept: kEndings.join(","), class: "unseen", "aria-label": "Add files", "data-key": "files" });
picker.addEventListener("change", () => { void send(Array.from(picker.files ?? [])); picker.value = ""; });
function filePicker(): HTMLElement { return picker; }

function showMessages(title: string, lines: string[]): void {
  const dialog = el("dialog", { "aria-label": title });
  dialog.append(el("h2", {}, title), el("ul", {}, lines.map((l) => el("li", {}, l))), button("Close", () => dialog.close()));
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

function problem(p: Problem | null): void {
  note.hidden = !p;
  if (!p) return fillOnce(note, "");
  const place = (f: Problem["findings"][number]) => f.file + (f.line ? `:${f.line}` : "") + (f.column ? `, column ${f.column}` : "");
  // Screen readers say it once, not with each change of the state.
  fillOnce(note, JSON.stringify(p), el("div", { class: "row" }, el("strong", {}, p.during ? `${words(p.during)}: ${p.what}` : p.what), button("Dismiss", () => { local = null; run("dismiss"); })),
    p.findings.length ? el("ul", {}, p.findings.slice(0, 8).map((f) => el("li", {}, f.file ? el("code", {}, place(f)) : null, f.file ? " " : "", `${f.what}. `, el("em", {}, f.remedy)))) : null);
}

function render(): void {
  const s = state;
  if (!s) return;
  header(s);
  problem(local ?? s.problem ?? null);
  const begins = beginning.render(s);
  panels.hidden = begins;
  document.body.dataset.ready = "yes";
  document.body.dataset.step = s.steps.length ? String(s.at) : "";
  if (begins) return;
  if (shownAt !== s.at) announce(`step ${s.at + 1} of ${s.steps.length}`);
  shownAt = s.at;
  good.render(s);
  where.render(s);
  missing.render(s);
  add.render(s);
}

// The search for what is missing starts by itself, once for each step.
function searchAutomatically(s: State): void {
  const key = stepKey(s);
  if (!s.steps.length || s.proposal || s.diagnosis || s.work || !where.isShown || wasDiagnosing === key) return;
  wasDiagnosing = key;
  // Something else may have begun meanwhile: then it starts after that.
  act("diagnose").catch((error: Error) => { if (error instanceof Refusal && error.status === 409) wasDiagnosing = ""; else complain(error); });
}
// A search that was cancelled for another action begins again.
function again(): void {
  wasDiagnosing = "";
  if (state) searchAutomatically(state);
}

async function follow(): Promise<void> {
  for (let seen = 0; ;) {
    try {
      const next = await get<State>("state", { seen });
      const wasLost = document.body.classList.contains("lost");
      document.body.classList.remove("lost");
      if (next.changes === seen) {
        if (wasLost) render();  // without the message
        continue;
      }
      state = next;
      seen = next.changes;
      render();
      searchAutomatically(state);
    } catch (error) {
      if (error instanceof Refusal && error.status === 404) return location.reload();
      document.body.classList.add("lost");
      const isOther = error instanceof Refusal && error.status === 403;
      local = { during: "", what: isOther ? "Another workbench answers here: the one of this page has ended. Open the address that the new one printed."
        : "The workbench does not answer. If it was ended, start it again and open the address that it prints; else this page continues as soon as it answers.", findings: [] };
      problem(local);
      await new Promise((later) => setTimeout(later, 1500));
      local = null;
    }
  }
}

async function send(files: File[]): Promise<void> {
  local = null;
  if (!files.length) return;
  try {
    const searching = state?.work?.what.startsWith("Searching");
    if (searching) await act("cancel");
    await sendFiles(files).finally(() => { if (searching) again(); });
  } catch (error) {
    complain(error as Error);
  }
}

function theme(dark: boolean): void {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  redrawAll();
}
function toggleTheme(): void {
  const dark = document.documentElement.dataset.theme !== "dark";
  localStorage.setItem("theme", dark ? "dark" : "light");
  theme(dark);
}

function keys(): void {
  fill(help, el("h2", {}, "Keys"), el("dl", {}, [["1 2 3 4", "to the four panels"], ["Tab, arrows", "through experiments, maps, candidates"], ["in curves: ← →  + −  0", "pan, zoom, show all; wheel and drag zoom, Shift and drag pans"],
    ["in a map: ← →", "mark a region; it shows in the curves; Esc clears it"], ["Ctrl+Z, Ctrl+Y", "undo, redo"], ["?", "this"]].map(([k, t]) => el("div", {}, el("dt", {}, k), el("dd", {}, t)))), button("Close", () => help.close()));
  addEventListener("keydown", (e) => {
    const typing = e.target instanceof HTMLInputElement || e.target instanceof HTMLSelectElement;
    if ((e.ctrlKey || e.metaKey) && !typing) {
      // Columns that are being chosen belong to no step: they would be lost.
      const steps = panels.hidden ? 0 : state?.steps.length ?? 0, at = state?.at ?? 0;
      const isUndo = e.key === "z" && !e.shiftKey, isRedo = e.key === "y" || (e.key === "Z" && e.shiftKey);
      if (isUndo || isRedo) e.preventDefault();
      if (isUndo && steps && at > 0) run("undo");
      if (isRedo && at + 1 < steps) run("redo");
      return;
    }
    if (typing || e.altKey) return;
    if (e.key === "?" && !help.open) help.showModal();
    const panel = panels.children[Number(e.key) - 1];
    if (/^[1-4]$/.test(e.key) && panel) (panel.querySelector<HTMLElement>("[tabindex='0'], button:not(:disabled), [role=tab]") ?? (panel as HTMLElement)).focus();
  });
}

function dropping(): void {
  fill(drop, el("p", {}, "Drop recordings here"));
  addEventListener("dragover", (e) => { e.preventDefault(); drop.hidden = false; });
  addEventListener("dragleave", (e) => { if (!e.relatedTarget) drop.hidden = true; });
  addEventListener("drop", (e) => { e.preventDefault(); drop.hidden = true; droppedFiles(e.dataTransfer).then(send, complain); });
}

async function begin(): Promise<void> {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const stored = localStorage.getItem("theme");
  theme(stored ? stored === "dark" : dark.matches);
  dark.addEventListener("change", () => { if (!localStorage.getItem("theme")) theme(dark.matches); });
  top_.append(el("h1", {}, "Flexspline"), el("p", { class: "about" }, "Loading …"));
  panels.append(good.element, where.element, missing.element, add.element);
  document.body.append(help);
  top_.after(note);
  panels.after(beginning.element);
  keys();
  dropping();
  onViewChange(() => { if (state?.steps.length) { good.render(state); where.render(state); add.render(state); } });
  try {
    await openTab();
  } catch (error) {
    fill(top_, el("h1", {}, "Flexspline"), el("p", { class: "about" }, (error as Error).message));
    return;
  }
  await follow();
}

void begin();
export { view };
