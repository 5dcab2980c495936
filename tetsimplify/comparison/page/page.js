// Joins the parts: the case that is chosen, the tables, the charts and the views.

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const find = (selector) => document.querySelector(selector);
const data = JSON.parse(find("#comparison").textContent);
const hidden = new Set();
let chosenCase = data.firstCase, styles = [], panels = [], errorKind = "mean";

data.resultOf = (value) => data.results[value];
data.sceneOf = (input) => {
  const { middle, radius } = data.inputs[input];
  return { toScene: (point) => point.map((x, axis) => (x - middle[axis]) / radius) };
};

const runsOfCase = () => data.runs.filter((run) => run.case === chosenCase);
const shownRuns = () => runsOfCase().filter((run) => run.nFaces && !hidden.has(run.method));

// --- charts

function setStyles() {
  styles = stylesOf(data.methods);
  document.querySelectorAll(".swatch").forEach((swatch) => {
    const m = data.methods.findIndex((method) => method.key === swatch.dataset.method);
    swatch.style.background = styles[m].colour;
  });
  drawLegend();
}

function drawLegend() {
  find(".legend").replaceChildren(...data.methods.map((method, m) => {
    const button = element("button", { type: "button", "aria-pressed": !hidden.has(m) });
    const { colour, dash, width } = styles[m], gaps = { solid: "", dash: "5 3", dot: "1.5 2.5", dashdot: "6 2 1.5 2" };
    button.innerHTML = `<svg width="22" height="8" aria-hidden="true"><path d="M0 4H22" stroke="${colour}"
      stroke-width="${width + 0.6}" stroke-dasharray="${gaps[dash]}"/></svg>`;
    button.append(method.title);
    button.addEventListener("click", () => {
      if (!hidden.delete(m)) hidden.add(m);
      button.setAttribute("aria-pressed", !hidden.has(m));
      drawErrorCharts();
      drawCaseCharts();
    });
    return button;
  }));
}

function drawErrorCharts() {
  const place = find("#error-charts");
  if (!place.children.length) {
    place.append(...data.inputs.map(({ name }) => element("div", {}, element("h3", {}, name),
      element("div", { role: "img", "aria-label": `Error against faces, ${name}` }))));
  }
  [...place.children].forEach((holder, i) => {
    drawErrors(holder.lastChild, data, i, errorKind, styles, hidden, showRun);
  });
}

function drawCaseCharts() {
  const runs = shownRuns(), { title } = data.cases[chosenCase];
  document.querySelectorAll("h2 .case").forEach((place) => { place.textContent = title; });
  const titles = runs.map((run) => data.methods[run.method].title);
  const ours = runsOfCase().find((run) => run.histogram && data.methods[run.method].isOurs);
  const place = find("#quality-charts"), drawn = runs.filter((run) => run.histogram);
  while (place.children.length < drawn.length) {
    place.append(element("div", {}, element("h3"), element("div", { role: "img" })));
  }
  [...place.children].forEach((holder, k) => {
    const run = drawn[k], [heading, chart] = holder.children;
    holder.hidden = !run;
    if (!run) return;
    const { title } = data.methods[run.method];
    heading.replaceChildren(`${title} `, element("small", {}, `mean ${run.meanRatio}`));
    chart.setAttribute("aria-label", `Quality of ${title}, mean ${run.meanRatio}`);
    drawQuality(chart, run, ours, styles[run.method]);
  });
  drawDegrees(find("#degree-chart"), runs, titles);
}

// --- what is chosen

function chooseCase(number) {
  chosenCase = number;
  const { input, criterion } = data.cases[number];
  find("#input").value = input;
  find("#criterion").replaceChildren(...data.cases
    .map((entry, k) => ({ ...entry, k }))
    .filter((entry) => entry.input === input)
    .map((entry) => element("option", { value: entry.k }, entry.criterion)));
  find("#criterion").value = number;
  document.querySelectorAll(".figures tbody").forEach((group) => {
    group.classList.toggle("aside", Number(group.dataset.case) !== number && !find("#all-cases").checked);
  });
  drawCaseCharts();
  offerResults();
}

/** On the left ours or the input; on the right a result with violations, if there is one. */
function offerResults() {
  const runs = runsOfCase(), { input } = data.cases[chosenCase], given = `input-${input}`;
  const choices = [{ value: given, text: "the input" }, ...runs.map((run) => ({
    value: `run-${run.number}`, isOff: !data.resultOf(`run-${run.number}`),
    text: `${run.nFaces ? (run.isKept ? "✓" : "✗") : "–"} ${data.methods[run.method].title}`,
  }))];
  const there = (run) => run && data.resultOf(`run-${run.number}`);
  const kept = runs.find((run) => there(run) && data.methods[run.method].isOurs && run.isKept);
  const broken = runs.find((run) => there(run) && run.nViolating && data.methods[run.method].isPeer)
    || runs.find((run) => there(run) && run.nViolating) || runs.find((run) => there(run) && run !== kept);
  [kept, broken].forEach((run, k) => panels[k]?.offer(choices, run ? `run-${run.number}` : given));
}

async function showRun(number) {
  const run = data.runs[number];
  if (run.case !== chosenCase) chooseCase(run.case);
  if (!data.resultOf(`run-${number}`) || !panels.length) return;
  const panel = panels[data.methods[run.method].isOurs ? 0 : 1];
  await panel.choose(`run-${number}`);
  find("#view").scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
}

// --- tables

function sortFigures(column, head) {
  const heads = [...head.parentElement.children], wasUp = head.getAttribute("aria-sort") === "ascending";
  heads.forEach((other) => other.removeAttribute("aria-sort"));
  head.setAttribute("aria-sort", wasUp ? "descending" : "ascending");
  const sign = wasUp ? -1 : 1;
  const valueOf = (row) => {
    if (column === 0) return Number(row.dataset.run);
    const value = row.children[column]?.dataset.sort;
    return value === undefined ? NaN : Number(value);
  };
  document.querySelectorAll(".figures tbody").forEach((group) => {
    const rows = [...group.querySelectorAll("tr[data-run]")];
    const isLast = (row) => Number.isNaN(valueOf(row));
    rows.sort((a, b) => isLast(a) - isLast(b) || sign * (valueOf(a) - valueOf(b)) || a.dataset.run - b.dataset.run);
    group.append(...rows);
  });
}

function startTables() {
  document.querySelectorAll(".figures thead th").forEach((head, column) => {
    head.querySelector("button").addEventListener("click", () => sortFigures(column, head));
  });
  document.querySelectorAll(".figures tr[data-run]").forEach((row) => {
    row.classList.toggle("ours", data.methods[data.runs[row.dataset.run].method].isOurs);
  });
  document.querySelectorAll(".verdicts button").forEach((button) => {
    button.addEventListener("click", () => showRun(Number(button.dataset.run)));
  });
  find("#all-cases").addEventListener("change", () => chooseCase(chosenCase));
  find("#all-columns").addEventListener("change", (event) => {
    find(".figures").classList.toggle("wide", event.target.checked);
  });
}

// --- views

function startViews() {
  let isWaiting = false;
  const changed = () => {
    if (isWaiting) return;
    isWaiting = true;
    requestAnimationFrame(() => {
      isWaiting = false;
      panels.forEach((panel) => panel.draw(find("#edges").checked));
    });
  };
  const camera = new Camera();
  try {
    panels = ["left", "right"].map((name) => new Panel(data, camera, name, changed));
  } catch (error) {
    find("#view .unavailable").append(` (${error.message})`);
    return;
  }
  document.body.classList.add("views-work");
  find(".panels").append(...panels.map((panel) => panel.figure));
  find("#edges").addEventListener("change", changed);
  find("#linked").addEventListener("change", (event) => {
    panels[1].camera = event.target.checked ? panels[0].camera : panels[0].camera.copy();
    changed();
  });
  find("#whole").addEventListener("click", () => {
    panels.forEach((panel) => panel.camera.showAll());
    changed();
  });
}

// --- beginning

find("#input").append(...data.inputs.map((input, k) => element("option", { value: k }, input.name)));
find("#input").addEventListener("change", (event) => {
  const wanted = Number(event.target.value), { criterion } = data.cases[chosenCase];
  const there = data.cases.map((entry, k) => k).filter((k) => data.cases[k].input === wanted);
  chooseCase(there.find((k) => data.cases[k].criterion === criterion) ?? there[0]);
  panels.forEach((panel) => panel.camera.showAll());
});
find("#criterion").addEventListener("change", (event) => chooseCase(Number(event.target.value)));
find(".bar").addEventListener("submit", (event) => event.preventDefault());
document.querySelectorAll("[name=error]").forEach((choice) => choice.addEventListener("change", () => {
  errorKind = choice.value;
  drawErrorCharts();
}));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  setStyles();
  drawErrorCharts();
  drawCaseCharts();
});
startTables();
startViews();
setStyles();
drawErrorCharts();
chooseCase(chosenCase);
