"""The page of a comparison: what is in it, that it is safe and complete, and that it draws."""

from __future__ import annotations

import copy
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons import HOSTILE, decoded, small_comparison
from tetsimplify.comparison.page import embedding, wording, write_page
from tetsimplify.comparison.page.model import Comparison, case_of
from tetsimplify.errors import FileError, MissingExtraError, OptionError
from tetsimplify.mesh import Mesh

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


class Elements(HTMLParser):
    """All start tags with their attributes, and the text of scripts, cells and items."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.texts, self.open = [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.texts.append("")
        if tag not in {"meta", "link", "input", "br"}:
            self.open.append(len(self.tags) - 1)

    def handle_endtag(self, tag):
        while self.open and self.tags[self.open.pop()][0] != tag:
            pass

    def handle_data(self, data):
        for k in self.open:
            self.texts[k] += data

    def of(self, tag, **wanted):
        """Attributes and texts of the elements of a kind."""
        for (name, attributes), text in zip(self.tags, self.texts, strict=True):
            if name == tag and wanted.items() <= attributes.items():
                yield attributes, text


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    pytest.importorskip("plotly")
    folder = tmp_path_factory.mktemp("report")
    results = small_comparison(folder)
    path = write_page(results, folder)
    return folder, results, path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def elements(report):
    return Elements(report[2])


def embedded_in(elements, name):
    (_, text), *others = elements.of("script", id=name)
    assert not others
    return json.loads(text)


# --- complete and safe -----------------------------------------------------------------------


def test_nothing_is_loaded(report, elements):
    for _, attributes in elements.tags:
        for name in ("src", "href", "srcset", "data", "action"):
            assert attributes.get(name, "#").startswith(("#", "data:")), attributes
    (policy,) = (a["content"] for a, _ in elements.of("meta") if "http-equiv" in a)
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy
    (_, style), *_ = elements.of("style")
    assert "@import" not in style
    assert "url(" not in style
    plain = [text for a, text in elements.of("script") if "plotly.js v" not in text]
    assert len(plain) == len(list(elements.of("script"))) - 1
    assert not re.search(r"https?://|import\s*\(|fetch\(|XMLHttp", "".join(plain))


def test_hostile_names_are_text(report, elements):
    _, results, page = report
    n_meshes = sum("mesh" in entry for entry in results["inputs"] + results["runs"])
    assert len(list(elements.of("script"))) == n_meshes + 3
    assert not any(
        "alert" in text and "application/json" != a.get("type") for a, text in elements.of("script")
    )
    assert "<script>alert" not in page
    titles = [text for _, text in elements.of("th", scope="row")]
    assert f"title of {HOSTILE}" in titles
    assert any(HOSTILE in text for _, text in elements.of("title"))


def test_every_run_is_there(report, elements):
    _, results, _ = report
    runs = results["runs"]
    rows = {int(a["data-run"]): text for a, text in elements.of("tr") if "data-run" in a}
    assert sorted(rows) == list(range(len(runs)))
    buttons = {int(a["data-run"]): a for a, _ in elements.of("button") if "data-run" in a}
    for k, run in enumerate(runs):
        assert run["title"] in rows[k]
        assert (k in buttons) == ("mesh" in run)
        if "mesh" in run:
            assert buttons[k]["class"] == ("kept" if run["topology_kept"] else "broken")
            assert all(why in rows[k] for why in run["why_not"])
            assert f"{run['n_faces']:,}" in rows[k]
        else:
            assert run["status"] in rows[k]
            assert run["message"] in rows[k]
    data = embedded_in(elements, "comparison")
    assert [run["status"] for run in data["runs"]] == [run["status"] for run in runs]


def test_what_is_missing_is_named(elements):
    items = [text for _, text in elements.of("li")]
    assert any(HOSTILE in text and "pip install g" in text for text in items)
    (crashed,) = (text for text in items if "crashed" in text and ", ball at" in text)
    assert "50 % and 25 %" in crashed
    assert f"signal {HOSTILE}" in crashed
    assert any("not applicable" in text and "ε 0.3" in text for text in items)


def test_figures(report, elements):
    _, results, _ = report
    (_, row), *_ = elements.of("tr", **{"data-run": "1"})
    diagonal = results["inputs"][0]["diagonal"]
    assert wording.short(1e-3 / diagonal / 1e-5) in row
    assert "0.250 0.20 to 0.30" in row
    assert "4: 1" in row
    (_, lede), *_ = elements.of("p", **{"class": "lede"})
    assert lede.startswith("2 surfaces, 3 methods, 3 sizes: 13 runs.")
    assert "in every run by title of tetsimplify. The other 2 did not" in lede


def test_numbers_that_are_none_become_null(elements):
    for _, text in elements.of("script", type="application/json"):
        json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def test_the_same_results_give_the_same_bytes(report):
    folder, results, page = report
    before = copy.deepcopy(results)
    again = write_page(results, folder)
    assert again == folder / "index.html"
    assert again.read_text(encoding="utf-8") == page
    assert repr(results) == repr(before)


# --- meshes ----------------------------------------------------------------------------------


def test_meshes_decode(report, elements):
    folder, results, _ = report
    entries = [(f"input-{k}", entry) for k, entry in enumerate(results["inputs"])]
    entries += [(f"run-{k}", run) for k, run in enumerate(results["runs"]) if "mesh" in run]
    for key, entry in entries:
        given = np.load(folder / entry["mesh"])
        check_decoded(embedded_in(elements, f"mesh-{key}"), given["vertices"], given["faces"])


def check_decoded(embedded, vertices, faces):
    found, found_faces = decoded(embedded)
    used = vertices[np.unique(faces)]
    half_level = np.ptp(used, axis=0) / 65535 / 2
    error = np.abs(found[found_faces] - vertices[faces]).reshape(-1, 3).max(axis=0)
    assert (error <= half_level * (1 + 1e-6) + 1e-12 * np.abs(used).max()).all()
    assert len(found) == len(used)
    to_found = dict(zip(faces.ravel().tolist(), np.ravel(found_faces).tolist(), strict=True))
    assert len(to_found) == len(set(to_found.values())) == len(used)


def test_violating_edges_are_edges_of_the_embedded_mesh(report, elements):
    _, results, _ = report
    for k, run in enumerate(results["runs"]):
        if not run.get("violating_edges"):
            continue
        embedded = embedded_in(elements, f"mesh-run-{k}")
        vertices, faces = decoded(embedded)
        low, high = np.array(embedded["low"]), np.array(embedded["high"])
        for edge in embedded["marked_edges"]:
            ends = low + np.reshape(edge, (2, 3)) / 65535 * (high - low)
            a, b = (int(np.linalg.norm(vertices - end, axis=1).argmin()) for end in ends)
            np.testing.assert_allclose(vertices[[a, b]], ends, atol=1e-9)
            assert sum({a, b} <= set(face) for face in faces) == 4


@given(st.data())
def test_any_mesh_decodes(data):
    n = data.draw(st.integers(1, 40))
    corner = st.integers(0, n - 1)
    faces = data.draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=60))
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    scale = data.draw(st.sampled_from([0.0, 1e-6, 1.0, 1e6]))
    vertices = rng.uniform(-1, 1, (n, 3)) * [scale, 1, 0] + [0, 0, 1e3]
    mesh = Mesh(vertices, np.array(faces, np.int32))
    check_decoded(embedding.embedded(mesh), vertices, mesh.faces)


def test_a_mesh_without_faces():
    embedded = embedding.embedded(Mesh(np.ones((3, 3)), np.zeros((0, 3), np.int32)))
    assert decoded(embedded)[1] == []


@pytest.mark.parametrize(
    ("counts", "limit"),
    [
        ([], embedding.WHOLE_FACES),
        ([10, 10**9], embedding.WHOLE_FACES),
        ([embedding.PAGE_FACES // 20] * 20, embedding.WHOLE_FACES),
        ([embedding.PAGE_FACES // 20] * 21, 0),
        ([7, *[embedding.PAGE_FACES // 20] * 21], 7),
    ],
)
def test_how_many_faces_a_whole_mesh_has(counts, limit):
    assert embedding.whole_limit(counts) == limit


def strip(n):
    """A strip of faces along x."""
    vertices = np.array([[k / 2, k % 2, 0.0] for k in range(n + 2)])
    return Mesh(vertices, np.array([[k, k + 1, k + 2] for k in range(n)], np.int32))


def test_places_and_patches(monkeypatch):
    monkeypatch.setattr(embedding, "PATCH_FACES", 6)
    mesh = strip(400)
    edges = np.array([[20.0, 0, 0, 21, 0, 0], [20.1, 0, 0, 21, 0, 0], [90, 0, 0, 91, 0, 0]])
    places = embedding.places_of([edges[:0], edges, edges[2:]], mesh.vertices)
    assert places.tolist() == [[20.5, 0, 0], [90.5, 0, 0]]
    patch = embedding.patches(mesh, places)
    middles = mesh.vertices[patch.faces][:, :, 0].mean(axis=1)
    assert len(patch.faces) == 12
    assert np.abs(middles[:, None] - places[:, 0]).min(axis=1).max() < 2
    everywhere = embedding.places_of([edges[:0]], mesh.vertices)
    assert everywhere.shape == (1, 3)
    assert abs(everywhere[0, 0] - 100) <= 1


def test_large_meshes_are_embedded_in_part(report, tmp_path, monkeypatch):
    folder, results, _ = report
    shutil.copytree(folder, tmp_path / "copy")
    monkeypatch.setattr(embedding, "WHOLE_FACES", 30)
    monkeypatch.setattr(embedding, "PATCH_FACES", 9)
    page = Elements(write_page(results, tmp_path / "copy").read_text(encoding="utf-8"))
    assert embedded_in(page, "mesh-input-0")["n_faces"] < results["inputs"][0]["n_faces"]
    run = embedded_in(page, "mesh-run-1")
    assert 9 <= run["n_faces"] < results["runs"][1]["n_faces"]
    told = [text for _, text in page.of("p") if "more than 30 faces" in text]
    assert len(told) == 1
    assert "with 9 faces each" in told[0]


def test_vertices_that_are_not_finite(tmp_path):
    pytest.importorskip("plotly")
    results = small_comparison(tmp_path)
    path = tmp_path / results["runs"][0]["mesh"]
    given = np.load(path)
    vertices, faces = given["vertices"], given["faces"]
    vertices[faces[0, 0]] = np.nan
    np.savez(path, vertices=vertices, faces=faces)
    page = Elements(write_page(results, tmp_path).read_text(encoding="utf-8"))
    rest = faces[(faces != faces[0, 0]).all(axis=1)]
    check_decoded(embedded_in(page, "mesh-run-0"), vertices, rest)


# --- the document ----------------------------------------------------------------------------


def test_who_is_compared_with(report):
    comparison = Comparison(report[1])
    case = case_of(comparison.runs[1])
    assert comparison.reference(case) is comparison.runs[0]
    slow = copy.deepcopy(report[1])
    slow["runs"][0]["topology_kept"] = False
    assert Comparison(slow).reference(case) is None
    slow["runs"][0] |= {"topology_kept": True, "method": "standard"}
    assert Comparison(slow).reference(case) is None


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda r: r.update(version=2), "version 1, got 2"),
        (lambda r: r.update(runs=[]), "a list of runs"),
        (lambda r: r["runs"][2].update(input="x"), "run 2 is of the input 'x'"),
        (lambda r: r["runs"][2].update(status="fine"), "run 2 has the status 'fine'"),
        (lambda r: r["runs"][3].pop("title"), "run 3 has no title"),
        (lambda r: r["inputs"][1].pop("mesh"), "input 1 has no mesh"),
    ],
)
def test_no_comparison(report, tmp_path, change, told):
    results = copy.deepcopy(report[1])
    change(results)
    with pytest.raises(OptionError, match=told):
        write_page(results, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_mesh_that_is_missing(report, tmp_path):
    with pytest.raises(FileError, match="there is no file"):
        write_page(report[1], tmp_path)
    assert not list(tmp_path.iterdir())


def test_without_plotly(report, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "plotly.offline", None)
    with pytest.raises(MissingExtraError, match=r"plotly: pip install .tetsimplify\[compare\]"):
        write_page(report[1], tmp_path)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (wording.whole(-1234567), f"{wording.MINUS}1,234,567"),
        (wording.whole(None), "—"),
        (wording.short(0.00012345), "0.000123"),
        (wording.short(1234.5), "1,234"),
        (wording.short(2.5e-9, 2), f"2.5e{wording.MINUS}09"),
        (wording.short(float("nan")), "—"),
        (wording.short(0), "0"),
        (wording.percent(0.15), "15 %"),
        (wording.criterion_name({"max_edge_length": 0.25}), "ε 0.25"),
        (wording.degrees({"1": 3, "2": 1000, "4": 1200}), "1: 3 · 4: 1,200"),
        (wording.degrees({"2": 9, "3": 0}), "all 2"),
        (wording.listing(["a", "b", "c"]), "a, b and c"),
        (wording.counted(1, "face"), "1 face"),
    ],
)
def test_wording(text, wanted):
    assert text == wanted


# --- in a browser ----------------------------------------------------------------------------

WATCH = """<script>
window.wrong = [];
addEventListener("error", (event) => wrong.push(event.message));
addEventListener("unhandledrejection", (event) => wrong.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) => wrong.push("loads " + event.blockedURI));
console.error = console.warn = (...words) => wrong.push(words.join(" "));
</script>"""

LOOK = """<script>
const pause = () => new Promise((resolve) => setTimeout(resolve, 300));
function coloursOf(canvas) {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let drawn = 0, marked = 0, strong = 0;
  for (let k = 0; k < data.length; k += 4) {
    drawn += data[k + 3] > 200;
    const [red, green, blue, opacity] = data.subarray(k, k + 4);
    marked += opacity > 200 && red > 1.3 * green && red > blue + 60;
    strong += opacity > 200 && red > 150 && green < 110 && blue < 60;
  }
  return { drawn: drawn / (data.length / 4), marked, strong };
}
(async () => {
  while (!panels.every((panel) => panel.mesh)) await pause();
  await pause();
  const look = () => panels.map((panel) => {
    panel.draw(true);  // a browser without a screen may never ask for a frame
    return coloursOf(panel.canvas);
  });
  const rows = () => [...document.querySelectorAll(".figures tbody:not(.aside) tr[data-run]")]
    .map((row) => row.dataset.run);
  const found = { wrong, first: look() };
  found.charts = document.querySelectorAll(".js-plotly-plot .main-svg").length;
  found.titles = panels.map((panel) => panel.choice.selectedOptions[0].text);
  found.degrees = panels.map((panel) => [...panel.degrees]);
  panels[1].next.click();
  await pause();
  found.close = look();
  found.told = panels[1].caption.textContent;
  found.shown = rows();
  document.querySelectorAll(".figures thead button")[4].click();
  document.querySelectorAll(".figures thead button")[4].click();
  found.sorted = rows();
  document.querySelector("#input").value = 1;
  document.querySelector("#input").dispatchEvent(new Event("change"));
  await pause();
  found.other = look();
  for (const k of data.cases.keys()) {
    chooseCase(k);
    await pause();
  }
  const outcome = document.createElement("pre");
  outcome.id = "outcome";
  outcome.textContent = JSON.stringify(found);
  document.body.append(outcome);
})();
</script>"""


def test_in_a_browser(report, tmp_path):
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        pytest.skip(f"needs a browser: none of {', '.join(BROWSERS)} is found")
    page = report[2].replace("<head>", f"<head>{WATCH}").replace("</body>", f"{LOOK}</body>")
    path = tmp_path / "watched.html"
    path.write_text(page, encoding="utf-8")
    options = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader"]
    options += ["--enable-unsafe-swiftshader", f"--user-data-dir={tmp_path / 'profile'}"]
    options += ["--window-size=1280,1000", "--virtual-time-budget=30000", "--dump-dom"]
    run = subprocess.run(
        [browser, *options, path.as_uri()], capture_output=True, encoding="utf-8", timeout=120
    )
    outcomes = list(Elements(run.stdout).of("pre", id="outcome"))
    assert outcomes, run.stderr[-2000:]
    found = json.loads(outcomes[0][1])
    assert found["wrong"] == []
    assert found["charts"] >= 2 + 2 + 1
    assert found["titles"] == ["✓ title of tetsimplify", "✗ title of finned"]
    assert found["degrees"] == [[], [4]]
    (ours, finned), (_, close) = found["first"], found["close"]
    assert 0.1 < ours["drawn"] < 0.9
    assert 0.1 < finned["drawn"] < 0.9
    assert ours["marked"] == 0
    assert finned["marked"] > 20
    assert close["strong"] > 100
    assert "Violation 1: an edge of 4 faces" in found["told"]
    assert len(found["shown"]) == 3
    assert sorted(found["sorted"]) == sorted(found["shown"])
    faces = [report[1]["runs"][int(k)].get("n_faces", -1) for k in found["sorted"]]
    assert faces == sorted(faces, reverse=True)
    assert all(panel["drawn"] > 0.1 for panel in found["other"])
