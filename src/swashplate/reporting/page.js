"use strict";
(function () {
  // A finger that scrolls the page must not zoom a plot on its way.
  var touch = window.matchMedia("(pointer: coarse)").matches;
  var specs = Array.prototype.slice.call(document.querySelectorAll("script.spec"));
  var config = { responsive: true, displaylogo: false, scrollZoom: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };

  function draw(spec) {
    var figure = JSON.parse(spec.textContent);
    if (touch) { figure.layout.dragmode = false; }
    return Plotly.newPlot(spec.dataset.for, figure.data, figure.layout, config);
  }

  // One plot at a time, so that the words can be read and scrolled while the plots appear.
  function next() {
    var spec = specs.shift();
    if (!spec) { document.documentElement.dataset.drawn = "all"; return; }
    draw(spec).then(function () { window.setTimeout(next, 0); });
  }
  next();

  // Links lead into folded sections; paper shows everything, at the width of the paper.
  function unfold() {
    var target = document.getElementById(decodeURIComponent(window.location.hash.slice(1)));
    var folded = target && (target.closest("details") || target.querySelector("details"));
    if (folded && !folded.open) { folded.open = true; target.scrollIntoView(); }
  }
  window.addEventListener("hashchange", unfold);
  unfold();

  var opened = [];
  function size(width) {
    document.querySelectorAll(".canvas.js-plotly-plot").forEach(function (plot) {
      if (width) { Plotly.relayout(plot, { width: width }); } else { Plotly.relayout(plot, { width: null, autosize: true }); }
    });
  }
  window.addEventListener("beforeprint", function () {
    opened = Array.prototype.filter.call(document.querySelectorAll("details"), function (d) { return !d.open; });
    opened.forEach(function (d) { d.open = true; });
    size(660);
  });
  window.addEventListener("afterprint", function () {
    opened.forEach(function (d) { d.open = false; });
    size(0);
  });
})();
