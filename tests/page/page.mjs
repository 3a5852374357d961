// Opens reports in Chromium and uses them as a reader does: zoom, satellites, filter, keyboard, print.
//
// usage: node page.mjs REPORT.html [--title TEXT] [--shots DIR]
// exit:  0 if every law holds; 1 with the first that does not

import assert from "node:assert/strict";
import { statSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { inked, open } from "./browser.mjs";

const [file, ...options] = process.argv.slice(2);
const option = (name) => (options.includes(name) ? options[options.indexOf(name) + 1] : undefined);
const title = option("--title"), shots = option("--shots"), url = pathToFileURL(resolve(file)).href;
const { page, faults, requests, shot, close } = await open(shots);

// Views of all plots; `linked` ones share the axis of time.
const views = () => page.evaluate(() => [...document.querySelectorAll(".plot")].filter((root) => root.plot.view)
  .map(({ plot }) => ({ title: plot.chart.title, linked: plot.linked, x: [...plot.view.x], y: [...plot.view.y] })));
const settled = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
const same = (a, b) => a.every((value, n) => Math.abs(value - b[n]) < 1e-9);

// ---- It opens, alone ----

const begun = performance.now();
await page.goto(url);
await settled();
const opened = performance.now() - begun;
assert.equal(faults.join("\n"), "", "errors on the console");
const first = await page.evaluate(() => ({
  title: document.title, heading: document.querySelector("h1").textContent, scripts: document.scripts.length,
  images: document.images.length, banner: document.querySelector(".banner").textContent,
}));
if (title) assert.deepEqual([first.title, first.heading], [title, title], "the title is text, whatever is in it");
assert.deepEqual([first.scripts, first.images], [2, 0], "no element comes from a file");
await shot("first");

// ---- Everything is drawn ----

const count = await page.locator(".plot").count();
const plots = await views();
assert.ok(count >= 5 && plots.length >= 4, `${count} plots`);
for (let at = 0; at < count; at += 1) {
  await page.locator(".plot").nth(at).scrollIntoViewIfNeeded();
  await settled();
  const { coloured, other, all } = await page.locator(".plot canvas.base").nth(at).evaluate(inked);
  const name = await page.locator(".plot .plot-title").nth(at).textContent();
  assert.ok(other > 0.005 * all && coloured > 30, `${name}: ${other} of ${all} pixels drawn, ${coloured} coloured`);
}

// ---- The wheel moves all axes of time, and no other ----

const linked = plots.map((plot, n) => (plot.linked ? n : -1)).filter((n) => n >= 0);
assert.ok(linked.length >= 2, "several plots over time");
const target = page.locator(".plot:not(.sky)").nth(linked[0]);
const box = async () => target.locator("canvas.over").boundingBox();
const wheel = async (turn) => { await page.mouse.wheel(0, turn); await settled(); };
await target.scrollIntoViewIfNeeded();
let frame = await box();
await page.mouse.move(frame.x + frame.width / 2, frame.y + frame.height / 2);
const top = await page.evaluate(() => scrollY);
await wheel(120);
await page.waitForTimeout(200);
assert.ok(same((await views())[linked[0]].x, plots[linked[0]].x), "the page scrolls over a plot that was not chosen");
assert.notEqual(await page.evaluate(() => scrollY), top, "the page scrolls");
await target.scrollIntoViewIfNeeded();
frame = await box();
await page.mouse.click(frame.x + frame.width / 2, frame.y + frame.height / 2);
await wheel(-120);
let now = await views();
const span = ([from, to]) => to - from;
now.forEach((plot, n) => {
  const shrunk = span(plot.x) / span(plots[n].x);
  if (plot.linked) assert.ok(Math.abs(shrunk - 0.8) < 1e-6 && same(plot.x, now[linked[0]].x), `${plot.title}: ${shrunk}`);
  else assert.ok(same(plot.x, plots[n].x), `${plot.title} moved`);
});
await page.keyboard.down("Shift");
await wheel(-120);
await page.keyboard.up("Shift");
now = await views();
assert.ok(span(now[linked[0]].y) < 0.9 * span(plots[linked[0]].y), "Shift turns the wheel to the vertical axis");
assert.ok(same(now[linked[1]].y, plots[linked[1]].y), "vertical axes are each their own");
await shot("zoomed");

// ---- A double click resets, a drag takes a part ----

await page.mouse.dblclick(frame.x + frame.width / 2, frame.y + frame.height / 2);
await settled();
now = await views();
assert.ok(now.every((plot, n) => same(plot.x, plots[n].x)), "a double click resets all axes of time");
await page.mouse.move(frame.x + 0.4 * frame.width, frame.y + 60);
await page.mouse.down();
await page.mouse.move(frame.x + 0.6 * frame.width, frame.y + 65, { steps: 4 });
await page.mouse.up();
await settled();
now = await views();
const share = span(now[linked[0]].x) / span(plots[linked[0]].x);
assert.ok(share > 0.15 && share < 0.3 && linked.every((n) => same(now[n].x, now[linked[0]].x)), `a drag took ${share}`);

// ---- Keys ----

await target.focus();
const press = async (...keys) => { for (const key of keys) await page.keyboard.press(key); await settled(); return (await views())[linked[0]]; };
const before = (await views())[linked[0]];
const right = await press("ArrowRight");
assert.ok(right.x[0] > before.x[0] && Math.abs(span(right.x) - span(before.x)) < 1e-9, "an arrow moves");
assert.ok(span((await press("+")).x) < 0.75 * span(before.x), "+ magnifies");
assert.ok(span((await press("-", "-")).x) > span(before.x), "− shows more");
const up = await press("ArrowUp");
assert.ok(up.y[0] > before.y[0], "an arrow moves up");
await press("f");
await press("0");
assert.ok(same((await views())[linked[0]].x, plots[linked[0]].x), "0 resets");
await press(".", ".");
const said = await page.locator("#readout").textContent();
assert.match(said, /\d/, "a value is read out");
assert.ok(await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle !== "none"), "the focus is seen");

// ---- Values under the pointer ----

const values = await page.evaluate((at) => {
  const { plot } = document.querySelectorAll(".plot:not(.sky)")[at];
  const series = plot.visible().find((one) => one.x.length > 10), n = Math.floor(series.x.length / 2);
  return { x: plot.toX(series.x[n]), y: plot.toY(series.y[n]), time: series.x[n] };
}, linked[0]);
frame = await box();
await page.mouse.move(frame.x + values.x, frame.y + values.y);
await settled();
const near = await page.evaluate((at) => {
  const { plot } = document.querySelectorAll(".plot:not(.sky)")[at];
  return plot.near && { text: plot.inWords(), time: plot.near.series.x[plot.near.n] };
}, linked[0]);
assert.ok(near && Math.abs(near.time - values.time) < 0.02 * span(plots[linked[0]].x), `hover: ${JSON.stringify(near)}`);
await shot("hover");

// ---- Satellites ----

const satellites = page.locator(".satellites button[data-keys]:has(canvas)");
if (await satellites.count() > 0) {
  const shown = () => page.evaluate(() => [...document.querySelectorAll(".plot")].map(({ plot }) =>
    (plot.tracks ? plot.tracks.filter((track) => !plot.isOff(track)) : plot.visible()).length));
  const all = await shown();
  const named = await satellites.first().textContent();
  await satellites.first().click();
  await settled();
  const less = await shown();
  const fewer = less.filter((value, n) => value < all[n]).length;
  assert.ok(fewer >= 3 && less.every((value, n) => value <= all[n]), `${named} left ${fewer} plots`);
  assert.equal(await satellites.first().getAttribute("aria-pressed"), "false");
  await page.locator(".satellites button.wide", { hasText: "none" }).click();
  await settled();
  await shot("no_satellites");
  await page.locator(".satellites button.wide", { hasText: "all" }).click();
  await settled();
  assert.deepEqual(await shown(), all, "all come back");
}

// ---- The verdict's table ----

await page.evaluate(() => {
  const table = document.querySelector("tr[data-group]")?.closest("table") ?? document.querySelector("table[data-filter]");
  table.id = "judged";
  table.parentElement.previousElementSibling.id = "judged-controls";
});
const table = page.locator("#judged"), controls = page.locator("#judged-controls");
const rows = () => table.locator("tbody tr:not(.group):not([hidden])").count();
const full = await rows();
await controls.locator("input[type=search]").fill("error");
const some = await rows();
assert.ok(some > 0 && some < full, `${some} of ${full} rows with a word`);
await controls.locator("input[type=search]").fill("no such words");
assert.equal(await rows(), 0);
await controls.locator("input[type=search]").fill("");
const grouped = await page.locator("tr[data-group]").count() > 0;
if (grouped) {
  await controls.getByLabel("by group").check();
  const groups = await page.evaluate(() => [...document.querySelectorAll("#judged tr[data-group]")].map((row) => row.dataset.group));
  assert.equal(await table.locator("tr.group").count(), new Set(groups).size, "a heading for each group");
  assert.ok(groups.every((group, n) => n === 0 || group === groups[n - 1] || !groups.slice(0, n).includes(group)), "rows by group");
  assert.equal(await rows(), full, "groups hold all rows");
}
await controls.scrollIntoViewIfNeeded();
await shot("verdict");
await controls.getByLabel("failed or marginal only").check();
const bad = await rows();
assert.equal(bad, await table.locator("tbody tr:not([hidden]) :is(td.bad, td.caution)").count());
assert.ok(bad < full);
await controls.getByLabel("failed or marginal only").uncheck();
if (grouped) await controls.getByLabel("by group").uncheck();
assert.equal(await rows(), full);

// ---- Colours ----

const luminance = (rgb) => {
  const [r, g, b] = rgb.map((value) => (value / 255 <= 0.04045 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
for (const scheme of ["light", "dark"]) {
  await page.emulateMedia({ colorScheme: scheme });
  await settled();
  const colours = await page.evaluate(() => {
    const style = getComputedStyle(document.documentElement);
    const rgb = (name) => [1, 3, 5].map((at) => parseInt(style.getPropertyValue(`--${name}`).trim().slice(at, at + 2), 16));
    return [["ink", "ground"], ["faint", "ground"], ["accent", "ground"], ["good", "ground"], ["caution", "ground"],
      ["bad", "ground"], ["good", "good-ground"], ["caution", "caution-ground"], ["bad", "bad-ground"], ["faint", "panel"]]
      .map(([words, ground]) => [words, ground, rgb(words), rgb(ground)]);
  });
  for (const [words, ground, a, b] of colours) {
    const [high, low] = [luminance(a), luminance(b)].sort((x, y) => y - x);
    // WCAG 2.2, 1.4.3.
    assert.ok((high + 0.05) / (low + 0.05) >= 4.5, `${scheme}: ${words} on ${ground} ${(high + 0.05) / (low + 0.05)}`);
  }
  const ground = await page.evaluate(() => {
    const { base } = document.querySelector(".plot").plot;
    return [...base.getContext("2d").getImageData(1, 1, 1, 1).data];
  });
  assert.equal(ground[0] > 128, scheme === "light", `plots in ${scheme} colours: ${ground}`);
  await page.evaluate(() => scrollTo(0, 0));
  await settled();
  await shot(`top_${scheme}`);
}

// ---- Paper ----

const A4 = { width: 688, height: 1016 }; // pixels of 1/96 inch within margins of 14 mm
await page.setViewportSize(A4);
await page.emulateMedia({ media: "print", colorScheme: "dark" });
await page.evaluate(() => dispatchEvent(new Event("beforeprint")));
await settled();
const cut = await page.evaluate(({ width, height }) => [...document.querySelectorAll(".plot")].flatMap((root) => {
  const { left, right, height: tall } = root.getBoundingClientRect(), style = getComputedStyle(root);
  const pixel = root.plot.base.getContext("2d").getImageData(1, 1, 1, 1).data;
  const whole = left >= -1 && right <= width + 1 && tall < height && style.breakInside === "avoid" && pixel[0] === 255;
  return whole ? [] : [`${root.textContent}: ${left} to ${right}, ${tall} high, ${style.breakInside}, ground ${pixel[0]}`];
}), A4);
assert.deepEqual(cut, [], "plots are whole on paper");
const hidden = await page.evaluate(() => [...document.querySelectorAll("nav, .controls")].every((one) => one.offsetHeight === 0));
assert.ok(hidden, "controls are not printed");
await page.evaluate(() => dispatchEvent(new Event("afterprint")));
const paper = await page.pdf({ preferCSSPageSize: true, ...(shots ? { path: join(shots, "print.pdf") } : {}) });
assert.ok(paper.length > 50_000);

// ---- A small screen ----

await page.emulateMedia({ media: "screen", colorScheme: "light" });
await page.setViewportSize({ width: 390, height: 800 });
await settled();
const wide = await page.evaluate(() => document.documentElement.scrollWidth);
assert.ok(wide <= 391, `the page is ${wide} wide on a screen of 390`);
await shot("phone");

assert.equal(faults.join("\n"), "", "errors on the console");
assert.deepEqual([...new Set(requests)].filter((one) => one !== url), [], "no request but for the file");
await close();
const kilobytes = Math.round(statSync(file).size / 1000);
console.log(`${file}: ${kilobytes} kB, open and drawn after ${Math.round(opened)} ms, ${count} plots, ${linked.length} linked, ${full} rows judged`);
