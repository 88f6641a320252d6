// The workbench as its user sees it: headless Chromium, the twin's data with a hidden effect, every step with a
// screenshot. Waits are for what is to be seen, never for a time.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { readFileSync, writeFileSync, mkdirSync, rmSync, existsSync } from "node:fs";
import { join } from "node:path";
import { request } from "node:http";
import { createRequire } from "node:module";

const [tool, modules, work, chromiumPath] = process.argv.slice(2);
const load = createRequire(join(modules, "x.js"));
const { chromium } = load("playwright-core");
const axe = readFileSync(load.resolve("axe-core/axe.min.js"), "utf8");
const kPatience = 180_000;  // of a loaded machine
const shots = join(work, "screenshots");
rmSync(work, { recursive: true, force: true });
mkdirSync(shots, { recursive: true });
const figures = {};
const say = (text) => console.log(text);

function run(program, args) {
  return new Promise((resolve, reject) => {
    const child = spawn(program, args, { cwd: work, stdio: ["ignore", "inherit", "inherit"] });
    child.on("exit", (code) => (code === 0 ? resolve() : reject(new Error(`${program} ${args.join(" ")} exits with ${code}`))));
  });
}

// The server, once it has printed its address.
function workbench(args) {
  const child = spawn(tool, ["workbench", ...args, "--no-open"], { cwd: work, stdio: ["ignore", "pipe", "inherit"] });
  const ended = new Promise((resolve) => child.on("exit", resolve));
  const address = new Promise((resolve, reject) => {
    let text = "";
    child.stdout.on("data", (more) => {
      text += more;
      const found = /http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]+\//.exec(text);
      if (found) resolve(found[0]);
    });
    child.on("exit", (code) => reject(new Error(`the workbench ended with ${code}: ${text}`)));
  });
  return { address, child, end: async () => { child.kill("SIGINT"); return ended; } };
}

function status(url, headers = {}) {
  return new Promise((resolve, reject) => {
    request(url, { headers }, (answer) => { answer.resume(); answer.on("end", () => resolve({ code: answer.statusCode, headers: answer.headers })); }).on("error", reject).end();
  });
}

const hil = join(tool, "..", "flexspline-hil");
await run(hil, ["record", "--out", "rec", "--seed", "7", "--hide", "stribeck_gaussian", "--force"]);
// A drive with the same hidden effect, which is asked over a socket; it goes faster than real time.
const serve = (port, more = []) => spawn(hil, ["twin", "--serve", port, ...more, "--fast", "--hide", "stribeck_gaussian", "--json", "twin.json"], { cwd: work, stdio: ["ignore", "ignore", "inherit"] });
let twin = serve("0");
let drive = "";
while (!drive) {
  await new Promise((later) => setTimeout(later, 50));
  try { drive = JSON.parse(readFileSync(join(work, "twin.json"))).drive; } catch { /* not there, or not whole yet */ }
}
const served = workbench(["rec", "--model", "rec/base-model.toml", "--drive", drive]);
const address = await served.address;
const browser = await chromium.launch({ executablePath: chromiumPath, headless: true,
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"] });

const complaints = [];
async function open(url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(kPatience);
  page.on("console", (m) => { if (["error", "warning"].includes(m.type())) complaints.push(`console: ${m.text()} ${m.location().url}`); });
  page.on("pageerror", (e) => complaints.push(`page: ${e.stack}`));
  page.on("request", (r) => { if (!r.url().startsWith(new URL(address).origin + "/") && !/^(data|blob):/.test(r.url())) complaints.push(`request to ${r.url()}`); });
  await page.goto(url);
  return page;
}
// Asks again and again until it holds. Playwright's own waitForFunction evaluates text in the page from its second look on,
// which the page's policy forbids.
async function until(page, holds) {
  for (const end = Date.now() + kPatience; !(await page.evaluate(holds)); await new Promise((later) => setTimeout(later, 20)))
    if (Date.now() > end) throw new Error(`not within ${kPatience / 1000} s: ${holds}`);
}
const shot = (page, name) => page.screenshot({ path: join(shots, `${name}.png`) });
const excess = async (page) => Number(await page.locator(".big").getAttribute("data-excess"));
const idle = (page) => until(page, () => !document.querySelector(".work") && document.body.dataset.ready === "yes");
const drawn = (page) => page.waitForSelector(".time[data-drawn]");
// Where an element is once it no longer moves and nothing lies above its middle: the mouse finds it there.
async function place(locator) {
  for (let before = null;;) {
    const box = await locator.boundingBox();
    const isOnTop = box && await locator.evaluate((e) => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
      const at = e.getBoundingClientRect(), top = document.elementFromPoint(at.x + at.width / 2, at.y + at.height / 2);
      done(top !== null && (e === top || e.contains(top)));
    })))).catch(() => false);
    if (isOnTop && before && JSON.stringify(box) === JSON.stringify(before)) return box;
    before = box;
  }
}

// Shows first what it changes; the drive has its old block until that is confirmed.
async function flash(page) {
  await page.locator("[data-flash]").click();
  await page.waitForSelector("[data-preview=flash]");
  assert.match(await page.locator("[data-preview]").innerText(), /→.*\([+−×±].*\)|added/s);
  assert.equal(await page.locator("[data-flashed]").count(), 0);
  await idle(page);
  assert.match(await page.locator("[data-predicted]").innerText(), /Predicted at slow reversals: \S+ mrad with this model/);
  await shot(page, "9-preview");
  await page.locator("[data-confirm]").click();
  await page.waitForSelector("[data-flashed=yes]");
}

async function accessible(page, where) {
  // The page's policy forbids inline scripts, so axe comes in by the debugger's door.
  await page.evaluate(axe);
  const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const serious = found.violations.filter((v) => ["serious", "critical"].includes(v.impact));
  assert.deepEqual(serious.map((v) => `${v.id}: ${v.nodes.slice(0, 3).map((n) => `${n.target} ${n.failureSummary}`).join("; ")}`), [], where);
}

let failed = false;
try {
  say("the gate");
  const origin = new URL(address).origin;
  assert.equal((await status(`${origin}/`)).code, 403);
  assert.equal((await status(`${origin}/api/state`)).code, 403);
  assert.equal((await status(`${origin}/${"0".repeat(32)}/`)).code, 403);
  assert.equal((await status(address, { Host: "attacker.example" })).code, 403);
  assert.equal((await status(address, { Origin: "http://attacker.example" })).code, 403);
  const good = await status(address);
  assert.equal(good.code, 200);
  assert.match(good.headers["content-security-policy"], /default-src 'none'/);

  say("1. how good");
  const page = await open(address);
  await drawn(page);
  await page.waitForSelector(".where .uplot");
  const first = page.locator(".good [role=option]").first();
  assert.equal(await first.getAttribute("aria-selected"), "true");
  figures.before = await excess(page);
  assert.ok(figures.before > 10, `error before: ${figures.before}`);
  await shot(page, "1-how-good");

  say("another record is overlaid");
  await page.getByLabel("Overlay another experiment").selectOption({ index: 1 });
  await until(page, () => (document.querySelector(".time").dataset.overlay ?? "") !== "");
  await shot(page, "1-overlay");
  await page.getByLabel("Overlay another experiment").selectOption("");
  await until(page, () => document.querySelector(".time").dataset.overlay === "");

  say("zoom and pan");
  await page.locator(".time").focus();
  for (let k = 0; k < 6; ++k) await page.keyboard.press("+");
  await page.keyboard.press("ArrowRight");
  await until(page, () => Number(document.querySelector(".time").dataset.to) - Number(document.querySelector(".time").dataset.from) < 2);
  await page.keyboard.press("0");

  say("2. where: the map that explains most is open; a region is brushed");
  const map = page.locator(".where .plot .u-over").first();
  const variable = await page.locator(".where").getAttribute("data-variable");
  assert.match(variable, /speed|velocity/);
  const box = await place(map);
  await page.mouse.move(box.x + box.width * 0.35, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.6, box.y + box.height / 2, { steps: 4 });
  // Whatever the diagnosis reports meanwhile draws the map again: the region under the pointer must not be lost.
  await page.evaluate(() => document.querySelector(".where [role=option][aria-selected=true]").click());
  await page.mouse.up();
  await page.waitForSelector(".mark.brushed");
  await shot(page, "2-where");

  say("3. what is missing");
  await page.waitForSelector("[data-verdict=missing_effect]");
  const add = page.locator("[data-add]");
  assert.equal(await add.getAttribute("data-add"), "stribeck_gaussian");
  await idle(page);
  await shot(page, "3-missing");
  await accessible(page, "with a diagnosis");

  say("4. add it");
  await add.click();
  await page.waitForSelector("body[data-step='1']");
  figures.after = await excess(page);
  assert.ok(figures.after < 1.1, `error after: ${figures.after}`);
  await page.waitForSelector("[data-verdict=at_noise_floor]");
  await idle(page);
  await shot(page, "4-added");

  say("undo, redo; a reload finds the same; another tab is not disturbed");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.waitForSelector("body[data-step='0']");
  await page.getByRole("button", { name: "Redo" }).click();
  await page.waitForSelector("body[data-step='1']");
  await page.reload();
  await page.waitForSelector("body[data-step='1']");
  const other = await open(address, { colorScheme: "dark" });
  await other.waitForSelector("body[data-step='0']");
  await drawn(other);
  await other.waitForSelector("[data-verdict]");
  await shot(other, "5-dark");
  await accessible(other, "dark");
  await other.context().close();

  say("the process that does the work crashes while it works: the page says so, and goes on with the steps that were there");
  const worker = () => Number(readFileSync(`/proc/${served.child.pid}/task/${served.child.pid}/children`, "utf8").trim().split(" ")[0]);
  const crashed = worker();
  await page.getByRole("tab", { name: "Closed loop" }).click();
  await page.getByLabel("Motion").selectOption("joint-trajectory");
  await page.locator("[data-try]").click();
  await until(page, () => /run \d+ of/.test(document.querySelector(".work")?.textContent ?? ""));
  process.kill(crashed, "SIGSEGV");
  await until(page, () => /Running the closed loop: it crashed \(signal 11/.test(document.querySelector(".note")?.textContent ?? ""));
  assert.notEqual(worker(), crashed);
  await shot(page, "5-crashed");
  await page.getByRole("button", { name: "Dismiss" }).click();
  await page.waitForSelector("body[data-step='1']");
  await until(page, () => document.querySelectorAll(".note:not([hidden])").length === 0);
  await page.waitForSelector("[data-verdict=at_noise_floor]");
  await idle(page);
  // What the browser says of the connections that the crash closed.
  const closed = /ERR_(CONNECTION_|EMPTY_RESPONSE|SOCKET_NOT_CONNECTED|INCOMPLETE_CHUNKED)/;
  complaints.splice(0, complaints.length, ...complaints.filter((c) => !closed.test(c)));

  say("parameters, save, pack");
  await page.getByRole("tab", { name: "Parameters" }).click();
  await page.waitForSelector("tbody tr");
  assert.match(await page.locator("tbody").innerText(), /[+−]\S+ %/, "changes against the step before");
  await shot(page, "6-parameters");
  await page.getByRole("tab", { name: "Save" }).click();
  await page.getByLabel("Name of the file").fill("better");
  await page.locator("[data-save=model]").click();
  await page.waitForSelector("[data-saved=model]");
  assert.match(readFileSync(join(work, "rec", "better.toml"), "utf8"), /stribeck_gaussian/);
  await page.locator("[data-pack]").click();
  await page.waitForSelector("[data-packed]");
  await page.locator("[data-save=report]").click();
  await page.waitForSelector("[data-saved=report]");
  assert.ok(existsSync(join(work, "rec", "better.html")));
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Download model" }).click()]);
  assert.equal(download.suggestedFilename(), "flexspline-model.toml");
  await shot(page, "7-saved");
  // A file that cannot be made is a message on the page, not a page of its own.
  await page.route("**/api/file*", (route) => route.fulfill({ status: 400, contentType: "application/json", body: '{"what": "it cannot be packed"}' }));
  await page.getByRole("button", { name: "Download block" }).click();
  await until(page, () => /it cannot be packed/.test(document.querySelector(".note").textContent));
  await page.unroute("**/api/file*");
  await page.getByRole("button", { name: "Dismiss" }).click();
  complaints.splice(0, complaints.length, ...complaints.filter((c) => !/status of 400/.test(c)));

  say("the closed loop: cancelled midway, then to its end");
  await page.getByRole("tab", { name: "Closed loop" }).click();
  await page.getByLabel("Motion").selectOption("joint-trajectory");
  await page.locator("[data-try]").click();
  // Within the page, as it may be done before a mouse is there.
  await until(page, () => {
    const work = document.querySelector(".work");
    if (!/run \d+ of/.test(work?.textContent ?? "")) return false;
    work.querySelector("button").click();
    return true;
  });
  await idle(page);
  assert.equal(await page.locator("table[data-runs]").count(), 0, "cancelled, and there all the same");
  await page.getByLabel("Motion").selectOption("slow-reversals");
  await page.locator("[data-try]").click();
  await page.waitForSelector("table[data-runs='3']");
  await page.waitForSelector(".closed[data-drawn=yes]");
  await idle(page);
  const loop = await page.locator("table[data-runs]").evaluate((t) => ({ base: Number(t.dataset.base), now: Number(t.dataset.ratio) }));
  Object.assign(figures, { loopBase: loop.base, loopNow: loop.now });
  assert.ok(loop.now < loop.base && loop.base < 1, `tracking error, of that without compensation: ${JSON.stringify(loop)}`);
  assert.match(await page.locator(".closed").innerText(), /A simulation.*truth\.toml/s);
  await shot(page, "8-closed-loop");
  await accessible(page, "with a closed loop");

  say("flash to the twin, its signals, and where its model fails before and after");
  await page.getByRole("tab", { name: "Drive" }).click();
  // What was asked before it was connected is answered last: the page must not believe it.
  // Where the page first asks when the drive is connected already, there is no such answer to hold back.
  let late = () => undefined;
  const connected = new Promise((done) => { late = done; });
  await page.route("**/api/drive*", async (route) => {
    const answer = await route.fetch();
    if (!(await answer.json()).status.connected) await connected;
    await route.fulfill({ response: answer });
  });
  await page.locator(`[data-connect="${drive}"]`).click();
  await page.waitForSelector("[data-flash]");
  late();
  await idle(page);
  await page.unroute("**/api/drive*");
  await until(page, () => Number(document.querySelector(".live")?.dataset.samples) > 20);
  await page.getByRole("button", { name: "Residual map" }).click();
  await page.waitForSelector("[data-map=too_little_data]");
  await page.locator("[data-move]").click();
  await page.waitForSelector("[data-map=model_fails]");
  await idle(page);
  await shot(page, "9-map-before");
  await flash(page);
  await page.waitForSelector("[data-map=too_little_data]");
  await idle(page);
  await page.locator("[data-move]").click();
  await page.waitForSelector("[data-map=model_fits]");
  await idle(page);
  await shot(page, "10-map-after");
  await accessible(page, "with a map");
  await page.getByRole("button", { name: "Live signals" }).click();
  await until(page, () => Number(document.querySelector(".live")?.dataset.samples) > 20);
  await shot(page, "11-flashed");
  await accessible(page, "with a drive");

  say("the drive is switched off and on again: it is connected by itself, and nothing is flashed by itself");
  const off = new Promise((done) => twin.on("exit", done));
  twin.kill("SIGINT");
  await off;
  await page.waitForSelector("[data-again]");
  assert.match(await page.locator("[data-again]").innerText(), /The drive was lost.*as soon as it answers.*Stop trying/s);
  await until(page, () => Number(document.querySelector("[data-again]")?.dataset.again) > 0);
  await shot(page, "12-lost");
  await accessible(page, "with a lost drive");
  const [port, token] = drive.split(":").pop().split("/");
  twin = serve(port, ["--token", token]);
  await page.waitForSelector("[data-back]");
  await until(page, () => Number(document.querySelector(".live")?.dataset.samples) > 20);
  // A twin without a file for its flash memory begins with the block of its maker. The page hears of the work only when
  // it is over.
  await page.route("**/api/state*", async (route) => {
    await new Promise((slow) => setTimeout(slow, 1500));
    await route.continue();
  });
  await flash(page);
  await page.unroute("**/api/state*");
  assert.equal(await page.locator("[data-back]").count(), 0);
  await idle(page);

  say("a bad file is dropped");
  const transfer = await page.evaluateHandle(() => {
    const t = new DataTransfer();
    t.items.add(new File(["time_s,current_a,motor_position_rad\n0,1,2\n0.001,oops,2\n"], "bad.csv"));
    return t;
  });
  await page.dispatchEvent("body", "drop", { dataTransfer: transfer });
  await page.waitForSelector(".note code");
  assert.match(await page.locator(".note").innerText(), /bad\.csv:3.*current_a/);
  await shot(page, "13-bad-file");
  assert.equal(await page.locator("body").getAttribute("data-step"), "1");

  if (process.env.FLEXSPLINE_LARGE_SHOT) {
    await page.setViewportSize({ width: 3840, height: 2160 });
    await page.getByRole("button", { name: "Dismiss" }).click();
    for (const [tab, file] of [["Steps", "14-4k"], ["Closed loop", "15-4k-closed-loop"], ["Drive", "16-4k-drive"]]) {
      await page.getByRole("tab", { name: tab }).click();
      if (tab === "Drive") await page.getByRole("button", { name: "Residual map" }).click();
      await place(page.locator(".add"));
      await shot(page, file);
    }
    await page.setViewportSize({ width: 1280, height: 720 });
    await page.getByRole("button", { name: "Light or dark" }).click();
    await place(page.locator(".add"));
    await shot(page, "17-dark-map");
    await page.getByRole("tab", { name: "Closed loop" }).click();
    await place(page.locator(".add"));
    await shot(page, "18-dark-closed-loop");
    await accessible(page, "dark, with a closed loop");
  }

  say("plots as files");
  const plain = await open(address);
  await drawn(plain);
  await plain.getByRole("button", { name: "Save plots" }).click();
  for (const [ending, content] of [["png", /^.PNG/s], ["svg", /^<svg [^]*stroke-dasharray="7 4"[^]*<\/svg>/], ["csv", /^"[^"]*","measured, [^"]*","model, [^"]*"\n[-0-9.e]+,[-0-9.e]+,/]]) {
    const [download] = await Promise.all([plain.waitForEvent("download"), plain.locator(`[data-save=${ending}]`).first().click()]);
    assert.ok(download.suggestedFilename().endsWith(`.${ending}`));
    assert.match(readFileSync(await download.path(), "latin1"), content, ending);
  }
  await plain.context().close();

  say("phone, tablet and desk, light and dark");
  // A colour changes no width.
  for (const [width, height, colorScheme] of [[390, 844, "dark"], [768, 1024, "light"], [1280, 720, "dark"]]) {
    const small = await open(address, { viewport: { width, height }, colorScheme });
    await drawn(small);
    for (const tab of ["Steps", "Parameters", "Save", "Closed loop", "Drive"]) {
      await small.getByRole("tab", { name: tab }).click();
      assert.ok((await small.evaluate(() => document.documentElement.scrollWidth - innerWidth)) <= 0, `${tab} is wider than ${width} px`);
    }
    // The button that adds holds the candidate's name, however long.
    await small.waitForSelector("[data-add]");
    await idle(small);
    await small.evaluate(() => { document.querySelector("[data-add]").textContent = "Add prandtl ishlinskii hysteresis of the second stage, 21 per turn"; });
    assert.ok((await small.evaluate(() => document.documentElement.scrollWidth - innerWidth)) <= 0, `the button that adds is wider than ${width} px`);
    // It can be reached and pressed, too.
    await small.getByRole("button", { name: "Flash this model" }).click({ trial: true });
    await small.screenshot({ path: join(shots, `${width}-${colorScheme}.png`), fullPage: true });
    await small.context().close();
  }
  assert.deepEqual(complaints, []);
} catch (error) {
  failed = true;
  console.error(error);
  for (const context of browser.contexts()) for (const page of context.pages()) await page.screenshot({ path: join(shots, "failed.png") }).catch(() => undefined);
  console.error(complaints.join("\n"));
}
await browser.close();
const code = await served.end();
twin.kill("SIGINT");
if (code !== 0) console.error(`the workbench ended with ${code}`);
writeFileSync(join(work, "figures.json"), JSON.stringify(figures));
say(`error over noise on motions that the fit never saw: ${figures.before} -> ${figures.after}; tracking error of that without compensation: ${figures.loopBase} -> ${figures.loopNow}`);
process.exit(failed || code !== 0 ? 1 : 0);
