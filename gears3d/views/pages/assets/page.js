// Theme, printing and size of every page.
"use strict";
const root = document.documentElement, preferred = matchMedia("(prefers-color-scheme: dark)");
const setTheme = (name) => { root.dataset.theme = name; globalThis.drawAll?.(); };
document.getElementById("theme").addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
document.getElementById("print").addEventListener("click", () => print());
preferred.addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"));
let before = "light", waiting = 0;
addEventListener("beforeprint", () => { before = root.dataset.theme; setTheme("light"); });
addEventListener("afterprint", () => setTheme(before));
addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(() => globalThis.drawAll?.(), 150); });
setTheme(preferred.matches ? "dark" : "light");
