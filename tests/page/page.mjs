// Opens reports in Chromium and uses them as a reader does: zoom, satellites, filter, keyboard, print.
//
// usage: node page.mjs REPORT.html [--title TEXT] [--shots DIR]
// exit:  0 if every law holds; 1 with the first that does not

import assert from "node:assert/strict";
import { coloured, drawn, ended, printed, report, small, ticked } from "./laws.mjs";

const [file, ...options] = process.argv.slice(2);
const option = (name) => (options.includes(name) ? options[options.indexOf(name) + 1] : undefined);
const it = await report(file, { title: option("--title"), shots: option("--shots") });
const { page, shot, views, settled } = it;
const same = (a, b) => a.every((value, n) => Math.abs(value - b[n]) < 1e-9);
const plots = await views(), count = await drawn(it);
assert.ok(count >= 5 && plots.length >= 4, `${count} plots`);

// ---- The wheel moves all axes of time, and no other ----

// Those with curves first: a run without fixes has plots of nothing.
const isBusy = (n) => plots[n].most > 10;
const linked = plots.map((plot, n) => (plot.linked ? n : -1)).filter((n) => n >= 0).sort((a, b) => isBusy(b) - isBusy(a));
assert.ok(linked.length >= 2 && isBusy(linked[0]), "several plots over time, one with a curve at least");
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

// ---- What holds for every report ----

await ticked(it);
await coloured(it);
await printed(it);
await small(it);
console.log(`${await ended(it)}, ${count} plots, ${linked.length} linked, ${full} rows judged`);
