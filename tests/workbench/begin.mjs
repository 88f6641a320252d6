// The workbench without arguments, as its user sees it: a robot's log is dropped, columns and drive are chosen, and a first
// model is there. At three widths, light and dark, with screenshots.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { readFileSync, mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { createRequire } from "node:module";

const [tool, modules, work, chromiumPath] = process.argv.slice(2);
const load = createRequire(join(modules, "x.js"));
const { chromium } = load("playwright-core");
const axe = readFileSync(load.resolve("axe-core/axe.min.js"), "utf8");
const kPatience = 180_000;
rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });

// A drive of inertia 2e-4 kg*m^2 and Coulomb friction 0.05 N*m behind a gear of 100; names that do not say the side.
function log() {
  const lines = ["stamp;q;qd;i_q;T_housing"];
  for (let k = 0; k < 1500; ++k) {
    const t = 0.008 * k, angle = 60 * (Math.sin(2 * t) / 2 + (0.5 * Math.sin(5.3 * t)) / 5.3), speed = 60 * (Math.cos(2 * t) + 0.5 * Math.cos(5.3 * t));
    const torque = 2e-4 * -60 * (2 * Math.sin(2 * t) + 0.5 * 5.3 * Math.sin(5.3 * t)) + 1e-3 * speed + 0.05 * Math.tanh(speed / 0.05);
    lines.push([t.toFixed(3), ((angle / 100) * 180) / Math.PI, ((speed / 100) * 180) / Math.PI, torque / 0.1, 30 + 0.01 * t].join(";"));
  }
  return lines.join("\n") + "\n";
}

const server = spawn(tool, ["workbench", "--no-open"], { cwd: work, stdio: ["ignore", "pipe", "inherit"] });
const address = await new Promise((resolve, reject) => {
  let text = "";
  server.stdout.on("data", (more) => { text += more; const found = /http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]+\//.exec(text); if (found) resolve(found[0]); });
  server.on("exit", (code) => reject(new Error(`the workbench ended with ${code}: ${text}`)));
});
const browser = await chromium.launch({ executablePath: chromiumPath, headless: true, args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-dev-shm-usage"] });
const complaints = [];
async function until(page, holds) {
  for (const end = Date.now() + kPatience; !(await page.evaluate(holds)); await new Promise((later) => setTimeout(later, 20)))
    if (Date.now() > end) throw new Error(`not within ${kPatience / 1000} s: ${holds}`);
}
const idle = (page) => until(page, () => !document.querySelector(".work") && document.body.dataset.ready === "yes");
async function accessible(page, where) {
  await page.evaluate(axe);
  const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const serious = found.violations.filter((v) => ["serious", "critical"].includes(v.impact));
  assert.deepEqual(serious.map((v) => `${v.id}: ${v.nodes.slice(0, 3).map((n) => `${n.target} ${n.failureSummary}`).join("; ")}`), [], where);
}

// A file or a folder, as the mouse drops it.
async function dropPath(page, path) {
  const devtools = await page.context().newCDPSession(page);
  for (const type of ["dragEnter", "dragOver", "drop"])
    await devtools.send("Input.dispatchDragEvent", { type, x: 100, y: 300, data: { items: [], files: [path], dragOperationsMask: 1 } });
  await devtools.detach();
}
for (const folder of ["papers", "recordings", "recordings/older"]) mkdirSync(join(work, folder));
writeFileSync(join(work, "papers", "notes.pdf"), "no recording");
writeFileSync(join(work, "recordings", "notes.pdf"), "no recording");
writeFileSync(join(work, "recordings", "joint.csv"), log());
writeFileSync(join(work, "axis.csv"), log().replace("stamp;q;qd;i_q;T_housing", "t;x_mm;v_mm_s;force;T_housing"));

let failed = false;
try {
  for (const [width, height, colorScheme] of [[1280, 720, "light"], [768, 1024, "dark"], [390, 844, "light"]]) {
    const context = await browser.newContext({ viewport: { width, height }, colorScheme });
    const page = await context.newPage();
    page.setDefaultTimeout(kPatience);
    page.on("console", (m) => { if (["error", "warning"].includes(m.type())) complaints.push(`console: ${m.text()} ${m.location().url}`); });
    page.on("pageerror", (e) => complaints.push(`page: ${e.stack}`));
    const shot = (name) => page.screenshot({ path: join(work, `begin-${name}-${width}-${colorScheme}.png`), fullPage: true });
    const fits = async (what) => assert.ok((await page.evaluate(() => document.documentElement.scrollWidth - innerWidth)) <= 0, `${what} is wider than ${width} px`);
    await page.goto(address);
    await page.waitForSelector("[data-pick]");
    await shot("1-empty");
    await fits("the empty page");
    await accessible(page, "empty");
    await dropPath(page, join(work, "papers"));
    await until(page, () => /There is no recording in the folder papers/.test(document.querySelector(".note").textContent));
    await dropPath(page, join(work, "gone.csv"));
    await until(page, () => /gone.csv: not sent. Check that the files are still there/.test(document.querySelector(".note").textContent));
    assert.ok(complaints.splice(0).every((one) => one.includes("/api/drop")), "of that request alone");
    await dropPath(page, join(work, "recordings"));
    await page.waitForSelector("[data-column=current_a] .sparkline");
    await idle(page);
    await page.locator("[data-fact=gear_ratio]").fill("1:100");
    await until(page, () => /Gear ratio: .1:100. is not a number/.test(document.querySelector(".note").textContent));
    await page.locator("[data-fact=gear_ratio]").fill("1,000");
    await until(page, () => /Gear ratio: .1,000. is not a number above zero. Type it without a comma, as 1000/.test(document.querySelector(".note").textContent));
    await page.locator("[data-fact=gear_ratio]").fill("100");
    await until(page, () => document.querySelector(".beginning").dataset.can === "no");
    // What the reader has opened stays open while work says how far it is.
    await page.locator("details[data-key=notes] summary").click();
    const notes = await page.locator("details[data-key=notes]").elementHandle();
    await shot("2-asked");
    await idle(page);
    // Of which side the position is, the names do not say.
    await page.locator("[data-fact=position_side]").selectOption("link");
    await until(page, () => document.querySelector(".beginning").dataset.can === "yes");
    assert.ok(!(await notes.evaluate((e) => e.isConnected)), "the page was drawn again");
    assert.ok(await page.locator("details[data-key=notes]").evaluate((e) => e.open), "and the list is open");
    await page.locator("[data-fact=torque_constant_nm_a]").fill("0.1");
    for (const [column, unit] of [["motor_position_rad", "deg"], ["motor_velocity_rad_s", "deg/s"]]) {
      await idle(page);
      await page.locator(`[data-column=${column}] td:nth-child(3) select`).selectOption(unit);
    }
    await idle(page);
    await until(page, () => document.querySelector(".beginning").dataset.can === "yes");
    await shot("3-chosen");
    await fits("the choice of columns");
    await accessible(page, "columns");
    // A page that is loaded again goes on with what was chosen.
    await page.reload();
    await page.waitForSelector("[data-column=current_a] .sparkline");
    assert.equal(await page.locator("[data-fact=gear_ratio]").inputValue(), "100");
    // Keys for steps do not take the columns away.
    await page.keyboard.press("Control+z");
    await idle(page);
    await page.locator("[data-begin]").click();
    await page.waitForSelector("body[data-step='0']");
    await page.waitForSelector(".time[data-drawn]");
    await page.getByRole("tab", { name: "Parameters" }).click();
    const inertia = await page.locator(".add tbody tr", { hasText: "inertia" }).first().locator("td").nth(1).innerText();
    const value = Number(inertia.replace("·10", "e").replace(/[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]/g, (c) => "-0123456789"["⁻⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(c)]));
    assert.ok(Math.abs(value / 2e-4 - 1) < 0.05, `the inertia is ${inertia}`);
    await page.waitForSelector("[data-verdict]");
    await idle(page);
    await shot("4-model");
    await context.close();
  }
  // Of a linear axis the pitch is asked for.
  const linear = await browser.newPage();
  linear.setDefaultTimeout(kPatience);
  await linear.goto(address);
  await linear.waitForSelector("[data-pick]");
  await dropPath(linear, join(work, "axis.csv"));
  await linear.waitForSelector("[data-fact=pitch_m]");
  await idle(linear);
  await linear.locator("details[data-key=notes] summary").click();
  assert.match(await linear.locator("details[data-key=notes]").innerText(), /the pitch is not known.*; type it above/);
  await linear.locator("[data-fact=pitch_m]").fill("0.005");
  await until(linear, () => !/pitch/.test(document.querySelector("details[data-key=notes]").textContent));
  assert.ok(await linear.locator("details[data-key=notes]").evaluate((e) => e.open));
  assert.deepEqual(complaints, []);
} catch (error) {
  failed = true;
  console.error(error);
  for (const context of browser.contexts()) for (const page of context.pages()) await page.screenshot({ path: join(work, "failed.png") }).catch(() => undefined);
  console.error(complaints.join("\n"));
}
await browser.close();
server.removeAllListeners("exit");
server.kill("SIGINT");
process.exit(failed ? 1 : 0);
