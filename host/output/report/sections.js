
const main = document.getElementById("sections");
const contents = el("ul", {});
document.getElementById("contents").append(contents);
let sectionCount = 0;
function section(title, introduction) {
  const id = "part-" + ++sectionCount;
  const element = el("section", { "aria-labelledby": id }, el("h2", { id }, `${sectionCount}. ${title}`),
    introduction ? el("p", {}, introduction) : null);
  contents.append(el("li", {}, el("a", { href: "#" + id }, title)));
  main.append(element);
  return element;
}
function folded(summary, open, fill) {
  const body = el("div", { class: "body" });
  const details = el("details", open ? { open: "" } : {}, el("summary", {}, summary), body);
  // What is never opened is never built.
  let filled = false;
  const build = () => { if (!filled) { filled = true; fill(body); } };
  if (open) build();
  details.addEventListener("toggle", () => { if (details.open) build(); });
  return details;
}

const isBalance = (s) => s.signal.endsWith("_balance");
const excessOf = (s) => (s && s.noise_floor > 0 && s.rmse !== null ? s.rmse / s.noise_floor : null);
const kAtNoise = 1.3;
// As the terminal sorts: times the noise, or where that is not known, share of the signal.
function badness(experiment) {
  return Math.max(0, ...experiment.signals.filter(isBalance).map((s) => excessOf(s) ?? s.nrmse ?? 0));
}
const experiments = [...report.comparison.experiments].sort((a, b) => badness(b) - badness(a));
const roles = new Map(experiments.map((e) => [e.name, e.role]));
const before = report.comparison_before;
const signalBefore = (name, signal) => before?.experiments.find((e) => e.name === name)?.signals.find((s) => s.signal === signal);

const kNoiseSources = {
  periods: "from the differences between periods", replicates: "from the differences between repeated records",
  propagated: "stated noise and resolution, through the filters",
};

// ---- head ----
{
  const fact = (name, value) => (value ? el("div", {}, el("dt", {}, name), el("dd", {}, value)) : null);
  document.getElementById("facts").append(...[
    fact("Data", `${report.data_set} (${report.experiments} experiments${report.held_out ? `, ${report.held_out} of them held out` : ""})`),
    fact("Model", report.model.file || report.model.name),
    fact("Effects in it", listed(report.model.effects)),
    fact("Made by", `flexspline ${report.command}, ${report.tool}, ${report.created}`),
  ].filter(Boolean));
  if (report.good) document.getElementById("verdict").classList.add("good");
  const h = report.headline;
  if (h) {
    const tile = (name, value, note, more) => el("div", {}, el("dt", {}, name),
      el("dd", {}, value, note ? el("small", {}, " " + note) : null, more ? el("small", {}, more) : null));
    const unit = unitText(h.unit);
    const best = h.noise_floor > 0 ? h.error / h.noise_floor : null;
    document.getElementById("headline").append(el("p", { class: "soft" }, `Root mean square error of the ${signalName(h.signal)}, ${h.on}:`),
      el("dl", { class: "tiles" },
        h.error_before !== null ? tile(report.addition ? "before" : "without it", number(h.error_before, 3), unit) : null,
        tile(h.error_before === null ? "error" : report.addition ? "after" : "with it", number(h.error, 3), unit),
        tile("noise alone", number(h.noise_floor, 3), h.noise_floor === null ? "not known" : unit, kNoiseSources[h.noise_floor_from]),
        best !== null ? tile("error over noise", number(best, 3), best <= kAtNoise ? "at the noise" : "times") : null));
  }
  document.getElementById("footer").textContent = "How the data were prepared: " + report.pipeline;
}

// ---- how good ----
function errorTable() {
  const signals = [...new Set(report.comparison.overall.filter(isBalance).map((s) => s.signal))];
  if (!signals.length) return null;
  const overall = (answer, signal) => answer?.overall.find((s) => s.signal === signal);
  // A balance that the change did not touch has no before.
  const changed = (signal) => { const a = overall(report.comparison, signal), b = overall(before, signal); return b && Math.abs(b.rmse - a.rmse) > 1e-3 * a.rmse; };
  const groups = signals.map((signal) => ({ signal, unit: overall(report.comparison, signal).unit, before: changed(signal) }));
  const head = el("thead", {},
    el("tr", {}, el("th", { scope: "col", rowspan: 2 }, "experiment, worst first"),
      groups.map((g) => el("th", { scope: "colgroup", colspan: g.before ? 4 : 3, class: "group" }, `${signalName(g.signal)} (${unitText(g.unit)})`))),
    el("tr", {}, groups.flatMap((g) => [g.before ? el("th", { scope: "col", class: "n group" }, "before") : null,
      el("th", { scope: "col", class: "n" + (g.before ? "" : " group") }, g.before ? "after" : "error"),
      el("th", { scope: "col", class: "n" }, "noise"), el("th", { scope: "col", class: "n" }, "error / noise")].filter(Boolean))));
  const cells = (find, findBefore) => groups.flatMap((g) => {
    const s = find(g.signal), b = g.before ? findBefore(g.signal) : null, excess = excessOf(s);
    return [g.before ? el("td", { class: "n first" }, number(b ? b.rmse : null, 3)) : null,
      el("td", { class: "n" + (g.before ? "" : " first") }, number(s ? s.rmse : null, 3)),
      el("td", { class: "n" }, number(s ? s.noise_floor : null, 3)),
      el("td", { class: "n" + (excess === null ? "" : excess > kAtNoise ? " high" : " low") }, excess === null ? "–" : number(excess, 3))].filter(Boolean);
  });
  const rows = experiments.map((e) => el("tr", {}, el("th", { scope: "row" }, e.name, roleTag(e.role)),
    cells((signal) => e.signals.find((s) => s.signal === signal), (signal) => signalBefore(e.name, signal))));
  rows.push(el("tr", {}, el("th", { scope: "row" }, "all together"),
    cells((signal) => report.comparison.overall.find((s) => s.signal === signal), (signal) => before?.overall.find((s) => s.signal === signal))));
  const note = `Root mean square error of the ${effort} balances, with the motion as measured; noise is what a perfect model would leave. ` +
    `Up to ${kAtNoise} times the noise an error is that of the noise (green); above, something is missing (bold).`;
  return el("div", { class: "scroll" }, el("table", { class: "wide" }, el("caption", {}, note), head, el("tbody", {}, rows)));
}

function freeRunTable() {
  const signals = [...new Set(report.comparison.overall.filter((s) => !isBalance(s)).map((s) => s.signal))];
  if (!signals.length) return null;
  const unit = (signal) => unitText(report.comparison.overall.find((s) => s.signal === signal).unit);
  return table("Free run: what the model does with the measured effort alone, from the measured start. Root mean square error; errors of positions sum up over time. In slow motion a small error of friction changes the motion much: where the error is large here and small in the balances above, that is the likely cause.",
    ["experiment", ...signals.map((s) => ({ n: `${signalName(s)} (${unit(s)})` }))],
    experiments.filter((e) => e.signals.some((s) => !isBalance(s))).map((e) => [el("span", {}, e.name, roleTag(e.role)), ...signals.map((signal) => {
      const s = e.signals.find((x) => x.signal === signal);
      return { n: !s ? "–" : s.rmse === null ? "diverges" : number(s.rmse, 3) };
    })]));
}

const kTimeNames = { x: "time (s)" };
function timePlot(linked, names, colours, unit, data, { height, noise, zero, label, title, caption, half, bare, dashes = [] }) {
  return figure({
    title, label, caption, height, half,
    key: bare ? null : names.map((name, k) => ({ name, colour: colours[k], dash: dashes[k] })).concat(noise ? [{ name: "noise alone (±2 standard deviations)", colour: "noise", kind: "band" }] : []),
    make: (k, plot) => ({
      data,
      options: {
        scales: { x: { time: false } },
        axes: axes(kTimeNames.x, unitText(unit), k),
        series: [{}, ...names.map((_, s) => line(colours[s], k, { dash: dashes[s], width: s === 0 && names.length > 1 ? 2 : 1.3 }))],
        cursor: { sync: { key: linked.key, setSeries: false, scales: ["x", null] }, drag: { x: true, y: false }, bind: { mousedown: movable } },
        hooks: {
          ...linked.hook(),
          drawClear: [...(noise ? [bandHook(-2 * noise, 2 * noise, "noise")] : []), ...(zero ? [zeroHook(k)] : [])],
          setCursor: [readoutHook(plot, names, unit, "at", "s")],
        },
      },
    }),
  });
}

let linkCount = 0;
function fillExperiment(body, trace) {
  const linked = new Linked();
  linked.key = "linked-" + ++linkCount;
  body.append(linked.tools());
  for (const b of trace.balances) {
    const time = unpacked(b.time), unit = b.unit, name = signalName(b.signal);
    const s = report.comparison.experiments.find((e) => e.name === trace.experiment).signals.find((x) => x.signal === b.signal);
    body.append(timePlot(linked, ["measured", "model"], ["measured", "model"], unit, [time, unpacked(b.measured), unpacked(b.model)], {
      title: name, height: 210, dashes: [null, [6, 3]],
      label: `${name} of ${trace.experiment} over time, measured and modelled; root mean square error ${withUnit(s.rmse, unit)}` }));
    const series = b.before ? [unpacked(b.before), unpacked(b.residual)] : [unpacked(b.residual)];
    body.append(timePlot(linked, b.before ? ["error before", "error after"] : ["error (measured less model)"], b.before ? ["before", "residual"] : ["residual"], unit, [time, ...series], {
      height: 160, noise: b.noise_floor, zero: true,
      label: `Error of the ${name} of ${trace.experiment} over time; noise alone ${withUnit(b.noise_floor, unit)}`,
      caption: series.some((values) => values.some((v) => v === null || Number.isNaN(v))) ? "Gaps are reversals and sticking, which are left out of the error." : undefined }));
  }
  for (const f of trace.free_runs) {
    const name = signalName(f.signal);
    body.append(timePlot(linked, ["measured", "free run of the model"], ["measured", "model"], f.unit, [unpacked(f.time), unpacked(f.measured), unpacked(f.model)], {
      title: `${name}, free run`, height: 170, dashes: [null, [6, 3]],
      label: `${name} of ${trace.experiment} over time, measured and as the model runs freely` }));
  }
}

{
  const s = section("How good is the model?", `The model is asked for the ${effort} that the measured motion takes, and that is compared with the ${effort} that was measured, ` +
    "for each torque balance: of the motor, of the transmission, of the load. The difference is the error.");
  s.append(...[errorTable(), freeRunTable(), baselineTable()].filter(Boolean));
  for (const warning of report.comparison.warnings) s.append(el("p", { class: "note" }, warning));
  const traces = new Map(report.traces.map((t) => [t.experiment, t]));
  const drawn = experiments.filter((e) => traces.has(e.name) && (traces.get(e.name).balances.length || traces.get(e.name).free_runs.length));
  if (drawn.length) s.append(el("h3", {}, "Measured and modelled over time"));
  drawn.forEach((e, k) => {
    const excess = Math.max(...e.signals.filter(isBalance).map((x) => excessOf(x) ?? -1));
    s.append(folded(el("span", {}, e.name, roleTag(e.role), excess >= 0 ? el("span", { class: "soft" }, `  largest error of a balance ${number(excess, 3)} times its noise`) : null),
      k === 0, (body) => fillExperiment(body, traces.get(e.name))));
  });
  if (drawn.length > 1) s.append(el("p", { class: "paper-only soft" }, `Only the experiments that were open on the screen are printed (${drawn.length} in all).`));
  freeRunGallery(traces);
}

// ---- where it fails ----
// What happens near standstill or at a reversal would be a needle on a linear scale.
const kCrowdedAtZero = ["velocity", "speed", "torsion_rate", "travel"];
function mapScale(m) {
  const sizes = m.x.filter((v) => v !== null).map(Math.abs);
  const largest = Math.max(...sizes), least = Math.min(...sizes.filter((v) => v > 0));
  if (!kCrowdedAtZero.includes(m.variable) || !(least < 0.05 * largest)) return { time: false };
  return { time: false, distr: 4, asinh: Math.max(least, largest / 300), range: (u, low, high) => [low, high] };
}
// Decades of both signs, and zero.
function mapSplits(scale) {
  if (scale.distr !== 4) return {};
  return { splits: (u, axisAt, low, high) => {
    const splits = low <= 0 && high >= 0 ? [0] : [];
    for (let v = 10 ** Math.ceil(Math.log10(2 * scale.asinh)); v <= Math.max(-low, high); v *= 10)
      for (const s of [-v, v]) if (s >= low && s <= high) splits.push(s);
    return splits.sort((a, b) => a - b);
  }, filter: (u, splits) => splits };
}

function mapFigure(signal, unit, m) {
  const share = Math.max(m.share_percent, m.share_with_direction_percent);
  const name = kVariableNames[m.variable] || m.variable;
  const up = (x, n) => x.mean.map((v, k) => (v === null ? null : v + n * x.standard_error[k]));
  const noise = m.noise.map((v) => (v === null ? null : 2 * v));
  const hasNoise = noise.some((v) => v !== null);
  const title = name[0].toUpperCase() + name.slice(1);
  const scale = mapScale(m);
  return figure({
    title, half: true, height: 190,
    label: `Mean error of the ${signalName(signal)} over ${name}; it explains ${number(share, 3)} % of the error's variance`,
    caption: share > 0 ? el("span", {}, el("strong", {}, `${number(share, 3)} %`), ` of the ${before ? "variance of the error before" : "error's variance"} depends on it${m.share_with_direction_percent > m.share_percent ? ", by direction of motion" : ""}`) : "no structure that could be distinguished from chance",
    make: (k, plot) => ({
      data: [m.x, noise, noise.map((v) => (v === null ? null : -v)), up(m.plain, 2), up(m.plain, -2), up(m.with_direction, 2), up(m.with_direction, -2),
        m.plain.mean, m.with_direction.mean, ...(m.plain_before ? [m.plain_before.mean, m.with_direction_before.mean] : [])],
      options: {
        scales: { x: scale },
        axes: axes(m.unit ? `${name} (${unitText(m.unit)})` : name, unitText(unit), k, mapSplits(scale)),
        series: [{}, kHidden, kHidden, kHidden, kHidden, kHidden, kHidden,
          line("residual", k, { width: 2 }), line("directed", k, { width: 2, dash: [6, 3] }),
          ...(m.plain_before ? [line("residual", k, { width: 1, dash: [2, 3] }), line("directed", k, { width: 1, dash: [2, 3] })] : [])],
        bands: [...(hasNoise ? [{ series: [1, 2], fill: colour("noise") }] : []),
          { series: [3, 4], fill: faded("residual") }, { series: [5, 6], fill: faded("directed") }],
        cursor: { drag: { x: false, y: false }, y: false },
        hooks: { drawClear: [zeroHook(k)], setCursor: [readoutHook(plot, [null, null, null, null, null, null, "mean", "with direction"], unit, "at", m.unit)] },
      },
    }),
  });
}
function orderFigure(signal, unit, m) {
  const orders = m.orders.amplitude.map((_, k) => k + 1);
  const strongest = orders[m.orders.amplitude.indexOf(Math.max(...m.orders.amplitude.map((v) => v ?? 0)))];
  return figure({
    title: "Waves per motor turn", half: true, height: 190,
    label: `Amplitude of waves of the motor's turn in the error of the ${signalName(signal)}, by order; the strongest is ${strongest} per turn`,
    caption: m.orders.before ? "order spectrum of the error: bars after, dots before" : `order spectrum of the error; the strongest wave comes ${strongest} times a turn`,
    make: (k, plot) => ({
      data: [orders, m.orders.amplitude, ...(m.orders.before ? [m.orders.before] : [])],
      options: {
        scales: { x: { time: false, range: [0.2, orders.length + 0.8] }, y: { range: (u, low, high) => [0, (high || 1) * 1.08] } },
        axes: axes("waves per motor turn", unitText(unit), k),
        series: [{}, { ...line("residual", k, { width: 1 }), fill: colour("residual"), paths: uPlot.paths.bars({ size: [0.6, 100] }) },
          ...(m.orders.before ? [line("before", k, { path: false, points: true })] : [])],
        cursor: { drag: { x: false, y: false }, y: false },
        hooks: { setCursor: [readoutHook(plot, ["amplitude", "before"], unit, "order", "")] },
      },
    }),
  });
}

function loopFigure(loop) {
  const x = unpacked(loop.torsion), measured = unpacked(loop.measured), model = unpacked(loop.model);
  const span = (...lists) => { let low = Infinity, high = -Infinity; for (const l of lists) for (const v of l) if (v !== null) { low = Math.min(low, v); high = Math.max(high, v); } const pad = 0.05 * (high - low || 1); return [low - pad, high + pad]; };
  // uPlot's own lines want x to rise; the x of a loop goes back and forth.
  const path = (u, seriesIdx) => {
    uPlot.orient(u, seriesIdx, (series, dataX, dataY, scaleX, scaleY, toX, toY, left, top, width, height) => {
      const [xs, ys] = u.data[seriesIdx];
      u.ctx.save();
      u.ctx.beginPath();
      u.ctx.rect(left, top, width, height);
      u.ctx.clip();
      u.ctx.beginPath();
      let pen = false;
      for (let k = 0; k < xs.length; ++k) {
        if (xs[k] === null || ys[k] === null) { pen = false; continue; }
        const px = toX(xs[k], scaleX, width, left), py = toY(ys[k], scaleY, height, top);
        if (pen) u.ctx.lineTo(px, py); else u.ctx.moveTo(px, py);
        pen = true;
      }
      u.ctx.strokeStyle = series.stroke(u, seriesIdx);
      u.ctx.lineWidth = series.width;
      u.ctx.setLineDash(series.dash || []);
      u.ctx.stroke();
      u.ctx.restore();
    });
    return null;
  };
  const facets = [{ scale: "x", auto: true }, { scale: "y", auto: true }];
  return figure({
    title: loop.experiment, half: true, height: 260,
    label: `${kEffort} through the gear against torsion in ${loop.experiment}, measured and modelled`,
    caption: loop.locked ? "output locked" : "output free",
    make: (k) => ({
      data: [null, [x, measured], [x, model]],
      options: {
        mode: 2, scales: { x: { time: false, range: span(x) }, y: { range: span(measured, model) } },
        axes: axes(`torsion (${unitText(loop.torsion_unit)})`, unitText(loop.unit), k),
        series: [{}, { ...line("measured", k, { width: 1.8 }), facets, paths: path }, { ...line("model", k, { width: 1.6, dash: [6, 3] }), facets, paths: path }],
        cursor: { show: false },
      },
    }),
  });
}

// `top`: velocities up to it only, for what happens near standstill.
function frictionFigure(f, title, top) {
  // Between the directions friction jumps: the line is broken there.
  const gap = f.velocity.findIndex((v) => v > 0);
  const broken = (list) => (gap > 0 ? [...list.slice(0, gap), null, ...list.slice(gap)] : list);
  const x = gap > 0 ? [...f.velocity.slice(0, gap), (f.velocity[gap - 1] + f.velocity[gap]) / 2, ...f.velocity.slice(gap)] : f.velocity;
  const up = (n) => f.measured.map((v, k) => (v === null ? null : v + n * f.standard_error[k]));
  const dashes = [null, [8, 3], [2, 3], [8, 3, 2, 3], [4, 2], [1, 2]];
  return figure({
    title, label: `Friction ${effort} over motor velocity, ${title}: measured, modelled, and each effect of the model alone`, height: 320,
    key: [{ name: "measured (the motor balance less what is no friction), ±2 standard errors", colour: "measured", kind: "point" }, { name: "model", colour: "model" },
      ...f.parts.map((p, k) => ({ name: p.id, colour: "part-" + (k % 6), dash: dashes[k % 6] }))],
    make: (k, plot) => ({
      data: [x, broken(up(2)), broken(up(-2)), broken(f.measured), broken(f.model), ...f.parts.map((p) => broken(p.torque))],
      options: {
        scales: { x: { time: false, ...(top ? { range: [-top, top] } : {}) } },
        axes: axes(`motor velocity (${unitText(f.velocity_unit)})`, unitText(f.unit), k),
        series: [{}, kHidden, kHidden, line("measured", k, { path: false, points: true }), line("model", k, { width: 2.4 }),
          ...f.parts.map((_, p) => line("part-" + (p % 6), k, { width: 1.4, dash: dashes[p % 6] }))],
        bands: [{ series: [1, 2], fill: colour("noise") }],
        cursor: { drag: { x: true, y: false } },
        hooks: { drawClear: [zeroHook(k)], setCursor: [readoutHook(plot, [null, null, "measured", "model", ...f.parts.map((p) => p.id)], f.unit, "at", f.velocity_unit)] },
      },
    }),
  });
}

{
  const hasMaps = report.maps.some((b) => b.maps.length);
  if (hasMaps || report.loops.length || report.friction) {
    const s = section(before ? "Where did it fail, and what is left?" : "Where does it fail?",
      hasMaps ? "The error is averaged over all samples in which a quantity has about the same value. If it differs from zero somewhere by more than its bands, the model lacks " +
        "something that depends on that quantity. What resists motion changes its sign with the direction: it shows in the error times the direction." : null);
    if (hasMaps)
      s.append(el("ul", { class: "key", "aria-label": "Lines of the plots below" }, [
        { name: "mean error (measured less model)", colour: "residual" }, { name: "mean of error times direction", colour: "directed", dash: [6, 3] },
        ...(before ? [{ name: "both before (dotted)", colour: "before", dash: [2, 3] }] : []),
        { name: "±2 standard errors", colour: "residual", kind: "band", opacity: 0.2 },
        { name: "noise alone would stay in here", colour: "noise", kind: "band" }].map(keyItem)));
    for (const b of report.maps) {
      if (!b.maps.length) continue;
      const name = signalName(b.signal);
      const shows = b.maps.filter((m) => Math.max(m.share_percent, m.share_with_direction_percent) >= 5).slice(0, 6);
      const rest = b.maps.filter((m) => !shows.includes(m));
      s.append(el("h3", {}, name[0].toUpperCase() + name.slice(1) + (shows.length ? ", largest share first" : "")));
      const draw = (maps, into) => {
        const grid = el("div", { class: "grid" });
        for (const m of maps) {
          grid.append(mapFigure(b.signal, b.unit, m));
          if (m.orders) grid.append(orderFigure(b.signal, b.unit, m));
        }
        into.append(grid);
      };
      if (shows.length) draw(shows, s);
      else s.append(el("p", {}, "The error depends on none of the measured quantities more than by chance."));
      if (rest.length)
        s.append(folded(shows.length ? `${rest.length} more quantities, with less or nothing to see` : `The maps of all ${rest.length} quantities`, false, (body) => draw(rest, body)));
    }
    if (report.loops.length) {
      s.append(el("h3", {}, `${kEffort} against torsion`),
        el("p", {}, "Twisting the gear to and fro draws a loop: its slope is the stiffness, its width is energy that is lost. Where the two lines part, stiffness or hysteresis are not modelled rightly."),
        el("ul", { class: "key" }, [{ name: "measured", colour: "measured" }, { name: "model", colour: "model", dash: [6, 3] }].map(keyItem)));
      s.append(el("div", { class: "grid" }, report.loops.map(loopFigure)));
    }
    if (report.friction)
      s.append(el("h3", {}, "Friction over motor velocity"),
        el("p", {}, "Averages over the velocities, loads and temperatures that were recorded. Where the points leave the model's line, friction is not modelled rightly at that speed."),
        frictionFigure(report.friction, "all velocities", null));
    if (report.friction) {
      const speeds = report.friction.velocity.filter((v) => v !== null).map(Math.abs);
      const slow = 0.1 * Math.max(...speeds);
      if (speeds.filter((v) => v < slow).length >= 6) s.append(frictionFigure(report.friction, "near standstill", slow));
    }
  }
}

// ---- what is missing ----
if (report.rounds.length) {
  const s = report.addition
    ? section("What was missing?", `Diagnosis of the model without ${report.addition.effect}, by cross-validation. What became of the error is in the last part.`)
    : section("What is missing?");
  report.rounds.forEach((round, k) => {
    if (report.rounds.length > 1) s.append(el("h3", {}, `Round ${k + 1}`));
    fillRound(s, round);
  });
}

if (report.parameters.length) {
  const s = section("Parameters of the model");
  const spreads = report.parameters.some((p) => p.spread_percent !== null);
  const remark = (p) => (!p.identifiable ? "these data do not identify it" : p.reliable === false ? "unreliable: differs from experiment to experiment by more than 30 %" : "") +
    (p.left_out ? `${!p.identifiable || p.reliable === false ? "; " : ""}${p.counted} of ${p.counted + p.left_out} experiments identify it when each is fitted alone` : "");
  s.append(table("Values with 95 % intervals" + (spreads ? ", and how much they differ from experiment to experiment (standard deviation over average)" : "") +
    ". An interval holds for this model; while an effect is missing, the true value may lie outside.",
    ["parameter", { n: "value" }, { n: "95 % interval" }, "unit", { n: "spread" }, ""],
    report.parameters.map((p) => [`${p.id}.${p.parameter}`, { n: p.identifiable ? number(p.value, 5) : "–" }, { n: interval(p) }, unitText(p.unit),
      { n: p.spread_percent === null ? "–" : number(p.spread_percent, 3) + " %", class: p.reliable === false ? "high" : "" }, el("span", { class: !p.identifiable || p.reliable === false ? "high" : "" }, remark(p))])));
}

// ---- after adding ----
if (report.addition) {
  const a = report.addition, unit = unitText(a.unit);
  const s = section(`What ${report.command === "remove" ? "taking out" : "adding"} ${a.effect} did`, `Error of the ${signalName(a.signal)}. Hold-out experiments took no part in the fit: they show whether the effect is real.`);
  const rows = [];
  if (a.before.rmse_holdout !== null) rows.push({ name: "all hold-out experiments", before: a.before.rmse_holdout, after: a.after.rmse_holdout, noise: a.noise_floor, strong: true });
  rows.push({ name: "all fitted experiments", before: a.before.rmse_fit, after: a.after.rmse_fit, noise: a.before.rmse_holdout === null ? a.noise_floor : null, strong: true });
  for (const e of [...a.experiments].sort((x, y) => y.before - x.before))
    rows.push({ name: e.experiment, role: e.role, before: e.before, after: e.after, noise: e.noise_floor });
  const most = Math.max(...rows.flatMap((r) => [r.before, r.after, r.noise ?? 0]));
  const bar = (kind, value) => { const b = el("span", { class: "bar " + kind }); b.style.width = `${(100 * value) / most}%`; return b; };
  s.append(el("ul", { class: "key" }, [{ name: "before", colour: "before", kind: "band" }, { name: "after", colour: "model", kind: "band" }, { name: "noise alone (hatched)", colour: "noise", kind: "band" }].map(keyItem)));
  s.append(table(`Root mean square error before and after, in ${unit}`, ["experiment", "", { n: "before" }, { n: "after" }, { n: "noise" }, { n: "change" }], rows.map((r) => {
    const bars = el("div", { class: "bars", "aria-hidden": "true" }, bar("before", r.before), bar("after", r.after), r.noise ? bar("noise", r.noise) : null);
    return [el(r.strong ? "strong" : "span", {}, r.name, roleTag(r.role)), bars, { n: number(r.before, 3) }, { n: number(r.after, 3) }, { n: number(r.noise, 3) },
      { n: r.before > 0 ? `${r.after > r.before ? "+" : "−"}${number(Math.abs(100 * (r.after / r.before - 1)), 3)} %` : "–" }];
  })));
  for (const bars of s.querySelectorAll("div.bars")) bars.parentElement.classList.add("bars");
}
