// Laws of every report's page, whatever it reports: it opens alone, all is drawn, colours, paper, a small screen.

import assert from "node:assert/strict";
import { statSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { inked, open } from "./browser.mjs";

// Opens a report; `title` is the one that it must have, `shots` a directory for pictures. Its plots, their views and more come with it.
export async function report(file, { title, shots }) {
  const url = pathToFileURL(resolve(file)).href;
  const it = { file, url, shots, ...(await open(shots)) };
  const { page, faults, shot } = it;
  // Views of all plots but the sky; `linked` ones share the axis of time, `most` is the number of points of the longest curve.
  it.views = () => page.evaluate(() => [...document.querySelectorAll(".plot")].filter((root) => root.plot.view)
    .map(({ plot }) => ({ title: plot.chart.title, linked: plot.linked, x: [...plot.view.x], y: [...plot.view.y],
      most: Math.max(0, ...plot.series.map((one) => one.x.length)) })));
  it.settled = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  const begun = performance.now();
  await page.goto(url);
  await it.settled();
  it.opened_ms = performance.now() - begun;
  assert.equal(faults.join("\n"), "", "errors on the console");
  const first = await page.evaluate(() => ({
    title: document.title, heading: document.querySelector("h1").textContent, scripts: document.scripts.length,
    images: document.images.length,
  }));
  if (title) assert.deepEqual([first.title, first.heading], [title, title], "the title is text, whatever is in it");
  assert.deepEqual([first.scripts, first.images], [2, 0], "no element comes from a file");
  await shot("first");
  return it;
}

// Evaluated in the page: names of a plot's curves, clouds, bars, tiles or tracks that have something within the frame, and of those
// among them whose drawing alone leaves the canvas as it is without them.
function undrawn(root) {
  const { plot } = root, key = plot.tracks ? "tracks" : "series", kept = plot[key];
  const pixels = (some) => {
    plot[key] = some;
    plot.draw();
    return plot.base.getContext("2d").getImageData(0, 0, plot.base.width, plot.base.height).data;
  };
  const size = (values) => Math.max(...values) - Math.min(...values);
  const isShown = ({ mark, x, y }) => {
    const { box } = plot, points = [...x].map((value, n) => [plot.toX(value), plot.toY(y[n])]).filter((point) => point.every(Number.isFinite));
    const [across, up] = [points.map(([px]) => px), points.map(([, py]) => py)];
    const inside = points.filter(([px, py]) => px >= box.x && px <= box.x + box.w && py >= box.y && py <= box.y + box.h);
    if (inside.length === 0) return false;
    // A line that does not leave its first point, a band of no width and a bar of no height are nothing.
    if (mark.line) return Math.max(size(across), size(up)) >= 1;
    if (mark.band) return Math.min(size(across), size(up)) >= 2;
    if (mark.bars) return inside.some(([, py]) => Math.abs(py - plot.toY(0)) >= 1);
    return true;
  };
  // The frame stays that of the whole plot: a plot of nothing says so in words.
  const none = plot.tracks ? [] : kept.map((one) => ({ ...one, x: [plot.view.x[0] - 9 * size(plot.view.x)], y: [plot.view.y[0]] }));
  const shown = plot.tracks ? kept : plot.visible().filter(isShown), without = pixels(none);
  const lost = shown.filter((one) => {
    const alone = pixels(plot.tracks ? [one] : [...none, one]);
    return alone.every((value, n) => value === without[n]);
  });
  plot[key] = kept;
  plot.draw();
  const name = (one) => one.sv ?? (one.name || JSON.stringify(one.mark));
  return { shown: shown.map(name), lost: lost.map(name) };
}

// Every plot has axes, and draws all that it has within them; a run without fixes or without noise may have none. How many plots there are.
export async function drawn({ page, settled }) {
  const count = await page.locator(".plot").count();
  let all_shown = 0;
  for (let at = 0; at < count; at += 1) {
    const plot = page.locator(".plot").nth(at);
    await plot.scrollIntoViewIfNeeded();
    await settled();
    const { other, all } = await plot.locator("canvas.base").evaluate(inked);
    const name = await plot.locator(".plot-title").textContent();
    assert.ok(other > 0.005 * all, `${name}: ${other} of ${all} pixels drawn`);
    const { shown, lost } = await plot.evaluate(undrawn);
    assert.deepEqual(lost, [], `${name}: not drawn, of ${shown.length}`);
    all_shown += shown.length;
  }
  assert.ok(all_shown > 0, "no plot has data");
  return count;
}

// Labels of 10 000 random axes are the numbers at the places where they are drawn, to a pixel, and each axis has two at least.
export async function ticked({ page }) {
  const faults = await page.evaluate(() => {
    const plots = [...document.querySelectorAll(".plot")].map(({ plot }) => plot).filter((plot) => plot.view && !plot.chart.equal);
    const plot = plots.find(({ chart }) => !chart.x.names && !chart.y.names);
    const kept = [plot.view, plot.chart], faults = [];
    // A linear congruential generator, so that a fault comes again.
    let state = 50;
    const random = () => (state = (state * 1664525 + 1013904223) % 2 ** 32) / 2 ** 32;
    const range = (isLog) => {
      const span = 10 ** (isLog ? -3 + 4 * random() : -9 + 18 * random());
      // Up to a million spans from zero, where a label needs six digits more than its step.
      const middle = isLog ? 16 * random() - 8 : (random() - 0.5) * span * 10 ** (7 * random());
      return [middle - span / 2, middle + span / 2];
    };
    for (let round = 0; round < 10_000; round += 1) {
      const isLog = round % 4 === 0;
      plot.chart = { ...kept[1], x: { label: "x", log: isLog }, y: { label: "y", log: isLog } };
      plot.view = { x: range(isLog), y: range(isLog) };
      const drawn = [];
      plot.axes(new Proxy({}, { get: (_, name) => (name === "fillText" ? (...words) => drawn.push(words) : () => {}), set: () => true }));
      const number = (text) => Number(text.replaceAll("−", "-"));
      const { x, y, h } = plot.box;
      for (const [axis, value, size] of [["x", ([, px]) => plot.fromX(px), plot.box.w], ["y", ([, , py]) => plot.fromY(py), h]]) {
        const own = drawn.filter(([, px, py]) => (axis === "x" ? py === y + h + 5 : px === x - 6));
        const words = drawn.find(([text]) => text.startsWith(axis))[0], offset = number(/ from (.*)/.exec(words)?.[1] ?? "0");
        const [from, to] = plot.view[axis], pixel = (to - from) / size;
        const values = own.map(([text]) => offset + number(text)).map((one) => (isLog ? Math.log10(one) : one));
        const wrong = own.filter((one, n) => !(Math.abs(values[n] - value(one)) <= 1.01 * pixel));
        const long = axis === "y" && own.some(([text]) => text.length > 9);
        if (own.length < 2 || wrong.length > 0 || long || new Set(own.map(([text]) => text)).size < own.length) {
          faults.push(`${isLog ? "log" : "linear"} ${axis} ${from} to ${to}: ${own.map(([text]) => text).join(", ")} (${words})`);
        }
      }
    }
    [plot.view, plot.chart] = kept;
    return faults;
  });
  assert.deepEqual(faults.slice(0, 5), [], `${faults.length} of 20 000 axes`);
}

const luminance = (rgb) => {
  const [r, g, b] = rgb.map((value) => (value / 255 <= 0.04045 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};

// Words stand out from their ground in both schemes, and plots follow.
export async function coloured({ page, settled, shot }) {
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
}

const A4 = { width: 688, height: 1016 }; // pixels of 1/96 inch within margins of 14 mm

// Plots are whole on paper, and what is for a screen alone is not printed.
export async function printed({ page, settled, shots }) {
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
  const heights = (what) => page.evaluate((what) => [...document.querySelectorAll(what)].map((one) => one.offsetHeight), what);
  assert.ok((await heights("nav, .controls:not(.legend), button.wide")).every((height) => height === 0), "controls are not printed");
  const legends = await heights(".legend");
  assert.ok(legends.length > 0 && legends.every((height) => height > 0), "legends are");
  await page.evaluate(() => dispatchEvent(new Event("afterprint")));
  const paper = await page.pdf({ preferCSSPageSize: true, ...(shots ? { path: join(shots, "print.pdf") } : {}) });
  assert.ok(paper.length > 50_000);
}

// The page is as narrow as a telephone's screen.
export async function small({ page, settled, shot }) {
  await page.emulateMedia({ media: "screen", colorScheme: "light" });
  await page.setViewportSize({ width: 390, height: 800 });
  await settled();
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 391, `the page is ${wide} wide on a screen of 390`);
  await shot("phone");
}

// Nothing went wrong and nothing was asked for; the page's size and time in words.
export async function ended({ file, url, faults, requests, close, opened_ms }) {
  assert.equal(faults.join("\n"), "", "errors on the console");
  assert.deepEqual([...new Set(requests)].filter((one) => one !== url), [], "no request but for the file");
  await close();
  return `${file}: ${Math.round(statSync(file).size / 1000)} kB, open and drawn after ${Math.round(opened_ms)} ms`;
}
