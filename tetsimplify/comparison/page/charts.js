// The charts, drawn by plotly.js, and how each method looks in all of them.

const PEER_COLOURS = ["#8a8a8a", "#e69f00", "#009e73", "#cc79a7", "#8c6bb1", "#999933", "#b5606d", "#44aa99", "#8c5a3c"];
const SYMBOLS = ["circle", "square", "diamond", "triangle-up", "triangle-down", "pentagon", "star", "hexagon"];
const DASHES = ["solid", "dash", "dot", "dashdot"];
const LEAST = 0.5; // edges, where bars on a logarithmic axis begin

const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// plotly reads some markup in labels.
const asLabel = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");

/** One colour a package, one dash and one symbol a method; ours stands out. */
function stylesOf(methods) {
  const family = (method) => (method.isOurs ? "" : method.package);
  const families = [...new Set(methods.map(family))].filter((name) => name !== "");
  const seen = {};
  return methods.map((method, k) => {
    const name = family(method), nth = (seen[name] = (seen[name] ?? -1) + 1);
    const colour = method.isOurs
      ? colourOf("--ours")
      : PEER_COLOURS[families.indexOf(name) % PEER_COLOURS.length];
    return {
      colour, dash: DASHES[nth % DASHES.length], symbol: SYMBOLS[k % SYMBOLS.length],
      width: method.isOurs && nth === 0 ? 3 : 1.6,
    };
  });
}

/** A label broken between words into lines of about so many letters. */
function inLines(title, n) {
  const lines = [""];
  for (const word of title.split(" ")) {
    const last = lines.length - 1;
    if (lines[last] && lines[last].length + word.length >= n) lines.push(word);
    else lines[last] += (lines[last] && " ") + word;
  }
  return lines.map(asLabel).join("<br>");
}

function layoutOf(height, changes) {
  const axis = {
    gridcolor: colourOf("--grid"), linecolor: colourOf("--line"), zeroline: false, ticks: "outside",
    tickcolor: colourOf("--line"), ticklen: 4, fixedrange: true, automargin: true,
  };
  return {
    height, autosize: true, showlegend: false, margin: { l: 10, r: 12, t: 8, b: 10 },
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: "closest",
    font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: colourOf("--ink") },
    hoverlabel: { align: "left", bgcolor: colourOf("--card"), font: { color: colourOf("--ink") } },
    ...changes,
    xaxis: { ...axis, ...changes.xaxis }, yaxis: { ...axis, ...changes.yaxis },
  };
}

function draw(element, traces, layout) {
  return Plotly.react(element, traces, layout, { displayModeBar: false, responsive: true });
}

/** Error against faces, both logarithmic, a line for each method. */
function drawErrors(element, data, input, error, styles, hidden, choose) {
  const traces = data.methods.map((method, m) => {
    const runs = data.runs
      .filter((r) => r.method === m && r.input === input && r.nFaces && r.error && r.error[error] > 0)
      .sort((a, b) => a.nFaces - b.nFaces);
    const { colour, dash, symbol, width } = styles[m];
    return {
      x: runs.map((r) => r.nFaces), y: runs.map((r) => r.error[error]), visible: !hidden.has(m) && runs.length > 0,
      customdata: runs.map((r) => r.number), mode: "lines+markers", line: { color: colour, dash, width },
      marker: {
        symbol: runs.map((r) => symbol + (r.isKept ? "" : "-open")), size: method.isOurs ? 9 : 8, color: colour,
        line: { width: 1.6, color: colour },
      },
      text: runs.map((r) => asLabel(`${method.title}, ${r.criterion}`)),
      hovertemplate: "%{text}<br>%{x:,} faces<br>%{y:.3~g} of the diagonal<extra></extra>",
    };
  });
  const shownErrors = traces.flatMap(({ visible, y }) => (visible ? y : []));
  const isTall = Math.max(...shownErrors) > 20 * Math.min(...shownErrors);
  const logarithmic = { type: "log", exponentformat: "power", minor: { ticks: "outside", ticklen: 2, tickcolor: colourOf("--line") } };
  const shown = draw(element, traces.reverse(), layoutOf(340, {
    xaxis: { ...logarithmic, title: { text: "faces" }, tickformat: "~s", dtick: "D2" },
    yaxis: { ...logarithmic, title: { text: "error / diagonal" }, dtick: isTall ? 1 : "D2" },
  }));
  shown.then(() => {
    element.removeAllListeners("plotly_click");
    element.on("plotly_click", (event) => choose(event.points[0].customdata));
  });
}

/** The distribution of 2r/R of one run, with that of ours as a line. */
function drawQuality(element, run, ours, style) {
  const sharesOf = ({ counts }) => counts.map((n) => n / Math.max(counts.reduce((a, b) => a + b, 0), 1));
  const { edges } = run.histogram;
  const shares = sharesOf(run.histogram);
  const traces = [{
    type: "bar", x: edges.slice(0, -1).map((low, k) => (low + edges[k + 1]) / 2), y: shares,
    width: edges.slice(0, -1).map((low, k) => edges[k + 1] - low), customdata: run.histogram.counts,
    marker: { color: style.colour, opacity: 0.75, line: { width: 0 } },
    hovertemplate: "2r/R about %{x:.2f}<br>%{customdata:,} faces, %{y:.1%}<extra></extra>",
  }];
  if (ours && ours !== run) {
    traces.push({
      x: ours.histogram.edges, y: [...sharesOf(ours.histogram), 0], mode: "lines", hoverinfo: "skip",
      line: { shape: "hv", width: 1.4, color: colourOf("--ours") },
    });
  }
  const highest = Math.max(...shares, ...(ours ? sharesOf(ours.histogram) : []));
  draw(element, traces, layoutOf(130, {
    margin: { l: 6, r: 6, t: 4, b: 22 }, bargap: 0,
    xaxis: { range: [0, 1], tickvals: [0, 0.5, 1], showgrid: false },
    yaxis: { range: [0, highest * 1.05], showticklabels: false, ticks: "", showgrid: false, automargin: false },
  }));
}

/** How many edges have 1, 2, 3, 4 or more faces, a group of bars for each run. */
function drawDegrees(element, runs, titles) {
  const kinds = [
    ["two faces", (d) => d === 2, colourOf("--line"), ""],
    ["one face", (d) => d === 1, "#56b4e9", ""],
    ["three faces", (d) => d === 3, "#e69f00", "/"],
    ["four faces", (d) => d === 4, "#d55e00", ""],
    ["five or more", (d) => d > 4, "#aa4499", "x"],
  ];
  const countOf = (run, isOne) => Object.entries(run.degrees)
    .reduce((sum, [degree, n]) => sum + (isOne(Number(degree)) ? n : 0), 0);
  const bars = [], ticks = [], isNarrow = element.clientWidth < 600;
  const labels = titles.map((title) => inLines(title, isNarrow ? 16 : 60));
  let height = 0;
  runs.forEach((run, r) => {
    const present = kinds.map((kind, k) => ({ k, r, n: countOf(run, kind[1]) })).filter(({ n }) => n);
    const rows = Math.max(present.length, 0.95 * labels[r].split("<br>").length);
    ticks.push(height + (rows - 1) / 2);
    present.forEach((bar, k) => bars.push({ ...bar, y: height + (rows - present.length) / 2 + k }));
    height += rows + 0.7;
  });
  const traces = kinds.map(([name, , color, shape], k) => {
    const drawn = bars.filter((bar) => bar.k === k), counts = drawn.map(({ n }) => n.toLocaleString("en"));
    return {
      type: "bar", orientation: "h", name, y: drawn.map(({ y }) => y), x: drawn.map(({ n }) => n - LEAST),
      base: LEAST, width: 0.86, text: counts, textposition: "outside", cliponaxis: false, visible: drawn.length > 0,
      marker: { color, pattern: { shape, fillmode: "overlay", fgcolor: colourOf("--paper"), size: 5 } },
      hovertemplate: drawn.map(({ r }, i) => `${asLabel(titles[r])}<br>${counts[i]} edges of ${name}<extra></extra>`),
    };
  });
  const most = Math.max(10, ...bars.map(({ n }) => n));
  draw(element, traces, layoutOf(100 + 17 * height, {
    showlegend: true, legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom", traceorder: "normal", itemclick: false },
    margin: { l: 10, r: 60, t: 40, b: 45 }, barmode: "overlay",
    xaxis: { type: "log", range: [Math.log10(LEAST), Math.log10(most * 1.5)], dtick: 1, exponentformat: "power", title: { text: "edges" } },
    yaxis: { tickvals: ticks, ticktext: labels, range: [height - 0.7, -0.7], ticks: "", showgrid: false },
  }));
}
