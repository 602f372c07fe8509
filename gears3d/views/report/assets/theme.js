// Theme and printing of a page without moving plots.
"use strict";
const root = document.documentElement;
const preferred = matchMedia("(prefers-color-scheme: dark)");
const setTheme = (name) => { root.dataset.theme = name; };
setTheme(preferred.matches ? "dark" : "light");
preferred.addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"));
document.getElementById("theme").addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
document.getElementById("print").addEventListener("click", () => print());
addEventListener("beforeprint", () => { root.dataset.printing = root.dataset.theme; setTheme("light"); });
addEventListener("afterprint", () => setTheme(root.dataset.printing || "light"));
