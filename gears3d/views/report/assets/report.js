// What the reader does: theme, printing, time window, keys, saving.
"use strict";
const root = document.documentElement;
const preferred = matchMedia("(prefers-color-scheme: dark)");
const setTheme = (name) => { root.dataset.theme = name; drawAll(); };
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

function onKey(event) {
  if (!time.plots.length) return;
  const { min, max } = span(), width = max - min, middle = (min + max) / 2;
  const act = {
    ArrowLeft: () => look(min - width / 5, max - width / 5), ArrowRight: () => look(min + width / 5, max + width / 5),
    "+": () => look(middle - width / 4, middle + width / 4), "-": () => look(middle - width, middle + width), 0: ZOOMS.all,
  }[event.key];
  if (act) { event.preventDefault(); act(); }
}

function save(name, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

document.getElementById("theme").addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
document.getElementById("print").addEventListener("click", () => print());
document.getElementById("csv")?.addEventListener("click", () => save("impacts.csv", impactsCsv()));
document.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => time.plots.length && ZOOMS[button.dataset.zoom]()));
["displacement", "velocity", "speed"].forEach((name) => document.getElementById("plot-" + name)?.addEventListener("keydown", onKey));
preferred.addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"));

if (!DATA.wallsComplete) document.getElementById("walls-note").textContent = " The bands do not include deviations of single teeth.";

let before = "light";
addEventListener("beforeprint", () => { before = root.dataset.theme; setTheme("light"); });
addEventListener("afterprint", () => setTheme(before));
let waiting = 0;
addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(drawAll, 150); });

setTheme(preferred.matches ? "dark" : "light");
