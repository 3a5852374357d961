// Opens the page of a live run in Chromium: plots, buttons, zoom, colours, a small screen, and the end of the run.
//
// usage: node live.mjs URL --title TEXT [--receiver] [--shots DIR]
// exit:  0 if every law holds; 1 with the first that does not

import assert from "node:assert/strict";
import { inked, open } from "./browser.mjs";

const [url, ...options] = process.argv.slice(2);
const option = (name) => (options.includes(name) ? options[options.indexOf(name) + 1] : undefined);
const title = option("--title"), receives = options.includes("--receiver");
const { page, faults, requests, shot, close } = await open(option("--shots"));
const frames = () => page.evaluate(() => Number(document.body.dataset.frames ?? 0));
const more = async (count) => {
  const least = (await frames()) + count;
  await page.waitForFunction((at) => Number(document.body.dataset.frames ?? 0) >= at, least, { timeout: 30_000 });
};

// ---- It opens and is filled ----

await page.goto(url);
await more(10);
assert.equal(await page.title(), title, "the title is text, whatever is in it");
assert.match(await page.locator(".banner").first().textContent(), /Connected/);
assert.equal(await page.evaluate(() => document.scripts.length), 3, "no element comes from a name");
if (receives) await page.waitForFunction(() => document.querySelector("#channel").options.length > 3, null, { timeout: 60_000 });
await more(5);
const drawn = await page.evaluate(() => [...document.querySelectorAll(".plot")].map((root) => root.plot.base.width));
assert.equal(drawn.length, 11, "eleven plots");
const names = receives ? ["sky", "strengths", "spectrum", "loops"] : ["sky", "strengths", "spectrum"];
for (const name of names) {
  const { coloured } = await page.locator(`#figure-${name} canvas.base`).first().evaluate(inked);
  assert.ok(coloured > 30, `${name}: ${coloured} coloured pixels`);
}
if (receives) {
  // The mean of many rows is a peak about the prompt, whose sides are half a spacing away.
  await page.waitForFunction(() => document.querySelectorAll("#figure-loops .plot")[1].plot.series[0].y.length === 3, null, { timeout: 30_000 });
  await more(20);
  const { x, y: [late, prompt, early] } = await page.evaluate(() => document.querySelectorAll("#figure-loops .plot")[1].plot.series[0]);
  assert.ok(x[0] < 0 && x[0] === -x[2] && x[1] === 0, `taps at ${x}`);
  assert.ok(prompt > 1.1 * Math.max(early, late) && Math.abs(early - late) < 0.3 * prompt, `taps ${late}, ${prompt}, ${early}`);
}
assert.ok((await page.locator("#waterfall").evaluate(inked)).coloured > 5000, "a waterfall");
assert.ok(await page.evaluate(() => document.querySelector("#figure-sky .plot").plot.tracks.length) > 4, "satellites in the sky");
await shot("live_light", true);

// ---- Buttons switch the run's sources ----

await page.locator("#source").selectOption({ label: "jammer 1" });
await page.getByRole("button", { name: "off", exact: true }).click();
await page.waitForFunction(() => /jammer 1 off/.test(document.querySelector("#log").textContent), null, { timeout: 20_000 });
assert.match(await page.locator("#answer").textContent(), /sent: jammer 1 off/);
assert.ok(await page.getByRole("button", { name: "set range error" }).isDisabled(), "a jammer has no range error");
await page.locator("#source").selectOption({ index: 0 });
await page.locator("#metres").fill("12.5");
await page.getByRole("button", { name: "set range error" }).click();
await page.waitForFunction(() => /range_error \w+ 12.5/.test(document.querySelector("#log").textContent), null, { timeout: 20_000 });

// ---- A plot that was moved stays ----

const spectrum = page.locator("#figure-spectrum .plot");
const view = () => page.evaluate(() => [...document.querySelector("#figure-spectrum .plot").plot.view.x]);
const before = await view();
await spectrum.focus();
await page.keyboard.press("+");
await more(3);
const zoomed = await view();
assert.ok(zoomed[1] - zoomed[0] < 0.8 * (before[1] - before[0]), "a zoom outlasts the next frames");
await page.keyboard.press("0");
await more(2);
assert.deepEqual(await view(), before, "0 resets");

// ---- Dark, and a small screen ----

await page.emulateMedia({ colorScheme: "dark" });
await more(2);
const ground = await page.locator("#figure-spectrum canvas.base").evaluate((canvas) =>
  canvas.getContext("2d").getImageData(1, 1, 1, 1).data[0]);
assert.ok(ground < 128, "plots in dark colours");
await shot("live_dark", true);
await page.emulateMedia({ colorScheme: "light" });
await page.setViewportSize({ width: 390, height: 800 });
await more(3);
const wide = await page.evaluate(() => document.documentElement.scrollWidth);
assert.ok(wide <= 391, `the page is ${wide} wide on a screen of 390`);
await shot("live_phone", true);

assert.equal(faults.join("\n"), "", "errors on the console");
const origin = new URL(url).origin;
assert.deepEqual([...new Set(requests)].filter((one) => new URL(one).origin !== origin), [], "no request leaves the server");
const count = await frames();
await close();
console.log(`live page: ${count} frames drawn, 11 plots, ${requests.length} requests`);
