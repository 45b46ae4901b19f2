// Draws every plot of #plots-data into the element that asks for it by name.
(function () {
  "use strict";
  const element = document.getElementById("plots-data");
  const described = JSON.parse(element.textContent);
  const watcher = new ResizeObserver((entries) => {
    for (const { target, contentRect } of entries)
      if (contentRect.width && target._fullLayout && Math.abs(target._fullLayout.width - contentRect.width) > 1)
        Plotly.relayout(target, { width: contentRect.width });
  });
  for (const place of document.querySelectorAll("[data-plot]")) {
    const plot = described[place.dataset.plot];
    if (!plot) { place.closest("figure").remove(); continue; }
    // a finger scrolls the page; a mouse may zoom
    plot.layout.dragmode = matchMedia("(pointer: fine)").matches ? "zoom" : false;
    place.style.minHeight = plot.layout.height + "px";
    Plotly.newPlot(place, plot.data, plot.layout, { displayModeBar: false, scrollZoom: false });
    watcher.observe(place);
  }
  document.body.dataset.plots = "ready";
})();
