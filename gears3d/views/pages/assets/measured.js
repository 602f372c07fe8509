// Plots of a measured record, in addition to those that it shares with the report of a run.
"use strict";
const CLOSE = block("close"), SPECTRA = block("spectra"), ORDERS = block("orders");
const FLIGHTS = Object.fromEntries(Object.entries(block("flights")).map(([key, c]) => [key, c.values.map((v) => v === null ? null : v * c.quantum)]));
const numbers = (count) => Array.from({ length: count }, (_, i) => i);
const among = (columns, keep, key, scale = 1) => keep.map((i) => columns[key][i] === null ? null : columns[key][i] * scale);
// from zero, with space for bars and markers
const fromZero = (u, low, high) => low === null ? [0, 1] : u.status === 0 || low < 0 ? [0, high * 1.06 || 1] : [low, high];

// filled: used for identification, open: excluded; both flanks of each
function byFlank(columns, flank, use, label, make) {
  const sets = [];
  for (const [open, word] of [[false, ""], [true, ", excluded"]]) for (const code of [0, 1]) {
    const keep = numbers(columns[flank].length).filter((i) => columns[flank][i] === code && (columns.testifies[i] !== 1) === open && use(i));
    if (keep.length || !open) sets.push({ flank: code, open, label: label(code) + word, size: 6, ...make(keep) });
  }
  return sets;
}

function drawClose() {
  const um = (u, v) => show(v, 3, "µm"), ms = CLOSE.time.map((t) => t * 1e3);
  const dots = (k, [name, colour]) => ({ label: name, stroke: css(colour), paths: () => null, value: um,
    points: { show: true, size: 3, width: 0, fill: css(colour) } });
  const place = (k) => CLOSE.place.map((v, i) => +CLOSE.state[i] === k ? v : null);
  const hit = numbers(DATA.impacts.time.length).filter((k) => DATA.impacts.time[k] >= CLOSE.start && DATA.impacts.time[k] <= CLOSE.end);
  const edge = (name, colour, values) => ({ values, series: line(name, colour, um, { width: 1.4, dash: [6, 4] }) });
  const edges = [edge("active flank", "--active", CLOSE.low), ...(CLOSE.high ? [edge("reverse flank", "--reverse", CLOSE.high)] : [])];
  const struck = [0, 1].map((code) => {
    const values = new Array(ms.length).fill(null);
    hit.filter((k) => DATA.impacts.flank[k] === code).forEach((k) => {
      const i = Math.min(lower(CLOSE.time, DATA.impacts.time[k] - CLOSE.start), ms.length - 1);
      values[i] = (code && CLOSE.high ? CLOSE.high : CLOSE.low)[i];
    });
    return { values, series: spots("impact on " + FLANK[code], code, true, um, 9) };
  });
  const plot = build("plot-close", { x: { label: "time", value: (u, v) => show(v, 3, "ms") },
    scales: { x: { time: false }, y: { range: padded(.08, .5) } }, axes: axes(`time from ${CLOSE.start.toFixed(4)} s [ms]`, "displacement [µm]"),
    cursor: { drag: { x: true, y: true, uni: 30, dist: 6 } } },
    [...STATES.map((state, k) => dots(k, state)), ...edges.map((e) => e.series), ...struck.map((s) => s.series)],
    [ms, ...STATES.map((_, k) => place(k)), ...edges.map((e) => e.values), ...struck.map((s) => s.values)]);
  if (plot) alone.push(plot);
  document.getElementById("close-note").textContent = `${CLOSE.every > 1 ? `One reading in ${CLOSE.every}` : "Every reading"} from ${CLOSE.start.toFixed(4)} s to `
    + `${CLOSE.end.toFixed(4)} s, not smoothed; standard deviation of one reading ${CLOSE.sigma.toPrecision(2)} µm. Dashed: flanks; rings: impacts.`;
}

function drawImpacts() {
  const hits = DATA.impacts, mm = (u, v) => show(v, 3, "mm/s"), speed = (v) => show(v, 3, "mm/s");
  const sets = byFlank(hits, "flank", (i) => hits.rebound_m_s[i] !== null, (code) => FLANK[code], (keep) => ({ value: mm,
    x: among(hits, keep, "velocity_m_s", 1e3).map(Math.abs), y: among(hits, keep, "rebound_m_s", 1e3).map(Math.abs),
    wide: among(hits, keep, "velocity_sigma_m_s", 1e3), tall: among(hits, keep, "rebound_sigma_m_s", 1e3) }));
  for (const set of sets.filter((one) => !one.open && one.x.length)) {
    const ratios = set.x.map((v, i) => set.y[i] / v).sort((a, b) => a - b), ratio = ratios[ratios.length >> 1], far = Math.max(...set.x);
    sets.push({ stroke: "--" + FLANK[set.flank], label: `median ${ratio.toPrecision(3)}, ${FLANK[set.flank]}`, value: mm, x: [0, far], y: [0, ratio * far], more: { width: 1, dash: [5, 4] } });
  }
  scatter("plot-rebound", "approach speed [mm/s]", "rebound speed [mm/s]", speed, sets, { xName: "approach", range: fromZero, y: { range: fromZero } });
  const lasting = byFlank(hits, "flank", (i) => hits.duration_s[i] !== null, (code) => FLANK[code], (keep) => ({ value: (u, v) => show(v, 1, "µs"),
    x: among(hits, keep, "velocity_m_s", 1e3).map(Math.abs), y: among(hits, keep, "duration_s", 1e6),
    tall: among(hits, keep, "duration_sigma_s", 1e6) }));
  scatter("plot-durations", "impact speed [mm/s]", "duration [µs]", speed, lasting, { xName: "speed", range: fromZero, y: { range: (u, low, high) => fromZero(u, low, high * 1.25) } });
}

function drawFlights() {
  const flown = FLIGHTS, of = (code) => "to " + FLANK[code];
  if (!flown.start_s.length) return;
  scatter("plot-height", "duration [ms]", "height [µm]", (v) => show(v, 3, "ms"), byFlank(flown, "struck", () => true, of, (keep) => ({
    value: (u, v) => show(v, 3, "µm"), x: keep.map((i) => (flown.end_s[i] - flown.start_s[i]) * 1e3), y: among(flown, keep, "height_m", 1e6) })),
    { xName: "duration", range: fromZero, y: { range: fromZero } });
  const sorted = flown.deceleration_rad_s2.filter((v) => v !== null).sort((a, b) => a - b), middle = Math.abs(sorted[sorted.length >> 1] || 0);
  const known = (i) => flown.deceleration_rad_s2[i] !== null && flown.deceleration_sigma_rad_s2[i] < .25 * middle;
  scatter("plot-deceleration", "speed of the loose gear [rpm]", "deceleration [rad/s²]", (v) => show(v, 3, "rpm"),
    byFlank(flown, "struck", known, of, (keep) => ({ value: (u, v) => show(v, 3, "rad/s²"), x: among(flown, keep, "omega_loose_rad_s", 30 / Math.PI),
      y: among(flown, keep, "deceleration_rad_s2"), tall: among(flown, keep, "deceleration_sigma_rad_s2") })), { xName: "speed", range: spaced });
  scatter("plot-chi", "time [s]", "χ² per degree of freedom", (v) => show(v, 4, "s"), byFlank(flown, "struck", (i) => flown.chi2[i] !== null, of, (keep) => ({
    value: (u, v) => show(v, 2, ""), x: among(flown, keep, "end_s"), y: among(flown, keep, "chi2") })), { xName: "time", range: spaced, y: { range: fromZero } });
}

const spaced = (u, low, high) => low === null ? [0, 1] : u.status ? [low, high] : [low - .03 * (high - low || 1), high + .03 * (high - low || 1)];

function drawOrders() {
  const um = (u, v) => v === null || v === undefined ? "–" : v >= 1 ? show(v, 3, "µm") : show(v * 1e3, 2, "nm");
  for (const [gear, floors] of Object.entries(SPECTRA)) {
    const sets = [];
    for (const flank of Object.keys(floors)) {
      const code = FLANK.indexOf(flank), mine = ORDERS[flank].filter((one) => one.gear === gear), taken = mine.map((one) => one.order);
      const left = numbers(floors[flank].length).filter((i) => !taken.includes(i + 1) && floors[flank][i] > 0);
      sets.push({ stroke: `--${flank}`, label: `noise floor, ${flank} flank`, value: um, x: left.map((i) => i + 1), y: left.map((i) => floors[flank][i] * 1e6), more: { width: 1, alpha: .6 } });
      if (mine.length) sets.push({ flank: code, label: `orders, ${flank} flank`, value: um, size: code ? 9 : 14, x: taken, y: mine.map((one) => one.amplitude_m * 1e6),
        tall: mine.map((one) => Math.min(one.sigma_m, .9 * one.amplitude_m) * 1e6) });
    }
    const decades = (u, low, high) => low === null || low <= 0 ? [1e-3, 1] : [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high * 1.2))];
    scatter("plot-orders-" + gear, `order of the ${gear} gear`, "amplitude [µm]", (v) => v === null ? "–" : String(Math.round(v)), sets,
      { xName: "order", x: { distr: 3 }, range: (u, low, high) => u.status ? [low, high] : [.8, high * 1.1], y: { distr: 3, range: decades },
        powers: true });
  }
}

function flightsCsv() {
  const names = Object.keys(FLIGHTS), cell = (name, v) => v === null ? "" : ["left", "struck"].includes(name) ? FLANK[v] : Number(v.toPrecision(9));
  return [names.join(","), ...numbers(FLIGHTS.start_s.length).map((i) => names.map((name) => cell(name, FLIGHTS[name][i])).join(","))].join("\n") + "\n";
}
document.getElementById("csv-flights")?.addEventListener("click", () => save("flights.csv", flightsCsv()));

draws.push(() => { if (DATA.time.length > 1) { drawClose(); drawImpacts(); drawFlights(); drawOrders(); } });
