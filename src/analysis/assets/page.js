// Plots and filters of a report. The figures come as JSON in the page; nothing is loaded.
//
// A plot is two canvases: the lower has axes and series, the upper the cursor. Axes in seconds share one
// range. What is drawn is written in `Plot.draw`, what moves it in `Plot.listen`.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const arrays = data.arrays.map(decoded);
  const plots = [];
  // Names of satellites that are switched off, and the numbers of the legends' own entries.
  const off = new Set();
  // What is shown in print: the light colours, everything drawn.
  let printing = false;

  // ---- Data ----

  function decoded(array) {
    const bytes = Uint8Array.from(atob(array.f ?? array.q), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    if (array.f !== undefined) {
      return Float64Array.from({ length: bytes.length / 4 }, (_, n) => view.getFloat32(4 * n, true));
    }
    const value = (_, n) => array.low + array.step * view.getUint16(2 * n, true);
    return Float64Array.from({ length: bytes.length / 2 }, value);
  }

  // A satellite, or one of its signals.
  const isSatellite = (name) => /^[A-Z]\d\d\b/.test(name);
  const satelliteOf = (name) => name.split(" ")[0];
  const signalOf = (name) => name.split(" ").slice(1).join(" ");

  // ---- Colours ----

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => dark.matches && !printing;

  function palette() {
    return isDark()
      ? { ground: "#15181b", ink: "#e8e8e6", faint: "#a9adb0", grid: "#2e3337", frame: "#6a7076" }
      : { ground: "#ffffff", ink: "#1e1e1e", faint: "#5f5f5f", grid: "#e3e3e3", frame: "#8a8a8a" };
  }

  // The colour of a series; on a dark ground dark ones are lightened.
  function ink(colour) {
    const rgb = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
    const light = (0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]) / 255;
    if (!isDark() || light > 0.5) return colour;
    const share = light < 0.1 ? 0.9 : 0.35;
    return `rgb(${rgb.map((value) => Math.round(value + (255 - value) * share)).join(",")})`;
  }

  // ---- Numbers ----

  // Ticks at whole multiples of 1, 2 or 5 times a power of ten, at least two; labels have the step's decimals.
  function linearTicks(from, to, most) {
    let best = [[], 0];
    for (let power = Math.floor(Math.log10((to - from) / most)) - 1; ; power += 1) {
      for (const unit of [1, 2, 5]) {
        const step = unit * 10 ** power;
        const first = Math.ceil(from / step - 1e-6), last = Math.floor(to / step + 1e-6);
        // The last step with two ticks stands where the next has fewer.
        if (!(last > first)) return labelled(...best);
        best = [Array.from({ length: last - first + 1 }, (_, n) => (first + n) * unit), power];
        if (last - first < most) return labelled(...best);
      }
    }
  }

  // Characters of a label that fit beside an axis, and digits of a label with an exponent.
  const MOST_CHARACTERS = 7, MOST_DIGITS = 3;

  // Ticks at numbers of units of 10^power; where many digits are common to all, labels count from an offset.
  function labelled(units, power) {
    const ticks = (labels) => units.map((count, n) => ({ at: count * 10 ** power, label: labels[n] }));
    const isLong = (counts) => counts.some((count) => plain(Math.abs(count), power).length > MOST_CHARACTERS);
    const words = (counts) => {
      const written = isLong(counts) ? scientific : plain;
      return counts.map((count) => written(count, power));
    };
    const digits = Math.max(...units.map((count) => String(Math.abs(count)).length));
    if (!isLong(units) || digits <= MOST_DIGITS) return { ticks: ticks(words(units)) };
    // The roundest number below the first tick from which the others are few digits away.
    const round = 10 ** String(units[units.length - 1] - units[0]).length;
    const offset = Math.floor(units[0] / round) * round;
    const text = plain(Math.abs(offset), power).length > 2 * MOST_CHARACTERS ? scientific(offset, power)
      : plain(offset, power).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
    return { ticks: ticks(words(units.map((count) => count - offset))), offset: text };
  }

  // The number units·10^power, without and with an exponent.
  const plain = (units, power) => (units * 10 ** power).toFixed(Math.max(0, -power)).replace("-", "−");
  function scientific(units, power) {
    if (units === 0) return "0";
    return (units * 10 ** power).toExponential(String(Math.abs(units)).length - 1).replace(/\.?0*e\+?/, "e").replaceAll("-", "−");
  }
  const multiple = (units, power) => labelled([units], power).ticks[0].label;

  // Ticks of an axis whose numbers are common logarithms: 1, 2 and 5 in each decade, or decades as far apart as `most` needs. A short
  // axis has those of a linear one.
  function logarithmicTicks(from, to, most) {
    const of = (factors, stride) => {
      const ticks = [];
      for (let decade = Math.floor(from / stride) * stride; decade <= to; decade += stride) {
        for (const factor of factors) {
          const at = decade + Math.log10(factor);
          if (at >= from - 1e-9 && at <= to + 1e-9) ticks.push({ at, label: multiple(factor, decade) });
        }
      }
      return ticks;
    };
    let best = null;
    for (const [factors, stride] of [[[1, 2, 5], 1], [[1, 3], 1], ...[1, 2, 3, 5, 10, 20, 50, 100].map((stride) => [[1], stride])]) {
      const ticks = of(factors, stride);
      if (ticks.length < 2) break;
      best = { ticks };
      if (ticks.length <= most) return best;
    }
    if (best) return best;
    const linear = linearTicks(10 ** from, 10 ** to, most);
    return { ...linear, ticks: linear.ticks.map(({ at, label }) => ({ at: Math.log10(at), label })) };
  }

  function namedTicks(names, [from, to], most) {
    const seen = names.filter(([at]) => at >= from && at <= to);
    const stride = Math.ceil(seen.length / Math.max(most, 2));
    return { ticks: seen.filter((_, n) => n % stride === 0).map(([at, label]) => ({ at, label })) };
  }

  function ticksOf(axis, [from, to], most) {
    if (axis.names) return namedTicks(axis.names, [from, to], most);
    return axis.log ? logarithmicTicks(from, to, most) : linearTicks(from, to, most);
  }

  // A value with as many digits as its axis resolves.
  function shown(value, axis, [from, to]) {
    if (axis.names) {
      const near = axis.names.find(([at]) => Math.abs(at - value) < 0.5);
      return near ? near[1] : "";
    }
    const unit = (/\(([^)]*)\)\s*$/.exec(axis.label) ?? ["", ""])[1];
    if (axis.log) return `${(10 ** value).toPrecision(3)} ${unit}`;
    const decimals = Math.min(12, Math.max(0, Math.ceil(3 - Math.log10(to - from))));
    return `${value.toFixed(decimals).replace("-", "−")} ${unit}`;
  }

  // ---- Marks ----

  function polygon(pen, x, y, corners, radius) {
    corners.forEach(([dx, dy], n) => pen[n ? "lineTo" : "moveTo"](x + (dx * radius) / 8, y + (dy * radius) / 8));
    pen.closePath();
  }

  // Marks at points, in one path each.
  function drawMarks(pen, mark, points, scale) {
    pen.beginPath();
    const shape = mark.shape ?? {};
    for (const [x, y] of points) {
      const r = scale * (mark.dot ?? mark.ring ?? mark.cross ?? mark.size);
      if (mark.dot || mark.ring) {
        pen.moveTo(x + r, y);
        pen.arc(x, y, r, 0, 2 * Math.PI);
      } else if (mark.cross) {
        pen.moveTo(x - r, y - r); pen.lineTo(x + r, y + r);
        pen.moveTo(x - r, y + r); pen.lineTo(x + r, y - r);
      } else if (shape.strokes) {
        for (const [a, b] of shape.strokes) {
          pen.moveTo(x + (a[0] * r) / 8, y + (a[1] * r) / 8);
          pen.lineTo(x + (b[0] * r) / 8, y + (b[1] * r) / 8);
        }
      } else polygon(pen, x, y, shape.fill ?? shape.outline ?? [], r);
    }
    pen.lineWidth = mark.cross ? 2 : 1;
    if (mark.dot || shape.fill) pen.fill(); else pen.stroke();
  }

  // A small picture of a series for a button.
  function swatch(series) {
    const canvas = element("canvas", { width: 28, height: 28, ariaHidden: "true" });
    const pen = canvas.getContext("2d");
    pen.scale(2, 2);
    const { mark } = series;
    pen.fillStyle = pen.strokeStyle = mark.tile ? series.colour : ink(series.colour);
    if (mark.line) {
      pen.lineWidth = 2;
      pen.setLineDash(mark.line.map((length) => length / 2));
      pen.beginPath(); pen.moveTo(0, 7); pen.lineTo(14, 7); pen.stroke();
    } else if (mark.bars || mark.tile || mark.band) {
      pen.globalAlpha = mark.band ? 0.3 : 1;
      pen.fillRect(2, 2, 10, 10);
    } else drawMarks(pen, mark, [[7, 7]], mark.cross ? 0.6 : mark.size ? 4.5 / mark.size : 1.8);
    return canvas;
  }

  // Gives both canvases of a plot a size, and paper three dots a pixel.
  function resize(plot, width, height) {
    const ratio = printing ? 3 : Math.max(1, window.devicePixelRatio || 1);
    if (plot.width === width && plot.height === height && plot.ratio === ratio) return;
    Object.assign(plot, { width, height, ratio });
    for (const canvas of [plot.base, plot.over]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
  }

  function element(name, properties = {}, ...children) {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
  }

  // ---- A plot ----

  const EDGE = { left: 64, right: 12, top: 8, bottom: 38 };
  const readout = document.getElementById("readout");

  class Plot {
    constructor(figure, chart, holder) {
      Object.assign(this, { figure, chart });
      this.series = chart.series.map((one) => ({ ...one, x: arrays[one.x], y: arrays[one.y] }));
      this.home = { x: [chart.x.from, chart.x.to], y: [chart.y.from, chart.y.to] };
      this.view = { x: [...this.home.x], y: [...this.home.y] };
      // Axes in seconds move together; those of averaging times are logarithmic.
      this.linked = !chart.x.log && !chart.x.names && /time.*\(s\)$/.test(chart.x.label);
      this.base = element("canvas", { className: "base" });
      this.over = element("canvas", { className: "over" });
      this.words = element("small");
      this.root = element("div", { className: "plot", tabIndex: 0, role: "application" },
        element("div", { className: "plot-title" }, chart.title, this.words),
        element("div", { className: "canvases" }, this.base, this.over));
      this.root.ariaRoleDescription = "plot";
      this.root.ariaLabel = `${chart.title}: ${chart.y.label} over ${chart.x.label}`;
      this.root.setAttribute("aria-describedby", "help");
      holder.append(this.root);
      this.near = null;
      this.listen();
    }

    // ---- Size and scales ----

    layout() {
      const width = Math.max(200, this.root.clientWidth || 600);
      const isSquare = this.figure.charts.some((chart) => chart.equal);
      const height = isSquare ? Math.min(width, 480) : this.figure.columns > 1 ? 260 : 230;
      resize(this, width, height);
      this.box = { x: EDGE.left, y: EDGE.top, w: width - EDGE.left - EDGE.right, h: height - EDGE.top - EDGE.bottom };
      if (!this.chart.equal) return;
      if (!this.moved) this.view = { x: [...this.home.x], y: [...this.home.y] };
      this.equalise();
    }

    // Widens one axis until a metre is as long up as across.
    equalise() {
      const { x, y } = this.view;
      const perPixel = Math.max((x[1] - x[0]) / this.box.w, (y[1] - y[0]) / this.box.h);
      const about = ([from, to], length) => [-0.5, 0.5].map((half) => 0.5 * (from + to) + half * perPixel * length);
      this.view = { x: about(x, this.box.w), y: about(y, this.box.h) };
    }

    toX(value) { return this.box.x + ((value - this.view.x[0]) / (this.view.x[1] - this.view.x[0])) * this.box.w; }
    toY(value) { return this.box.y + ((this.view.y[1] - value) / (this.view.y[1] - this.view.y[0])) * this.box.h; }
    fromX(x) { return this.view.x[0] + ((x - this.box.x) / this.box.w) * (this.view.x[1] - this.view.x[0]); }
    fromY(y) { return this.view.y[1] - ((y - this.box.y) / this.box.h) * (this.view.y[1] - this.view.y[0]); }

    isOff(series) {
      if (isSatellite(series.name)) return off.has(series.name);
      return off.has(`${this.figure.name}|${series.colour}|${JSON.stringify(series.mark)}`);
    }

    visible() { return this.series.filter((series) => !this.isOff(series)); }

    // ---- Drawing ----

    draw() {
      this.layout();
      const pen = this.base.getContext("2d");
      const { box } = this;
      pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      pen.fillStyle = palette().ground;
      pen.fillRect(0, 0, this.width, this.height);
      this.axes(pen);
      pen.save();
      pen.beginPath();
      pen.rect(box.x, box.y, box.w, box.h);
      pen.clip();
      let outside = 0;
      for (const series of this.visible()) outside += this.one(pen, series);
      for (const [x, y, text, up] of this.chart.labels) {
        // Tiles are pale in every theme.
        pen.fillStyle = this.series.some(({ mark }) => mark.tile) ? "#1e1e1e" : palette().ink;
        pen.font = "11px system-ui, 'DejaVu Sans', sans-serif";
        pen.textAlign = "left";
        pen.textBaseline = "middle";
        pen.fillText(text, this.toX(x) - 2, this.toY(y) - up);
      }
      pen.restore();
      if (this.series.every(({ x }) => x.length === 0)) {
        pen.fillStyle = palette().faint;
        pen.textAlign = "center";
        pen.fillText("no data", box.x + box.w / 2, box.y + box.h / 2);
      }
      if (this.chart.equal) this.scaleBar(pen);
      const colours = palette();
      pen.strokeStyle = colours.frame;
      pen.lineWidth = 1;
      pen.setLineDash([]);
      pen.strokeRect(box.x + 0.5, box.y + 0.5, box.w - 1, box.h - 1);
      this.words.textContent = outside > 0 ? `${outside} points above or below: F fits them` : "";
      this.drawn = true;
      this.cursor();
    }

    axes(pen) {
      const { box, chart } = this, colours = palette();
      pen.font = "11.5px system-ui, 'DejaVu Sans', sans-serif";
      pen.lineWidth = 1;
      pen.setLineDash([]);
      const across = Math.max(2, Math.floor(box.w / (chart.x.names ? 26 : 78)));
      const up = chart.y.names ? 40 : Math.max(2, Math.floor(box.h / 34));
      pen.textAlign = "center";
      pen.textBaseline = "top";
      const [x, y] = [ticksOf(chart.x, this.view.x, across), ticksOf(chart.y, this.view.y, up)];
      for (const { at, label } of x.ticks) {
        const place = Math.round(this.toX(at)) + 0.5;
        pen.strokeStyle = colours.grid;
        pen.beginPath(); pen.moveTo(place, box.y); pen.lineTo(place, box.y + box.h); pen.stroke();
        pen.fillStyle = colours.faint;
        pen.fillText(label, place, box.y + box.h + 5);
      }
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      for (const { at, label } of y.ticks) {
        const place = Math.round(this.toY(at)) + 0.5;
        pen.strokeStyle = colours.grid;
        pen.beginPath(); pen.moveTo(box.x, place); pen.lineTo(box.x + box.w, place); pen.stroke();
        pen.fillStyle = colours.faint;
        pen.fillText(label, box.x - 6, place);
      }
      pen.fillStyle = colours.ink;
      pen.textAlign = "center";
      pen.textBaseline = "bottom";
      const words = (axis, { offset }) => (offset === undefined ? axis.label : `${axis.label}, counted from ${offset}`);
      pen.fillText(words(chart.x, x), box.x + box.w / 2, this.height - 2);
      pen.save();
      pen.translate(11, box.y + box.h / 2);
      pen.rotate(-Math.PI / 2);
      pen.textBaseline = "middle";
      pen.fillText(words(chart.y, y), 0, 0, box.h);
      pen.restore();
    }

    // Draws a series; how many of its points are above or below the frame.
    one(pen, series) {
      const { mark } = series, colour = mark.tile ? series.colour : ink(series.colour);
      pen.strokeStyle = pen.fillStyle = colour;
      pen.globalAlpha = 1;
      if (mark.bars || mark.tile) {
        const [w, h] = mark.tile ?? [mark.bars, 0];
        for (let n = 0; n < series.x.length; n += 1) {
          const [x, y] = [series.x[n], series.y[n]];
          const [top, low] = mark.tile ? [y + h / 2, y - h / 2] : [Math.max(y, 0), Math.min(y, 0)];
          const left = this.toX(x - w / 2);
          pen.fillRect(left, this.toY(top), this.toX(x + w / 2) - left, this.toY(low) - this.toY(top));
        }
        return 0;
      }
      if (mark.line || mark.band) { this.line(pen, series); return 0; }
      const { box, view } = this, points = [];
      let outside = 0;
      for (let n = 0; n < series.x.length; n += 1) {
        const x = series.x[n], y = series.y[n];
        if (x < view.x[0] || x > view.x[1]) continue;
        if (y < view.y[0] || y > view.y[1]) { outside += 1; continue; }
        points.push([this.toX(x), this.toY(y)]);
      }
      // Marks grow where few are in view.
      const scale = mark.cross || points.length === 0 ? 1 : Math.min(1.8, Math.max(0.8, box.w / points.length / 2));
      if (points.length > 0) drawMarks(pen, mark, points, scale);
      return this.linked ? outside : 0;
    }

    line(pen, { mark, x, y }) {
      pen.lineWidth = 1.5;
      pen.lineJoin = "round";
      pen.setLineDash(mark.line ?? []);
      pen.beginPath();
      for (let n = 0; n < x.length; n += 1) pen[n ? "lineTo" : "moveTo"](this.toX(x[n]), this.toY(y[n]));
      if (mark.band) {
        pen.globalAlpha = 0.2;
        pen.fill();
      } else pen.stroke();
      pen.globalAlpha = 1;
      pen.setLineDash([]);
    }

    // A length of round metres in the lower right corner.
    scaleBar(pen) {
      const unit = (/\(([^)]*)\)\s*$/.exec(this.chart.x.label) ?? ["", ""])[1];
      const perPixel = (this.view.x[1] - this.view.x[0]) / this.box.w;
      const power = Math.floor(Math.log10(90 * perPixel));
      const digit = [5, 2, 1].find((one) => one * 10 ** power <= 90 * perPixel) ?? 1;
      const length = (digit * 10 ** power) / perPixel;
      const right = this.box.x + this.box.w - 12, y = this.box.y + this.box.h - 12;
      pen.strokeStyle = pen.fillStyle = palette().ink;
      pen.lineWidth = 2;
      pen.beginPath();
      pen.moveTo(right - length, y - 4); pen.lineTo(right - length, y); pen.lineTo(right, y); pen.lineTo(right, y - 4);
      pen.stroke();
      pen.textAlign = "center";
      pen.textBaseline = "bottom";
      pen.fillText(`${multiple(digit, power)} ${unit}`, right - length / 2, y - 4);
    }

    // Draws the line of the common time, the nearest point and its values, and the part being dragged.
    cursor() {
      const pen = this.over.getContext("2d"), { box } = this, colours = palette();
      pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      pen.clearRect(0, 0, this.width, this.height);
      if (printing) return;
      if (this.dragged) {
        const { x, y, w, h } = this.dragged;
        pen.fillStyle = isDark() ? "rgba(108,184,238,0.25)" : "rgba(0,96,160,0.15)";
        pen.fillRect(x, y, w, h);
      }
      if (this.linked && Plot.time !== null && Plot.time >= this.view.x[0] && Plot.time <= this.view.x[1]) {
        pen.strokeStyle = colours.faint;
        pen.setLineDash([3, 3]);
        const x = this.toX(Plot.time);
        pen.beginPath(); pen.moveTo(x, box.y); pen.lineTo(x, box.y + box.h); pen.stroke();
        pen.setLineDash([]);
      }
      if (!this.near) return;
      const { series, n } = this.near, x = this.toX(series.x[n]), y = this.toY(series.y[n]);
      pen.strokeStyle = colours.ink;
      pen.lineWidth = 1.5;
      pen.beginPath(); pen.arc(x, y, 5, 0, 2 * Math.PI); pen.stroke();
      const text = this.inWords();
      pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
      const width = pen.measureText(text).width + 12;
      const left = Math.min(Math.max(x + 10, box.x), box.x + box.w - width), top = y > box.y + 34 ? y - 32 : y + 12;
      pen.fillStyle = colours.ground;
      pen.strokeStyle = colours.frame;
      pen.lineWidth = 1;
      pen.fillRect(left, top, width, 22);
      pen.strokeRect(left, top, width, 22);
      pen.fillStyle = colours.ink;
      pen.textAlign = "left";
      pen.textBaseline = "middle";
      pen.fillText(text, left + 6, top + 11);
    }

    // Name and values of the nearest point.
    inWords() {
      const { series, n } = this.near, { chart, view } = this;
      const entry = this.figure.legend.find((one) => one.colour === series.colour && sameMark(one.mark, series.mark));
      // A tile is named by the value that is written on it.
      const written = chart.labels.find(([x, y]) => Math.hypot(x - series.x[n], y - series.y[n]) < 0.5);
      const name = series.mark.tile && written ? written[2] : series.name || (entry ? entry.name : "");
      const values = [shown(series.x[n], chart.x, view.x), shown(series.y[n], chart.y, view.y)];
      return [name, ...values].filter((word) => word.trim() !== "").join(" · ");
    }

    // The nearest point of a series that is on, within 40 pixels.
    find(px, py) {
      let best = 40 ** 2, found = null;
      for (const series of this.visible()) {
        for (let n = 0; n < series.x.length; n += 1) {
          const dx = this.toX(series.x[n]) - px, dy = this.toY(series.y[n]) - py, distance = dx * dx + dy * dy;
          if (distance < best) [best, found] = [distance, { series, n }];
        }
      }
      return found;
    }

    point(near) {
      this.near = near;
      if (this.linked) {
        Plot.time = near ? near.series.x[near.n] : null;
        for (const other of plots.filter((plot) => plot !== this && plot.linked)) {
          other.near = null;
          if (other.seen) other.cursor();
        }
      }
      this.cursor();
    }

    // ---- Moving ----

    setX(range) {
      this.moved = true;
      if (!this.linked) { this.view.x = range; this.draw(); return; }
      const [low, high] = Plot.times;
      // No further out than the whole run.
      const span = Math.min(range[1] - range[0], high - low);
      const from = Math.min(Math.max(range[0], low), high - span);
      for (const plot of plots) if (plot.linked) { plot.view.x = [from, from + span]; plot.drawn = false; }
      redraw();
    }

    setY(range) { this.view.y = range; this.draw(); }

    // Magnifies about a point of the canvas.
    zoom(factor, px, py, vertical) {
      const about = ([from, to], middle) => [middle + (from - middle) * factor, middle + (to - middle) * factor];
      const { x, y } = this.view, middle = [this.fromX(px), this.fromY(py)];
      if (vertical || this.chart.equal) this.view.y = about(y, middle[1]);
      if (!vertical || this.chart.equal) this.setX(about(x, middle[0])); else this.draw();
    }

    // Moves by a part of the view.
    move(across, up) {
      const by = ([from, to], share) => [from + share * (to - from), to + share * (to - from)];
      if (up) this.view.y = by(this.view.y, up);
      if (across) this.setX(by(this.view.x, across)); else this.draw();
    }

    // Fits the vertical axis to what is in view.
    fit() {
      let low = Infinity, high = -Infinity;
      for (const { x, y } of this.visible()) {
        for (let n = 0; n < x.length; n += 1) {
          if (x[n] < this.view.x[0] || x[n] > this.view.x[1]) continue;
          low = Math.min(low, y[n]);
          high = Math.max(high, y[n]);
        }
      }
      const room = 0.05 * (high - low) || 1e-6;
      if (low <= high) this.setY([low - room, high + room]);
    }

    reset() {
      this.view.y = [...this.home.y];
      this.setX(this.linked ? [...Plot.times] : [...this.home.x]);
      this.moved = false;
      this.draw();
    }

    // Steps the cursor through the points of its series.
    step(by) {
      const series = this.near ? this.near.series : this.visible().find((one) => one.x.length > 0);
      if (!series) return;
      const inside = this.near ? this.near.n + by : series.x.findIndex((x) => x >= this.view.x[0]);
      this.point({ series, n: Math.min(Math.max(inside, 0), series.x.length - 1) });
      readout.textContent = this.inWords();
    }

    key(event) {
      const middle = [this.box.x + this.box.w / 2, this.box.y + this.box.h / 2];
      const actions = {
        ArrowLeft: () => this.move(-0.15, 0), ArrowRight: () => this.move(0.15, 0),
        ArrowUp: () => this.move(0, 0.15), ArrowDown: () => this.move(0, -0.15),
        "+": () => this.zoom(0.7, ...middle, event.altKey), "=": () => this.zoom(0.7, ...middle, event.altKey),
        "-": () => this.zoom(1 / 0.7, ...middle, event.altKey), 0: () => this.reset(), f: () => this.fit(),
        ",": () => this.step(-1), ".": () => this.step(1), Escape: () => this.point(null),
      };
      const action = actions[event.key];
      if (!action || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      action();
    }

    listen() {
      const at = (event) => {
        const frame = this.base.getBoundingClientRect(), scale = this.width / frame.width;
        return [(event.clientX - frame.left) * scale, (event.clientY - frame.top) * scale];
      };
      const { over } = this;
      this.root.addEventListener("keydown", (event) => this.key(event));
      over.addEventListener("wheel", (event) => {
        // The page scrolls unless this plot was chosen.
        if (!event.ctrlKey && document.activeElement !== this.root) return;
        event.preventDefault();
        const [x, y] = at(event), turn = event.deltaY || event.deltaX;
        this.zoom(turn < 0 ? 0.8 : 1.25, x, y, event.shiftKey);
      }, { passive: false });
      over.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        this.root.focus({ preventScroll: true });
        over.setPointerCapture(event.pointerId);
        this.start = { at: at(event), view: { x: [...this.view.x], y: [...this.view.y] }, moves: event.shiftKey };
      });
      over.addEventListener("pointermove", (event) => {
        const [x, y] = at(event);
        if (!this.start) { this.point(this.find(x, y)); return; }
        const [fromX, fromY] = this.start.at, { view } = this.start;
        if (this.start.moves) {
          const across = ((fromX - x) / this.box.w) * (view.x[1] - view.x[0]);
          const up = ((y - fromY) / this.box.h) * (view.y[1] - view.y[0]);
          this.view.y = view.y.map((value) => value + up);
          this.setX(view.x.map((value) => value + across));
          this.draw();
          return;
        }
        // A flat drag takes a part of the time, any other a rectangle.
        const flat = Math.abs(y - fromY) < 18;
        this.dragged = flat
          ? { x: Math.min(x, fromX), y: this.box.y, w: Math.abs(x - fromX), h: this.box.h }
          : { x: Math.min(x, fromX), y: Math.min(y, fromY), w: Math.abs(x - fromX), h: Math.abs(y - fromY) };
        this.cursor();
      });
      over.addEventListener("pointerup", () => {
        const part = this.dragged;
        this.start = this.dragged = null;
        if (!part || part.w < 6) { this.cursor(); return; }
        if (part.h < this.box.h) this.view.y = [this.fromY(part.y + part.h), this.fromY(part.y)];
        this.setX([this.fromX(part.x), this.fromX(part.x + part.w)]);
        this.draw();
      });
      over.addEventListener("pointercancel", () => { this.start = this.dragged = null; this.cursor(); });
      over.addEventListener("pointerleave", () => { if (!this.start) this.point(null); });
      over.addEventListener("dblclick", () => this.reset());
    }
  }
  Plot.time = null;
  Plot.times = [0, 1];

  const sameMark = (a, b) => JSON.stringify(a) === JSON.stringify(b) || (a.bars && b.bars) || (a.tile && b.tile);

  // ---- The sky ----

  // The corners of each system's dots after the first, which has discs.
  const SYSTEM_SHAPES = [null, [[-7, -7], [7, -7], [7, 7], [-7, 7]], [[0, -10], [10, 0], [0, 10], [-10, 0]],
    [[0, -10], [9, 6], [-9, 6]], [[0, 10], [9, -6], [-9, -6]], [[-11, -4], [11, -4], [11, 4], [-11, 4]],
    [[-4, -11], [4, -11], [4, 11], [-4, 11]]];

  class Sky {
    constructor(figure, sky, holder) {
      Object.assign(this, { figure, sky, linked: false });
      this.tracks = sky.tracks.map((track) => ({ ...track, x: arrays[track.x], y: arrays[track.y] }));
      this.systems = [...new Set(sky.tracks.map((track) => track.system))];
      this.base = element("canvas", { className: "base" });
      this.over = element("canvas", { className: "over" });
      this.words = element("small");
      this.root = element("div", { className: "plot sky", tabIndex: 0, role: "img" },
        element("div", { className: "plot-title" }, "Satellites above the horizon", this.words),
        element("div", { className: "canvases" }, this.base, this.over));
      this.root.ariaLabel = `Sky with ${this.tracks.length} satellites: ` +
        this.tracks.map((track) => this.inWords(track)).join("; ");
      holder.append(this.root);
      this.over.addEventListener("pointermove", (event) => this.hover(event));
      this.over.addEventListener("pointerleave", () => { this.words.textContent = ""; });
    }

    place(x, y) { return [this.middle[0] + x * this.radius, this.middle[1] - y * this.radius]; }

    static end(track) { const last = track.x.length - 1; return [track.x[last], track.y[last]]; }

    inWords(track) {
      const [x, y] = Sky.end(track);
      const azimuth = ((Math.atan2(x, y) * 180) / Math.PI + 360) % 360, elevation = 90 * (1 - Math.hypot(x, y));
      const strength = track.cn0 === null ? "" : `, ${track.cn0.toFixed(1)} dB-Hz`;
      const seen = track.observed ? "" : ", not observed";
      return `${track.sv} azimuth ${azimuth.toFixed(0)}°, elevation ${elevation.toFixed(0)}°${strength}${seen}`;
    }

    isOff(track) {
      const own = known.get(track.sv);
      return own !== undefined && own.names.every((name) => off.has(name));
    }

    layout() {
      const width = Math.max(200, this.root.clientWidth || 400), height = Math.min(width, 480);
      resize(this, width, height);
      this.middle = [width / 2, height / 2 - 8];
      this.radius = Math.min(width, height) / 2 - 42;
    }

    draw() {
      this.layout();
      const { width, height } = this, pen = this.base.getContext("2d"), colours = palette();
      pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      pen.fillStyle = colours.ground;
      pen.fillRect(0, 0, width, height);
      this.frame(pen, colours);
      for (const track of this.tracks) if (!this.isOff(track)) this.track(pen, track, colours);
      this.scale(pen, colours);
      this.drawn = true;
    }

    frame(pen, colours) {
      const direction = (azimuth, distance) => {
        const angle = (azimuth * Math.PI) / 180;
        return this.place(distance * Math.sin(angle), distance * Math.cos(angle));
      };
      if (this.sky.skyline.length > 0) {
        pen.fillStyle = isDark() ? "#34322c" : "#e2ded6";
        pen.beginPath();
        for (const [azimuth, elevation] of this.sky.skyline) pen.lineTo(...direction(azimuth, 1 - elevation / 90));
        for (const [azimuth] of [...this.sky.skyline].reverse()) pen.lineTo(...direction(azimuth, 1));
        pen.fill();
      }
      pen.strokeStyle = colours.grid;
      pen.fillStyle = colours.faint;
      pen.font = "11px system-ui, 'DejaVu Sans', sans-serif";
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      for (const elevation of [0, 30, 60]) {
        pen.beginPath(); pen.arc(...this.middle, this.radius * (1 - elevation / 90), 0, 2 * Math.PI); pen.stroke();
        const up = this.radius * (1 - elevation / 90);
        if (elevation) pen.fillText(`${elevation}°`, this.middle[0] + 12, this.middle[1] - up - 7);
      }
      for (let azimuth = 0; azimuth < 360; azimuth += 30) {
        pen.beginPath(); pen.moveTo(...this.middle); pen.lineTo(...direction(azimuth, 1)); pen.stroke();
        const name = { 0: "N", 90: "E", 180: "S", 270: "W" }[azimuth] ?? `${azimuth}°`;
        pen.fillText(name, ...direction(azimuth, 1 + 16 / this.radius));
      }
    }

    track(pen, track, colours) {
      const colour = track.colour ?? colours.faint;
      pen.lineWidth = 3;
      pen.strokeStyle = colour;
      pen.beginPath();
      for (let n = 0; n < track.x.length; n += 1) pen.lineTo(...this.place(track.x[n], track.y[n]));
      pen.stroke();
      const [x, y] = this.place(...Sky.end(track)), corners = SYSTEM_SHAPES[this.systems.indexOf(track.system) % 7];
      pen.beginPath();
      if (corners) polygon(pen, x, y, corners, 8); else pen.arc(x, y, 7, 0, 2 * Math.PI);
      pen.fillStyle = track.observed ? colour : colours.ground;
      pen.fill();
      // A light rim keeps dark dots visible on a dark ground.
      pen.strokeStyle = isDark() ? "#ffffff" : colour;
      pen.lineWidth = track.observed ? 1 : 2;
      pen.stroke();
      pen.fillStyle = colours.ink;
      pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
      pen.textAlign = x > this.middle[0] + 0.7 * this.radius ? "right" : "left";
      pen.textBaseline = "middle";
      pen.fillText(track.sv, x + (pen.textAlign === "right" ? -11 : 11), y);
    }

    scale(pen, colours) {
      const { low, high, scale } = this.sky, y = this.height - 12, width = 110, left = 8;
      scale.forEach((colour, n) => {
        pen.fillStyle = colour;
        pen.fillRect(left + 30 + (n * width) / scale.length, y - 6, width / scale.length + 1, 10);
      });
      pen.fillStyle = colours.faint;
      pen.textBaseline = "middle";
      pen.font = "11px system-ui, 'DejaVu Sans', sans-serif";
      pen.textAlign = "right";
      pen.fillText(`${low}`, left + 26, y);
      pen.textAlign = "left";
      pen.fillText(`${high} dB-Hz; hollow: not observed`, left + 36 + width, y);
      if (this.systems.length < 2) return;
      const names = ["disc", "square", "diamond", "triangle", "triangle down", "bar", "post"];
      pen.fillText(this.systems.map((system, n) => `${names[n % 7]} ${system}`).join(", "), left, 10);
    }

    hover(event) {
      const frame = this.base.getBoundingClientRect(), scale = this.width / frame.width;
      const [px, py] = [(event.clientX - frame.left) * scale, (event.clientY - frame.top) * scale];
      const distance = (track) => { const [x, y] = this.place(...Sky.end(track)); return Math.hypot(x - px, y - py); };
      const near = this.tracks.filter((track) => !this.isOff(track) && distance(track) < 22)
        .sort((a, b) => distance(a) - distance(b))[0];
      this.words.textContent = near ? this.inWords(near) : "";
    }

    cursor() {}
    reset() { this.draw(); }
  }

  // ---- All plots ----

  // Satellites: the look of the first legend that names them, and the names of their series.
  const known = new Map();

  function learn(entry) {
    const satellite = satelliteOf(entry.name);
    if (!known.has(satellite)) known.set(satellite, { ...entry, name: satellite, names: [] });
    const { names } = known.get(satellite);
    if (!names.includes(entry.name)) names.push(entry.name);
  }

  let asked = false;
  function redraw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      for (const plot of plots) if (plot.seen && !plot.drawn) plot.draw();
    });
  }

  function redrawAll() {
    for (const plot of plots) plot.drawn = false;
    if (printing) plots.forEach((plot) => plot.draw()); else redraw();
  }

  function toggle(entry, keys) {
    const button = element("button", { type: "button", ariaPressed: "true" });
    const paint = () => button.replaceChildren(...(entry.mark ? [swatch(entry)] : []), entry.name);
    button.dataset.keys = JSON.stringify(keys);
    button.paint = paint;
    paint();
    button.addEventListener("click", () => {
      const isOn = button.ariaPressed === "true";
      keys.forEach((key) => (isOn ? off.add(key) : off.delete(key)));
      refresh();
    });
    return button;
  }

  // Brings buttons and plots in line with what is off.
  function refresh() {
    for (const button of document.querySelectorAll("button[data-keys]")) {
      button.ariaPressed = String(!JSON.parse(button.dataset.keys).every((key) => off.has(key)));
    }
    redrawAll();
  }

  function satelliteBar() {
    const holder = document.getElementById("plots");
    if (!holder || known.size === 0) return;
    const action = (name, run) => {
      const button = element("button", { type: "button", className: "wide" }, name);
      button.addEventListener("click", run);
      return button;
    };
    const names = [...known.values()].flatMap((satellite) => satellite.names);
    const bar = element("div", { className: "controls legend satellites", role: "group", ariaLabel: "Satellites" },
      action("all", () => { names.forEach((name) => off.delete(name)); refresh(); }),
      action("none", () => { names.forEach((name) => off.add(name)); refresh(); }),
      action("reset zoom", () => plots.forEach((plot) => plot.reset())));
    const alone = (button, keys) => {
      button.title = "A double click shows this alone";
      button.addEventListener("dblclick", () => {
        names.forEach((name) => off.add(name));
        keys.forEach((key) => off.delete(key));
        refresh();
      });
      bar.append(button);
    };
    // A button for each signal where there are several, and one for each satellite.
    const signals = [...new Set(names.map(signalOf))].filter((signal) => signal !== "");
    for (const signal of signals.length > 1 ? signals : []) {
      const keys = names.filter((name) => signalOf(name) === signal);
      alone(toggle({ name: signal }, keys), keys);
    }
    for (const satellite of known.values()) alone(toggle(satellite, satellite.names), satellite.names);
    holder.prepend(bar);
  }

  function build() {
    for (const figure of data.figures) {
      for (const entry of figure.legend ?? []) {
        if (isSatellite(entry.name)) learn(entry);
      }
    }
    for (const root of document.querySelectorAll("figure[data-figure]")) {
      const figure = data.figures[Number(root.dataset.figure)], holder = root.querySelector(".plots");
      if (figure.sky) { plots.push(new Sky(figure, figure.sky, holder)); continue; }
      if (figure.columns > 1) holder.classList.add(figure.columns === 2 ? "two" : "three");
      for (const chart of figure.charts) plots.push(new Plot(figure, chart, holder));
      const own = figure.legend.filter((entry) => entry.name !== "" && !isSatellite(entry.name));
      if (own.length === 0) continue;
      const all = figure.charts.flatMap((chart) => chart.series);
      // An entry names the series of its look or, in a colour of none, all of its kind of mark.
      const keys = (entry) => {
        const own = all.filter((series) => series.colour === entry.colour && sameMark(series.mark, entry.mark));
        const kind = Object.keys(entry.mark)[0], named = own.length > 0 ? own : all.filter((series) => kind in series.mark);
        return [...new Set(named.map((series) => `${figure.name}|${series.colour}|${JSON.stringify(series.mark)}`))];
      };
      const legend = element("div", { className: "controls legend", role: "group", ariaLabel: "Series" });
      // Colours of a map's values are a scale, and no series can be switched off by them.
      own.forEach((entry) => legend.append(entry.mark.tile || keys(entry).length === 0
        ? element("span", { className: "step" }, swatch(entry), entry.name) : toggle(entry, keys(entry))));
      holder.after(legend);
    }
    const times = plots.filter((plot) => plot.linked).map((plot) => plot.home.x);
    if (times.length > 0) Plot.times = [Math.min(...times.flat()), Math.max(...times.flat())];
    for (const plot of plots) if (plot.linked) plot.view.x = [...Plot.times];
    satelliteBar();
  }

  // ---- Tables ----

  function filterTable(table) {
    const body = table.tBodies[0], rows = [...body.rows];
    const search = element("input", { type: "search", placeholder: "filter rows", ariaLabel: "Filter the rows" });
    const count = element("span", { className: "faint", role: "status" });
    const controls = element("div", { className: "controls" }, search);
    const tick = (name) => {
      const box = element("input", { type: "checkbox" });
      controls.append(element("label", {}, box, ` ${name}`));
      box.addEventListener("change", apply);
      return box;
    };
    const isBad = (row) => row.querySelector("td.bad, td.caution") !== null;
    const isJudged = rows.some((row) => row.querySelector("td.good, td.bad, td.caution"));
    const bad = isJudged ? tick("failed or marginal only") : null;
    const grouped = rows[0]?.dataset.group !== undefined ? tick("by group") : null;
    controls.append(count);
    search.addEventListener("input", apply);
    table.parentElement.before(controls);
    apply();

    function apply() {
      const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
      const holds = (row) => {
        const text = `${row.textContent} ${row.dataset.group ?? ""}`.toLowerCase();
        return words.every((word) => text.includes(word)) && (!bad?.checked || isBad(row));
      };
      for (const row of rows) row.hidden = !holds(row);
      const left = rows.filter((row) => !row.hidden);
      count.textContent = `${left.length} of ${rows.length} rows`;
      if (!grouped?.checked) { body.replaceChildren(...rows); return; }
      const groups = Map.groupBy ? Map.groupBy(left, (row) => row.dataset.group) : groupedBy(left);
      body.replaceChildren(...[...groups].flatMap(([name, members]) => [
        element("tr", { className: "group" },
          element("th", { colSpan: table.tHead.rows[0].cells.length }, `${name} (${members.length})`)),
        ...members]));
    }
  }

  function groupedBy(rows) {
    const groups = new Map();
    for (const row of rows) groups.set(row.dataset.group, [...(groups.get(row.dataset.group) ?? []), row]);
    return groups;
  }

  // ---- Start ----

  build();
  document.querySelectorAll("table[data-filter]").forEach(filterTable);
  const watch = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) target.plot.seen = isIntersecting;
    redraw();
  }, { rootMargin: "300px" });
  const resized = new ResizeObserver((entries) => {
    for (const { target } of entries) target.plot.drawn = false;
    redraw();
  });
  for (const plot of plots) {
    plot.root.plot = plot;
    // Sizes first: what is far down is drawn when it comes near.
    plot.layout();
    watch.observe(plot.root);
    resized.observe(plot.root);
  }
  const repaint = () => {
    document.querySelectorAll("button[data-keys]").forEach((button) => button.paint());
    redrawAll();
  };
  dark.addEventListener("change", repaint);
  addEventListener("beforeprint", () => { printing = true; redrawAll(); });
  addEventListener("afterprint", () => { printing = false; redrawAll(); });
})();
