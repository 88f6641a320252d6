// The server: what it answers, and the tab's place with it.
import { saveAs } from "./dom";

export interface Signal {
  signal: string; unit: string; rmse: number | null; nrmse: number | null; noise_floor: number | null; excess: number | null; free_run: boolean;
}
export interface Experiment {
  name: string; role: "fit" | "holdout"; load: string; samples: number; begin_s: number; end_s: number; signals: Signal[];
}
export interface Balance {
  signal: string; unit: string; fit: number | null; holdout: number | null; noise_floor_fit: number | null; noise_floor_holdout: number | null;
  noise_floor_from: string;
}
export interface Step { id: string; action: string; what: string; balances: Balance[]; effects: string[] }
export interface Parameter {
  id: string; effect: string; parameter: string; value: number | null; unit: string; std: number | null; interval: [number | null, number | null];
  spread_percent: number | null; reliable: boolean | null; identifiable: boolean;
}
export interface Bin { low: number; high: number; lacking: number; effect: number }
export interface Evidence { variable: string; unit: string; resisting: boolean; bins: Bin[] }
export interface Candidate {
  effect: string; order: number | null; balance: string; rank: number; score: number | null; chi2_fall_percent: number | null;
  rmse_cv_before: number | null; rmse_cv_after: number | null; unit: string; p_value: number | null; parameters: Parameter[];
  admissible: boolean; why_not: string | null; note: string | null; rivals: string[]; evidence: Evidence | null; equation: string | null;
  separating_experiment: string | null; explanation: string | null; consequence: string | null; causes: string | null; check: string | null;
  order_causes: { from: string; cause: string; check: string; cure: string; reference: string }[] | null; order_hint: string | null;
}
export interface Diagnosis {
  verdict: string; verdict_in_words: string; named: { effect: string; order: number | null }[]; balance: string | null;
  base: { rmse: number | null; rmse_cv: number | null; noise_floor: number | null; unit?: string };
  localised: { variable: string; share_percent: number }[]; candidates: Candidate[];
  resampling?: { decides: boolean; found: { effects: { effect: string; order: number | null }[]; frequency: number | null }[] } | null;
  possible?: { effects: { effect: string; order: number | null }[]; frequency: number | null; why_not: string }[];
  unknown?: Unknown | null; disturbances: { experiment: string; from_s: number; to_s: number; peak: number; unit: string }[];
}
// A curve that no effect explains.
export interface Unknown { [key: string]: unknown }
export interface Problem { during: string; what: string; findings: { file: string; line: number; column: string; what: string; remedy: string }[] }
export interface BlockView { model: string; bytes: number; sha256: string }
export interface BlockChange { effect: string; change: string; parameter: string; before: number | null; after: number | null; unit: string }
export interface Flash {
  before: BlockView | null; after: BlockView | null; warnings: string[]; flashed: boolean; drive: string; changes: BlockChange[];
}
// What a flash, or going back, would change; nothing is done before it is confirmed.
export interface FlashPreview extends Flash { restores: boolean; predicted?: { in_words?: string; problem?: string; stable?: boolean } }
export interface State {
  changes: number; data_name: string; model_name: string; model_file: string; folder: string; experiments: Experiment[]; balances: Balance[];
  warnings: string[]; steps: Step[]; at: number; parameters: Parameter[]; diagnosis: Diagnosis | null;
  works_started: number;
  work: { what: string; stage: string; seconds: number } | null; problem?: Problem;
  pack?: { bytes: number; sha256: string; max_error_nm: number; max_error_share_of_rated: number; worst_balance: string; bounds: number; unit: string };
  saved?: { what: string; file: string }; flash?: Flash;
  scenarios: string[]; rig: string; closed_loop?: ClosedLoop;
  parameters_before: { id: string; parameter: string; value: number | null }[]; has_dataset_text?: boolean; proposal?: Proposal; flash_preview?: FlashPreview;
}

// Recordings, and which of their columns is taken for which signal; see host/app/workbench/README.md.
export interface ProposedColumn {
  column: string; units: { unit: string; factor: number | null; offset: number }[]; source: string | null; unit?: string; scale?: number; why?: string; stated?: boolean;
}
export interface Proposal {
  files: string[]; columns: ProposedColumn[]; adds: boolean;
  signals: { name: string; unit: string; low?: (number | null)[]; high?: (number | null)[]; least?: number | null; largest?: number | null }[];
  axis: string; position_side: string; question: string; joints: number[]; joint: number | null; needs_pole_pairs: string; gear_ratio: number | null; torque_constant_nm_a: number | null; pitch_m: number | null;
  encoder_counts: number | null; notes: string[]; warnings: string[]; effects: string[]; reasons: string[]; can_begin: boolean; why_not: string; has_dataset_toml: boolean;
  choices?: { page?: PageChoices } | null;
  findings: { file: string; line: number; column: string; what: string; remedy: string; tolerate: string | null }[];
}

// What was chosen on the page, which is sent with each proposal: a page that is loaded again goes on with it.
export interface PageChoices {
  chosen: [string, { source: string | null; unit: string }][]; facts: Record<string, string>; tolerated: string[]; turned: string[]; left: string[];
}

// Errors in rad, currents in A; see host/output/answers/JSON.md.
export interface ClosedRun {
  compensation: "none" | "base" | "now"; rms_error_rad: number | null; peak_error_rad: number | null; rms_current_a: number | null; ratio_to_none: number | null;
  fault: string | null; ends_in_fault: boolean; predicted: { ratio: number; interval: [number, number] } | null;
}
export interface ClosedLoop {
  scenario: string; what: string; seconds: number; gains: { velocity_loop_hz: number; position_loop_hz: number }; runs: ClosedRun[]; plant: string; is_model: boolean;
  step: { at: number; action: string; what: string };
}

export class Refusal extends Error {
  constructor(readonly status: number, what: string) { super(what); }
}

const kBase = new URL(".", location.href).href;
let tab = "";

async function answer(response: Response): Promise<unknown> {
  const text = await response.text();
  if (response.ok) return JSON.parse(text);
  let what = text;
  try { what = (JSON.parse(text) as { what: string }).what; } catch { /* plain text */ }
  if (response.status === 413) what = "These are more than the workbench takes at a time (1 GB): send fewer files, or shorter ones.";
  throw new Refusal(response.status, what || `The workbench answers with the status ${response.status}.`);
}

function address(path: string, query: Record<string, string | number> = {}): string {
  const url = new URL(`api/${path}`, kBase);
  url.searchParams.set("tab", tab);
  for (const [key, value] of Object.entries(query)) url.searchParams.set(key, String(value));
  return url.href;
}

export async function get<T>(path: string, query: Record<string, string | number> = {}, signal?: AbortSignal): Promise<T> {
  return (await answer(await fetch(address(path, query), signal ? { signal } : {}))) as T;
}

export async function act(what: string, more: Record<string, unknown> = {}): Promise<void> {
  await answer(await fetch(address("do"), { method: "POST", body: JSON.stringify({ do: what, ...more }) }));
}

export async function sendFiles(files: File[]): Promise<void> {
  const form = new FormData();
  files.forEach((file, k) => form.append(`file${k}`, file, file.name));
  // The browser gives no reason.
  const response = await fetch(address("drop"), { method: "POST", body: form }).catch(() => { throw new Error(`${files.map((f) => f.name).slice(0, 3).join(", ")}: not sent. Check that the files are still there and may be read, and that the workbench runs; then drop them again.`); });
  await answer(response);
}

// A link to the file would show a refusal in place of the page.
export async function download(what: string): Promise<void> {
  const response = await fetch(address("file", { what }));
  if (!response.ok) await answer(response);
  saveAs(await response.blob(), /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ?? what);
}

// A reload finds its tab again; a tab that was duplicated gets one of its own, which begins with the other's step.
export async function openTab(): Promise<void> {
  const kept = sessionStorage.getItem("tab") ?? "";
  if (kept && (await isMine(kept))) {
    tab = kept;
    try {
      await get("state", { seen: 0 });
      return;
    } catch (error) {
      if (!(error instanceof Refusal) || error.status !== 404) throw error;
    }
  }
  const url = new URL("api/tab", kBase);
  if (kept) url.searchParams.set("like", kept);
  tab = ((await answer(await fetch(url, { method: "POST" }))) as { tab: string }).tab;
  sessionStorage.setItem("tab", tab);
  await isMine(tab);
}

// Holds a lock as long as the page lives. The page before a reload may let go of it a moment later.
async function isMine(id: string): Promise<boolean> {
  for (let attempt = 0; attempt < 5; ++attempt) {
    const got = await new Promise<boolean>((resolve) => {
      void navigator.locks.request(`flexspline-${id}`, { ifAvailable: true }, (lock) => {
        resolve(lock !== null);
        return lock ? new Promise<void>(() => undefined) : undefined;
      });
    });
    if (got) return true;
    await new Promise((later) => setTimeout(later, 100));
  }
  return false;
}

// A packed signal: see host/output/report/README.md.
export interface Packed { offset: number; scale: number; count: number; codes: string }
export function unpack(packed: Packed): (number | null)[] {
  const bytes = atob(packed.codes);
  const values = new Array<number | null>(packed.count);
  for (let k = 0; k < packed.count; ++k) {
    const code = bytes.charCodeAt(2 * k) | (bytes.charCodeAt(2 * k + 1) << 8);
    values[k] = code === 65535 ? null : packed.offset + packed.scale * code;
  }
  return values;
}
