// Chromium with an empty profile, and what a page did in it.

import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

// A page; errors of its console and its dialogs; addresses that it asked for; pictures into `shots`, where that is set; the end.
export async function open(shots) {
  const profile = mkdtempSync(join(tmpdir(), "page-"));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"],
    viewport: { width: 1280, height: 900 },
  });
  const page = await context.newPage();
  const faults = [], requests = [];
  page.on("console", (message) => { if (message.type() === "error") faults.push(message.text()); });
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("dialog", (dialog) => { faults.push(`a dialog: ${dialog.message()}`); dialog.dismiss(); });
  page.on("request", (request) => requests.push(request.url()));
  const shot = async (name, fullPage = false) => { if (shots) await page.screenshot({ path: join(shots, `${name}.png`), fullPage }); };
  const close = async () => { await context.close(); rmSync(profile, { recursive: true, force: true }); };
  return { page, faults, requests, shot, close };
}

// Pixels of a canvas, evaluated in the page: all, those that differ from its first one, and coloured ones.
export function inked(canvas) {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let coloured = 0, other = 0;
  for (let n = 0; n < data.length; n += 4) {
    if (data[n] !== data[0] || data[n + 1] !== data[1] || data[n + 2] !== data[2]) other += 1;
    if (Math.max(data[n], data[n + 1], data[n + 2]) - Math.min(data[n], data[n + 1], data[n + 2]) > 60) coloured += 1;
  }
  return { coloured, other, all: data.length / 4 };
}
