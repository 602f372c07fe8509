// What the tests of pages look for in a browser.
// What is written on canvases, with the place where it stands.
(() => {
  const write = CanvasRenderingContext2D.prototype.fillText, clear = CanvasRenderingContext2D.prototype.clearRect;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...more) {
    const size = this.measureText(text), m = this.getTransform();
    const left = { left: 0, start: 0, center: size.width / 2, right: size.width, end: size.width }[this.textAlign];
    const high = size.actualBoundingBoxAscent, low = size.actualBoundingBoxDescent;
    const ends = [[x - left, y - high], [x - left + size.width, y + low]].map(([a, b]) => [m.a * a + m.c * b + m.e, m.b * a + m.d * b + m.f]);
    (this.canvas.written ||= []).push({ text: String(text), left: Math.min(ends[0][0], ends[1][0]), right: Math.max(ends[0][0], ends[1][0]),
      top: Math.min(ends[0][1], ends[1][1]), bottom: Math.max(ends[0][1], ends[1][1]) });
    return write.call(this, text, x, y, ...more);
  };
  CanvasRenderingContext2D.prototype.clearRect = function (...box) { this.canvas.written = []; return clear.apply(this, box); };
})();

// Text that covers other text.
globalThis.covered = () => {
  const groups = [], seen = (e) => e.checkVisibility({ opacityProperty: true, visibilityProperty: true });
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), shown = [];
  for (let node; (node = texts.nextNode());) {
    const of = node.parentElement;
    if (!node.data.trim() || ["SCRIPT", "STYLE", "NOSCRIPT", "TITLE"].includes(of.tagName) || !seen(of)) continue;
    if (of.closest(".toolbar")) continue;  // sticks to the top of the window, above what scrolls past
    const range = document.createRange();
    range.selectNodeContents(node);
    const frame = of.closest(".scroll, pre, svg")?.getBoundingClientRect();
    for (const box of range.getClientRects()) {
      if (box.width < 1 || (frame && (box.right < frame.left || box.left > frame.right))) continue;
      shown.push({ text: node.data.trim().slice(0, 40), left: box.left, right: box.right, top: box.top + scrollY, bottom: box.bottom + scrollY, of });
    }
  }
  groups.push(shown);
  for (const canvas of document.querySelectorAll("canvas")) groups.push(canvas.written || []);
  const found = [];
  for (const group of groups) {
    group.sort((a, b) => a.top - b.top);
    for (let i = 0; i < group.length; i++) for (let k = i + 1; k < group.length && group[k].top < group[i].bottom - 3; k++) {
      const [a, b] = [group[i], group[k]], wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      if (a.of && (a.of === b.of || a.of.contains(b.of) || b.of.contains(a.of))) continue;
      if (wide > 2 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 3) found.push(a.text + " | " + b.text);
    }
  }
  return found;
};

// Text on a canvas that its edge cuts off.
globalThis.cutOff = () => [...document.querySelectorAll("canvas")].flatMap((canvas) => (canvas.written || [])
  .filter((one) => one.left < -1 || one.right > canvas.width + 1 || one.top < -1 || one.bottom > canvas.height + 1).map((one) => one.text));

// Violations of accessibility rules.
globalThis.violations = () => axe.run(document, { resultTypes: ["violations"] }).then((all) => all.violations
  .map((one) => one.impact + " " + one.id + ": " + one.nodes.length + " " + one.nodes[0].target + " " + (one.nodes[0].any[0]?.message || "")));
