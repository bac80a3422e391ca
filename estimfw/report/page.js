"use strict";
(function () {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const darkTwin = read("dark-twin");
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const narrow = window.matchMedia("(max-width: 32rem)");
  const charts = Array.from(document.querySelectorAll(".chart"));

  /* The same figure with other colours; packed arrays are left alone. */
  function recoloured(value) {
    if (typeof value === "string") return darkTwin[value] || value;
    if (Array.isArray(value)) return value.map(recoloured);
    if (value === null || typeof value !== "object" || "bdata" in value) return value;
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, recoloured(item)]));
  }

  function dressed(layout) {
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(name).trim();
    const rule = { gridcolor: colour("--rule"), zerolinecolor: colour("--rule"), linecolor: colour("--soft") };
    const result = {
      ...layout,
      autosize: true,
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: getComputedStyle(document.body).fontFamily, size: 12.5, color: colour("--ink") },
      hoverlabel: { bgcolor: colour("--raised"), bordercolor: colour("--rule"), font: { color: colour("--ink") } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("--soft"), activecolor: colour("--link"), orientation: "h" },
    };
    for (const key of Object.keys(layout)) {
      if (/^[xy]axis/.test(key)) result[key] = { ...rule, ...layout[key] };
    }
    if (narrow.matches) result.margin = { ...layout.margin, l: 66, r: 6 };
    return result;
  }

  function draw(element) {
    const figure = read(element.dataset.figure);
    const data = dark.matches ? recoloured(figure.data) : figure.data;
    const config = {
      responsive: true,
      displaylogo: false,
      scrollZoom: false,
      /* Named one by one: by default plotly.js offers a button that uploads the chart to its maker's cloud. */
      modeBarButtons: [["toImage"], ["zoom2d", "pan2d"], ["autoScale2d", "resetScale2d"]],
      showSendToCloud: false,
      plotlyServerURL: "",
      toImageButtonOptions: { format: "svg", filename: element.dataset.figure },
    };
    element.dataset.drawn = "yes";
    return Plotly.react(element, data, dressed(figure.layout), config);
  }

  /* A chart is drawn when it comes near the window, so that a long page opens at once. */
  const nearby = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      nearby.unobserve(entry.target);
      draw(entry.target);
    }
  }, { rootMargin: "800px 0px" });
  charts.forEach((element) => nearby.observe(element));

  dark.addEventListener("change", () => charts.filter((element) => element.dataset.drawn).forEach(draw));
  window.addEventListener("beforeprint", () => charts.filter((element) => !element.dataset.drawn).forEach(draw));

  const links = new Map(Array.from(document.querySelectorAll("nav a"), (link) => [link.hash.slice(1), link]));
  const reading = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      links.forEach((link) => link.classList.remove("here"));
      links.get(entry.target.id).classList.add("here");
    }
  }, { rootMargin: "-10% 0px -80% 0px" });
  document.querySelectorAll("main section[id]").forEach((section) => reading.observe(section));
})();
