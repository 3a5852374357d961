// Fills the plots of a live page with the frames that its server sends, and sends events.
//
// A frame is the whole state of the run; histories are kept here. What comes is text and numbers: nothing of
// it becomes markup. The plots are those of page.js, which zooms and draws them.
"use strict";
(() => {
  const MOST = 3000, WINDOW_S = 60, ROWS = 150;
  const plots = (name) => [...document.querySelectorAll(`#figure-${name} .plot`)].map((root) => root.plot);
  const [sky] = plots("sky"), [map] = plots("map"), [strengths] = plots("strengths"), [spectrum] = plots("spectrum");
  const [prompt, taps, ...loops] = plots("loops"), [ages, counts] = plots("stream");
  const linked = [...loops, ages, counts], Plot = ages.constructor;
  const all = [sky, map, strengths, spectrum, prompt, taps, ...linked];
  let frame = null, channel = "", histories = new Map(), tail = "", asked = false;

  function element(name, properties = {}, ...children) {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
  }

  // Adds a value to a history of bounded length.
  function keep(list, value) {
    list.push(value);
    if (list.length > MOST) list.shift();
  }

  const fixed = (value, digits = 1) => (typeof value === "number" ? value.toFixed(digits).replace("-", "−") : "–");
  // A number with its unit; without a number there is no unit.
  const measured = (value, unit, digits = 1) => (typeof value === "number" ? `${fixed(value, digits)} ${unit}`.trim() : "–");

  // ---- Elements that are not plots ----

  const banner = element("p", { className: "banner", role: "status", textContent: "Connecting …" });
  const facts = element("dl", { id: "facts" });
  const verdict = element("tbody", { id: "verdict" });
  const head = element("tr", {}, ...["check so far", "value", "limit", "verdict"].map((text) => element("th", { scope: "col" }, text)));
  document.querySelector("main").prepend(banner, facts, element("div", { className: "scrolled" },
    element("table", {}, element("thead", {}, head), verdict)));
  const chooser = element("select", { id: "channel", ariaLabel: "Channel" });
  document.querySelector("#figure-loops").prepend(element("label", { className: "controls" }, "Channel ", chooser));
  chooser.addEventListener("change", () => { channel = chooser.value; redraw(); });

  const waterfall = element("canvas", { id: "waterfall", role: "img", ariaLabel: "Waterfall: spectra of the last half minute" });
  document.querySelector("#figure-spectrum .plots").after(element("div", { className: "canvases" }, waterfall));
  const rows = element("canvas", { width: 1, height: ROWS });

  // ---- Facts and verdict ----

  function showFacts({ t_s, origin, status, fix, verdict: errors, page, receiver }) {
    const ticks = status?.ticks, refused = Object.entries(page.refused).filter(([, count]) => count > 0);
    const pairs = [
      ["time", `${fixed(t_s)} s`],
      ["origin of map", origin ? `${fixed(origin[0], 5)}°, ${fixed(origin[1], 5)}°, ${fixed(origin[2], 0)} m` : "–"],
      ["underruns", status ? `${status.underruns}, stalls ${status.stalls}` : "–"],
      ["latency", status ? `median ${measured(status.age_ms.p50, "ms")}, largest ${measured(status.age_ms.max, "ms")}` : "–"],
      ["motion", ticks ? `${ticks.fresh} fresh ticks, ${ticks.extrapolated} extrapolated, ${ticks.snap} snaps` : "–"],
      ["receiver", receiver || "none"],
      ["fixes", errors.fixes ? `${errors.fixes}, ${fix?.satellites ?? "–"} satellites, HDOP ${fixed(fix?.hdop)}` : "none"],
      ["page", `${page.browsers} ${page.browsers === 1 ? "browser" : "browsers"}, ${page.dropped} ${page.dropped === 1 ? "frame" : "frames"} dropped`],
      ["refused", refused.map(([name, count]) => `${name} ${count}`).join(", ") || "nothing"],
    ];
    facts.replaceChildren(...pairs.map(([name, value]) =>
      element("div", {}, element("dt", {}, name), element("dd", {}, value))));
  }

  function showVerdict({ status, verdict: errors }) {
    const line = (name, value, limit, unit, digits) => {
      const known = typeof value === "number" && typeof limit === "number", good = known && value <= limit;
      const words = known ? (good ? "pass" : "fail") : "no data";
      return element("tr", {}, element("td", {}, name), element("td", {}, measured(value, unit, digits)),
        element("td", {}, known ? `${fixed(limit, digits)} ${unit}` : "–"),
        element("td", { className: known ? (good ? "good" : "bad") : "faint" }, words));
    };
    verdict.replaceChildren(
      line("horizontal error, 95 % (limit 2.45 σ as reported)", errors.horizontal_p95_m, errors.horizontal_limit_m, "m", 2),
      line("vertical error, 95 % (limit 1.96 σ as reported)", errors.vertical_p95_m, errors.vertical_limit_m, "m", 2),
      line("underruns", status?.underruns, 0, "", 0));
  }

  // ---- Histories ----

  // The history of a channel: times and the twelve values of its rows.
  function historyOf(name) {
    if (!histories.has(name)) histories.set(name, { t: [], values: Array.from({ length: 12 }, () => []) });
    return histories.get(name);
  }

  function learn(next) {
    frame = next;
    const t = next.t_s;
    for (const [name, values] of Object.entries(next.channels)) {
      const history = historyOf(name), row = JSON.stringify(values);
      // A row that did not change is no new one.
      if (history.row === row) continue;
      history.row = row;
      keep(history.t, t);
      values.forEach((value, n) => keep(history.values[n], value ?? NaN));
    }
    const point = (series, place) => {
      const last = series.x.length - 1;
      if (!place || (series.x[last] === place[0] && series.y[last] === place[1])) return;
      keep(series.x, place[0]);
      keep(series.y, place[1]);
    };
    point(map.series[0], next.truth);
    point(map.series[1], next.fix?.place);
    [map.series[2].x, map.series[2].y] = next.truth ? [[next.truth[0]], [next.truth[1]]] : [[], []];
    const { status } = next;
    if (status) {
      for (const [series, value] of [[ages.series[0], status.age_ms.p50], [ages.series[1], status.age_ms.p99],
        [counts.series[0], status.underruns], [counts.series[1], status.stalls]]) {
        if (typeof value !== "number") continue;
        keep(series.x, t);
        keep(series.y, value);
      }
    }
    if (next.spectrum) pour(next.spectrum[1]);
    redraw();
  }

  function forget() {
    histories = new Map();
    for (const plot of [map, ages, counts]) for (const series of plot.series) { series.x = []; series.y = []; }
    rows.width = 1;
    tail = "";
  }

  // ---- Waterfall ----

  // The scale of C/N0 as numbers, dark to light.
  const shades = sky.sky.scale.map((colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16)));

  // Adds a spectrum as the uppermost row.
  function pour(density) {
    const text = density.join();
    if (text === tail) return;
    tail = text;
    const pen = rows.getContext("2d", { willReadFrequently: true });
    if (rows.width !== density.length) rows.width = density.length;
    pen.drawImage(rows, 0, 1);
    const row = pen.createImageData(density.length, 1), [low, high] = rangeOf(density);
    density.forEach((value, n) => {
      const shade = shades[Math.round(Math.min(Math.max((value - low) / (high - low), 0), 1) * (shades.length - 1))];
      row.data.set([...shade, 255], 4 * n);
    });
    pen.putImageData(row, 0, 0);
  }

  // Range of a spectrum, in steps of 10 dB, at least 20 dB.
  function rangeOf(density) {
    const sorted = [...density].sort((a, b) => a - b);
    const low = Math.floor((sorted[Math.floor(sorted.length / 50)] - 3) / 10) * 10;
    return [low, Math.max(Math.ceil((sorted[sorted.length - 1] + 3) / 10) * 10, low + 20)];
  }

  function drawWaterfall() {
    const { width, ratio, box, view, home } = spectrum, height = 120;
    waterfall.width = Math.round(width * ratio);
    waterfall.height = Math.round(height * ratio);
    const pen = waterfall.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.imageSmoothingEnabled = false;
    const perColumn = (home.x[1] - home.x[0]) / rows.width, from = (view.x[0] - home.x[0]) / perColumn;
    pen.drawImage(rows, from, 0, (view.x[1] - view.x[0]) / perColumn, ROWS, box.x, 0, box.w, height);
  }

  // ---- Plots ----

  // Sets the home of an axis, and the view where nobody has moved it.
  function range(plot, axis, ends) {
    plot.home[axis] = [...ends];
    if (!plot.moved) plot.view[axis] = [...ends];
  }

  // Ends around values, and not closer than `least`.
  function around(values, least) {
    const known = values.filter(Number.isFinite);
    if (known.length === 0) return [-least / 2, least / 2];
    const low = known.reduce((a, b) => Math.min(a, b)), high = known.reduce((a, b) => Math.max(a, b));
    const half = Math.max(0.55 * (high - low), least / 2), middle = (low + high) / 2;
    return [middle - half, middle + half];
  }

  function drawSky() {
    const scale = sky.sky.scale, { low, high } = sky.sky, channels = Object.keys(frame.channels);
    const strongest = (sv) => Math.max(...[frame.cn0, Object.fromEntries(Object.entries(frame.channels)
      .map(([name, values]) => [name, values[0]]))].flatMap((table) => Object.entries(table)
      .filter(([name]) => name.split(" ")[0] === sv).map(([, value]) => value ?? -Infinity)));
    sky.tracks = Object.entries(frame.sky).map(([sv, [azimuth, elevation]]) => {
      const angle = (azimuth * Math.PI) / 180, distance = 1 - elevation / 90, cn0 = strongest(sv);
      const share = Math.min(Math.max((cn0 - low) / (high - low), 0), 1);
      const isKnown = Number.isFinite(cn0);
      return { sv, system: sv.slice(0, 1), cn0: isKnown ? cn0 : null,
        observed: channels.length === 0 || channels.some((name) => name.split(" ")[0] === sv),
        colour: isKnown ? scale[Math.round(share * (scale.length - 1))] : null,
        x: [distance * Math.sin(angle)], y: [distance * Math.cos(angle)] };
    });
    sky.systems = [...new Set(sky.tracks.map((track) => track.system))];
    sky.root.ariaLabel = `Sky with ${sky.tracks.length} satellites: ` + sky.tracks.map((track) => sky.inWords(track)).join("; ");
    sky.draw();
  }

  function drawStrengths() {
    const names = [...new Set([...Object.keys(frame.cn0), ...Object.keys(frame.channels)])].sort();
    const [truth, received] = strengths.series;
    truth.x = []; truth.y = []; received.x = []; received.y = [];
    names.forEach((name, n) => {
      if (frame.cn0[name] !== undefined) { truth.x.push(n); truth.y.push(frame.cn0[name]); }
      const measured = frame.channels[name]?.[0];
      if (typeof measured === "number") { received.x.push(n); received.y.push(measured); }
    });
    strengths.chart.x.names = names.map((name, n) => [n, name.split(" ")[0]]);
    range(strengths, "x", [-0.7, Math.max(names.length, 1) - 0.3]);
    range(strengths, "y", [0, 60]);
    strengths.draw();
  }

  function drawSpectrum() {
    if (frame.spectrum) {
      const [[low, high], density] = frame.spectrum, step = (high - low) / (density.length - 1);
      spectrum.series[0].x = density.map((_, n) => (low + n * step) / 1e6);
      spectrum.series[0].y = density;
      range(spectrum, "x", [low / 1e6, high / 1e6]);
      range(spectrum, "y", rangeOf(density));
    }
    spectrum.draw();
    drawWaterfall();
  }

  function drawLoops() {
    const names = Object.keys(frame.channels).sort();
    if (!names.includes(channel)) channel = names[0] ?? "";
    if (names.join() !== chooser.dataset.names) {
      chooser.dataset.names = names.join();
      chooser.replaceChildren(...names.map((name) => element("option", { value: name }, name)));
    }
    chooser.value = channel;
    const { t, values } = channel ? historyOf(channel) : { t: [], values: Array.from({ length: 12 }, () => []) };
    const recent = (list) => list.slice(-300);
    prompt.series[0].x = recent(values[1]);
    prompt.series[0].y = recent(values[2]);
    const reach = 1.1 * Math.max(5, ...[...prompt.series[0].x, ...prompt.series[0].y].filter(Number.isFinite).map(Math.abs));
    range(prompt, "x", [-reach, reach]);
    range(prompt, "y", [-reach, reach]);
    drawTaps(values.map(recent));
    [4, 3, 5].forEach((column, n) => {
      const plot = loops[n];
      plot.series[0].x = t;
      plot.series[0].y = values[column];
      range(plot, "y", around(recent(values[column]), [0.02, 0.02, 1][n]));
    });
  }

  // Magnitudes of late, prompt and early over how far their replicas are ahead of the prompt's.
  function drawTaps(values) {
    const [mean, last] = taps.series, count = values[11].length;
    const rows = Array.from({ length: count }, (_, n) => values.map((column) => column[n])).filter((row) => row.slice(7).every(Number.isFinite));
    const magnitudes = rows.map((row) => [[9, 10], [1, 2], [7, 8]].map(([i, q]) => Math.hypot(row[i], row[q])));
    const spacing = rows.length > 0 ? rows[rows.length - 1][11] : 0;
    // A channel that changes its spacing begins again.
    const alike = magnitudes.filter((_, n) => rows[n][11] === spacing);
    mean.x = last.x = alike.length > 0 ? [-spacing / 2, 0, spacing / 2] : [];
    last.y = alike[alike.length - 1] ?? [];
    mean.y = alike.length > 0 ? [0, 1, 2].map((tap) => alike.reduce((sum, row) => sum + row[tap], 0) / alike.length) : [];
    range(taps, "x", [-Math.max(spacing, 0.1), Math.max(spacing, 0.1)]);
    range(taps, "y", [0, 1.2 * Math.max(5, ...mean.y, ...last.y)]);
  }

  function drawAll() {
    asked = false;
    if (!frame) return;
    showFacts(frame);
    showVerdict(frame);
    const end = Math.max(frame.t_s, 1);
    Plot.times = [0, end];
    const follows = linked.every((plot) => !plot.moved);
    for (const plot of linked) {
      plot.home.x = [0, end];
      if (follows) plot.view.x = [Math.max(0, end - WINDOW_S), Math.max(end, 10)];
    }
    drawLoops();
    range(ages, "y", [0, 1.1 * Math.max(10, ...ages.series[1].y.slice(-600))]);
    range(counts, "y", [0, 1.1 * Math.max(5, ...counts.series.flatMap(({ y }) => y.slice(-1)))]);
    const places = ["x", "y"].map((axis) => around(map.series.flatMap((series) => series[axis]), 10));
    range(map, "x", places[0]);
    range(map, "y", places[1]);
    for (const plot of [map, prompt, taps, ...linked]) plot.draw();
    drawSky();
    drawStrengths();
    drawSpectrum();
    document.body.dataset.frames = String(Number(document.body.dataset.frames ?? 0) + 1);
  }

  function redraw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(drawAll);
  }

  // ---- Events ----

  const log = element("ol", { id: "log" }), answer = element("p", { id: "answer", role: "status" });

  async function send(line) {
    try {
      const got = await fetch(`event${location.search}`, { method: "POST", body: line });
      const why = got.ok ? "" : await got.text();
      answer.textContent = got.ok ? `sent: ${line}` : `refused: ${line}: ${why || got.status}`;
    } catch {
      answer.textContent = `not sent: ${line}: no connection`;
    }
  }

  function buildEvents() {
    const section = document.querySelector("#events"), list = section.querySelector("dl");
    const sources = [...list.querySelectorAll("div")].map((pair) =>
      ({ name: pair.querySelector("dt").textContent, verb: pair.querySelector("dd").textContent }));
    list.remove();
    if (sources.length === 0) {
      section.append(element("p", { className: "note" }, "Events need a live run of a scene with pushed motion."));
      return;
    }
    const source = element("select", { id: "source", ariaLabel: "Source" }, ...sources.map(({ name, verb }, n) =>
      element("option", { value: String(n) }, verb === "power" ? name : `${verb} ${name}`)));
    const entry = (id, value, label) => element("input", { id, type: "number", value, ariaLabel: label, step: "any" });
    const power = entry("decibels", "-10", "Power over the scene's in dB"), error = entry("metres", "30", "Range error in metres");
    const chosen = () => sources[Number(source.value)];
    const button = (text, line) => {
      const made = element("button", { type: "button" }, text);
      made.addEventListener("click", () => send(line(chosen())));
      return made;
    };
    const wrong = button("set range error", ({ name }) => `range_error ${name} ${error.value}`);
    source.addEventListener("change", () => { wrong.disabled = error.disabled = chosen().verb !== "power"; });
    wrong.disabled = error.disabled = chosen().verb !== "power";
    section.append(element("div", { className: "controls", role: "group", ariaLabel: "Events" }, source,
      button("off", ({ name, verb }) => `${verb} ${name} off`), button("on", ({ name, verb }) => `${verb} ${name} on`),
      power, "dB", button("set power", ({ name, verb }) => `${verb} ${name} ${power.value}`), error, "m", wrong), answer, log);
  }

  // ---- Start ----

  buildEvents();
  let ended = false;
  function connect() {
    const stream = new EventSource(`stream${location.search}`);
    const say = (text, tone) => { banner.textContent = text; banner.className = `banner ${tone}`; };
    stream.addEventListener("open", () => { forget(); say("Connected: this page follows the run.", "good"); });
    stream.addEventListener("message", ({ data }) => {
      const next = JSON.parse(data);
      learn(next);
      log.replaceChildren(...[...next.events].reverse().map((text) => element("li", {}, text)));
    });
    stream.addEventListener("end", () => { ended = true; stream.close(); say("The run has ended: these are its last values.", "plain"); });
    stream.addEventListener("error", () => {
      stream.close();
      if (ended) return;
      say("No connection: trying again. The run may have ended.", "caution");
      setTimeout(connect, 2000);
    });
  }
  connect();
  for (const plot of all) plot.root.addEventListener("dblclick", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
})();
