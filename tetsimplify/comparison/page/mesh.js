// Decodes the meshes of the page; embedding.py is the inverse.

/** Levels are places in the box from `low` to `high`, 0 to 65535, three a vertex. */
async function decodeMesh(embedded) {
  const packed = Uint8Array.from(atob(embedded.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const n = embedded.n_vertices, nCorners = 3 * embedded.n_faces;

  const levels = new Uint16Array(3 * n);
  for (let axis = 0; axis < 3; axis++) {
    for (let v = 0, level = 0; v < n; v++) {
      const at = axis * n + v;
      level = (level + bytes[at] + 256 * bytes[3 * n + at]) & 65535;
      levels[3 * v + axis] = level;
    }
  }
  const faces = new Uint32Array(nCorners), start = 6 * n;
  for (let corner = 0, newest = 0; corner < nCorners; corner++) {
    let behind = 0;
    for (let k = 3; k >= 0; k--) behind = 256 * behind + bytes[start + k * nCorners + corner];
    faces[corner] = newest - behind;
    if (behind === 0) newest++;
  }
  return { levels, faces, low: embedded.low, high: embedded.high, markedEdges: embedded.marked_edges };
}

/** A point of the box in the units of the mesh. */
function pointAt(mesh, level) {
  return level.map((step, axis) => mesh.low[axis] + ((mesh.high[axis] - mesh.low[axis]) * step) / 65535);
}

/**
 * Which faces lie at which marked edges.
 * @returns {{degrees: Uint16Array, isMarked: Uint8Array}} number of faces at each marked edge; of
 *   each face, whether it lies at one
 */
function facesAtMarkedEdges(mesh) {
  const key = (x, y, z) => (x * 65536 + y) * 65536 + z;
  const ends = new Map(), edgeOf = new Map();
  const endOf = (level) => {
    const at = key(...level);
    if (!ends.has(at)) ends.set(at, ends.size + 1);
    return ends.get(at);
  };
  const pair = (a, b) => Math.min(a, b) * 65536 + Math.max(a, b);
  mesh.markedEdges.forEach((edge, e) => edgeOf.set(pair(endOf(edge.slice(0, 3)), endOf(edge.slice(3))), e));

  const { levels, faces } = mesh;
  const end = new Uint16Array(levels.length / 3);
  for (let v = 0; v < end.length; v++) {
    end[v] = ends.get(key(levels[3 * v], levels[3 * v + 1], levels[3 * v + 2])) || 0;
  }
  const degrees = new Uint16Array(mesh.markedEdges.length), isMarked = new Uint8Array(faces.length / 3);
  for (let f = 0; f < isMarked.length; f++) {
    for (let k = 0; k < 3; k++) {
      const a = end[faces[3 * f + k]], b = end[faces[3 * f + ((k + 1) % 3)]];
      const e = a && b ? edgeOf.get(pair(a, b)) : undefined;
      if (e !== undefined) { degrees[e]++; isMarked[f] = 1; }
    }
  }
  return { degrees, isMarked };
}
