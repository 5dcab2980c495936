// Two results side by side: what is chosen, what is told about it, and how one moves around.

/** A view of one result of the case that is chosen. */
class Panel {
  constructor(data, camera, name, changed) {
    Object.assign(this, { data, camera, changed, violations: [], mesh: null, request: 0 });
    this.figure = element("figure", { class: "panel" });
    this.choice = element("select", { "aria-label": `Result on the ${name}` });
    this.number = element("input", { type: "number", min: 1, "aria-label": "Number of the violation" });
    this.total = element("span");
    this.previous = element("button", { type: "button", "aria-label": "Previous violation" }, "‹");
    this.next = element("button", { type: "button", "aria-label": "Next violation" }, "›");
    this.stepper = element("span", { class: "stepper" }, "violation ", this.previous, this.number, this.total, this.next);
    this.canvas = element("canvas", { tabindex: 0, role: "application" });
    this.caption = element("figcaption", { "aria-live": "polite" });
    this.figure.append(element("div", {}, this.choice, this.stepper), this.canvas, this.caption);
    this.surface = new Surface(this.canvas);
    this.choice.addEventListener("change", () => this.load());
    this.previous.addEventListener("click", () => this.step(-1));
    this.next.addEventListener("click", () => this.step(1));
    this.number.addEventListener("change", () => this.jump(this.number.valueAsNumber - 1));
    listen(this);
    new ResizeObserver(() => this.changed()).observe(this.canvas);
  }

  /** Offer the results of a case. */
  offer(choices, chosen) {
    this.choice.replaceChildren(...choices.map(({ value, text, isOff }) => {
      const option = element("option", { value }, text);
      option.disabled = isOff;
      return option;
    }));
    this.choose(chosen);
  }

  choose(value) {
    this.choice.value = value;
    return this.load();
  }

  async load() {
    const request = ++this.request, result = this.data.resultOf(this.choice.value);
    const stored = document.getElementById(result.mesh);
    const mesh = await decodeMesh(JSON.parse(stored.textContent));
    if (request !== this.request) return;
    const { toScene } = this.data.sceneOf(result.input);
    const { degrees, isMarked } = facesAtMarkedEdges(mesh);
    const ends = (edge) => [pointAt(mesh, edge.slice(0, 3)), pointAt(mesh, edge.slice(3))].map(toScene);
    const edges = mesh.markedEdges.map(ends);
    Object.assign(this, { mesh, result, degrees, violations: edges });
    this.surface.show(mesh, isMarked, edges, toScene);
    this.faces = facesOf(mesh, toScene);
    this.edgeLength = Math.sqrt(((4 / Math.sqrt(3)) * this.faces.area) / Math.max(mesh.faces.length / 3, 1));
    this.stepper.hidden = !edges.length;
    this.number.value = "";
    this.number.max = edges.length;
    this.total.textContent = ` of ${edges.length.toLocaleString("en")}`;
    this.tell("");
    this.changed();
  }

  tell(more) {
    const about = this.result.about + (this.result.part ? ` ${this.result.part}` : "");
    this.caption.textContent = more ? `${about} ${more}` : about;
    this.canvas.setAttribute("aria-label", `${this.choice.selectedOptions[0].text}. ${this.caption.textContent}`);
  }

  step(by) {
    const n = this.violations.length;
    if (n) this.jump(this.surface.current < 0 ? (by > 0 ? 0 : n - 1) : (this.surface.current + by + n) % n);
  }

  /** Look at a violation from where the least is in the way. */
  jump(k) {
    const edge = this.violations[k];
    if (!edge) return;
    const middle = along(along([0, 0, 0], 0.5, edge[0]), 0.5, edge[1]);
    const extent = length(along(edge[1], -1, edge[0]));
    this.surface.current = k;
    this.number.value = k + 1;
    this.camera.target = middle;
    this.camera.distance = Math.max(5 * this.edgeLength, 2.5 * extent) / ANGLE;
    this.camera.lookFrom(this.freeDirection(middle, unit(along(edge[1], -1, edge[0]))), [0, 0, 1]);
    const degree = this.degrees[k];
    const told = degree && degree !== 2 ? `an edge of ${degree} face${degree > 1 ? "s" : ""}` : "an edge";
    const [a, b] = [this.mesh.markedEdges[k].slice(0, 3), this.mesh.markedEdges[k].slice(3)];
    const at = pointAt(this.mesh, a.map((step, axis) => (step + b[axis]) / 2)).map((x) => x.toPrecision(4)).join(", ");
    this.tell(`Violation ${k + 1}: ${told} at (${at}).`);
    this.changed();
  }

  /** A direction with few faces between a point and the eye, in front of the surface and across an edge. */
  freeDirection(point, edge) {
    const { camera, faces: { middles, normals } } = this;
    const candidates = directions(96), inTheWay = candidates.map(() => 0), near = 2 * this.edgeLength;
    let normal = [0, 0, 0];
    for (let f = 0; f < middles.length; f += 3) {
      const to = [middles[f] - point[0], middles[f + 1] - point[1], middles[f + 2] - point[2]];
      const distance = length(to);
      if (distance < near) normal = along(normal, 1, normals.subarray(f, f + 3));
      if (distance < near / 4 || distance > camera.distance) continue;
      candidates.forEach((direction, k) => {
        if (dot(direction, to) > 0.97 * distance) inTheWay[k] += near / distance;
      });
    }
    const facing = unit(normal);
    const costs = candidates.map((direction, k) => inTheWay[k] + Math.abs(dot(direction, edge))
      - 2 * dot(direction, facing) - 0.3 * dot(direction, camera.towardsEye));
    return candidates[costs.indexOf(Math.min(...costs))];
  }

  draw(withEdges) {
    if (this.mesh) this.surface.draw(this.camera, withEdges);
  }
}

/** Directions all around, evenly, on a spiral. */
function directions(n) {
  return Array.from({ length: n }, (_, k) => {
    const z = 1 - (2 * k + 1) / n, turn = k * Math.PI * (3 - Math.sqrt(5));
    return [Math.sqrt(1 - z * z) * Math.cos(turn), Math.sqrt(1 - z * z) * Math.sin(turn), z];
  });
}

/** Middles of the faces, their normals of the length of twice their areas, and the area of all. */
function facesOf(mesh, toScene) {
  const low = toScene(mesh.low), size = along(toScene(mesh.high), -1, low), { levels, faces } = mesh;
  const corner = (c) => [0, 1, 2].map((axis) => low[axis] + (size[axis] * levels[3 * faces[c] + axis]) / 65535);
  const middles = new Float32Array(faces.length), normals = new Float32Array(faces.length);
  let area = 0;
  for (let c = 0; c < faces.length; c += 3) {
    const [p, q, r] = [corner(c), corner(c + 1), corner(c + 2)];
    const normal = cross(along(q, -1, p), along(r, -1, p));
    area += length(normal) / 2;
    for (let axis = 0; axis < 3; axis++) {
      middles[c + axis] = (p[axis] + q[axis] + r[axis]) / 3;
      normals[c + axis] = normal[axis];
    }
  }
  return { middles, normals, area };
}

/** Mouse, touch and keys of a panel. */
function listen(panel) {
  const { canvas } = panel, pointers = new Map();
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.hypot(a.x - b.x, a.y - b.y) };
  };
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(kind, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId), height = canvas.clientHeight;
    if (!last) return;
    const before = pointers.size > 1 ? spread() : last;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const after = pointers.size > 1 ? spread() : pointers.get(event.pointerId);
    const x = (after.x - before.x) / height, y = (after.y - before.y) / height;
    if (pointers.size > 1) panel.camera.zoom(before.size / Math.max(after.size, 1));
    if (pointers.size > 1 || event.shiftKey || event.buttons & 6) panel.camera.move(x, y);
    else panel.camera.turn(3 * x, 3 * y);
    panel.changed();
  });
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    panel.camera.zoom(Math.exp(Math.sign(event.deltaY) * 0.12));
    panel.changed();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const act = keys(panel, event.shiftKey)[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
    panel.changed();
  });
}

function keys(panel, isMoving) {
  const { camera } = panel;
  const by = (x, y) => () => (isMoving ? camera.move(0.06 * x, -0.06 * y) : camera.turn(0.12 * x, -0.12 * y));
  return {
    ArrowLeft: by(-1, 0), ArrowRight: by(1, 0), ArrowUp: by(0, 1), ArrowDown: by(0, -1),
    "+": () => camera.zoom(0.85), "=": () => camera.zoom(0.85), "-": () => camera.zoom(1 / 0.85),
    n: () => panel.step(1), p: () => panel.step(-1), 0: () => camera.showAll(),
  };
}
