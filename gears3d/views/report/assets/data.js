// What the page carries: integers of stated quanta, as running differences.
"use strict";
const block = (name) => JSON.parse(document.getElementById("data-" + name).textContent);

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
