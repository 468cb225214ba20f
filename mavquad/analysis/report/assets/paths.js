"use strict";
// The path of a flight on a canvas: seen from a corner and turned by dragging, or from above with north up.
// Coordinates are east, north, up; the projection is orthographic, so that lengths along an axis compare.
class PathView {
  static AZIMUTH = -0.62;
  static ELEVATION = 0.42;

  constructor(canvas, tracks, above, colour, redraw) {
    Object.assign(this, { canvas, above, colour, redraw, fingers: new Map() });
    this.tracks = tracks.map(({ points: [north, east, up], ...track }) => ({ ...track, points: [east, north, up] }));
    this.measure();
    this.reset();
    this.listen();
  }

  measure() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const { points } of this.tracks) {
      points.forEach((column, axis) => column.forEach((value) => {
        if (value < low[axis]) low[axis] = value;
        if (value > high[axis]) high[axis] = value;
      }));
    }
    for (let axis = 0; axis < 3; axis++) if (!(low[axis] <= high[axis])) low[axis] = high[axis] = 0;
    this.middle = low.map((value, axis) => (value + high[axis]) / 2);
    const half = Math.max(high[0] - low[0], high[1] - low[1], 1) / 2;  // a hover is not blown up to its millimetres
    this.step = PathView.nice(half / 3);
    this.half = Math.ceil(half / this.step + 0.2) * this.step;
    this.centre = [0, 1].map((axis) => Math.round(this.middle[axis] / this.step) * this.step);
    // The floor is the ground, where that is not too far below.
    this.floor = low[2] > 0 && low[2] < 2.5 * half ? 0 : low[2] - 0.05 * half;
    this.ceiling = Math.max(high[2], this.floor + 0.4 * half);
    this.middle[2] = (this.floor + this.ceiling) / 2;
    this.extent = [half * 1.12, half * 1.12];
  }

  static nice(value) {
    const power = 10 ** Math.floor(Math.log10(value)), part = value / power;
    return power * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
  }

  reset() {
    Object.assign(this, { azimuth: this.above ? 0 : PathView.AZIMUTH, elevation: this.above ? Math.PI / 2 : PathView.ELEVATION, zoom: 1, shift: [0, 0] });
    this.redraw();
  }

  listen() {
    const canvas = this.canvas, fingers = this.fingers;
    canvas.addEventListener("pointerdown", (e) => { fingers.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
    for (const type of ["pointerup", "pointercancel"]) canvas.addEventListener(type, (e) => fingers.delete(e.pointerId));
    canvas.addEventListener("pointermove", (e) => {
      const before = fingers.get(e.pointerId);
      if (!before) return;
      const apart = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
      const spread = fingers.size === 2 ? apart() : 0, dx = e.clientX - before[0], dy = e.clientY - before[1];
      fingers.set(e.pointerId, [e.clientX, e.clientY]);
      if (spread) this.scaleBy(apart() / Math.max(spread, 1), null);
      else if (this.above || e.shiftKey) this.shift = [this.shift[0] + dx, this.shift[1] + dy];
      else {
        this.azimuth += dx * 0.008;
        this.elevation = Math.min(Math.max(this.elevation + dy * 0.006, -0.2), Math.PI / 2);
      }
      this.redraw();
    });
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      const box = canvas.getBoundingClientRect();
      this.scaleBy(Math.exp(-e.deltaY * 0.0015), [e.clientX - box.left - box.width / 2, e.clientY - box.top - box.height / 2]);
      this.redraw();
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.reset());
  }

  scaleBy(factor, about) {
    factor = Math.min(Math.max(this.zoom * factor, 0.2), 500) / this.zoom;
    this.zoom *= factor;
    this.shift = this.shift.map((s, i) => (about ? about[i] - (about[i] - s) * factor : s * factor));
  }

  // Screen coordinates of a point, in CSS pixels.
  project(e, n, u) {
    e -= this.middle[0]; n -= this.middle[1]; u -= this.middle[2];
    const across = e * this.cosA + n * this.sinA, away = n * this.cosA - e * this.sinA;
    return [
      this.width / 2 + this.shift[0] + this.scale * across,
      this.height / 2 + this.shift[1] - this.scale * (away * this.sinE + u * this.cosE),
    ];
  }

  draw(view, cursor_s) {
    const ratio = devicePixelRatio || 1, canvas = this.canvas;
    this.width = canvas.clientWidth;
    this.height = Math.round(this.width * (this.above ? 0.72 : 0.7));
    if (!this.width) return;
    canvas.style.height = `${this.height}px`;
    if (canvas.width !== Math.round(this.width * ratio) || canvas.height !== Math.round(this.height * ratio)) {
      canvas.width = Math.round(this.width * ratio);
      canvas.height = Math.round(this.height * ratio);
    }
    const ctx = (this.ctx = canvas.getContext("2d"));
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, this.width, this.height);
    ctx.font = '11px system-ui, "Segoe UI", Roboto, Arial, "Noto Sans", "DejaVu Sans", sans-serif';
    ctx.lineJoin = "round";
    [this.cosA, this.sinA] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    [this.cosE, this.sinE] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    this.scale = this.zoom * this.fit();
    if (this.above) this.rulers(); else this.ground();
    if (!this.above) for (const track of this.tracks) if (!track.dashed) this.shadow(track);
    for (const track of this.tracks) {
      this.line(track, [0, Infinity], 0.2);
      this.line(track, view, 1);
    }
    this.ends();
    if (cursor_s != null) for (const track of this.tracks) this.dot(track, cursor_s);
  }

  // Pixels a metre with which all of it is seen: from above the path, else the box about it as it first stands.
  fit() {
    if (this.above) return Math.min(this.width - 60, this.height - 30) / (2 * this.extent[0]);
    const [a, e] = [PathView.AZIMUTH, PathView.ELEVATION], tall = this.ceiling - this.floor;
    const broad = 2 * this.half * (Math.cos(a) + Math.abs(Math.sin(a)));
    return Math.min((this.width - 80) / broad, (this.height - 56) / (broad * Math.sin(e) + tall * Math.cos(e)));
  }

  stroke(points, style, width, dash = []) {
    const ctx = this.ctx;
    ctx.beginPath();
    points.forEach(([x, y], i) => (i ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
    ctx.strokeStyle = style;
    ctx.lineWidth = width;
    ctx.setLineDash(dash);
    ctx.stroke();
    ctx.setLineDash([]);
  }

  label(text, [x, y], align = "center", name = "--muted", baseline = "middle") {
    Object.assign(this.ctx, { fillStyle: this.colour(name), textAlign: align, textBaseline: baseline });
    this.ctx.fillText(text, x, y);
  }

  number(value, step) {
    return (Math.abs(value) < step / 2 ? 0 : value).toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  }

  // A square of ground with a grid, numbers along two of its edges, and a scale of height at one corner.
  ground() {
    const [e0, n0] = this.centre, half = this.half, step = this.step, floor = this.floor;
    const count = Math.round((2 * half) / step);
    // A point of an edge, so many pixels farther out along the direction (east, north) that leaves the ground there.
    const outward = ([e, n], [de, dn], pixels) => {
      const [x, y] = this.project(e, n, floor), [x1, y1] = this.project(e + de, n + dn, floor);
      const length = Math.hypot(x1 - x, y1 - y) || 1;
      return [x + ((x1 - x) / length) * pixels * 1.25, y + ((y1 - y) / length) * pixels + 2];
    };
    const lateral = (e, n) => this.project(e, n, floor)[0];
    for (let i = 0; i <= count; i++) {
      const at = -half + i * step, style = this.colour(i === 0 || i === count ? "--edge" : "--grid");
      this.stroke([this.project(e0 + at, n0 - half, floor), this.project(e0 + at, n0 + half, floor)], style, 1);
      this.stroke([this.project(e0 - half, n0 + at, floor), this.project(e0 + half, n0 + at, floor)], style, 1);
    }
    // The two edges that face the viewer: where the screen's y is greatest.
    const south = this.cosA > 0 ? -1 : 1, west = this.sinA > 0 ? 1 : -1;
    const every = Math.max(Math.ceil(count / 4), Math.ceil(30 / (step * this.scale)));
    for (let i = 1; i < count; i++) {
      const at = -half + i * step;
      if ((count / 2 - i) % every) continue;
      this.label(this.number(e0 + at, step), outward([e0 + at, n0 + south * half], [0, south], 13));
      this.label(this.number(n0 + at, step), outward([e0 + west * half, n0 + at], [west, 0], 13));
    }
    this.label("east (m)", outward([e0, n0 + south * half], [0, south], 36), "center", "--ink");
    this.label("north (m)", outward([e0 + west * half, n0], [west, 0], 36), "center", "--ink");
    const corners = [[-1, -1], [-1, 1], [1, -1], [1, 1]].map(([a, b]) => [e0 + a * half, n0 + b * half]);
    const [e, n] = corners.reduce((best, corner) => (lateral(...corner) < lateral(...best) ? corner : best));
    const height = this.ceiling - floor, upright = PathView.nice(26 / (this.scale * Math.max(this.cosE, 0.2)));
    this.stroke([this.project(e, n, floor), this.project(e, n, floor + height)], this.colour("--edge"), 1);
    for (let u = 0; u <= height * 1.001; u += upright) {
      const [x, y] = this.project(e, n, floor + u);
      this.stroke([[x - 3, y], [x + 3, y]], this.colour("--muted"), 1);
      if (u > 0) this.label(this.number(floor + u, upright), [x - 6, y], "right");
    }
    const [x, y] = this.project(e, n, floor + height);
    this.label("up (m)", [x + 8, y - 6], "left", "--ink");
  }

  // A map's edges: metres east along the bottom, north along the left; as many as are easily read.
  rulers() {
    const step = PathView.nice(70 / this.scale), [w, h] = [this.width, this.height];
    const east = (x) => (x - w / 2 - this.shift[0]) / this.scale + this.middle[0];
    const north = (y) => (h / 2 + this.shift[1] - y) / this.scale + this.middle[1];
    for (let at = Math.ceil(east(0) / step) * step; at < east(w); at += step) {
      const [x] = this.project(at, 0, 0);
      this.stroke([[x, 0], [x, h]], this.colour("--grid"), 1);
      if (x > 44) this.label(this.number(at, step), [x, h - 3], "center", "--muted", "bottom");
    }
    for (let at = Math.ceil(north(h) / step) * step; at < north(0); at += step) {
      const [, y] = this.project(0, at, 0);
      this.stroke([[0, y], [w, y]], this.colour("--grid"), 1);
      if (y > 26 && y < h - 20) this.label(this.number(at, step), [3, y - 2], "left", "--muted", "bottom");
    }
    this.label("east →", [w - 4, h - 18], "right", "--ink", "bottom");
    this.label("north ↑", [3, 10], "left", "--ink");
  }

  line(track, [from, to], alpha) {
    const { ctx } = this, [e, n, u] = track.points, { times } = track;
    ctx.globalAlpha = alpha;
    ctx.beginPath();
    let drawing = false;
    for (let i = 0; i < times.length; i++) {
      const inside = times[i] >= from && times[i] <= to && Number.isFinite(e[i] + n[i] + u[i]);
      if (inside) {
        const [x, y] = this.project(e[i], n[i], u[i]);
        if (drawing) ctx.lineTo(x, y); else ctx.moveTo(x, y);
      }
      drawing = inside;
    }
    ctx.strokeStyle = this.colour(`--${track.colour}`);
    ctx.lineWidth = track.dashed ? 1.2 : 1.8;
    ctx.setLineDash(track.dashed ? [6, 4] : []);
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.globalAlpha = 1;
  }

  shadow(track) {
    const [e, n] = track.points;
    this.line({ ...track, points: [e, n, e.map(() => this.floor)], colour: "muted" }, [0, Infinity], 0.25);
  }

  first(track, backwards) {
    const [e, n, u] = track.points, last = e.length - 1;
    for (let i = 0; i <= last; i++) {
      const at = backwards ? last - i : i;
      if (Number.isFinite(e[at] + n[at] + u[at])) return [e[at], n[at], u[at]];
    }
    return null;
  }

  ends() {
    const { ctx } = this, track = this.tracks.find((candidate) => !candidate.dashed) ?? this.tracks[0];
    for (const backwards of [false, true]) {
      const point = this.first(track, backwards);
      if (!point) continue;
      const [x, y] = this.project(...point);
      ctx.beginPath();
      if (backwards) ctx.rect(x - 4, y - 4, 8, 8); else ctx.arc(x, y, 4.5, 0, 2 * Math.PI);
      Object.assign(ctx, { fillStyle: this.colour("--orange"), strokeStyle: this.colour("--card"), lineWidth: 1.5 });
      ctx.fill();
      ctx.stroke();
      this.label(backwards ? "end" : "start", [x + 8, y + (backwards ? 8 : -8)], "left", "--ink");
    }
  }

  dot(track, seconds) {
    const { ctx } = this, { times } = track, [e, n, u] = track.points;
    let low = 0, high = times.length - 1;
    while (low < high) { const middle = (low + high) >> 1; if (times[middle] < seconds) low = middle + 1; else high = middle; }
    if (low > 0 && seconds - times[low - 1] < times[low] - seconds) low--;
    if (!times.length || !Number.isFinite(e[low] + n[low] + u[low]) || Math.abs(times[low] - seconds) > 1) return;
    const [x, y] = this.project(e[low], n[low], u[low]);
    if (!this.above && !track.dashed) this.stroke([[x, y], this.project(e[low], n[low], this.floor)], this.colour("--muted"), 1, [2, 3]);
    ctx.beginPath();
    ctx.arc(x, y, track.dashed ? 5.5 : 4.5, 0, 2 * Math.PI);
    Object.assign(ctx, { fillStyle: this.colour(`--${track.colour}`), strokeStyle: this.colour("--ink"), lineWidth: 1.5 });
    if (!track.dashed) ctx.fill();
    ctx.stroke();
  }
}
