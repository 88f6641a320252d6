// Times of the page in headless Chromium, for host/app/workbench/README.md; no test, as times are no law.
// figures.mjs TOOL MODULES WORK CHROMIUM
import { spawn } from "node:child_process";
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [tool, modules, work, chromiumPath] = process.argv.slice(2);
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");
rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });

function run(program, args) {
  return new Promise((resolve, reject) => {
    const child = spawn(program, args, { cwd: work, stdio: ["ignore", "ignore", "inherit"] });
    child.on("exit", (code) => (code === 0 ? resolve() : reject(new Error(`${program} ${args.join(" ")} exits with ${code}`))));
  });
}

// The server and how long it took until it gave its address: it reads the data and fits the model first.
async function workbench(args) {
  const began = performance.now();
  const child = spawn(tool, ["workbench", ...args, "--no-open"], { cwd: work, stdio: ["ignore", "pipe", "inherit"] });
  const ended = new Promise((resolve) => child.on("exit", resolve));
  const address = await new Promise((resolve, reject) => {
    let text = "";
    child.stdout.on("data", (more) => {
      text += more;
      const found = /http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]+\//.exec(text);
      if (found) resolve(found[0]);
    });
    child.on("exit", (code) => reject(new Error(`the workbench ended with ${code}`)));
  });
  return { address, seconds: (performance.now() - began) / 1000, end: async () => { child.kill("SIGINT"); return ended; } };
}

const kPatience = 600_000;
// Asks again and again until it holds. Playwright's own waitForFunction evaluates text in the page from its second look on,
// which the page's policy forbids.
async function until(page, holds) {
  for (const end = Date.now() + kPatience; !(await page.evaluate(holds)); await new Promise((later) => setTimeout(later, 20)))
    if (Date.now() > end) throw new Error(`not within ${kPatience / 1000} s: ${holds}`);
}
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
const hil = join(tool, "..", "flexspline-hil");

// Ten motions of 60 s, six of them free and four with the output locked, two held out.
function plan(duration_s, runs) {
  return `format = "flexspline-plan/1"\nsample_s = 0.001\n[limits]\n` + runs.map(([name, locked, waveform, amplitude, hz]) =>
    `[[run]]\nname = "${name}"\nmode = "${locked ? "current" : "velocity"}"\nload = "${locked ? "locked" : "free"}"\nwaveform = "${waveform}"\namplitude = ${amplitude}\nfrequency_hz = ${hz}\nduration_s = ${duration_s}\n`).join("");
}
const ten = [["a", 0, "sine", 80, 1], ["b", 0, "sine", 40, 0.5], ["c", 0, "triangle", 20, 0.2], ["d", 0, "triangle", 100, 0.5], ["e", 0, "sine", 8, 0.3], ["f", 0, "composite", 60, 0.7],
  ["g", 1, "sine", 2, 0.5], ["h", 1, "triangle", 2.5, 0.25], ["i", 1, "sine", 1, 1], ["j", 1, "composite", 2, 0.5]];
writeFileSync(join(work, "ten.toml"), plan(60, ten));
writeFileSync(join(work, "long.toml"), plan(1000, [["long", 0, "composite", 60, 0.7]]));
await run(hil, ["record", "--out", "ten", "--plan", "ten.toml", "--seed", "7", "--hide", "stribeck_gaussian"]);
await run(hil, ["record", "--out", "long", "--plan", "long.toml", "--seed", "7"]);
// The long record alone does not tell all of the model.
await run(tool, ["identify", "ten", "--model", "ten/base-model.toml", "--out", "fitted.toml"]);

const browser = await chromium.launch({ executablePath: chromiumPath, headless: true, args: ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-dev-shm-usage"] });
const figures = {};
async function open(address, size = { width: 1280, height: 720 }) {
  const context = await browser.newContext({ viewport: size });
  const page = await context.newPage();
  page.setDefaultTimeout(600_000);
  const began = performance.now();
  await page.goto(address);
  // Curves of the worst experiment, its errors beside it, and the map.
  await page.waitForSelector(".time[data-drawn] .uplot");
  await page.waitForSelector(".where .uplot");
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return { page, seconds: (performance.now() - began) / 1000 };
}

{
  const served = await workbench(["ten", "--model", "ten/base-model.toml"]);
  figures.startup_s = served.seconds;
  // Each tab has its own session, but its server has made the maps by then: the first one is what counts.
  const { page, seconds } = await open(served.address);
  figures.first_view_s = seconds;
  const others = [];
  for (let k = 0; k < 3; ++k) {
    const again = await open(served.address);
    others.push(again.seconds);
    await again.page.context().close();
  }
  figures.next_view_s = median(others);
  const before = performance.now();
  await page.waitForSelector("[data-verdict]");
  figures.diagnosis_s = (performance.now() - before) / 1000;
  await until(page, () => !document.querySelector(".work"));
  const add = page.locator("[data-add]");
  figures.added = await add.getAttribute("data-add");
  const adds = [];
  for (let k = 0; k < 3; ++k) {
    const clicked = performance.now();
    await add.click();
    await page.waitForSelector("body[data-step='1']");
    adds.push((performance.now() - clicked) / 1000);
    await page.locator(".work").getByRole("button", { name: "Cancel" }).click({ timeout: 5000 }).catch(() => undefined);
    await until(page, () => !document.querySelector(".work"));
    await page.getByRole("button", { name: "Undo" }).click();
    await page.waitForSelector("body[data-step='0']");
    await page.waitForSelector("[data-verdict]");
    await until(page, () => !document.querySelector(".work"));
  }
  figures.add_first_s = adds[0];
  figures.add_s = median(adds);
  await served.end();
}

{
  const served = await workbench(["long", "--model", "fitted.toml"]);
  for (const [name, size] of [["1280", { width: 1280, height: 720 }], ["4k", { width: 3840, height: 2160 }]]) {
    const { page } = await open(served.address, size);
    await page.waitForSelector("[data-verdict]");
    await until(page, () => !document.querySelector(".work"));
    // A tenth of the record is in view, then it goes by at half a view a second, as fast as frames come.
    figures[`pan_${name}`] = await page.evaluate(() => new Promise((done) => {
      const time = document.querySelector(".time"), over = document.querySelector(".time .u-over");
      const key = (k) => time.dispatchEvent(new KeyboardEvent("keydown", { key: k, bubbles: true }));
      for (let k = 0; k < 5; ++k) key("+");
      const box = over.getBoundingClientRect(), frames = [];
      let last = performance.now();
      const begin = last, places = new Set();
      const step = (now) => {
        frames.push(now - last);
        const direction = Math.floor((now - begin) / 2500) % 2 ? -1 : 1;
        over.dispatchEvent(new WheelEvent("wheel", { deltaY: direction * 300 * Math.min(0.2, (now - last) / 1000), shiftKey: true, clientX: box.x + 10, clientY: box.y + 10, bubbles: true, cancelable: true }));
        last = now;
        places.add(time.dataset.from);
        if (now - begin < 10_000) return requestAnimationFrame(step);
        frames.sort((a, b) => a - b);
        done({ frames_per_s: (1000 * frames.length) / (now - begin), slowest_20th_ms: frames[Math.floor(0.95 * frames.length)], slowest_ms: frames[frames.length - 1], places: places.size });
      };
      requestAnimationFrame(step);
    }));
    await page.context().close();
  }
  await served.end();
}
await browser.close();
writeFileSync(join(work, "figures.json"), JSON.stringify(figures, null, 2));
console.log(`ten files of 60 s at 1 kHz
  command to address (reads, fits)   ${figures.startup_s.toFixed(2)} s
  address to first view              ${figures.first_view_s.toFixed(2)} s   (a further tab ${figures.next_view_s.toFixed(2)} s)
  verdict on what is missing         ${figures.diagnosis_s.toFixed(2)} s after that
  click on add ${figures.added} to the new error  ${figures.add_s.toFixed(2)} s   (the first one ${figures.add_first_s.toFixed(2)} s)
panning a record of a million samples
  1280 x 720    ${figures.pan_1280.frames_per_s.toFixed(0)} frames/s, one in twenty above ${figures.pan_1280.slowest_20th_ms.toFixed(0)} ms, slowest ${figures.pan_1280.slowest_ms.toFixed(0)} ms
  3840 x 2160   ${figures.pan_4k.frames_per_s.toFixed(0)} frames/s, one in twenty above ${figures.pan_4k.slowest_20th_ms.toFixed(0)} ms, slowest ${figures.pan_4k.slowest_ms.toFixed(0)} ms`);
