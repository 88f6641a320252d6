// Elements, numbers and words. Texts come into the page here alone, as text nodes: none of them becomes markup.
type Child = Node | string | number | null | undefined | false | Child[];
type Attributes = { [name: string]: string | number | boolean | null | undefined | ((event: never) => void) };

export function el<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name, value as EventListener);
    else if (name.startsWith("--")) element.style.setProperty(name, String(value));
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  append(element, children);
  return element;
}

function append(element: HTMLElement, children: Child[]): void {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    if (Array.isArray(child)) append(element, child);
    else element.append(child instanceof Node ? child : String(child));
  }
}

// What the pointer holds down. A button that is made again before it is let go of would never be clicked, so what holds
// it gets its new content then.
let held: Node | null = null;
const late = new Map<HTMLElement, Child[]>();
addEventListener("pointerdown", (e) => { held = e.target as Node; }, { capture: true });
for (const end of ["pointerup", "pointercancel", "dragend"])
  addEventListener(end, () => setTimeout(() => {
    held = null;
    const all = [...late];
    late.clear();
    for (const [element, children] of all) fill(element, ...children);
  }), { capture: true });

// Puts new content into an element; what had the focus has it again where it has a key (data-key), and a list with a key
// stays open or closed.
export function fill(element: HTMLElement, ...children: Child[]): void {
  if (held && held !== element && element.contains(held)) {
    late.set(element, children);
    return;
  }
  late.delete(element);
  const focused = element.contains(document.activeElement) ? (document.activeElement as HTMLElement).dataset.key : undefined;
  const scrolled = Array.from(element.querySelectorAll<HTMLElement>("[data-scroll]")).map((e) => [e.dataset.scroll, e.scrollTop] as const);
  const lists = Array.from(element.querySelectorAll<HTMLDetailsElement>("details[data-key]")).map((e) => [e.dataset.key ?? "", e.open] as const);
  element.replaceChildren();
  append(element, children);
  for (const [key, open] of lists) {
    const again = element.querySelector<HTMLDetailsElement>(`details[data-key="${CSS.escape(key)}"]`);
    if (again) again.open = open;
  }
  for (const [key, top] of scrolled) {
    const again = element.querySelector<HTMLElement>(`[data-scroll="${key}"]`);
    if (again) again.scrollTop = top;
  }
  if (focused) element.querySelector<HTMLElement>(`[data-key="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
}

// The same, where it is other content than before: a list that is open stays open.
export function fillOnce(element: HTMLElement, key: string, ...children: Child[]): void {
  if (element.dataset.content === key) return;
  element.dataset.content = key;
  fill(element, ...children);
}

const kSuperscript = "⁰¹²³⁴⁵⁶⁷⁸⁹";

export function num(value: number | null | undefined, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, power] = value.toExponential(digits - 1).split("e") as [string, string];
    const raised = String(Math.abs(Number(power))).replace(/\d/g, (d) => kSuperscript[Number(d)] ?? d);
    return `${mantissa.replace("-", "−")}·10${Number(power) < 0 ? "⁻" : ""}${raised}`;
  }
  return Number(value.toPrecision(digits)).toString().replace("-", "−");
}

export function unit(text: string): string {
  if (text === "1") return "";
  return text.replace(/\*/g, "·").replace(/\^2/g, "²").replace(/\^3/g, "³").replace("degC", "°C");
}

export function withUnit(value: number | null | undefined, of: string, digits = 4): string {
  return `${num(value, digits)} ${unit(of)}`.trim();
}

// "motor_balance" in words.
export function words(name: string): string {
  return name.replace(/_/g, " ");
}

export function times(excess: number | null | undefined): string {
  return excess === null || excess === undefined ? "–" : `${excess >= 100 ? excess.toFixed(0) : excess >= 10 ? excess.toFixed(1) : excess.toFixed(2)}×`;
}

// What is subtracted from a record's times where its column has a date in seconds, as the tool's messages do it.
export function startOfTimes(begin: number): number {
  return Math.abs(begin) < 1000 ? 0 : begin;
}

export function timeLabel(start: number): string {
  return start === 0 ? "time (s)" : "time after the first sample (s)";
}

// By how much a value has changed, of what it was before.
export function relative(before: number | null | undefined, after: number | null | undefined): string {
  if (before === null || before === undefined || after === null || after === undefined) return "new";
  if (before === after) return "±0 %";
  if (before === 0) return "was 0";
  const percent = 100 * (after / before - 1);
  const size = Math.abs(percent);
  return size >= 1000 ? `×${num(after / before, 3)}` : `${percent < 0 ? "−" : "+"}${size < 0.01 ? "<0.01" : num(size, 2)} %`;
}

// A bar of a length between zero and one.
export function bar(share: number, kind: string): HTMLElement {
  return el("span", { class: `bar ${kind}`, "--share": Math.max(0, Math.min(1, share)).toFixed(4), "aria-hidden": "true" });
}

export function button(text: string, press: () => void, attributes: Attributes = {}): HTMLButtonElement {
  return el("button", { type: "button", click: press, "data-key": text, ...attributes }, text);
}

// Content that the browser saves as a file.
export function saveAs(content: Blob, name: string): void {
  const href = URL.createObjectURL(content);
  el("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}

// For screen readers.
export function announce(text: string): void {
  const said = document.getElementById("said");
  if (said) said.textContent = text;
}
