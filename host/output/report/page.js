"use strict";
// The document that this page shows; host/output/report/README.md describes it.
const report = JSON.parse(document.getElementById("document").textContent);

// An element with text. Texts of the report are never markup: this is the only way in which they get into the page.
function el(tag, attributes, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes || {})) if (value !== null) element.setAttribute(name, value);
  for (const child of children.flat()) if (child !== null && child !== undefined) element.append(child);
  return element;
}

// Significant digits, as in the terminal; a dash for what is not known.
function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e6))
    return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e").replaceAll("-", "−");
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}

function unitText(unit) {
  if (!unit || unit === "1") return "";
  return unit.replaceAll("*", "·").replaceAll("^2", "²").replaceAll("^3", "³").replaceAll("degC", "°C");
}
function withUnit(value, unit, digits) {
  const text = unitText(unit);
  return number(value, digits) + (text ? " " + text : "");
}

const kSignalNames = {
  motor_balance: "motor balance", transmission_balance: "transmission balance", load_balance: "load balance",
  motor_velocity: "motor velocity", motor_position: "motor position", output_position: "output position", torque: "torque",
};
function signalName(signal) { return kSignalNames[signal] || signal.replaceAll("_", " "); }

const kVariableNames = {
  velocity: "velocity", speed: "speed (without its sign)", acceleration: "acceleration", motor_angle: "motor angle within a turn",
  output_angle: "output angle", current: "motor current", torque: "torque through the gear", torsion: "torsion",
  torsion_rate: "rate of torsion", temperature: "temperature", time: "time since the record began",
  travel: "travel since the last reversal", direction: "direction of motion", record: "experiment",
};
// Forces on a linear axis. The page of hil has no maps.
const isLinear = (report.maps || []).some((b) => b.unit === "N");
const effort = isLinear ? "force" : "torque", kEffort = isLinear ? "Force" : "Torque";
if (isLinear) kSignalNames.torque = effort;
if (isLinear) Object.assign(kVariableNames, { output_angle: "output position", torque: "force through the gear" });
// "velocity x direction" and "motor_angle order 7" in words.
function variableName(variable) {
  const directed = variable.endsWith(" x direction");
  const plain = directed ? variable.slice(0, -" x direction".length) : variable;
  const order = plain.match(/^motor_angle order (\d+)$/);
  const name = order ? `motor angle, ${order[1]} per turn` : kVariableNames[plain] || plain.replaceAll("_", " ");
  return directed ? name + ", with the direction of motion" : name;
}

function listed(items, joint = "and") {
  if (items.length < 2) return items.join("");
  return items.slice(0, -1).join(", ") + " " + joint + " " + items[items.length - 1];
}

// 16-bit codes to numbers; null is a gap.
function unpacked(trace) {
  const bytes = atob(trace.codes);
  const values = new Array(trace.count);
  for (let k = 0; k < trace.count; ++k) {
    const code = bytes.charCodeAt(2 * k) | (bytes.charCodeAt(2 * k + 1) << 8);
    values[k] = code === 65535 ? null : trace.offset + trace.scale * code;
  }
  return values;
}

// A table with a caption. Cells are texts, elements, or {n: number-like text}, which is set to the right.
function table(caption, head, rows) {
  const cell = (tag, content, attributes) => {
    const right = content !== null && typeof content === "object" && "n" in content;
    const given = right ? { class: "n" + (content.class ? " " + content.class : "") } : {};
    return el(tag, { ...given, ...attributes }, right ? content.n : content);
  };
  return el("div", { class: "scroll" }, el("table", {},
    el("caption", {}, caption),
    el("thead", {}, el("tr", {}, head.map((h) => cell("th", h, { scope: "col" })))),
    el("tbody", {}, rows.map((row) => el("tr", {}, row.map((c, k) => (k === 0 ? cell("th", c, { scope: "row" }) : cell("td", c))))))));
}

function roleTag(role) { return role === "holdout" ? el("span", { class: "tag" }, "hold-out") : null; }
