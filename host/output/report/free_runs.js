
// Errors as shares of what the signal does in all experiments: a drive that rests has an error of its own size. By what
// moves: positions add up their drift.
function freeRunBadness(experiment) {
  const runs = experiment.signals.filter((s) => !isBalance(s));
  const moving = runs.filter((s) => !s.signal.endsWith("_position"));
  return Math.max(-1, ...(moving.length ? moving : runs).map((s) => {
    const all = report.comparison.overall.find((o) => o.signal === s.signal);
    if (s.rmse === null) return Infinity;
    // Where one of them diverges there is no common size.
    return all.nrmse > 0 ? s.rmse * all.nrmse / all.rmse : s.nrmse ?? 0;
  }));
}

// Velocity and torque as in the report's figures, positions where one of them was not measured.
function twoOf(runs) {
  const wanted = ["motor_velocity", "torque", "output_position", "motor_position"];
  return wanted.map((signal) => runs.find((f) => f.signal === signal)).filter(Boolean).slice(0, 2);
}

function freeRunGallery(traces) {
  const shown = experiments.filter((e) => traces.get(e.name)?.free_runs.length).sort((a, b) => freeRunBadness(b) - freeRunBadness(a));
  if (!shown.length) return;
  const s = section("Free run and measurement", "What the model does with the measured effort alone, from the measured start, in every experiment; the worst first. " +
    `A free run adds up what friction and stiffness are wrong by, so that it shows what the ${effort} balances hide.`);
  s.append(el("ul", { class: "key" }, [{ name: "measured", colour: "measured" }, { name: "free run of the model", colour: "model", dash: [6, 3] }].map(keyItem)));
  for (const e of shown) {
    const linked = new Linked();
    linked.key = "gallery-" + ++linkCount;
    const figures = twoOf(traces.get(e.name).free_runs).map((f) => {
      const of = e.signals.find((x) => x.signal === f.signal), name = signalName(f.signal);
      const error = of.rmse === null ? "diverges" : `error ${withUnit(of.rmse, f.unit, 3)}` + (of.nrmse === null ? "" : `, ${number(100 * of.nrmse, 3)} % of its standard deviation`);
      return timePlot(linked, ["measured", "free run"], ["measured", "model"], f.unit, [unpacked(f.time), unpacked(f.measured), unpacked(f.model)], {
        title: name, height: 150, half: true, bare: true, dashes: [null, [6, 3]], caption: error,
        label: `${name} of ${e.name} over time, measured and as the model runs freely; ${error}` });
    });
    s.append(el("div", { class: "free-run" }, el("h3", {}, e.name, roleTag(e.role)), el("div", { class: "grid pair" }, figures)));
  }
}

// Null without black boxes.
function baselineTable() {
  const boxes = report.comparison.beside;
  if (!boxes.length) return null;
  const error = (value, box) => ({ n: box.stable ? number(value, 3) : "grows without bound" });
  return table("Black boxes compared with the model: linear models without physics, fitted to the same signals and run freely. The model's error is on the same samples.",
    ["black box", "signal", { n: "parameters" }, { n: "error" }, { n: "of the model" }, { n: "held out" }, { n: "of the model" }, "unit"],
    boxes.map((b) => [b.black_box, signalName(b.signal) + (b.load ? ", " + b.load : ""), { n: number(b.parameters) }, error(b.rmse, b), { n: number(b.model_rmse, 3) },
      b.stable ? error(b.rmse_holdout, b) : { n: "–" }, { n: number(b.model_rmse_holdout, 3) }, unitText(b.unit)]));
}
