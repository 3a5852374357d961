// Opens the report of a study in Chromium: maps with values under the pointer, curves, legends, tables, keyboard, print.
//
// usage: node study.mjs REPORT.html --cells N [--title TEXT] [--shots DIR]     (N: cells of the first map)
// exit:  0 if every law holds; 1 with the first that does not

import assert from "node:assert/strict";
import { coloured, drawn, ended, printed, report, small, ticked } from "./laws.mjs";

const [file, ...options] = process.argv.slice(2);
const option = (name) => (options.includes(name) ? options[options.indexOf(name) + 1] : undefined);
const it = await report(file, { title: option("--title"), shots: option("--shots") });
const { page, shot, views, settled } = it;
const plots = await views(), count = await drawn(it);
await shot("study", true);

// ---- A map tells the value of each tile, which is the one in the table of cells ----

const map = await page.evaluate(() => [...document.querySelectorAll(".plot")].findIndex(({ plot }) => plot.series[0].mark.tile));
assert.ok(map >= 0, "a map");
const root = page.locator(".plot").nth(map);
await root.scrollIntoViewIfNeeded();
const tiles = await page.evaluate((at) => {
  const { plot } = document.querySelectorAll(".plot")[at];
  return plot.series.map((tile, n) => ({ x: plot.toX(tile.x[0]), y: plot.toY(tile.y[0]), value: plot.chart.labels[n][2],
    across: plot.chart.x.names[tile.x[0]][1], up: plot.chart.y.names[tile.y[0]][1] }));
}, map);
assert.equal(tiles.length, Number(option("--cells")), "a tile for each cell");
assert.ok(new Set(tiles.map((tile) => tile.value)).size > tiles.length / 2, "values differ");
const place = await root.locator("canvas.over").boundingBox();
const hint = () => page.evaluate((at) => { const { plot } = document.querySelectorAll(".plot")[at]; return plot.near && plot.inWords(); }, map);
const cells = await page.locator("table").last().innerText();
for (const { x, y, value, across, up } of tiles) {
  // Anywhere in a tile, not in its middle alone.
  await page.mouse.move(place.x + x + 9, place.y + y - 6);
  const words = (await hint() ?? "").split(" · ");
  assert.deepEqual([words[0], words[1].split(" ")[0], words[2].split(" ")[0]], [value, across, up], `hover over ${across}, ${up}`);
  assert.ok(cells.includes(value), `${value} is a cell's figure`);
}
await shot("map_hover");

// ---- Heads of tables and what theory says are words, not keys ----

const heads = await page.locator("th").allTextContents();
assert.ok(heads.length > 5, "tables have heads");
for (const head of heads) assert.doesNotMatch(head, /`|\w_\w|^(receiver|signal)\./, "a head in words");
const said = (await page.locator(".banner").allTextContents()).filter((text) => /theory in its region/.test(text));
assert.ok(said.length > 0 && said.every((text) => /\w+.*: (within|beyond) theory/.test(text)), `a figure is named: ${said}`);

// ---- A legend's scale is no button; curves go and come back ----

assert.equal(await page.evaluate(() => [...document.querySelectorAll("button[data-keys]")]
  .filter((button) => JSON.parse(button.dataset.keys).length === 0).length), 0, "no button without a series");
const shown = () => page.evaluate(() => [...document.querySelectorAll(".plot")].map(({ plot }) => plot.visible().length));
const all = await shown();
for (const words of await page.locator("button[data-keys]").allTextContents()) {
  const button = page.locator("button[data-keys]", { hasText: words }).first();
  await button.click();
  assert.notDeepEqual(await shown(), all, `${words}: a button that changes nothing`);
  await button.click();
}
const curve = page.locator("button[data-keys]").first();
await curve.scrollIntoViewIfNeeded();
await curve.click();
const less = await shown();
assert.ok(less.some((value, n) => value < all[n]) && less.every((value, n) => value <= all[n]), `${all} became ${less}`);
assert.equal(await curve.getAttribute("aria-pressed"), "false");
await shot("curve_off");
await curve.press("Enter");
assert.deepEqual(await shown(), all, "it comes back by a key");

// ---- Keys and zoom; axes of a study move each for itself ----

assert.ok(plots.every((plot) => !plot.linked), "no axis of time");
await root.focus();
for (const key of ["+", "ArrowRight"]) await page.keyboard.press(key);
await settled();
let now = await views();
const span = ([from, to]) => to - from;
assert.ok(span(now[map].x) < 0.8 * span(plots[map].x), "+ magnifies");
now.forEach((plot, n) => { if (n !== map) assert.deepEqual(plot.x, plots[n].x, `${plot.title} moved`); });
await page.keyboard.press(".");
assert.match(await page.locator("#readout").textContent(), /\d/, "a value is read out");
await page.keyboard.press("0");
now = await views();
assert.deepEqual(now.map(({ x, y }) => [x, y]), plots.map(({ x, y }) => [x, y]), "0 resets");

// ---- Cells are filtered ----

const table = page.locator("table[data-filter]").last(), search = page.locator("input[type=search]").last();
const rows = () => table.locator("tbody tr:not([hidden])").count();
const full = await rows();
await search.fill(tiles[0].value);
assert.ok(await rows() > 0 && await rows() < full, "rows with a value");
await search.fill("");
assert.equal(await rows(), full);

// ---- What holds for every report ----

await ticked(it);
await coloured(it);
await printed(it);
await small(it);
console.log(`${await ended(it)}, ${count} plots, ${tiles.length} tiles, ${full} rows`);
