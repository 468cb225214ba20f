"use strict";
// The page's own script: all panels on one time axis, one cursor through all of them, and the list of texts.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const root = document.documentElement;
  const AXIS_WIDTH = 86, MARKED = { guard: "--alarm", operator: "--blue" };

  // ---------------------------------------------------------------- numbers

  function buffer(base64) {
    const text = atob(base64), bytes = new Uint8Array(text.length);
    for (let i = 0; i < bytes.length; i++) bytes[i] = text.charCodeAt(i);
    return bytes.buffer;
  }

  // uPlot knows a gap as null, which a typed array cannot hold.
  function withNulls(column) {
    return column.every(Number.isFinite) ? column : Array.from(column, (v) => (Number.isFinite(v) ? v : null));
  }

  const tables = data.tables.map((table) => ({
    times: new Float64Array(buffer(table.times)),
    columns: table.columns.map((column) => new Float32Array(buffer(column))),
  }));

  function tidy(value) {
    if (value == null || !Number.isFinite(value)) return "–";
    const size = Math.abs(value);
    if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(2);
    return value.toFixed(size >= 1000 ? 1 : size >= 100 ? 2 : size >= 10 ? 3 : 4);
  }

  function clockTime(seconds, digits) {
    if (data.duration_s < 600) return seconds.toFixed(digits);
    const sign = seconds < 0 ? "-" : "", whole = Math.abs(seconds);
    const h = Math.floor(whole / 3600), m = Math.floor((whole % 3600) / 60), s = (whole % 60).toFixed(digits);
    const padded = s.padStart(digits ? 3 + digits : 2, "0");
    return sign + (h ? `${h}:${String(m).padStart(2, "0")}` : m) + ":" + padded;
  }

  function utc(seconds) {
    const date = new Date(data.start_us / 1000 + seconds * 1000);
    return Number.isNaN(date.getTime()) ? "" : date.toISOString().replace("T", " ").slice(0, 23) + " UTC";
  }

  // ---------------------------------------------------------------- colours

  let colours = {};
  function colour(name) {
    return (colours[name] ??= getComputedStyle(root).getPropertyValue(name).trim());
  }
  const lineColour = (line) => colour(line.colour === "ink" ? "--ink" : `--${line.colour}`);
  const prefersDark = matchMedia("(prefers-color-scheme: dark)");
  function setTheme(theme) {
    root.dataset.theme = theme;
    colours = {};
    charts.forEach((chart) => chart.redraw(false));
    redrawPaths();
  }

  // ---------------------------------------------------------------- the view

  const charts = [], paths = [];
  let view = [...data.view_s], cursor_s = null, pending = false;

  function setView(from, to) {
    const least = Math.min(1e-3, data.duration_s);
    let span = Math.min(Math.max(to - from, least), data.duration_s);
    from = Math.min(Math.max((from + to - span) / 2, 0), data.duration_s - span);
    view = [from, from + span];
    root.dataset.view = view.map((s) => s.toFixed(3)).join(" ");
    charts.forEach((chart) => chart.setScale("x", { min: view[0], max: view[1] }));
    redrawPaths();
  }
  const zoom = (factor, about = (view[0] + view[1]) / 2) =>
    setView(about + (view[0] - about) * factor, about + (view[1] - about) * factor);
  const shift = (share) => {
    const by = Math.min(Math.max(share * (view[1] - view[0]), -view[0]), data.duration_s - view[1]);
    setView(view[0] + by, view[1] + by);
  };
  const ACTIONS = {
    all: () => setView(0, data.duration_s), in: () => zoom(0.5), out: () => zoom(2), back: () => shift(-0.25), on: () => shift(0.25),
  };

  function redrawPaths() {
    if (pending) return;
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      paths.forEach((path) => path.draw(view, cursor_s));
    });
  }

  function moveCursor(seconds) {
    if (seconds === cursor_s) return;
    cursor_s = seconds;
    const moment = document.getElementById("moment");
    const states = data.lanes.map((lane) => lane.spans.find(([from, to, name]) => name && from <= seconds && seconds <= to)?.[2]);
    const words = seconds == null ? [] : [`${clockTime(seconds, 3)} s`, utc(seconds), ...states.filter(Boolean)];
    moment.textContent = words.join(" · ");
    texts.follow(seconds);
    redrawPaths();
  }

  // ---------------------------------------------------------------- charts

  const INCREMENTS = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600,
    1800, 3600, 7200, 21600, 43200, 86400, 604800, 2592000, 31536000];
  const font = '11px system-ui, "Segoe UI", Roboto, Arial, "Noto Sans", "DejaVu Sans", sans-serif';

  function timeAxis(shown) {
    const digits = (step) => Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
    return {
      stroke: () => colour("--muted"), font, size: shown ? 26 : 6, gap: 3, incrs: INCREMENTS, space: 70,
      grid: { stroke: () => colour("--grid"), width: 1 }, ticks: { show: shown, stroke: () => colour("--edge"), size: 4 },
      values: (u, splits, _, __, step) => splits.map((s) => (shown ? clockTime(s, digits(step)) : "")),
    };
  }

  function options(width, height, axes, series, scales, hooks) {
    return {
      width, height, series, axes, legend: { show: false }, padding: [6, 8, 0, 0],
      scales: { x: { time: false, auto: false, min: view[0], max: view[1] }, ...scales },
      cursor: {
        y: false, drag: { x: true, y: false, setScale: false },
        points: { size: 6 },
        sync: { key: "time", filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } },
        dataIdx: nearest, bind: { mousedown: pressed, dblclick: () => () => ACTIONS.all() },
      },
      hooks: {
        ...hooks,
        setSelect: [(u) => {
          if (u.select.width > 2) setView(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
          u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }],
        setCursor: [(u) => moveCursor(u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null), ...(hooks.setCursor ?? [])],
      },
    };
  }

  // Lines of different streams share an axis: the value shown is that of the nearest sample.
  function nearest(u, series, index) {
    const column = u.data[series];
    if (series === 0 || column[index] != null) return index;
    for (let k = 1; k < 3000; k++) {
      if (column[index - k] != null) return index - k;
      if (column[index + k] != null) return index + k;
    }
    return index;
  }

  function pressed(u, target, handler) {
    return (event) => {
      if (event.button === 0 && !event.shiftKey) return handler(event);
      if (event.button > 1) return;
      const from = event.clientX, [low, high] = view, perPixel = (high - low) / u.over.clientWidth;
      const move = (e) => {
        const by = Math.min(Math.max((from - e.clientX) * perPixel, -low), data.duration_s - high);
        setView(low + by, high + by);
      };
      const done = () => { removeEventListener("mousemove", move); removeEventListener("mouseup", done); };
      addEventListener("mousemove", move);
      addEventListener("mouseup", done);
    };
  }

  function reactive(u) {
    const at = (clientX) => u.posToVal(clientX - u.over.getBoundingClientRect().left, "x");
    u.over.addEventListener("wheel", (event) => {
      const sideways = event.shiftKey ? event.deltaY || event.deltaX : event.deltaX;
      if (event.ctrlKey || event.metaKey) zoom(Math.exp(event.deltaY * 0.003), at(event.clientX));
      else if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) shift(sideways / u.over.clientWidth);
      else return;
      event.preventDefault();
    }, { passive: false });
    const fingers = new Map();
    u.over.addEventListener("pointerdown", (e) => { if (e.pointerType === "touch") fingers.set(e.pointerId, e.clientX); });
    for (const type of ["pointerup", "pointercancel"]) u.over.addEventListener(type, (e) => fingers.delete(e.pointerId));
    u.over.addEventListener("pointermove", (e) => {
      if (!fingers.has(e.pointerId)) return;
      const before = [...fingers.values()], width = u.over.clientWidth;
      fingers.set(e.pointerId, e.clientX);
      const after = [...fingers.values()];
      if (after.length === 1) shift((before[0] - after[0]) / width);
      else if (after.length === 2) {
        const ratio = Math.abs(before[0] - before[1]) / Math.max(Math.abs(after[0] - after[1]), 8);
        zoom(Math.min(Math.max(ratio, 0.5), 2), at((after[0] + after[1]) / 2));
      }
    });
    charts.push(u);
    return u;
  }

  // Every other state of the first lane tinted, and a line for what somebody did or what a guard saw.
  function background(u) {
    const { ctx, bbox } = u;
    const x = (s) => Math.min(Math.max(u.valToPos(s, "x", true), bbox.left), bbox.left + bbox.width);
    ctx.save();
    ctx.fillStyle = colour("--shade");
    (data.lanes[0]?.spans ?? []).forEach(([from, to], i) => {
      if (i % 2 === 0) ctx.fillRect(x(from), bbox.top, x(to) - x(from), bbox.height);
    });
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
    for (const [s, kind, , severity] of data.marks) {
      const name = MARKED[kind] ?? (severity != null && severity <= 3 ? "--alarm" : null);
      if (!name || s < view[0] || s > view[1]) continue;
      ctx.strokeStyle = colour(name);
      ctx.beginPath();
      ctx.moveTo(x(s), bbox.top);
      ctx.lineTo(x(s), bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  function tolerance(panel) {
    return (u) => {
      if (!panel.tolerance) return;
      const top = u.valToPos(panel.tolerance, "y", true), bottom = u.valToPos(-panel.tolerance, "y", true);
      const { left, top: first, width, height } = u.bbox;
      const from = Math.max(top, first), to = Math.min(bottom, first + height);
      u.ctx.fillStyle = colour("--good");
      if (to > from) u.ctx.fillRect(left, from, width, to - from);
    };
  }

  // [times, line, line ...] and the lines in that order; lines of several tables are aligned by uPlot itself, which is to
  // take a gap of one as a gap up to its neighbours (2: NULL_EXPAND).
  function aligned(panel) {
    const groups = new Map();
    for (const line of panel.lines) groups.set(line.table, [...(groups.get(line.table) ?? []), line]);
    const parts = [...groups].map(([table, lines]) => [
      tables[table].times, ...lines.map((line) => withNulls(tables[table].columns[line.column])),
    ]);
    const lines = [...groups.values()].flat();
    return [parts.length === 1 ? parts[0] : uPlot.join(parts, parts.map((part) => part.map(() => 2))), lines];
  }

  function element(tag, className, text) {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  }

  function swatch(line) {
    const made = element("span", line.dashed ? "swatch dashed" : "swatch");
    made.style.borderTopColor = `var(--${line.colour})`;
    return made;
  }

  function addPanel(panel, isLast) {
    const box = element("div", "panel"), head = element("div", "head"), title = element("b", "", panel.title);
    box.dataset.key = panel.key;
    title.append(element("small", "", panel.unit));
    const names = element("div", "lines");
    head.append(title, names);
    box.append(head);
    document.getElementById("panels").append(box);
    const [columns, lines] = aligned(panel);
    const values = lines.map((line, i) => {
      const button = element("button", ""), value = element("i", "");
      button.type = "button";
      button.append(swatch(line), line.name, value);
      button.addEventListener("click", () => {
        const on = !chart.series[i + 1].show;
        button.classList.toggle("off", !on);
        chart.setSeries(i + 1, { show: on });
      });
      names.append(button);
      return value;
    });
    const range = (u, low, high) => {
      if (low == null || high == null) [low, high] = [0, 0];
      const span = Math.max((high - low) * 1.08, panel.span, Math.max(Math.abs(low), Math.abs(high)) * 1e-6, 1e-9);
      return [(low + high - span) / 2, (low + high + span) / 2];
    };
    const axes = [timeAxis(isLast), {
      stroke: () => colour("--muted"), font, size: AXIS_WIDTH, gap: 6, space: 26,
      grid: { stroke: () => colour("--grid"), width: 1 }, ticks: { show: false },
    }];
    const series = [{}, ...lines.map((line) => ({
      label: line.name, stroke: () => lineColour(line), width: line.dashed ? 1.2 : 1.5, dash: line.dashed ? [6, 4] : undefined,
    }))];
    const show = (u) => values.forEach((value, i) => {
      const index = u.cursor.idxs?.[i + 1];
      value.textContent = u.cursor.left >= 0 && index != null ? tidy(u.data[i + 1][index]) : "";
    });
    const chart = reactive(new uPlot(
      options(width(), isLast ? 150 : 128, axes, series, { y: { range } }, { drawClear: [background, tolerance(panel)], setCursor: [show] }),
      columns, box,
    ));
    root.dataset.points = Number(root.dataset.points ?? 0) + lines.reduce(
      (sum, line) => sum + tables[line.table].columns[line.column].reduce((n, v) => n + Number.isFinite(v), 0), 0);
  }

  // ---------------------------------------------------------------- lanes: phases, modes, limits

  function addLanes() {
    const rows = [...data.lanes, ...(data.marks.length ? [{ name: "texts", spans: [], marks: true }] : [])];
    const axes = [timeAxis(true), {
      stroke: () => colour("--muted"), font, size: AXIS_WIDTH, gap: 6, grid: { show: false }, ticks: { show: false },
      splits: () => rows.map((_, i) => rows.length - 0.5 - i), values: () => rows.map((row) => row.name),
    }];
    const draw = (u) => {
      const { ctx, bbox } = u, pixel = devicePixelRatio, height = bbox.height / rows.length;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.font = font.replace("11px", `${11 * pixel}px`);
      ctx.textBaseline = "middle";
      ctx.textAlign = "left";
      rows.forEach((row, number) => {
        const top = bbox.top + number * height + 2 * pixel, tall = height - 4 * pixel;
        row.spans.forEach(([from, to, name], i) => {
          if (to < view[0] || from > view[1]) return;
          const left = Math.max(u.valToPos(from, "x", true), bbox.left), right = Math.min(u.valToPos(to, "x", true), bbox.left + bbox.width);
          ctx.fillStyle = colour(row.alarming ? "--lanealarm" : i % 2 ? "--lane1" : "--lane0");
          ctx.fillRect(left, top, Math.max(right - left - pixel, pixel), tall);
          if (right - left < ctx.measureText(name).width + 8 * pixel) return;
          ctx.fillStyle = colour("--laneink");
          ctx.fillText(name, left + 5 * pixel, top + tall / 2 + 0.5 * pixel);
        });
        if (row.marks) drawMarks(u, top, tall);
      });
      ctx.restore();
    };
    const lanes = document.getElementById("lanes");
    const y = { range: [0, rows.length] };
    const series = [{}, { show: true, stroke: "transparent", points: { show: false } }];
    reactive(new uPlot(
      options(width(), 34 + 21 * rows.length, axes, series, { y }, { draw: [draw] }),
      [[0, data.duration_s], [null, null]], lanes,
    ));
  }

  function drawMarks(u, top, tall) {
    const { ctx } = u;
    for (const [s, kind, , severity] of data.marks) {
      if (s < view[0] || s > view[1] || kind === "phase" || kind === "mode") continue;
      ctx.fillStyle = colour(MARKED[kind] ?? (severity != null && severity <= 3 ? "--alarm" : severity === 4 ? "--orange" : "--muted"));
      ctx.fillRect(u.valToPos(s, "x", true) - devicePixelRatio, top, 2 * devicePixelRatio, tall);
    }
  }

  // ---------------------------------------------------------------- texts

  const texts = (() => {
    const box = document.querySelector(".texts"), list = box.querySelector("ol");
    box.hidden = !data.marks.length;
    const items = data.marks.map(([s, kind, text, severity]) => {
      const item = element("li", kind === "guard" || (severity != null && severity <= 3) ? "grave" : severity === 4 ? "warning" : "");
      item.append(element("span", "", clockTime(s, 2)), element("span", "", kind), element("b", "", text));
      item.title = utc(s);
      item.addEventListener("click", () => {
        const half = (view[1] - view[0]) / 2;
        if (s < view[0] || s > view[1]) setView(s - half, s + half);
        // uPlot takes a new scale at the end of this task.
        requestAnimationFrame(() => charts[0]?.setCursor({ left: charts[0].valToPos(s, "x"), top: 10 }));
      });
      list.append(item);
      return item;
    });
    const count = box.querySelector(".count");
    count.textContent = String(items.length);
    box.querySelector("input").addEventListener("input", (event) => {
      const wanted = event.target.value.toLowerCase();
      items.forEach((item) => { item.hidden = !item.textContent.toLowerCase().includes(wanted); });
      count.textContent = String(items.filter((item) => !item.hidden).length);
    });
    let now = null;
    return {
      follow(seconds) {
        let index = -1;
        if (seconds != null) while (index + 1 < data.marks.length && data.marks[index + 1][0] <= seconds) index++;
        if (items[index] === now) return;
        now?.classList.remove("now");
        now = items[index];
        if (!now) return;
        now.classList.add("now");
        const top = now.offsetTop, { scrollTop, clientHeight } = list;
        if (top < scrollTop || top > scrollTop + clientHeight - 24) list.scrollTop = top - clientHeight / 2;
      },
    };
  })();

  // ---------------------------------------------------------------- the whole

  function width() {
    return Math.max(document.getElementById("panels").clientWidth, 240);
  }

  function addPaths() {
    const tracks = data.tracks.map((track) => ({
      ...track, times: tables[track.table].times, points: track.columns.map((column) => tables[track.table].columns[column]),
    }));
    document.querySelector(".nowhere").hidden = tracks.length > 0;
    for (const figure of document.querySelectorAll("[data-path]")) {
      if (!tracks.length) continue;
      figure.hidden = false;
      const legend = figure.querySelector(".legend");
      tracks.forEach((track) => legend.append(swatch(track), `${track.name} \u2002`));
      const path = new PathView(figure.querySelector("canvas"), tracks, figure.dataset.path === "above", colour, redrawPaths);
      figure.querySelector("[data-act]").addEventListener("click", () => path.reset());
      paths.push(path);
    }
  }

  function begin() {
    const remarks = document.getElementById("remarks");
    data.remarks.forEach((remark) => remarks.append(element("li", "", remark)));
    remarks.hidden = !data.remarks.length;
    setTheme(prefersDark.matches ? "dark" : "light");
    prefersDark.addEventListener("change", () => setTheme(prefersDark.matches ? "dark" : "light"));
    document.getElementById("theme").addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
    addPaths();
    addLanes();
    data.panels.forEach((panel, i) => addPanel(panel, i === data.panels.length - 1));
    document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", ACTIONS[button.dataset.view]));
    addEventListener("keydown", (event) => {
      if (event.target.matches?.("input") || event.ctrlKey || event.metaKey || event.altKey) return;
      ({ "+": ACTIONS.in, "=": ACTIONS.in, "-": ACTIONS.out, 0: ACTIONS.all, ArrowLeft: ACTIONS.back, ArrowRight: ACTIONS.on })[event.key]?.();
    });
    new ResizeObserver(() => {
      charts.forEach((chart) => { if (chart.width !== width()) chart.setSize({ width: width(), height: chart.height }); });
      redrawPaths();
    }).observe(document.getElementById("panels"));
    setView(...data.view_s);
    root.dataset.panels = String(data.panels.length);
    root.dataset.ready = "yes";
    window.report = { charts, setView, view: () => view };  // for whoever opens the console
  }

  begin();
})();
