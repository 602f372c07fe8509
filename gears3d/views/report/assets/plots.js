// The plots. Colours come from the style sheet; plots are rebuilt when the theme changes.
"use strict";
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

function axes(xLabel, yLabel) {
  const look = { stroke: css("--soft"), grid: { stroke: css("--grid"), width: 1 }, ticks: { stroke: css("--grid"), width: 1, size: 5 },
    font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelGap: 2 };
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
    legend: { live: true, markers: { width: 2, fill: (u, i) => u.series[i].swatch || u.series[i].fill?.() || "transparent" } }, ...options, series: [options.x, ...series] }, [data[0], ...data.slice(1)], host);
  plot.host = host;
  return plot;
}

// both flanks are in view as long as the whole run is
function betweenFlanks(u, low, high) {
  const { min, max } = u.scales.x, whole = min === DATA.time[0] && max === DATA.time[DATA.time.length - 1];
  const lowest = (values) => values.reduce((a, b) => Math.min(a, b)), highest = (values) => values.reduce((a, b) => Math.max(a, b));
  return whole ? padded(.09, DATA.reverse ? 1e-5 : .5)(u, Math.min(low, lowest(DATA.active)), Math.max(high, DATA.reverse ? highest(DATA.reverse) : high)) : padded(.09, .5)(u, low, high);
}

// ---- plots over time
const time = { plots: [], busy: false };

function follow(u, key) {
  if (key !== "x" || time.busy) return;
  time.busy = true;
  const { min, max } = u.scales.x;
  for (const other of time.plots) if (other !== u) other.setScale("x", { min, max });
  time.busy = false;
}

// the marker of an impact is selected when the cursor is within some pixels of it
function snap(u, index, at) {
  if (!u.series[index].markers || at === null) return at;
  const ys = u.data[index], left = u.cursor.left;
  for (let reach = 0, a = at, b = at + 1; reach < 400; reach++, a--, b++)
    for (const i of [a, b]) if (ys[i] !== null && ys[i] !== undefined && Math.abs(u.valToPos(u.data[0][i], "x") - left) < 10) return i;
  return at;
}

function timePlot(id, yLabel, series, columns, range = padded(.06, .1)) {
  const plot = build(id, {
    x: { label: "time", value: (u, v) => show(v, 6, "s") },
    scales: { x: { time: false }, y: { range } },
    axes: axes("time [s]", yLabel),
    cursor: { sync: { key: "gears3d-time", filters: { pub: (type) => !["mousedown", "mouseup", "dblclick"].includes(type) } },
      drag: { x: true, y: true, uni: 30, dist: 6 }, dataIdx: snap },
    hooks: { setScale: [follow] },
  }, series, [DATA.time, ...columns]);
  if (plot) time.plots.push(plot);
}

function onImpacts(table, flank, offset, values) {
  const out = new Array(DATA.time.length).fill(null), of = new Map();
  table.ticks.forEach((tick, k) => {
    if (table.flank[k] !== flank) return;
    const i = Math.min(lower(DATA.time, (tick + offset - .5) * DATA.tick), DATA.time.length - 1);
    out[i] = values(i, k); of.set(i, k);
  });
  return { out, of };
}

function impactSeries(offset, pick) {
  const series = [], columns = [];
  for (const flank of [0, 1]) {
    const { out, of } = onImpacts(DATA.impacts, flank, offset, pick);
    const value = (u, v, s, i) => {
      if (!of.has(i)) return "–";
      const k = of.get(i), tooth = DATA.impacts.tooth_drive[k];
      return show(DATA.impacts.velocity_m_s[k] * 1e3, 3, "mm/s") + (tooth ? ", tooth " + tooth : "");
    };
    series.push(spots("impact on " + FLANK[flank], flank, false, value)); columns.push(out);
  }
  return [series, columns];
}

// plot = name, run, twin of one signal
function pairOf(name, unit, digits) {
  const value = (u, v) => show(v, digits, unit);
  const series = [line("run", "--run", value)], columns = [DATA.run[name]];
  if (DATA.twin && DATA.twin[name]) { series.push(twinLine("rigid model", value)); columns.push(DATA.twin[name]); }
  return [series, columns];
}

// a measured path in the colours of its segments: interval i reaches from point i to the next
const STATES = [["active contact", "--active"], ["reverse contact", "--reverse"], ["flight", "--flight"]];
function byState(value) {
  const of = (k) => Array.from(DATA.run.displacement, (v, i) => DATA.states[i] === k || (i && DATA.states[i - 1] === k) ? v : null);
  return [STATES.map(([name, colour], k) => line(name, colour, value, { spanGaps: false, width: k === 2 ? 1.6 : 2.6 })), STATES.map((_, k) => of(k))];
}

function drawTime() {
  time.plots = [];
  const um = (u, v) => show(v, 3, "µm"), rpm = (u, v) => show(v, 4, "rpm");
  if (DATA.run.displacement) {
    const [series, columns] = pairOf("displacement", "µm", 3), [marks, at] = impactSeries(1, (i) => DATA.run.displacement[i]);
    const wall = (label, flank, to) => line(label, "--" + flank, um, { width: 1.5, auto: false, fill: css(`--${flank}-soft`), fillTo: to });
    const [lines, values] = DATA.states ? byState(um) : [series, columns], far = DATA.reverse ? 1 : 0;
    timePlot("plot-displacement", "displacement [µm]",
      [wall("active flank", "active", (u) => u.scales.y.min), ...[wall("reverse flank", "reverse", (u) => u.scales.y.max)].slice(1 - far), ...lines, ...marks],
      [DATA.active, ...[DATA.reverse].slice(1 - far), ...values, ...at], betweenFlanks);
  }
  if (DATA.run.velocity) {
    const [series, columns] = pairOf("velocity", "mm/s", 3), [marks, at] = impactSeries(-1, (i) => DATA.run.velocity[i]);
    timePlot("plot-velocity", "velocity [mm/s]", [...series, ...marks], [...columns, ...at]);
  }
  if (DATA.run.drive) timePlot("plot-speed", "speed [rpm]",
    [line("drive gear", "--flight", rpm), ...(DATA.run.loose ? [line("loose gear", "--run", rpm)] : []), ...(DATA.twin ? [twinLine("loose gear, rigid model", rpm)] : [])],
    [DATA.run.drive, ...(DATA.run.loose ? [DATA.run.loose] : []), ...(DATA.twin ? [DATA.twin.loose] : [])]);
}

// ---- plots of impacts
const alone = [], more = [];

// a set: x, y, maybe tall and wide (deviations drawn as bars), flank for a marker, or `stroke` for a line
function scatter(id, xLabel, yLabel, xValue, sets, options = {}) {
  const points = [];
  sets.forEach((set, s) => set.x.forEach((x, i) => points.push([x, s, i])));
  points.sort((a, b) => a[0] - b[0]);
  const spread = (key) => sets.map((set, s) => set[key] && points.map(([, of, i]) => of === s ? set[key][i] : null));
  const [columns, tall, wide] = ["y", "tall", "wide"].map(spread);
  const look = axes(xLabel, yLabel);
  if (options.steps) look[0].incrs = options.steps;
  if (options.powers) look[1].values = (u, ticks) => ticks.map((v) => Math.abs(Math.log10(v) % 1) < 1e-9 ? String(+v.toPrecision(1)) : "");
  const range = options.range || ((u, low, high) => [low, high]);
  const plot = build(id, { x: { label: options.xName, value: (u, v) => xValue(v) },
    scales: { x: { time: false, range, ...options.x }, y: options.y || { range: padded(.08) } }, axes: look, hooks: options.hooks || {},
    cursor: { drag: { x: true, y: true, uni: 30, dist: 6 }, dataIdx: snap } },
    sets.map((set, s) => set.stroke ? line(set.label, set.stroke, set.value, { spanGaps: true, ...set.more })
      : { ...spots(set.label, set.flank, set.open, set.value, set.size), tall: tall[s], wide: wide[s] }), [points.map((p) => p[0]), ...columns]);
  if (plot) alone.push(plot);
}

function drawSection() {
  const mm = (u, v) => show(v, 3, "mm/s"), settle = DATA.about.settle || 0;
  const set = (table, flank, label, open) => {
    const keep = table.time.map((t, k) => k).filter((k) => table.flank[k] === flank && table.time[k] >= settle && table.phase_rad[k] !== null);
    const wrap = (p) => ((p * 180 / Math.PI) % 360 + 360) % 360;
    return { flank, label, open, value: mm, x: keep.map((k) => wrap(table.phase_rad[k])), y: keep.map((k) => table.velocity_m_s[k] * 1e3),
      tall: table.velocity_sigma_m_s && keep.map((k) => table.velocity_sigma_m_s[k] * 1e3) };
  };
  const sets = [set(DATA.impacts, 0, "active"), set(DATA.impacts, 1, "reverse")];
  if (DATA.twinImpacts) sets.push(set(DATA.twinImpacts, 0, "active, rigid model", true), set(DATA.twinImpacts, 1, "reverse, rigid model", true));
  scatter("plot-section", "phase of the drive's fluctuation [°]", "impact velocity [mm/s]", (v) => show(v, 3, "°"), sets,
    { xName: "phase", steps: [1, 5, 10, 30, 60, 90], range: (u, low, high) => low === null || u.status === 0 ? [0, 360] : [low, high] });
}

function drawErrors() {
  const errors = DATA.errors;
  if (!errors) return;
  const largest = Math.max(0, ...errors.error.map(Math.abs));
  const [scale, unit] = largest >= 1e-5 ? [100, "%"] : largest >= 1e-7 ? [1e6, "ppm"] : [1e9, "ppb"];
  const set = (flank) => {
    const keep = errors.impact.map((k, i) => i).filter((i) => DATA.impacts.flank[errors.impact[i]] === flank);
    return { flank, label: FLANK[flank], value: (u, v) => show(v, 4, unit),
      x: keep.map((i) => DATA.impacts.time[errors.impact[i]]), y: keep.map((i) => errors.error[i] * scale) };
  };
  scatter("plot-errors", "time [s]", `error of impact speed [${unit}]`, (v) => show(v, 5, "s"), [set(0), set(1)], { xName: "time", range: (u, low, high) => u.status ? [low, high] : [DATA.time[0], DATA.time[DATA.time.length - 1]] });
}

function drawHistogram() {
  const { edges, run, twin } = DATA.histogram, count = (u, v) => v === null ? "–" : String(Math.abs(v));
  if (!edges.length) return;
  const stepped = uPlot.paths.stepped({ align: 1 }), closed = (counts, sign) => [...counts.map((c) => c * sign), 0];
  const bars = (flank, more) => line(FLANK[flank] + (more ? ", rigid model" : ""), "--" + FLANK[flank], count,
    { paths: stepped, width: 1.5, ...(more || { fill: css(`--${FLANK[flank]}-soft`) }) });
  const dashed = { dash: [5, 4], width: 2 };
  const upright = axes("impact speed [mm/s]", "impacts");
  upright[1].values = (u, ticks) => ticks.map((v) => Number.isInteger(v) ? Math.abs(v) : "");
  const plot = build("plot-histogram", { x: { label: "from", value: (u, v) => show(v, 2, "mm/s") },
    scales: { x: { time: false }, y: { range: padded(.06, 2) } }, axes: upright, cursor: { drag: { x: true, y: false, dist: 6 } } },
    [bars(0), bars(1), ...(twin ? [bars(0, dashed), bars(1, dashed)] : [])],
    [edges.map((e) => e * 1e3), closed(run[0], 1), closed(run[1], -1), ...(twin ? [closed(twin[0], 1), closed(twin[1], -1)] : [])]);
  if (plot) alone.push(plot);
}

function drawAll() {
  const window_ = time.plots.length ? { ...time.plots[0].scales.x } : null;
  for (const plot of [...time.plots, ...alone]) plot.destroy();
  alone.length = 0;
  if (DATA.time.length < 2) return;
  drawTime(); drawSection(); drawHistogram(); drawErrors(); more.forEach((draw) => draw());
  if (window_ && time.plots.length) time.plots[0].setScale("x", { min: window_.min, max: window_.max });
}
