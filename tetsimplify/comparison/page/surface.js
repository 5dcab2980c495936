// Draws a mesh and its violating edges with WebGL 2.
//
// Coordinates go to the graphics card as they are embedded, 16 bits each. A face is three vertices
// of its own, so that the fragment shader knows how far it is from the edges and can draw them.

const MESH_VERTEX = `#version 300 es
layout(location = 0) in vec4 level;  // 0 to 1 in the box, and whether the face is marked
uniform vec3 low, size;
uniform mat4 toEye, toScreen;
out vec3 eye, corner;
flat out float marked;
void main() {
  vec4 place = toEye * vec4(low + size * level.xyz, 1.0);
  int k = gl_VertexID % 3;
  corner = vec3(k == 0, k == 1, k == 2);
  eye = place.xyz;
  marked = level.w;
  gl_Position = toScreen * place;
}`;

const MESH_FRAGMENT = `#version 300 es
precision highp float;
in vec3 eye, corner;
flat in float marked;
uniform float edges;
out vec4 colour;
const vec3 OUTSIDE = vec3(0.83, 0.81, 0.77), INSIDE = vec3(0.42, 0.50, 0.60);
const vec3 MARK = vec3(1.0, 0.52, 0.16), INK = vec3(0.10, 0.13, 0.19);
float lit(vec3 normal, vec3 light, float strength) {
  vec3 towards = normalize(light);
  float gloss = pow(max(dot(normal, normalize(towards - normalize(eye))), 0.0), 30.0);
  return strength * (max((dot(normal, towards) + 0.25) / 1.25, 0.0) + 0.15 * gloss);
}
void main() {
  vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
  float light = 0.24 + lit(normal, vec3(-0.45, 0.65, 0.62), 0.72)
    + lit(normal, vec3(0.75, 0.10, 0.50), 0.24) + lit(normal, vec3(0.0, -0.7, 0.3), 0.10);
  vec3 base = gl_FrontFacing ? OUTSIDE : INSIDE;
  base = mix(base, MARK, 0.75 * marked) * light;
  vec3 across = fwidth(corner);
  vec3 away = smoothstep(across * 0.1, across * 1.1, corner);
  float line = 1.0 - min(min(away.x, away.y), away.z);
  float fade = 1.0 - smoothstep(0.04, 0.4, max(max(across.x, across.y), across.z));
  colour = vec4(mix(base, INK, 0.75 * line * fade * edges), 1.0);
}`;

// An edge is a strip of constant width on the screen; its ring is a square around its middle.
const MARK_VERTEX = `#version 300 es
layout(location = 0) in vec3 first;
layout(location = 1) in vec3 last;
uniform mat4 toEye, toScreen;
uniform vec2 screen;
uniform float width;
uniform bool isRing;
uniform int current;
out vec2 place;
flat out float radius;
const vec2 SQUARE[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(-1, 1), vec2(-1, 1), vec2(1, -1), vec2(1, 1));
void main() {
  float nearer = isRing ? 0.97 : 0.998;  // so that the surface does not cover what lies on it
  vec2 at = SQUARE[gl_VertexID];
  vec4 a = toScreen * vec4((toEye * vec4(first, 1.0)).xyz * nearer, 1.0);
  vec4 b = toScreen * vec4((toEye * vec4(last, 1.0)).xyz * nearer, 1.0);
  vec2 along = (b.xy / b.w - a.xy / a.w) * screen / 2.0;
  float apart = length(along);
  along = apart > 1e-4 ? along / apart : vec2(1.0, 0.0);
  radius = max((gl_InstanceID == current ? 2.0 : 1.0) * width, 0.75 * apart);
  vec4 here = isRing ? (a + b) / 2.0 : at.x < 0.0 ? a : b;
  place = isRing ? at * (radius + 2.0) : width / 2.0 * (at.x * along + at.y * vec2(-along.y, along.x));
  bool isBehind = a.w <= 0.0 || b.w <= 0.0;
  gl_Position = isBehind ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(here.xy + 2.0 * place / screen * here.w, here.zw);
}`;

const MARK_FRAGMENT = `#version 300 es
precision highp float;
in vec2 place;
flat in float radius;
uniform vec4 tint;
uniform bool isRing;
uniform float thickness;
out vec4 colour;
void main() {
  float cover = isRing ? 1.0 - smoothstep(thickness - 0.7, thickness + 0.7, abs(length(place) - radius + 1.0)) : 1.0;
  colour = vec4(tint.rgb, 1.0) * tint.a * cover;
}`;

const VIOLATION = [0.84, 0.20, 0.0], HALO = [1.0, 1.0, 1.0];

class Surface {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL 2");
    this.canvas = canvas;
    this.gl = gl;
    this.meshProgram = programOf(gl, MESH_VERTEX, MESH_FRAGMENT);
    this.markProgram = programOf(gl, MARK_VERTEX, MARK_FRAGMENT);
    this.meshBuffer = gl.createBuffer();
    this.markBuffer = gl.createBuffer();
    this.nCorners = this.nMarks = 0;
    this.current = -1;
  }

  /** `toScene` takes a point of the input to the scene; `edges` are in the scene. */
  show(mesh, isMarked, edges, toScene) {
    const { gl } = this, { levels, faces } = mesh;
    const corners = new Uint16Array(4 * faces.length);
    for (let c = 0; c < faces.length; c++) {
      corners.set(levels.subarray(3 * faces[c], 3 * faces[c] + 3), 4 * c);
      corners[4 * c + 3] = isMarked[Math.floor(c / 3)] ? 65535 : 0;
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.meshBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.markBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(edges.flat(2)), gl.STATIC_DRAW);
    this.low = toScene(mesh.low);
    this.size = along(toScene(mesh.high), -1, this.low);
    this.nCorners = faces.length;
    this.nMarks = edges.length;
    this.current = -1;
  }

  draw(camera, withEdges) {
    const { gl, canvas } = this, ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(Math.round(n * ratio), 1));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const matrices = camera.matrices(width / height);
    this.drawMesh(matrices, withEdges);
    if (this.nMarks) this.drawMarks(matrices, [width, height], ratio);
  }

  drawMesh({ toEye, toScreen }, withEdges) {
    const { gl } = this, set = uniformsOf(gl, this.meshProgram);
    gl.disable(gl.BLEND);
    gl.depthFunc(gl.LESS);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.meshBuffer);
    gl.enableVertexAttribArray(0);
    gl.disableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 4, gl.UNSIGNED_SHORT, true, 8, 0);
    gl.vertexAttribDivisor(0, 0);
    gl.uniformMatrix4fv(set("toEye"), false, toEye);
    gl.uniformMatrix4fv(set("toScreen"), false, toScreen);
    gl.uniform3fv(set("low"), this.low);
    gl.uniform3fv(set("size"), this.size);
    gl.uniform1f(set("edges"), withEdges ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, this.nCorners);
  }

  drawMarks({ toEye, toScreen }, screen, ratio) {
    const { gl } = this, set = uniformsOf(gl, this.markProgram);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.markBuffer);
    for (const k of [0, 1]) {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
      gl.vertexAttribDivisor(k, 1);
    }
    gl.uniformMatrix4fv(set("toEye"), false, toEye);
    gl.uniformMatrix4fv(set("toScreen"), false, toScreen);
    gl.uniform2fv(set("screen"), screen);
    gl.uniform1i(set("current"), this.current);
    const strokes = [
      { isRing: 1, width: 9, thickness: 2.2, tint: [...HALO, 0.75] },
      { isRing: 1, width: 9, thickness: 1.1, tint: [...VIOLATION, 1] },
      { isRing: 0, width: 6, thickness: 0, tint: [...HALO, 0.85] },
      { isRing: 0, width: 3.5, thickness: 0, tint: [...VIOLATION, 1] },
    ];
    for (const [depth, strength] of [[gl.GEQUAL, 0.4], [gl.LESS, 1]]) {
      gl.depthFunc(depth);
      for (const { isRing, width, thickness, tint } of strokes) {
        gl.uniform1i(set("isRing"), isRing);
        gl.uniform1f(set("width"), width * ratio);
        gl.uniform1f(set("thickness"), thickness * ratio);
        gl.uniform4f(set("tint"), tint[0], tint[1], tint[2], tint[3] * strength);
        gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, this.nMarks);
      }
    }
  }
}

function uniformsOf(gl, program) {
  gl.useProgram(program);
  return (name) => gl.getUniformLocation(program, name);
}

function programOf(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(gl.getProgramInfoLog(program) || "the shaders cannot be linked");
  }
  return program;
}
