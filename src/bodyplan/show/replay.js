// The replay: plan and execution drawn on a canvas in parallel projection, so that it needs no graphics card and a
// length means the same everywhere in the picture. Data: the JSON element #replay-data, made by scene.py.
(function () {
  "use strict";
  const root = document.getElementById("replay"), element = document.getElementById("replay-data");
  if (!root || !element) { document.body.dataset.ready = "none"; return; }
  const data = JSON.parse(element.textContent);
  const numbers = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const times = numbers(data.t), first = times[0], last = times[times.length - 1];
  const unpack = (track) => track && Object.assign(track, {
    poses: numbers(track.poses), centre: numbers(track.centre), advance: numbers(track.advance) });
  const path = data.path && numbers(data.path);
  const planned = unpack(data.planned), executed = unpack(data.executed);
  const fields = data.ground.fields.map((f) => ({ nx: f.nx, ny: f.ny, x: numbers(f.x), y: numbers(f.y), z: numbers(f.z) }));
  const COLORS = { planned: ["#e08a00", "#f0a93a", "#8a5500"], executed: ["#0072b2", "#2f97d3", "#004a75"] };
  const find = (name) => root.querySelector("[data-part=" + name + "]");
  const canvas = find("canvas"), context = canvas.getContext("2d"), bar = find("timeline"), scrub = find("scrub");
  const readout = find("readout"), playButton = find("play");
  const layer = document.createElement("canvas"), layerContext = layer.getContext("2d");
  const state = { t: Math.max(first, 0), playing: false, speed: 1, azimuth: -1.2, elevation: 0.72, scale: 1,
    target: [0, 0, 0], planned: true, executed: Boolean(executed), trail: true, follow: false,
    curve: Boolean(path) };
  let width = 0, height = 0, camera = null, dirty = true, before = 0;

  // --- vectors and poses
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const mix = (a, b, s) => a + s * (b - a);
  function turned(q, v) {
    const [w, x, y, z] = q, tx = 2 * (y * v[2] - z * v[1]), ty = 2 * (z * v[0] - x * v[2]), tz = 2 * (x * v[1] - y * v[0]);
    return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
  }
  function moved(pose, v) {
    const r = turned(pose.q, v);
    return [pose.p[0] + r[0], pose.p[1] + r[1], pose.p[2] + r[2]];
  }
  // index of the sample before t, and how far t is on the way to the next
  function place(track, t) {
    let low = 0, high = track.count - 1;
    if (t >= times[high]) return [Math.max(high - 1, 0), high > 0 ? 1 : 0];
    while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] <= t) low = middle; else high = middle; }
    return [low, Math.min(Math.max((t - times[low]) / (times[low + 1] - times[low]), 0), 1)];
  }
  function posesAt(track, t) {
    const [i, s] = place(track, t), size = 7 * data.bodies, a = track.poses, out = [];
    for (let b = 0; b < data.bodies; b++) {
      const m = i * size + 7 * b, n = s > 0 ? m + size : m;
      const sign = a[m + 3] * a[n + 3] + a[m + 4] * a[n + 4] + a[m + 5] * a[n + 5] + a[m + 6] * a[n + 6] < 0 ? -1 : 1;
      const q = [3, 4, 5, 6].map((k) => mix(a[m + k], sign * a[n + k], s)), size4 = Math.hypot(...q) || 1;
      out.push({ p: [0, 1, 2].map((k) => mix(a[m + k], a[n + k], s)), q: q.map((x) => x / size4) });
    }
    return out;
  }
  function valueAt(track, values, k, step, t) {
    const [i, s] = place(track, t);
    return mix(values[step * i + k], values[step * (s > 0 ? i + 1 : i) + k], s);
  }
  const centreAt = (track, t) => [0, 1, 2].map((k) => valueAt(track, track.centre, k, 3, t));
  const alive = (track, t) => t <= times[track.count - 1] + 1e-6;

  // --- camera: parallel projection; right and up span the picture, toward points at the viewer
  function look() {
    const ca = Math.cos(state.azimuth), sa = Math.sin(state.azimuth), ce = Math.cos(state.elevation), se = Math.sin(state.elevation);
    camera = { right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce], toward: [ce * ca, ce * sa, se] };
    const goal = state.follow ? centreAt(executed && alive(executed, state.t) ? executed : planned, state.t) : state.target;
    camera.x = 0.5 * width - state.scale * dot(camera.right, goal);
    camera.y = 0.5 * height + state.scale * dot(camera.up, goal);
  }
  const project = (p) => [camera.x + state.scale * dot(camera.right, p), camera.y - state.scale * dot(camera.up, p)];
  function fit() {
    look();
    const spread = [0, 0];
    const size = state.follow ? [0, 1, 2].map(() => 0.75 * data.reach) : data.high.map((h, k) => h - data.low[k]);
    for (let k = 0; k < 3; k++) {
      spread[0] += Math.abs(camera.right[k]) * size[k];
      spread[1] += Math.abs(camera.up[k]) * size[k];
    }
    state.scale = 0.9 * Math.min(width / spread[0], height / Math.max(spread[1], 1e-9));
    state.target = data.low.map((l, k) => 0.5 * (l + data.high[k]));
    dirty = true;
  }

  // --- drawing
  function polygon(ctx, points, fill, stroke, thin) {
    ctx.beginPath();
    points.forEach((p, i) => { const [x, y] = project(p); if (i) ctx.lineTo(x, y); else ctx.moveTo(x, y); });
    ctx.closePath();
    if (fill) { ctx.fillStyle = fill; ctx.fill(); }
    if (stroke) { ctx.strokeStyle = stroke; ctx.lineWidth = thin || 1; ctx.stroke(); }
  }
  function line(ctx, points, color, wide) {
    ctx.beginPath();
    points.forEach((p, i) => { const [x, y] = project(p); if (i) ctx.lineTo(x, y); else ctx.moveTo(x, y); });
    ctx.strokeStyle = color; ctx.lineWidth = wide; ctx.lineCap = "round"; ctx.lineJoin = "round"; ctx.stroke();
  }
  function tube(ctx, points, radius, colors, odd) {
    const r = Math.max(radius * state.scale, 0.8), lit = [0, 0, 0.4 * radius];
    line(ctx, points, colors[2], 2 * r + 1.2);
    line(ctx, points, odd ? colors[1] : colors[0], 2 * r - 0.4);
    if (r > 3) line(ctx, points.map((p) => p.map((x, k) => x + lit[k])), "rgba(255,255,255,.28)", 0.7 * r);
  }
  // an arc of constant curvature leaves along x of its first frame; its bend is what turns that into the last
  function arc(from, to, length) {
    const [w, x, y, z] = from.q, [u, i, j, k] = to.q;
    const turn = [w * i - x * u - y * k + z * j, w * j + x * k - y * u - z * i, w * k - x * j + y * i - z * u];
    const half = Math.atan2(Math.hypot(...turn), w * u + x * i + y * j + z * k), size = Math.hypot(turn[1], turn[2]);
    const bend = 2 * (half > Math.PI / 2 ? half - Math.PI : half), side = size > 1e-9 ? [turn[2] / size, -turn[1] / size] : [0, 0];
    return Array.from({ length: 9 }, (_, n) => {
      const a = bend * n / 8, ahead = Math.abs(bend) < 1e-6 ? n / 8 : Math.sin(a) / bend, aside = Math.abs(bend) < 1e-6 ? 0 : (1 - Math.cos(a)) / bend;
      return moved(from, [length * ahead, length * aside * side[0], length * aside * side[1]]);
    });
  }
  function box(ctx, pose, shape, colors) {
    const h = shape.half, c = shape.start;
    const corner = (x, y, z) => moved(pose, [c[0] + x * h[0], c[1] + y * h[1], c[2] + z * h[2]]);
    for (let axis = 0; axis < 3; axis++) for (const side of [-1, 1]) {
      const n = [0, 0, 0]; n[axis] = side;
      const shade = dot(turned(pose.q, n), camera.toward);
      if (shade <= 0) continue;
      const points = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([u, v]) => {
        const p = [0, 0, 0]; p[axis] = side; p[(axis + 1) % 3] = u; p[(axis + 2) % 3] = v;
        return corner(...p);
      });
      polygon(ctx, points, shade > 0.6 ? colors[1] : colors[0], colors[2]);
    }
  }
  function ring(pose, shape) {
    return Array.from({ length: 40 }, (_, i) => moved(pose, [shape.start[0] + shape.radius * Math.cos(i * Math.PI / 20),
      shape.start[1] + shape.radius * Math.sin(i * Math.PI / 20), shape.start[2]]));
  }
  // a bone inside a box is drawn before it
  function hiddenBy(poses, p) {
    return data.shapes.find((shape) => {
      if (shape.kind !== "box") return false;
      const { p: at, q } = poses[shape.body], back = [q[0], -q[1], -q[2], -q[3]];
      return turned(back, p.map((x, k) => x - at[k])).every((x, k) => Math.abs(x - shape.start[k]) < shape.half[k]);
    });
  }
  // the robot as parts with a depth, to be drawn from back to front
  function partsOf(track, colors) {
    const poses = posesAt(track, state.t), parts = [];
    const add = (p, draw) => parts.push({ depth: dot(camera.toward, p), draw });
    data.bones.forEach(([i, j, length, radius], number) => {
      const a = poses[i].p, b = poses[j].p, half = a.map((x, k) => 0.5 * (x + b[k])), cover = hiddenBy(poses, half);
      const points = length ? arc(poses[i], poses[j], length) : [a, b];
      add(cover ? moved(poses[cover.body], cover.start) : half,
        (ctx) => tube(ctx, points, radius || data.boneRadius, colors, Boolean(length) && number % 2 === 1));
    });
    data.shapes.forEach((shape, number) => {
      const pose = poses[shape.body], a = moved(pose, shape.start), b = moved(pose, shape.end);
      const middle = a.map((x, k) => 0.5 * (x + b[k]));
      if (shape.kind === "box") add(a, (ctx) => box(ctx, pose, shape, colors));
      else if (shape.kind === "rim") add(a, (ctx) => polygon(ctx, ring(pose, shape), null, colors[number % 2], Math.max(2, 0.12 * shape.radius * state.scale)));
      else add(middle, (ctx) => tube(ctx, [a, b], shape.radius, colors, number % 2 === 1));
    });
    return parts;
  }
  const backToFront = (parts, ctx) => parts.sort((a, b) => a.depth - b.depth).forEach((part) => part.draw(ctx));

  // one colour for all overlapping parts: drawn apart, then laid over the picture
  function veiled(alpha, draw) {
    layerContext.setTransform(1, 0, 0, 1, 0, 0);
    layerContext.clearRect(0, 0, layer.width, layer.height);
    layerContext.setTransform(context.getTransform());
    draw(layerContext);
    context.save();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = alpha;
    context.drawImage(layer, 0, 0);
    context.restore();
  }
  function gridStep() {
    const wanted = 60 / state.scale, power = Math.pow(10, Math.floor(Math.log10(wanted)));
    return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= wanted);
  }
  function drawPlane(corners) {
    polygon(context, corners, "#f3f4f2", "#d5d8d4");
    const [a, b, , d] = corners, step = gridStep();
    const height = (x, y) => a[2] + (b[2] - a[2]) * (x - a[0]) / (b[0] - a[0]) + (d[2] - a[2]) * (y - a[1]) / (d[1] - a[1]);
    for (let x = Math.ceil(a[0] / step) * step; x < b[0]; x += step)
      line(context, [[x, a[1], height(x, a[1])], [x, d[1], height(x, d[1])]], "#e0e3df", 1);
    for (let y = Math.ceil(a[1] / step) * step; y < d[1]; y += step)
      line(context, [[a[0], y, height(a[0], y)], [b[0], y, height(b[0], y)]], "#e0e3df", 1);
  }
  function fieldParts(f, parts) {
    for (let i = 0; i + 1 < f.nx; i++) for (let j = 0; j + 1 < f.ny; j++) {
      const at = (u, v) => [f.x[u], f.y[v], f.z[v * f.nx + u]];
      const p = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
      const sx = (p[1][2] - p[0][2]) / (p[1][0] - p[0][0]), sy = (p[3][2] - p[0][2]) / (p[3][1] - p[0][1]);
      const light = (0.35 * -sx + 0.25 * -sy + 0.9) / Math.hypot(sx, sy, 1), grey = Math.round(150 + 92 * Math.max(0, Math.min(1, light)));
      const color = "rgb(" + grey + "," + grey + "," + (grey - 8) + ")";
      parts.push({ depth: dot(camera.toward, p[0]) - 0.5 * data.reach, draw: (ctx) => polygon(ctx, p, color, color) });
    }
  }
  // a box can hide the robot unless a face that the robot is outside of looks at the viewer
  function boxesInFront(centre) {
    const front = {};
    for (const face of data.ground.faces) {
      const outside = dot(face.normal, centre) - dot(face.normal, face.corners[0]) > 0;
      if (!(face.box in front)) front[face.box] = true;
      if (outside && dot(face.normal, camera.toward) > -1e-6) front[face.box] = false;
    }
    return front;
  }
  function drawFaces(front, inFront) {
    const FILL = { wall: "127,143,158", floor: "205,209,203", ceiling: "150,160,170" };
    for (const face of data.ground.faces) {
      if (inFront[face.box] !== front || dot(face.normal, camera.toward) <= 1e-6) continue;
      const shade = 0.75 + 0.25 * Math.abs(face.normal[2]), alpha = front ? 0.2 : face.role === "floor" ? 0.9 : 0.42 * shade;
      polygon(context, face.corners, "rgba(" + (FILL[face.role] || FILL.wall) + "," + alpha + ")", "rgba(80,95,110," + (front ? 0.45 : 0.6) + ")");
    }
  }
  function drawTrail(track, color, dash) {
    const [i, s] = place(track, state.t), points = [];
    for (let k = 0; k <= i; k++) points.push([track.centre[3 * k], track.centre[3 * k + 1], track.centre[3 * k + 2]]);
    if (s > 0) points.push(centreAt(track, state.t));
    context.save(); context.setLineDash(dash); line(context, points, color, 2); context.restore();
    const [x, y] = project(points[points.length - 1]);
    context.beginPath(); context.arc(x, y, 4, 0, 7); context.fillStyle = color; context.fill();
    context.strokeStyle = "#fff"; context.lineWidth = 1.5; context.stroke();
  }
  function drawPath() {
    const points = Array.from({ length: path.length / 3 }, (_, k) => [path[3 * k], path[3 * k + 1], path[3 * k + 2]]);
    line(context, points, "rgba(0,158,115,.75)", 2);
  }
  function drawScale() {
    const step = gridStep(), long = step * state.scale, x = 14, y = height - 16;
    context.strokeStyle = context.fillStyle = "#333"; context.lineWidth = 1.5; context.lineCap = "butt";
    context.beginPath(); context.moveTo(x, y - 4); context.lineTo(x, y); context.lineTo(x + long, y); context.lineTo(x + long, y - 4); context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.fillText(step < 1 ? +(1000 * step).toPrecision(3) + " mm" : +step.toPrecision(3) + " m", x + 4, y - 6);
    const origin = [width - 40, height - 38];
    ["x", "y", "z"].forEach((name, k) => {
      const e = [0, 0, 0]; e[k] = 26;
      const dx = dot(camera.right, e), dy = -dot(camera.up, e);
      if (Math.hypot(dx, dy) < 4) return;
      context.strokeStyle = context.fillStyle = ["#a33", "#383", "#33a"][k];
      context.beginPath(); context.moveTo(...origin); context.lineTo(origin[0] + dx, origin[1] + dy); context.stroke();
      context.fillText(name, origin[0] + 1.28 * dx - 3, origin[1] + 1.28 * dy + 4);
    });
  }
  function draw() {
    look();
    context.clearRect(0, 0, width, height);
    data.ground.planes.forEach(drawPlane);
    const showExecuted = state.executed && executed && alive(executed, state.t), showPlanned = state.planned;
    const tracks = [showPlanned && planned, showExecuted && executed].filter(Boolean);
    const inFront = boxesInFront(centreAt(tracks[tracks.length - 1] || planned, state.t));
    drawFaces(false, inFront);
    const solid = showExecuted ? partsOf(executed, COLORS.executed) : showPlanned ? partsOf(planned, COLORS.planned) : [];
    const ghost = showExecuted && showPlanned ? partsOf(planned, COLORS.planned) : null;
    fields.forEach((f) => fieldParts(f, solid));
    if (ghost && !fields.length) veiled(0.5, (ctx) => backToFront(ghost, ctx));
    backToFront(solid, context);
    if (ghost && fields.length) veiled(0.4, (ctx) => backToFront(ghost, ctx));
    drawFaces(true, inFront);
    if (path && state.curve) drawPath();
    if (state.trail) {
      if (showPlanned) drawTrail(planned, COLORS.planned[2], [5, 4]);
      if (showExecuted) drawTrail(executed, COLORS.executed[2], []);
    }
    drawScale();
    tell();
  }

  // --- words and the line of stages
  const period = data.period || last;
  const cycleOf = (t) => Math.min(Math.max(Math.floor(t / period + 1e-9), 0), Math.max(data.cycles - 1, 0));
  const stagesAt = (t) => {
    const local = t - cycleOf(t) * period;
    return data.stages.filter((s) => local >= s.start - 1e-9 && local < s.end);
  };
  const stageLine = makeStageLine(bar, data, first, last, cycleOf, stagesAt, seek);
  const millimetres = (x) => (Math.abs(x) < 1 ? (1000 * x).toFixed(1) + " mm" : x.toFixed(3) + " m").replace("-", "\u2212");
  function tell() {
    const t = state.t, now = stagesAt(t), words = [];
    const item = (name, value) => words.push([name, value]);
    item("time", t.toFixed(2).replace("-", "\u2212") + " s");
    if (data.period) item("cycle", t < 0 ? "before the first" : cycleOf(t) + 1 + " of " + data.cycles);
    if (data.stages.length) item("stage", t < 0 ? "settling" : now.map((s) => s.name).join(" + ") || "\u2013");
    item("planned", millimetres(valueAt(planned, planned.advance, 0, 1, t)));
    if (executed) item("executed", alive(executed, t) ? millimetres(valueAt(executed, executed.advance, 0, 1, t)) : "physics diverged");
    readout.replaceChildren(...words.map(([name, value]) => {
      const span = document.createElement("span"), strong = document.createElement("b");
      strong.textContent = value; span.append(name + " ", strong); return span;
    }));
    scrub.value = String(t);
    scrub.setAttribute("aria-valuetext", words.map((w) => w.join(" ")).join(", "));
    stageLine.draw(t, now);
  }

  // --- controls
  function seek(t) { state.t = Math.min(Math.max(t, first), last); dirty = true; }
  function play(on) {
    if (on && state.t >= last - 1e-6) state.t = first;
    state.playing = on; before = 0;
    playButton.textContent = on ? "\u275a\u275a Pause" : "\u25b6 Play";
    playButton.setAttribute("aria-pressed", String(on));
    dirty = true;
  }
  const VIEWS = { "3d": [-1.2, 0.72], top: [-Math.PI / 2, Math.PI / 2], side: [-Math.PI / 2, 0], front: [0, 0] };
  function view(name) { if (VIEWS[name]) { [state.azimuth, state.elevation] = VIEWS[name]; fit(); } }
  function orbit(dx, dy) {
    state.azimuth -= 0.008 * dx;
    state.elevation = Math.min(Math.max(state.elevation + 0.008 * dy, 0), Math.PI / 2);
    dirty = true;
  }
  function zoom(factor, x, y) {
    const to = Math.min(Math.max(state.scale * factor, 1e-3), 1e6), f = 1 / state.scale - 1 / to;
    if (x !== undefined) pan(-(x - 0.5 * width) * f * to, -(y - 0.5 * height) * f * to, to);
    state.scale = to; dirty = true;
  }
  function pan(dx, dy, scale) {
    const s = scale || state.scale;
    state.target = state.target.map((v, k) => v - (camera.right[k] * dx - camera.up[k] * dy) / s);
    dirty = true;
  }
  playButton.addEventListener("click", () => play(!state.playing));
  scrub.min = String(first); scrub.max = String(last); scrub.step = "any";
  scrub.addEventListener("input", () => seek(Number(scrub.value)));
  find("speed").addEventListener("change", (event) => { state.speed = Number(event.target.value); });
  root.querySelectorAll("[data-view]").forEach((b) => b.addEventListener("click", () => view(b.dataset.view)));
  root.querySelectorAll("[data-zoom]").forEach((b) => b.addEventListener("click", () => zoom(Number(b.dataset.zoom))));
  root.querySelectorAll("[data-toggle]").forEach((b) => b.addEventListener("change", () => {
    state[b.dataset.toggle] = b.checked;
    if (b.dataset.toggle === "follow") fit(); else dirty = true;
  }));
  root.addEventListener("keydown", (event) => {
    if (event.target !== canvas) return;
    const jump = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === " ") play(!state.playing);
    else if (jump) seek(state.t + jump * (event.shiftKey ? 0.1 : 0.01) * (last - first));
    else if (event.key === "+" || event.key === "-") zoom(event.key === "+" ? 1.2 : 1 / 1.2);
    else return;
    event.preventDefault();
  });
  handlePointers(canvas, { orbit, pan, zoom });

  function fromAddress() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    if (wanted.has("view")) view(wanted.get("view"));
    if (wanted.has("t") && Number.isFinite(Number(wanted.get("t")))) seek(Number(wanted.get("t")));
    if (wanted.has("play")) play(true);
  }
  function resize() {
    const ratio = window.devicePixelRatio || 1;
    if (!canvas.clientWidth) return;
    width = canvas.clientWidth; height = canvas.clientHeight;
    canvas.width = layer.width = Math.round(width * ratio); canvas.height = layer.height = Math.round(height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    fit();
  }
  function tick(now) {
    if (state.playing) {
      if (before) seek(state.t + state.speed * Math.min(now - before, 200) / 1000);
      before = now;
      if (state.t >= last - 1e-9) play(false);
    }
    if (dirty && width) { dirty = false; draw(); }
    requestAnimationFrame(tick);
  }
  const size = data.high.map((h, k) => h - data.low[k]);
  state.follow = Math.hypot(size[0], size[1]) > 5 * data.reach;
  root.querySelectorAll("[data-toggle]").forEach((b) => { b.checked = state[b.dataset.toggle]; });
  new ResizeObserver(resize).observe(canvas);
  window.addEventListener("hashchange", fromAddress);
  resize(); fromAddress(); draw();
  requestAnimationFrame(tick);
  window.bodyplanReplay = { seek, play, view, state };
  document.body.dataset.ready = "replay";
})();
