// What the page shows at present, shared by its panels.
import type { Balance, Experiment, State } from "./api";

export interface Brush { variable: string; low: number; high: number; unit: string; list: { experiment: string; rows: number; stretches: [number, number][] }[] }

export const view = {
  signal: "",       // a balance or a free run
  experiment: "",
  overlay: "",      // another experiment, drawn into the same plots
  brush: null as Brush | null,
};

// The present step and the one before it: what is drawn for them need not be fetched again.
export function stepKey(state: State): string {
  return [state.at, state.steps[state.at]?.id, state.steps[state.at - 1]?.id].join("|");
}

type Listener = () => void;
const listeners = new Set<Listener>();
export function onViewChange(listener: Listener): void { listeners.add(listener); }
export function viewChanged(): void { for (const listener of listeners) listener(); }

// On motions that the fit never saw, where there are any.
export function errorOf(b: Balance): number | null { return b.holdout ?? b.fit; }
export function floorOf(b: Balance): number | null { return b.holdout === null ? b.noise_floor_fit : b.noise_floor_holdout; }
export function excessOf(b: Balance | undefined): number | null {
  if (!b) return null;
  const error = errorOf(b), floor = floorOf(b);
  return error !== null && floor ? error / floor : null;
}
export function worstBalance(balances: Balance[]): Balance | undefined {
  return [...balances].sort((a, b) => (excessOf(b) ?? 0) - (excessOf(a) ?? 0))[0];
}
// The balance that is shown at present; free runs have none of their own.
export function balanceInView(state: State): Balance | undefined {
  return state.balances.find((b) => b.signal === view.signal) ?? worstBalance(state.balances);
}
// A list has one unit: multiples of the noise where all of it has a noise, else the error itself.
export function inNoise(experiments: Experiment[], signal: string): boolean {
  const all = experiments.flatMap((e) => e.signals.filter((x) => x.signal === signal));
  return all.length > 0 && all.every((s) => s.excess !== null);
}
export function badness(e: Experiment, signal: string, byNoise: boolean): number {
  const s = e.signals.find((x) => x.signal === signal);
  return s ? (byNoise ? s.excess : s.rmse ?? s.nrmse) ?? -1 : -2;
}
