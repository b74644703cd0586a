"use strict";
(function () {
  // A finger that scrolls the page must not zoom a plot on its way.
  var touch = window.matchMedia("(pointer: coarse)").matches;
  var config = { responsive: true, displaylogo: false, scrollZoom: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  var darkOf = JSON.parse(document.getElementById("dark-colours").textContent);
  var dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
  var unit = null; // the figures' own, until someone asks for another
  var drawing = false;

  var figures = [];

  // plotly.js and the figures' numbers are in the page in compressed form (packing.py says how).
  function unpacked(name) {
    var packed = atob(document.getElementById(name).textContent);
    var bytes = new Uint8Array(packed.length);
    for (var i = 0; i < packed.length; i += 1) { bytes[i] = packed.charCodeAt(i); }
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
  }

  function row(place, bytes) {
    var found = new Array(place.n), level = 0;
    for (var i = 0; i < place.n; i += 1) {
      level = (level + 256 * bytes[place.at + i] + bytes[place.at + place.n + i]) % 65536;
      found[i] = level === 65535 ? null : place.low + place.step * level;
    }
    return found;
  }

  async function unpack() {
    var whole = await unpacked("figures-gzip").arrayBuffer();
    var size = new DataView(whole).getUint32(0, true);
    var bytes = new Uint8Array(whole, 4 + size);
    figures = JSON.parse(new TextDecoder().decode(new Uint8Array(whole, 4, size)));
    figures.forEach(function (figure) {
      figure.data.forEach(function (trace) {
        ["x", "y"].forEach(function (side) {
          if (trace[side] && trace[side].step !== undefined) { trace[side] = row(trace[side], bytes); }
        });
      });
    });
    var script = document.createElement("script");
    script.textContent = await unpacked("plotly-gzip").text();
    document.head.append(script);
  }

  function recoloured(value) {
    if (typeof value === "string") { return darkOf[value] || value; }
    if (Array.isArray(value)) { return value.map(recoloured); }
    if (value && typeof value === "object") {
      var found = {};
      Object.keys(value).forEach(function (key) {
        found[key] = ["x", "y", "z", "text"].indexOf(key) < 0 ? recoloured(value[key]) : value[key];
      });
      return found;
    }
    return value;
  }

  // A figure over frequency says in which unit its numbers are; the other unit is a factor of two pi away.
  function inUnit(figure) {
    var own = (figure.layout.meta || {}).frequency;
    if (!own || !unit || unit === own) { return; }
    var factor = unit === "Hz" ? 1 / (2 * Math.PI) : 2 * Math.PI;
    figure.data.forEach(function (trace) {
      trace.x = trace.x.map(function (value) { return value === null ? null : factor * value; });
      if (trace.hovertemplate) { trace.hovertemplate = trace.hovertemplate.split(own).join(unit); }
    });
    Object.keys(figure.layout).filter(function (key) { return key.startsWith("xaxis"); }).forEach(function (key) {
      var axis = figure.layout[key];
      if (axis.title) { axis.title.text = axis.title.text.split(own).join(unit); }
      if (axis.range && axis.type === "log") {
        axis.range = axis.range.map(function (end) { return end + Math.log10(factor); });
      }
    });
  }

  // Panels in rows of as many as a narrow screen has room for; theme.grid made them for a wide one.
  var PANEL = 150;
  function inRows(figure, place) {
    var told = (figure.layout.meta || {}).grid, layout = figure.layout;
    var columns = told && Math.max(1, Math.floor(place.parentElement.clientWidth / PANEL));
    if (!told || columns >= told.columns) { return; }
    var n = told.panels, rows = Math.ceil(n / columns), gap = Math.max(told.gap, 0.17);
    var wide = (1 - gap * (columns - 1)) / columns, high = (1 - 0.4 / rows * (rows - 1)) / rows;
    var words = { x: layout["xaxis" + (n > 1 ? n : "")].title, y: layout.yaxis.title };
    layout.height = told.height * rows + 56;
    for (var i = 0; i < n; i += 1) {
      var end = i ? i + 1 : "", left = (i % columns) * (wide + gap), row = Math.floor(i / columns);
      var top = 1 - row * (high + 0.4 / rows), x = layout["xaxis" + end], y = layout["yaxis" + end];
      x.domain = [left, Math.min(1, left + wide)];
      y.domain = [Math.max(0, top - high), top];
      x.title = i + columns >= n ? words.x : "";
      y.title = i % columns ? "" : words.y;
      layout.annotations[i].x = left;
      layout.annotations[i].y = top;
    }
    Object.assign(place.style, { height: layout.height + "px", minWidth: "0" });
  }

  function draw(entry) {
    var figure = structuredClone({ data: entry.data, layout: entry.layout });
    inRows(figure, document.getElementById(entry.name));
    if (touch) { figure.layout.dragmode = false; }
    inUnit(figure);
    if (dark) { figure = { data: recoloured(figure.data), layout: Object.assign(recoloured(figure.layout), { meta: figure.layout.meta }) }; }
    return Plotly.react(entry.name, figure.data, figure.layout, config);
  }

  function paint() {
    document.documentElement.dataset.look = dark ? "dark" : "light";
    document.querySelectorAll(".keys svg *").forEach(function (mark) {
      ["fill", "stroke"].forEach(function (side) {
        var own = mark.dataset[side] || mark.getAttribute(side);
        if (!own) { return; }
        mark.dataset[side] = own;
        mark.setAttribute(side, dark ? darkOf[own] || own : own);
      });
    });
    var look = document.getElementById("look");
    look.textContent = dark ? "Light" : "Dark";
    look.setAttribute("aria-pressed", String(dark));
  }

  // One plot at a time, so that the words can be read and scrolled while the plots appear.
  function drawAll() {
    drawing = true;
    document.documentElement.dataset.drawn = "";
    var waiting = figures.slice();
    return new Promise(function (done) {
      (function next() {
        var entry = waiting.shift();
        if (!entry) { drawing = false; document.documentElement.dataset.drawn = "all"; done(); return; }
        draw(entry).then(function () { window.setTimeout(next, 0); });
      })();
    });
  }

  paint();
  if (typeof DecompressionStream === "undefined") {
    document.getElementById("too-old").hidden = false;
  } else {
    unpack().then(drawAll);
  }

  document.getElementById("look").addEventListener("click", function () {
    if (drawing) { return; }
    dark = !dark;
    paint();
    drawAll();
  });
  var toggle = document.getElementById("unit");
  if (toggle) {
    toggle.addEventListener("click", function () {
      if (drawing) { return; }
      var first = figures.map(function (entry) { return (entry.layout.meta || {}).frequency; }).find(Boolean);
      unit = (unit || first) === "Hz" ? "rad/s" : "Hz";
      toggle.textContent = "frequency in " + unit;
      drawAll();
    });
  }

  // Links lead into folded sections; paper shows everything, in light colours, at the width of the paper.
  function unfold() {
    var target = document.getElementById(decodeURIComponent(window.location.hash.slice(1)));
    var folded = target && (target.closest("details") || target.querySelector("details"));
    if (folded && !folded.open) { folded.open = true; target.scrollIntoView(); }
  }
  window.addEventListener("hashchange", unfold);
  unfold();

  var opened = [], wasDark = false;
  function size(width) {
    document.querySelectorAll(".canvas.js-plotly-plot").forEach(function (plot) {
      if (width) { Plotly.relayout(plot, { width: width }); } else { Plotly.relayout(plot, { width: null, autosize: true }); }
    });
  }
  function inLight() {
    wasDark = dark;
    if (dark) { dark = false; paint(); figures.forEach(draw); }
  }
  window.addEventListener("beforeprint", function () {
    opened = Array.prototype.filter.call(document.querySelectorAll("details"), function (d) { return !d.open; });
    opened.forEach(function (d) { d.open = true; });
    inLight();
    size(660);
  });
  window.addEventListener("afterprint", function () {
    opened.forEach(function (d) { d.open = false; });
    if (wasDark) { dark = true; paint(); figures.forEach(draw); }
    size(0);
  });
})();
