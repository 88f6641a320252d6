// The page of `flexspline hil`: the same motion with one compensation after the other.
const kRunNames = { none: "no compensation", base: "base model", added: "base model and the added effect", model: "the model" };
const runName = (run) => kRunNames[run.compensation] || run.compensation;
const kRunLines = [["before", [6, 4]], ["model", null], ["residual", [2, 2]]];
const main = document.getElementById("sections");
const traces = report.traces.map((t) => Object.fromEntries(Object.entries(t).map(([name, trace]) => [name, unpacked(trace)])));

function part(title, introduction) {
  const element = el("section", {}, el("h2", {}, title), introduction ? el("p", {}, introduction) : null);
  main.append(element);
  return element;
}
{
  const fact = (name, value) => el("div", {}, el("dt", {}, name), el("dd", {}, value));
  document.getElementById("facts").append(
    fact("Scenario", `${report.scenario}: ${report.what}`),
    fact("Loops, the same in all runs", `velocity ${number(report.gains.velocity_loop_hz, 3)} Hz with an integrator, position ${number(report.gains.position_loop_hz, 3)} Hz`),
    fact("Controller", report.processor ? `image ${report.processor} on an emulated processor` : "the drive's firmware on the desktop"),
    fact("Made by", `flexspline hil, version ${report.tool_version}, ${report.created}`));
  if (report.good) document.getElementById("verdict").classList.add("good");
}
{
  const interval = (p) => (p ? `${number(p.ratio, 3)} (${number(p.interval[0], 2)} to ${number(p.interval[1], 2)})` : "–");
  const happened = (r) => (r.fault ? r.fault.replaceAll("_", " ") : r.limit_cycle ? "limit cycle" : r.stops ? `${r.stops} stops` : "–");
  const body = part("Runs", "Errors are those of the true output position, after the first second.");
  body.append(table("Error against the set point, current, and what was predicted before the run (with its 95 % interval)",
    ["compensation", { n: "rms error, mrad" }, { n: "peak, mrad" }, { n: "ratio to none" }, { n: "predicted" }, { n: "rms current, A" }, { n: "peak, A" }, "what happened"],
    report.runs.map((r) => [runName(r), { n: number(1e3 * r.rms_error_rad) }, { n: number(1e3 * r.peak_error_rad) }, { n: number(r.ratio_to_none, 3) },
      { n: interval(r.predicted) }, { n: number(r.rms_current_a, 3) }, { n: number(r.peak_current_a, 3) }, happened(r)])));
  if (report.no_prediction) body.append(el("p", { class: "note" }, `No prediction: ${report.no_prediction}`));
}
{
  const body = part("Over time", null);
  const linked = new Linked();
  body.append(linked.tools());
  const names = report.runs.map(runName);
  const key = names.map((name, i) => ({ name, colour: kRunLines[i % 3][0], dash: kRunLines[i % 3][1] }));
  const plot = (title, unit, factor, signal, more) => figure({
    title, label: `${title} over time, one line a run`, height: 240,
    key: more ? [{ name: "set point", colour: "measured" }, ...key] : key,
    make: (k, plotted) => {
      const lines = report.runs.map((_, i) => line(kRunLines[i % 3][0], k, { dash: kRunLines[i % 3][1] || undefined }));
      const data = traces.map((t) => t[signal].map((v) => (v === null ? null : factor * v)));
      const hooks = linked.hook();
      hooks.draw = [zeroHook(k)];
      hooks.setCursor = [readoutHook(plotted, more ? ["set point", ...names] : names, unit, "time", "s")];
      return {
        data: [traces[0].time, ...(more ? [traces[0].command.map((v) => (v === null ? null : factor * v))] : []), ...data],
        options: { scales: { x: { time: false } }, axes: axes("time, s", `${unitText(unit)}`, k), hooks,
          series: [{}, ...(more ? [line("measured", k)] : []), ...lines], cursor: { drag: { x: true, y: false }, bind: { mousedown: movable } } },
      };
    },
  });
  body.append(plot("Error of the output", "mrad", 1e3, "error", false), plot("Output position", "rad", 1, "output", true),
    plot("Motor velocity", "rad/s", 1, "velocity", false), plot("Current", "A", 1, "current", false),
    plot("Temperature", "degC", 1, "temperature", false));
}
document.getElementById("footer").textContent = "Every value is in this page as JSON.";
