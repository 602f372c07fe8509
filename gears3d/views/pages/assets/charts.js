// Plots of every page, on uPlot. Colours come from the style sheet; plots are rebuilt when the theme changes.
"use strict";
const block = (name) => JSON.parse(document.getElementById("data-" + name).textContent);
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const show = (v, digits, unit) => v === null || v === undefined || !isFinite(v) ? "–" : v.toFixed(digits) + " " + unit;
const FLANK = ["active", "reverse"];

// markers: a disc for the active, a square for the reverse flank, so that colour is not the only difference
function marker(square, size) {
  return (u, index, first, last) => {
    const path = new Path2D(), ratio = devicePixelRatio || 1, r = size / 2 * ratio;
    const xs = u.data[0], ys = u.data[index], scale = u.series[index].scale;
    for (let i = first; i <= last; i++) {
      if (ys[i] === null || ys[i] === undefined) continue;
      const x = u.valToPos(xs[i], "x", true), y = u.valToPos(ys[i], scale, true);
      if (square) path.rect(x - r * .9, y - r * .9, 1.8 * r, 1.8 * r);
      else { path.moveTo(x + r, y); path.arc(x, y, r, 0, 2 * Math.PI); }
      const { tall, wide } = u.series[index], bar = 1.2 * ratio;
      if (tall?.[i]) { const top = u.valToPos(ys[i] + tall[i], scale, true), end = u.valToPos(ys[i] - tall[i], scale, true); path.rect(x - bar / 2, top, bar, end - top); }
      if (wide?.[i]) { const from = u.valToPos(xs[i] - wide[i], "x", true), to = u.valToPos(xs[i] + wide[i], "x", true); path.rect(from, y - bar / 2, to - from, bar); }
    }
    const clip = new Path2D(), b = u.bbox;
    clip.rect(b.left - r, b.top - r, b.width + 2 * r, b.height + 2 * r);
    return { fill: path, stroke: path, clip, flags: 3 };
  };
}

function spots(label, flank, open, value, size = 7) {
  const colour = css("--" + FLANK[flank]);
  return { label, stroke: colour, paths: () => null, value, markers: true, auto: true, swatch: open ? "transparent" : colour,
    points: { show: true, size, width: open ? 1.5 : 0, stroke: colour,
      fill: open ? "transparent" : colour, paths: marker(flank === 1, open ? size + 4 : size) } };
}

const line = (label, colour, value, more = {}) =>
  ({ label, stroke: css(colour), width: 1.6, pxAlign: 0, points: { show: false }, value, ...more });
const twinLine = (label, value) => line(label, "--twin", value, { dash: [7, 5], width: 1.8 });

// powers of ten, or all ticks where there is no power of ten among them
const powers = (u, ticks) => {
  const whole = (v) => Math.abs(Math.log10(v) % 1) < 1e-9, some = ticks.some(whole);
  return ticks.map((v) => !some || whole(v) ? String(+v.toPrecision(some ? 1 : 2)) : "");
};

// as many digits as tell one tick from the next, of small numbers with an exponent
const stepped = (u, ticks, axis, space, step) => {
  const small = step < 5e-4 && Math.max(...ticks.map(Math.abs)) < 100 * step;
  const digits = new Intl.NumberFormat(undefined, { maximumFractionDigits: Math.min(Math.max(Math.ceil(-Math.log10(step) - 1e-9), 0), 6) });
  return ticks.map((v) => v === null ? "" : small && v ? (+v.toPrecision(2)).toExponential() : digits.format(v));
};

function axes(xLabel, yLabel) {
  const look = { stroke: css("--soft"), grid: { stroke: css("--grid"), width: 1 }, ticks: { stroke: css("--grid"), width: 1, size: 5 },
    values: stepped, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelGap: 2 };
  return [{ ...look, label: xLabel, labelSize: 20, size: 30 }, { ...look, label: yLabel, labelSize: 20, size: 54 }];
}

// the height follows what is in view, but never magnifies less than `least`
function padded(share, least = 1e-5) {
  return (u, low, high) => {
    if (low === null || high === null) return [0, 1];
    const pad = Math.max((high - low) * share, (least - (high - low)) / 2, Math.abs(high) * 1e-6);
    return [low - pad, high + pad];
  };
}

function build(id, options, series, data) {
  const host = document.getElementById(id);
  if (!host) return null;
  host.replaceChildren();
  const plot = new uPlot({ width: host.clientWidth, height: +host.dataset.height, padding: [10, 12, 0, 0], pxAlign: false,
    legend: { live: true, markers: { width: 2, fill: (u, i) => u.series[i].swatch || u.series[i].fill?.() || "transparent" } }, ...options,
    hooks: { ...options.hooks, ready: [(u) => { host.whole = [u.scales.x.min, u.scales.x.max]; }] }, series: [options.x, ...series] }, [data[0], ...data.slice(1)], host);
  plot.host = host;
  keyed(host, plot);
  host.querySelectorAll(".u-series").forEach((row) => { if (!row.querySelector(".u-label").textContent.trim()) row.remove(); });
  return plot;
}

// the marker of an impact is selected when the cursor is within some pixels of it
function snap(u, index, at) {
  if (!u.series[index].markers || at === null) return at;
  const ys = u.data[index], left = u.cursor.left;
  for (let reach = 0, a = at, b = at + 1; reach < 400; reach++, a--, b++)
    for (const i of [a, b]) if (ys[i] !== null && ys[i] !== undefined && Math.abs(u.valToPos(u.data[0][i], "x") - left) < 10) return i;
  return at;
}

// ---- plots with their own axes
const alone = [], draws = [];

// a set: x, y, maybe tall and wide (deviations drawn as bars), flank for a marker, or `stroke` for a line
function scatter(id, xLabel, yLabel, xValue, sets, options = {}) {
  const points = [];
  sets.forEach((set, s) => set.x.forEach((x, i) => points.push([x, s, i])));
  points.sort((a, b) => a[0] - b[0]);
  const spread = (key) => sets.map((set, s) => set[key] && points.map(([, of, i]) => of === s ? set[key][i] : null));
  const [columns, tall, wide] = ["y", "tall", "wide"].map(spread);
  const look = axes(xLabel, yLabel);
  if (options.steps) look[0].incrs = options.steps;
  if (options.powers) look[1].values = powers;
  const range = options.range || ((u, low, high) => [low, high]);
  const plot = build(id, { x: { label: options.xName, value: (u, v) => xValue(v) },
    scales: { x: { time: false, range, ...options.x }, y: options.y || { range: padded(.08) } }, axes: look, hooks: options.hooks || {},
    cursor: { drag: { x: true, y: true, uni: 30, dist: 6 }, dataIdx: snap } },
    sets.map((set, s) => set.stroke ? line(set.label, set.stroke, set.value, { spanGaps: true, ...set.more })
      : { ...spots(set.label, set.flank, set.open, set.value, set.size), tall: tall[s], wide: wide[s] }), [points.map((p) => p[0]), ...columns]);
  if (plot) alone.push(plot);
}

// ---- charts that come as data
const colour = (look) => look.startsWith("#") ? look : css("--" + look);

function drawChart(host, chart) {
  const sets = chart.sets, points = [], three = (u, v) => v === null || v === undefined ? "–" : String(+v.toPrecision(4));
  sets.forEach((set, s) => set.x.forEach((x, i) => points.push([x, s, i])));
  points.sort((a, b) => a[0] - b[0]);
  const column = (s, key) => points.map(([, of, i]) => of === s ? sets[s][key][i] : null);
  const series = [], data = [points.map((p) => p[0])], bands = [];
  sets.forEach((set, s) => {
    const stroke = colour(set.look), plain = { label: set.label || " ", stroke, value: three, pxAlign: 0, spanGaps: true, auto: !set.fixed };
    if (set.kind === "band") {
      bands.push({ series: [series.length + 1, series.length + 2], fill: stroke + "40" });
      series.push({ ...plain, width: 0, points: { show: false } }, { ...plain, label: " ", width: 0, points: { show: false } });
      data.push(column(s, "y"), column(s, "low"));
      return;
    }
    if (set.kind === "line") series.push({ ...plain, width: Math.max(set.width || 1.6, 1.4), points: { show: false }, dash: set.dash ? [7, 4] : undefined });
    else series.push({ ...plain, paths: () => null, markers: set.kind === "marks", alpha: set.alpha || 1, tall: set.tall && column(s, "tall"), wide: set.wide && column(s, "wide"), swatch: set.open ? "transparent" : stroke,
      points: { show: true, size: set.size || 6, width: set.open ? 1.5 : 0, stroke, fill: set.open ? "transparent" : stroke, paths: marker(set.square, set.size || 6) } });
    data.push(column(s, "y"));
  });
  const range = (given) => (u, low, high) => u.status === 0 || low === null ? given : [low, high];
  const look = axes(chart.x, chart.y);
  if (chart.turn) look[0].incrs = [1, 5, 10, 30, 45, 90];
  chart.distr.forEach((kind, k) => { if (kind === 3) look[k].values = powers; });
  const plot = build(host.id, { x: { label: chart.x, value: three }, bands, axes: look, cursor: { drag: { x: true, y: true, uni: 30, dist: 6 }, dataIdx: snap },
    scales: { x: { time: false, distr: chart.distr[0], range: range(chart.xrange) }, y: { distr: chart.distr[1], range: range(chart.yrange) } } }, series, data);
  if (plot) alone.push(plot);
}

// ---- keys of a plot: a window that moves, narrows, widens, or shows all
function keyed(host, plot) {
  host.onkeydown = (event) => {
    const { min, max } = plot.scales.x, width = max - min, middle = (min + max) / 2;
    const to = { ArrowLeft: [min - width / 5, max - width / 5], ArrowRight: [min + width / 5, max + width / 5],
      "+": [middle - width / 4, middle + width / 4], "-": [middle - width, middle + width], 0: host.whole }[event.key];
    if (!to) return;
    event.preventDefault();
    plot.setScale("x", { min: to[0], max: to[1] });
  };
}

function chartsCsv() {
  const rows = [["figure", "series", "x", "y", "low", "half_width_y", "half_width_x"]];
  const quoted = (text) => `"${String(text).replaceAll('"', '""')}"`;
  for (const chart of Object.values(block("charts"))) for (const set of chart.sets) set.x.forEach((x, i) =>
    rows.push([quoted(chart.words), quoted(set.label), x, set.y[i], set.low?.[i] ?? "", set.tall?.[i] ?? "", set.wide?.[i] ?? ""]));
  return rows.map((row) => row.join(",")).join("\n") + "\n";
}

function save(name, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
document.getElementById("csv-charts")?.addEventListener("click", () => save("figures.csv", chartsCsv()));

draws.push(() => {
  const charts = block("charts");
  document.querySelectorAll("[data-chart]").forEach((host) => drawChart(host, charts[host.dataset.chart]));
});

globalThis.drawAll = () => {
  for (const plot of alone) plot.destroy();
  alone.length = 0;
  draws.forEach((draw) => draw());
};
