// Plots of a run or a measured record: signals over time that share a window, impacts, and what the reader does.
"use strict";
function running(steps, quantum) {
  const out = new Float64Array(steps.length);
  for (let i = 0, sum = 0; i < steps.length; i++) out[i] = (sum += steps[i]) * quantum;
  return out;
}

const DATA = (() => {
  const traces = block("traces"), walls = block("walls");
  const time = running(traces.time, traces.tick);
  const channel = (table, name, scale) =>
    table && table[name] ? running(table[name].steps, table[name].quantum * scale) : null;
  const signals = (table) => table && {
    displacement: channel(table, "displacement_m", 1e6),
    velocity: channel(table, "velocity_m_s", 1e3),
    drive: channel(table, "omega_drive_rad_s", 30 / Math.PI),
    loose: channel(table, "omega_loose_rad_s", 30 / Math.PI),
  };
  const wall = (name) => walls[name] === null ? null : walls.moving
    ? running(walls[name], walls.quantum * 1e6)
    : new Float64Array(time.length).fill(walls[name][0] * walls.quantum * 1e6);
  const impacts = (name) => {
    const table = block(name);
    if (!table) return null;
    const out = { time: table.time.map((t) => t * table.tick), flank: table.flank, ticks: table.time };
    for (const [key, c] of Object.entries(table.columns)) out[key] = c.values.map((v) => v === null ? null : v * c.quantum);
    return out;
  };
  return {
    time, run: signals(traces.run), twin: signals(traces.twin), active: wall("active"), reverse: wall("reverse"),
    impacts: impacts("impacts"), twinImpacts: impacts("twin_impacts"), errors: block("errors"),
    histogram: block("histogram"), about: block("about"), wallsComplete: walls.complete, tick: traces.tick,
    states: traces.states ? Array.from(traces.states, Number) : null,
  };
})();

// index of the first time that is not less
function lower(times, t) {
  let low = 0, high = times.length;
  while (low < high) { const mid = (low + high) >> 1; if (times[mid] < t) low = mid + 1; else high = mid; }
  return low;
}

function impactsCsv() {
  const t = DATA.impacts, names = Object.keys(t).filter((k) => !["flank", "time", "ticks"].includes(k));
  const rows = [["time_s", "flank", ...names].join(",")];
  t.time.forEach((time, i) => rows.push([time.toFixed(7), t.flank[i] ? "reverse" : "active",
    ...names.map((n) => t[n][i] === null ? "" : Number(t[n][i].toPrecision(9)))].join(",")));
  return rows.join("\n") + "\n";
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

draws.push(() => {
  const window_ = time.plots.length ? { ...time.plots[0].scales.x } : null;
  for (const plot of time.plots) plot.destroy();
  if (DATA.time.length < 2) return;
  drawTime(); drawSection(); drawHistogram(); drawErrors();
  if (window_ && time.plots.length) time.plots[0].setScale("x", { min: window_.min, max: window_.max });
});

// ---- what the reader does
const span = () => time.plots[0].scales.x;
const ends = [DATA.time[0], DATA.time[DATA.time.length - 1]];

function look(min, max) {
  if (!time.plots.length) return;
  const width = Math.min(Math.max(max - min, 20 * DATA.tick), ends[1] - ends[0]);
  const from = Math.min(Math.max(min, ends[0]), ends[1] - width);
  time.plots[0].setScale("x", { min: from, max: from + width });
}

function toImpact(step) {
  const { min, max } = span(), times = DATA.impacts.time, width = (DATA.about.period || ends[1] - ends[0]) / 20;
  const at = max - min <= width * 1.01 ? (min + max) / 2 : step > 0 ? min - 1e-9 : max + 1e-9;
  const next = step > 0 ? times.find((t) => t > at + 2e-6) : times.findLast((t) => t < at - 2e-6);
  if (next !== undefined) look(next - width / 2, next + width / 2);
}

const ZOOMS = {
  all: () => look(...ends),
  period: () => {
    const period = DATA.about.period || (ends[1] - ends[0]) / 10, from = Math.max(DATA.about.settle || 0, ends[0]);
    const centre = span().max - span().min < ends[1] - ends[0] - 1e-9 ? (span().min + span().max) / 2 : from + period / 2;
    look(centre - period / 2, centre + period / 2);
  },
  next: () => toImpact(1),
  previous: () => toImpact(-1),
};

document.getElementById("csv")?.addEventListener("click", () => save("impacts.csv", impactsCsv()));
document.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => time.plots.length && ZOOMS[button.dataset.zoom]()));
if (!DATA.wallsComplete) document.getElementById("walls-note").textContent = " The bands do not include deviations of single teeth.";
