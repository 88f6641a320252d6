// What is missing: candidates, with their evidence in words, and what no effect of the catalogue explains.
function scoreInWords(c) {
  if (c.chi2_fall_percent < 0 || c.score < 0) return "none: left-out data are predicted worse";
  if (c.score >= 200) return "overwhelming";
  if (c.score >= 20) return c.chi2_fall_percent > 0.5 ? "strong" : "real, but of no use: it explains next to nothing";
  return c.score >= 10 ? "weak: not enough to name it" : "none that could not be chance";
}
const effectName = (c) => (c.order === null || c.order === undefined ? c.effect : `${c.effect}, ${number(c.order)} per motor turn`);

function candidateCard(c, round) {
  const card = el("div", { class: "card" }, el("h3", {}, effectName(c)));
  if (c.explanation) card.append(el("p", {}, c.explanation));
  card.append(el("p", {}, el("strong", {}, "Evidence: "), `with it, the error of the ${c.balance} balance in cross-validation decreases from ` +
    `${withUnit(c.rmse_cv_before, c.unit)} to ${withUnit(c.rmse_cv_after, c.unit)}; it explains ${number(c.chi2_fall_percent, 3)} % of the squared error there, weighted by each experiment's noise. ` +
    `The score is ${number(c.score, 3)} (a name needs 20): ${scoreInWords(c)}.`));
  if (c.note) card.append(el("p", {}, c.note));
  if (c.evidence && c.evidence.bins.length) card.append(evidenceTable(c.evidence));
  if (c.consequence) card.append(el("p", {}, el("strong", {}, "What it does: "), c.consequence));
  if (c.order_causes && c.order_causes.length)
    card.append(el("p", {}, `On this drive ${number(c.order)} per motor turn is the order of:`), el("ul", {}, ...c.order_causes.map((o) =>
      el("li", {}, el("strong", {}, `${o.cause} (${o.from}). `), `Check: ${o.check} Cure: ${o.cure} Reference: ${o.reference}.`))));
  if (c.order_hint) card.append(el("p", { class: "note" }, c.order_hint));
  if (c.causes) card.append(el("p", {}, el("strong", {}, "Usual causes: "), c.causes));
  if (c.check) card.append(el("p", {}, el("strong", {}, "Check on the machine: "), c.check));
  if (c.rivals.length) {
    card.append(el("p", {}, el("strong", {}, "Not to be distinguished from: "), listed(c.rivals, "or"), " in these data. ",
      c.rival_reasons.map((r) => `It cannot be distinguished from ${r.effect}: only ${number(r.own_percent, 2)} % of its ${effort} is orthogonal to it${r.variable ? `; both depend on ${variableName(r.variable)}` : ""}.`).join(" ")));
    if (c.separating_experiment) card.append(el("p", {}, el("strong", {}, "What would distinguish them: "), c.separating_experiment, "."));
  }
  if (c.parameters.length)
    card.append(table("Its parameters", ["parameter", { n: "value" }, { n: "95 % interval" }, "unit"],
      c.parameters.map((p) => [p.parameter, { n: number(p.value) }, { n: interval(p) }, unitText(p.unit)])));
  return card;
}
// What the model lacks over the variable in which the effect shows most.
function evidenceTable(map) {
  const what = map.resisting ? "lacks (positive resists the motion)" : "lacks";
  return table(`Where it shows in these data, over ${variableName(map.variable)}`,
    [{ n: unitText(map.variable_unit) || "from" }, { n: "to" }, { n: `the model ${what}` }, { n: "the effect makes" }, "unit"],
    map.bins.map((b) => [{ n: number(b.low, 3) }, { n: number(b.high, 3) }, { n: number(b.lacking, 3) }, { n: number(b.effect, 3) }, unitText(map.unit)]));
}
// The smallest size that would have been named.
function leastShown(c) {
  const m = c.minimum_detectable;
  return m ? `${m.at_most ? "below " : ""}${m.parameter} ${withUnit(Number(m.value.toPrecision(2)), m.unit)}` : "–";
}
function interval(p) { return p.interval[0] === null ? "–" : `${number(p.interval[0])} to ${number(p.interval[1])}`; }

// `named`: those of the verdict; of the others it states how far they are behind.
function candidateTable(list, named, caption) {
  const isNamed = (c) => named.some((n) => n.effect === c.effect && n.order === c.order);
  const verdict = (c) => (!c.admissible ? "refused: " + c.why_not : named.length && !isNamed(c) && c.score >= 20 ? "helps, but explains less than the best" : scoreInWords(c));
  return table(caption, ["candidate", "balance", { n: "score" }, { n: "explains" }, { n: "error before" }, { n: "after" }, "unit", "smallest detectable", "evidence"],
    list.map((c) => [effectName(c), c.balance, { n: number(c.score, 3) }, { n: number(c.chi2_fall_percent, 3) + " %" }, { n: number(c.rmse_cv_before, 3) }, { n: number(c.rmse_cv_after, 3) }, unitText(c.unit),
      leastShown(c), verdict(c)]));
}

// A curve over one signal, for what no effect of the catalogue explains.
function fillUnknown(s, c) {
  const at = c.points.map((p) => p.at), value = c.points.map((p) => p.value), unit = unitText(c.unit), xUnit = unitText(c.variable_unit);
  const end = (k) => c.points.map((p) => (p.visited ? p.interval[k] : null));
  const name = variableName(c.variable), what = c.times_direction ? "times the direction of motion" : "";
  s.append(figure({
    title: `What no effect explains, over ${name}`, height: 240,
    label: `${kEffort} over ${name} that no effect of the catalogue explains; it explains ${number(c.chi2_fall_percent, 3)} % of the squared error in cross-validation`,
    caption: el("span", {}, el("strong", {}, `${number(c.chi2_fall_percent, 3)} %`), ` less squared error on data left out of its fit with this curve${what ? ", " + what : ""}`),
    key: [{ name: "learnt curve", colour: "residual" }, { name: "95 % of it", colour: "residual", kind: "band" }],
    make: (k, plot) => ({
      data: [at, end(1), end(0), value],
      options: {
        scales: { x: { time: false } },
        axes: axes(xUnit ? `${name} (${xUnit})` : name, unit, k),
        series: [{}, kHidden, kHidden, line("residual", k, { width: 2 })],
        bands: [{ series: [1, 2], fill: faded("residual") }],
        cursor: { drag: { x: false, y: false }, y: false },
        hooks: { drawClear: [zeroHook(k)], setCursor: [readoutHook(plot, [null, null, effort], unit, "at", xUnit)] },
      },
    }),
  }));
  s.append(el("p", {}, `Record next: ${c.record_next}.`));
}

function fillRound(s, round) {
  s.append(el("p", {}, round.verdict_in_words));
  for (const size of round.sizes) s.append(el("p", {}, size, "."));
  s.append(el("p", {}, round.error_in_words, "."));
  for (const sentence of [...round.certainty, ...round.possible_in_words]) s.append(el("p", {}, sentence));
  const telling = round.localised.slice(0, 3).map((l) => `${variableName(l.variable)} (${number(l.share_percent, 3)} %)`);
  if (telling.length) s.append(el("p", {}, `Most of the error depends on ${listed(telling)}; shares overlap, as these quantities move together.`));
  if (round.delay_s !== null)
    s.append(el("p", { class: "note" }, round.delay_advice));
  if (round.untried_advice !== null)
    s.append(el("p", { class: "note" }, round.untried_advice));
  const same = (a, b) => a.effect === b.effect && a.order === b.order;
  for (const named of round.named) {
    const c = round.candidates.find((x) => same(x, named));
    if (c) s.append(candidateCard(c, round));
  }
  if (round.unknown) fillUnknown(s, round.unknown);
  if (round.candidates.length) {
    s.append(candidateTable(round.candidates.slice(0, 8), round.named, "Every effect that could be added was cross-validated. The best of them. Score: twice the logarithm of the likelihood ratio, less the penalty for parameters; " +
      "a name needs 20. Explains: part of the squared error, weighted by each experiment's noise; errors are not weighted."));
    if (round.candidates.length > 8)
      s.append(folded(`${round.candidates.length - 8} more candidates`, false, (body) => body.append(candidateTable(round.candidates.slice(8), round.named, "The others, best first"))));
  }
  for (const sentence of round.trends_in_words) s.append(el("p", { class: "note" }, sentence));
  if (round.named.length && round.remaining_structure.length)
    s.append(el("p", {}, `With the named effect added, the error still depends on ${listed(round.remaining_structure.slice(0, 3).map((l) => `${variableName(l.variable)} (${number(l.share_percent, 3)} %)`))}.`));
  if (round.disturbances.length)
    s.append(table("Something from outside acted on the axis in these intervals; they were left out.", ["experiment", { n: "from" }, { n: "to" }, { n: "peak" }],
      round.disturbances.map((d) => [d.experiment, { n: withUnit(d.from_s, "s") }, { n: withUnit(d.to_s, "s") }, { n: withUnit(d.peak, d.unit) }])));
  for (const warning of round.warnings) s.append(el("p", { class: "note" }, warning));
}
