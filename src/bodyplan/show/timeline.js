// The line of stages under the replay: a bar for each, line under line where they overlap; a click goes there.
"use strict";
function makeStageLine(bar, data, first, last, cycleOf, stagesAt, seek) {
  const timeAt = (event) => first + event.offsetX / bar.clientWidth * (last - first);
  const LINE = 15, count = 1 + Math.max(-1, ...data.stages.map((s) => s.lane)), period = data.period || last;
  bar.addEventListener("pointermove", (event) => { bar.title = stagesAt(timeAt(event)).map((s) => s.name).join(" + "); });
  bar.addEventListener("click", (event) => seek(timeAt(event)));
  function draw(t, now) {
    if (!data.showStages) return;
    const ratio = window.devicePixelRatio || 1, w = bar.clientWidth, h = LINE * count;
    if (bar.width !== Math.round(w * ratio) || bar.style.height !== h + "px") {
      bar.width = Math.round(w * ratio);
      bar.height = Math.round(h * ratio);
      bar.style.height = h + "px";
    }
    const ctx = bar.getContext("2d"), x = (time) => (time - first) / (last - first) * w;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, w, h);
    ctx.font = "10.5px system-ui, sans-serif";
    ctx.textBaseline = "middle";
    for (let cycle = 0; cycle * period < last - 1e-6; cycle++) data.stages.forEach((s) => {
      const a = x(cycle * period + s.start), b = x(Math.min(cycle * period + s.end, last)), y = LINE * s.lane;
      const active = t >= 0 && cycle === cycleOf(t) && now.includes(s);
      if (b <= a) return;
      ctx.fillStyle = active ? "#1b3a57" : s.shade ? "#c9d3dd" : "#dde4ea";
      ctx.fillRect(a, y, b - a - 0.5, LINE - 1);
      if (ctx.measureText(s.name).width > b - a - 5) return;
      ctx.fillStyle = active ? "#fff" : "#33404d";
      ctx.fillText(s.name, a + 3, y + 0.5 * LINE);
    });
    ctx.fillStyle = "#b3261e";
    ctx.fillRect(x(t) - 1, 0, 2, h);
  }
  return { draw };
}
