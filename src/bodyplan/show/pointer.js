// Pointers on a canvas: one turns (with shift or the right button: moves), two pinch and move, the wheel zooms.
"use strict";
function handlePointers(canvas, { orbit, pan, zoom }) {
  const fingers = new Map();
  const middle = () => {
    const [a, b] = [...fingers.values()];
    return [0.5 * (a.x + b.x), 0.5 * (a.y + b.y), Math.hypot(a.x - b.x, a.y - b.y)];
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const old = fingers.get(event.pointerId);
    if (!old) return;
    const now = { x: event.offsetX, y: event.offsetY }, dx = now.x - old.x, dy = now.y - old.y;
    if (fingers.size === 1) {
      fingers.set(event.pointerId, now);
      if (event.shiftKey || event.buttons & 2) pan(dx, dy); else orbit(dx, dy);
    } else if (fingers.size === 2) {
      const [x0, y0, d0] = middle();
      fingers.set(event.pointerId, now);
      const [x1, y1, d1] = middle();
      pan(x1 - x0, y1 - y0);
      zoom(d1 / Math.max(d0, 1), x1, y1);
    }
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  // the wheel zooms only in a picture that was clicked: else it scrolls the page
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY), event.offsetX, event.offsetY);
  }, { passive: false });
}
