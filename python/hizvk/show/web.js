// Draws a cull's result on a canvas, with a depth buffer of its own.
// So it needs no GPU, no library and no network.
"use strict";

const scene = JSON.parse(document.getElementById("scene").textContent);
const canvas = document.getElementById("view");
const context = canvas.getContext("2d");
const status = document.getElementById("status");

window.addEventListener("error", (event) => {
  status.textContent = "This page could not be drawn: " + event.message;
});

// -- data -----------------------------------------------------------------------------------------

function decoded(text, Type) {
  const bytes = atob(text);
  const array = new Uint8Array(bytes.length);
  for (let i = 0; i < bytes.length; i++) array[i] = bytes.charCodeAt(i);
  return new Type(array.buffer);
}

const centers = decoded(scene.centers, Float32Array);
const sizes = decoded(scene.sizes, Float32Array);
const classes = decoded(scene.classes, Uint8Array);
const indices = decoded(scene.indices, Uint32Array);
const vertices = decoded(scene.vertices, Float32Array);
const triangles = decoded(scene.triangles, Uint32Array);
const count = classes.length;

// Corners of a box as signs, and its edges as pairs of corners.
const SIGNS = [];
for (const x of [-1, 1]) for (const y of [-1, 1]) for (const z of [-1, 1]) SIGNS.push([x, y, z]);
const EDGES = [];
for (let i = 0; i < 8; i++) {
  for (const bit of [1, 2, 4]) if (!(i & bit)) EDGES.push([i, i | bit]);
}
const SIDES = 24;
const RING = [];
for (let i = 0; i <= SIDES; i++) {
  RING.push([Math.cos((2 * Math.PI * i) / SIDES), Math.sin((2 * Math.PI * i) / SIDES)]);
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, b, s) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
const colours = scene.colours.map(rgb);
const background = rgb(scene.background);
const yellow = rgb(scene.frustumColour);

// -- the viewer's camera --------------------------------------------------------------------------

const RADIANS = Math.PI / 180;
const STEEPEST = 89.9;
const start = { yaw: 0, pitch: 0, distance: 1, target: [0, 0, 0], fov: 45 };
const state = { ...start, xray: true, shown: [true, true, true, true] };

// Angles of a direction, in the basis that has `up` as its third axis.
function anglesOf(direction) {
  const [a, b, c] = scene.basis.map((axis) => dot(axis, direction));
  return [Math.atan2(b, a) / RADIANS, -Math.asin(Math.max(-1, Math.min(1, c))) / RADIANS];
}

function lookFromCamera() {
  const camera = scene.camera;
  [state.yaw, state.pitch] = anglesOf(camera.forward);
  state.distance = camera.distance;
  state.target = plus(camera.eye, camera.forward, camera.distance);
  state.fov = camera.fov;
}

function lookFromAbove() {
  state.yaw = anglesOf(scene.camera.forward)[0];
  state.pitch = STEEPEST;
  state.fov = start.fov;
  state.target = [0, 0, 0];
  state.distance = (1.15 * scene.reach) / Math.tan((start.fov / 2) * RADIANS);
}

// From behind the camera and above it.
function lookOver() {
  lookFromAbove();
  state.pitch = 28;
  state.distance *= 0.9;
}

function clamp() {
  state.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, state.pitch));
  state.distance = Math.max(1e-3 * scene.reach, Math.min(50 * scene.reach, state.distance));
}

function axesOfView() {
  const [e1, e2, up] = scene.basis;
  const yaw = state.yaw * RADIANS;
  const pitch = state.pitch * RADIANS;
  let forward = [0, 0, 0];
  forward = plus(forward, e1, Math.cos(pitch) * Math.cos(yaw));
  forward = plus(forward, e2, Math.cos(pitch) * Math.sin(yaw));
  forward = plus(forward, up, -Math.sin(pitch));
  let right = cross(forward, up);
  const length = Math.hypot(...right);
  right = right.map((one) => one / length);
  const upwards = cross(right, forward);
  // Cameras of left-handed worlds show them mirrored.
  if (scene.mirrored) right = right.map((one) => -one);
  return { forward, right, upwards, eye: plus(state.target, forward, -state.distance) };
}

// -- rasteriser -----------------------------------------------------------------------------------

let width, height, image, pixels, nearness, owners, view, focal, nearest;

function resize() {
  width = Math.max(canvas.clientWidth, 1);
  height = Math.max(canvas.clientHeight, 1);
  canvas.width = width;
  canvas.height = height;
  image = context.createImageData(width, height);
  pixels = image.data;
  nearness = new Float32Array(width * height); // 1 / z of what was drawn; 0: nothing
  owners = new Int32Array(width * height);
}

function toView(x, y, z) {
  const d = [x - view.eye[0], y - view.eye[1], z - view.eye[2]];
  return [dot(d, view.right), dot(d, view.upwards), dot(d, view.forward)];
}

// Column, row and 1 / z of a point in view coordinates.
function onScreen(p) {
  const inverse = 1 / p[2];
  return [width / 2 + p[0] * focal * inverse, height / 2 - p[1] * focal * inverse, inverse];
}

function cutAtNear(a, b) {
  const share = (nearest - a[2]) / (b[2] - a[2]);
  return [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), nearest];
}

function put(at, colour, share) {
  for (let k = 0; k < 3; k++) {
    pixels[4 * at + k] = share * colour[k] + (1 - share) * pixels[4 * at + k];
  }
}

// Lines a little behind a surface still show, so that outlines on it are whole.
const TOWARDS = 1.002;
const BEHIND = 0.4;

function line(a, b, colour, owner) {
  if (a[2] < nearest && b[2] < nearest) return;
  if (a[2] < nearest) a = cutAtNear(a, b);
  if (b[2] < nearest) b = cutAtNear(b, a);
  const p = onScreen(a);
  const q = onScreen(b);
  const d = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
  // The part within the canvas (Liang and Barsky 1984).
  let first = 0;
  let last = 1;
  for (const [by, room] of [[-d[0], p[0]], [d[0], width - 1e-3 - p[0]],
                            [-d[1], p[1]], [d[1], height - 1e-3 - p[1]]]) {
    if (by === 0) {
      if (room < 0) return;
    } else if (by < 0) first = Math.max(first, room / by);
    else last = Math.min(last, room / by);
  }
  if (first > last) return;
  const steps = Math.ceil(Math.max(Math.abs(d[0]), Math.abs(d[1])) * (last - first)) || 1;
  for (let i = 0; i <= steps; i++) {
    const share = first + ((last - first) * i) / steps;
    const x = (p[0] + share * d[0]) | 0;
    const y = (p[1] + share * d[1]) | 0;
    spot(y * width + x, p[2] + share * d[2], colour, owner);
  }
}

function spot(at, near, colour, owner) {
  if (near * TOWARDS >= nearness[at]) {
    put(at, colour, 1);
    nearness[at] = Math.max(near, nearness[at]);
    owners[at] = owner;
  } else if (state.xray) {
    put(at, colour, BEHIND);
    if (owners[at] < 0) owners[at] = owner;
  }
}

function square(p, side, colour, owner) {
  if (p[2] < nearest) return;
  const [x, y, near] = onScreen(p);
  for (let j = 0; j < side; j++) {
    for (let i = 0; i < side; i++) {
      const column = Math.floor(x + i - side / 2 + 0.5);
      const row = Math.floor(y + j - side / 2 + 0.5);
      if (column >= 0 && column < width && row >= 0 && row < height) {
        spot(row * width + column, near, colour, owner);
      }
    }
  }
}

function triangle(a, b, c, colour) {
  const p = onScreen(a);
  const q = onScreen(b);
  const r = onScreen(c);
  const area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
  if (area === 0) return;
  const top = Math.max(0, Math.ceil(Math.min(p[1], q[1], r[1]) - 0.5));
  const bottom = Math.min(height - 1, Math.floor(Math.max(p[1], q[1], r[1]) - 0.5));
  const leftmost = Math.max(0, Math.ceil(Math.min(p[0], q[0], r[0]) - 0.5));
  const rightmost = Math.min(width - 1, Math.floor(Math.max(p[0], q[0], r[0]) - 0.5));
  // Weights of q and r, and 1 / z, grow evenly along a row.
  const vx = (r[1] - p[1]) / area;
  const wx = -(q[1] - p[1]) / area;
  for (let y = top; y <= bottom; y++) {
    const dx = leftmost + 0.5 - p[0];
    const dy = y + 0.5 - p[1];
    let v = (dx * (r[1] - p[1]) - dy * (r[0] - p[0])) / area;
    let w = (dy * (q[0] - p[0]) - dx * (q[1] - p[1])) / area;
    for (let x = leftmost; x <= rightmost; x++, v += vx, w += wx) {
      if (v < 0 || w < 0 || v + w > 1) continue;
      const near = p[2] + v * (q[2] - p[2]) + w * (r[2] - p[2]);
      const at = y * width + x;
      if (near > nearness[at]) {
        nearness[at] = near;
        pixels[4 * at] = colour[0];
        pixels[4 * at + 1] = colour[1];
        pixels[4 * at + 2] = colour[2];
      }
    }
  }
}

// -- what is drawn --------------------------------------------------------------------------------

function drawOccluders() {
  const corners = [];
  for (let i = 0; i < vertices.length; i += 3) {
    corners.push(toView(vertices[i], vertices[i + 1], vertices[i + 2]));
  }
  const base = colours[3];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => corners[triangles[t + k]]);
    const normal = cross(plus(b, a, -1), plus(c, a, -1));
    const length = Math.hypot(...normal) || 1;
    const shade = 0.5 + 0.5 * Math.abs(normal[2] / length);
    const colour = base.map((one) => one * shade);
    const cut = [];
    for (const [p, q] of [[a, b], [b, c], [c, a]]) {
      if (p[2] >= nearest) cut.push(p);
      if (p[2] >= nearest !== q[2] >= nearest) cut.push(cutAtNear(p, q));
    }
    for (let k = 2; k < cut.length; k++) triangle(cut[0], cut[k - 1], cut[k], colour);
  }
}

function drawInstance(i) {
  const colour = colours[classes[i]];
  const [x, y, z] = [centers[3 * i], centers[3 * i + 1], centers[3 * i + 2]];
  const middle = toView(x, y, z);
  const per = scene.kind === "spheres" ? 1 : scene.kind === "boxes" ? 3 : 9;
  if (scene.kind === "points") return square(middle, 2, colour, i);
  let radius = 0;
  for (let k = 0; k < per; k++) radius += sizes[per * i + k] ** 2;
  radius = Math.sqrt(radius);
  if (middle[2] < -radius) return;
  // What is too small for an outline is a dot.
  if (middle[2] > nearest && (radius * focal) / middle[2] < 1.5) {
    return square(middle, 2, colour, i);
  }
  if (scene.kind === "spheres") {
    for (let k = 0; k < SIDES; k++) {
      const [p, q] = [RING[k], RING[k + 1]].map((at) => [
        middle[0] + radius * at[0], middle[1] + radius * at[1], middle[2],
      ]);
      line(p, q, colour, i);
    }
    return;
  }
  const corners = SIGNS.map((sign) => {
    let at = [x, y, z];
    for (let axis = 0; axis < 3; axis++) {
      if (per === 3) at[axis] += sign[axis] * sizes[3 * i + axis];
      else at = plus(at, sizes.subarray(9 * i + 3 * axis, 9 * i + 3 * axis + 3), sign[axis]);
    }
    return toView(...at);
  });
  for (const [from, to] of EDGES) line(corners[from], corners[to], colour, i);
}

function drawFrustum() {
  const corners = [];
  for (let k = 0; k < 8; k++) corners.push(toView(...scene.frustum.slice(3 * k, 3 * k + 3)));
  for (let k = 0; k < 4; k++) {
    line(corners[k], corners[k + 4], yellow, -1);
    line(corners[k], corners[(k + 1) % 4], yellow, -1);
    line(corners[k + 4], corners[4 + ((k + 1) % 4)], yellow, -1);
  }
  square(toView(...scene.camera.eye), 7, yellow, -1);
}

function drawAxes() {
  const size = 26;
  const corner = [size + 14, height - size - 14];
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.strokeStyle = context.fillStyle = "#aab6c2";
  for (let axis = 0; axis < 3; axis++) {
    const x = view.right[axis];
    const y = -view.upwards[axis];
    context.beginPath();
    context.moveTo(...corner);
    context.lineTo(corner[0] + size * x, corner[1] + size * y);
    context.stroke();
    context.fillText("xyz"[axis], corner[0] + (size + 9) * x, corner[1] + (size + 9) * y);
  }
}

let isAsked = false;
let lastWhole = 0; // milliseconds
let whole; // the timer of the next whole picture
const SMOOTH = 50;
// So few instances are always all drawn.
const FEW = 1000;

// Draws every instance, or while the view moves one of `stride`.
function draw(stride = 1) {
  const began = performance.now();
  isAsked = false;
  clamp();
  view = axesOfView();
  focal = height / 2 / Math.tan((state.fov / 2) * RADIANS);
  nearest = 1e-3 * Math.min(state.distance, scene.reach);
  new Uint32Array(pixels.buffer).fill(
    (255 << 24) | (background[2] << 16) | (background[1] << 8) | background[0],
  );
  nearness.fill(0);
  owners.fill(-1);
  if (state.shown[3]) drawOccluders();
  // Kept instances come last, and so lie on top where outlines meet.
  for (const one of [2, 1, 0]) {
    if (!state.shown[one]) continue;
    for (let i = 0; i < count; i += stride) if (classes[i] === one) drawInstance(i);
  }
  drawFrustum();
  context.putImageData(image, 0, 0);
  drawAxes();
  if (stride === 1) lastWhole = performance.now() - began;
}

// Draws soon; where a whole picture takes long, first a part of it, and the rest at rest.
function ask() {
  if (isAsked) return;
  isAsked = true;
  clearTimeout(whole);
  const stride = count > FEW ? Math.ceil(lastWhole / SMOOTH) || 1 : 1;
  requestAnimationFrame(() => {
    draw(stride);
    // Only now, for a hidden page may wait long for its next frame.
    if (stride > 1) whole = setTimeout(draw, 250);
  });
}

// -- mouse, touch, keys, address ------------------------------------------------------------------

const fingers = new Map();

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  canvas.focus();
  fingers.set(event.pointerId, event);
});
for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
}

function gap() {
  const [a, b] = [...fingers.values()];
  return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
}

canvas.addEventListener("pointermove", (event) => {
  const before = fingers.get(event.pointerId);
  if (!before) return tell(event);
  const dx = event.clientX - before.clientX;
  const dy = event.clientY - before.clientY;
  if (fingers.size === 2) {
    const far = gap();
    fingers.set(event.pointerId, event);
    state.distance *= far / Math.max(gap(), 1);
  } else {
    fingers.set(event.pointerId, event);
    if (event.shiftKey || event.buttons & 6) move(dx, dy);
    else turn(-0.3 * dx, 0.3 * dy);
  }
  ask();
});

canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener(
  "wheel",
  (event) => {
    event.preventDefault();
    state.distance *= Math.exp(0.0012 * event.deltaY);
    ask();
  },
  { passive: false },
);

// Says which instance is under the mouse, or up to two pixels beside it.
function tell(event) {
  const box = canvas.getBoundingClientRect();
  const x = Math.floor(event.clientX - box.left);
  const y = Math.floor(event.clientY - box.top);
  const beside = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [2, 0], [-2, 0], [0, 2], [0, -2]];
  for (const [i, j] of beside) {
    const at = (y + j) * width + x + i;
    if (x + i >= 0 && x + i < width && owners[at] >= 0) {
      const number = indices[owners[at]];
      const name = scene.names[classes[owners[at]]];
      status.textContent = `Instance ${number}: ${name}. In Python: seen.explain(${number})`;
      return;
    }
  }
  status.textContent = "";
}

function turn(yaw, pitch) {
  state.yaw += scene.mirrored ? -yaw : yaw;
  state.pitch += pitch;
  ask();
}

function move(dx, dy) {
  const step = state.distance / focal;
  state.target = plus(plus(state.target, view.right, -dx * step), view.upwards, dy * step);
}

const KEYS = {
  ArrowLeft: () => turn(5, 0),
  ArrowRight: () => turn(-5, 0),
  ArrowUp: () => turn(0, 5),
  ArrowDown: () => turn(0, -5),
  "+": () => (state.distance /= 1.15),
  "=": () => (state.distance /= 1.15),
  "-": () => (state.distance *= 1.15),
  c: lookFromCamera,
  t: lookFromAbove,
  r: lookOver,
  x: () => (state.xray = !state.xray),
};

window.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const box = document.querySelector(`input[data-class="${Number(event.key) - 1}"]`);
  if (/^[1-4]$/.test(event.key) && box) box.click();
  else if (KEYS[event.key]) {
    KEYS[event.key]();
    event.preventDefault();
    ask();
  }
});

for (const box of document.querySelectorAll("input[data-class]")) {
  box.addEventListener("change", () => {
    state.shown[Number(box.dataset.class)] = box.checked;
    ask();
  });
}
for (const button of document.querySelectorAll("button[data-key]")) {
  button.addEventListener("click", () => {
    KEYS[button.dataset.key]();
    ask();
  });
}

// "#view=camera&yaw=30&pitch=10&zoom=2" opens that view.
function readAddress() {
  const asked = new URLSearchParams(location.hash.slice(1));
  const views = { camera: lookFromCamera, top: lookFromAbove };
  (views[asked.get("view")] || lookOver)();
  for (const name of ["yaw", "pitch"]) {
    const angle = parseFloat(asked.get(name));
    if (Number.isFinite(angle)) state[name] = angle;
  }
  const zoom = parseFloat(asked.get("zoom"));
  if (zoom > 0) state.distance /= zoom;
  if (asked.get("xray") === "0") state.xray = false;
  ask();
}

window.addEventListener("hashchange", readAddress);
window.addEventListener("resize", () => {
  resize();
  ask();
});
resize();
readAddress();
