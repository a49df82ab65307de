"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const canvas = document.getElementById("canvas");
const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });

function decode(text, Kind) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Kind(bytes.buffer);
}

const vertexShader = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in float value;
layout(location = 2) in vec3 normal;
layout(location = 3) in vec3 origin;
layout(location = 4) in vec3 originNormal;
uniform mat3 turn; uniform vec2 scale; uniform vec2 shift; uniform float share;
out vec3 place; out vec3 corner; out vec3 smoothNormal; out float shade;
void main() {
  place = turn * mix(origin, position, share);
  smoothNormal = turn * mix(originNormal, normal, share);
  shade = value;
  corner = vec3(gl_VertexID % 3 == 0, gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);
  gl_Position = vec4(place.xy * scale + shift, -place.z * 0.3, 1.0);
}`;
const fragmentShader = `#version 300 es
precision highp float;
in vec3 place; in vec3 corner; in vec3 smoothNormal; in float shade;
uniform sampler2D ramp; uniform float least; uniform float most;
uniform bool coloured; uniform bool edged; uniform bool smoothed;
out vec4 colour;
void main() {
  vec3 normal = normalize(smoothed ? smoothNormal : cross(dFdx(place), dFdy(place)));
  if (normal.z < 0.0) normal = -normal;
  float light = 0.3 + 0.62 * max(dot(normal, normalize(vec3(-0.45, 0.65, 0.6))), 0.0)
                    + 0.2 * max(dot(normal, normalize(vec3(0.8, -0.1, 0.5))), 0.0);
  vec3 base = gl_FrontFacing ? vec3(0.84, 0.85, 0.87) : vec3(0.46, 0.58, 0.82);
  if (coloured) {
    base = texture(ramp, vec2(clamp((shade - least) / (most - least), 0.002, 0.998), 0.5)).rgb;
    light = 0.25 + 0.75 * light;
  }
  vec3 lit = base * min(light, 1.0);
  if (edged) {
    vec3 near = corner / max(fwidth(corner), vec3(1e-6));
    lit *= mix(0.45, 1.0, smoothstep(0.4, 1.2, min(near.x, min(near.y, near.z))));
  }
  colour = vec4(lit, 1.0);
}`;

function makeProgram() {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertexShader], [gl.FRAGMENT_SHADER, fragmentShader]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "no program");
  return program;
}

function unrolled(values, width, corner) {
  const out = new values.constructor(corner.length * width);
  for (let i = 0; i < corner.length; i++)
    for (let j = 0; j < width; j++) out[i * width + j] = values[corner[i] * width + j];
  return out;
}

function meshFile(origin, position, share, corner) {  // binary ply of what a share of the movement makes
  const count = position.length / 3;
  const header = new TextEncoder().encode(`ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n`
    + "property double x\nproperty double y\nproperty double z\n"
    + `element face ${corner.length / 3}\nproperty list uchar int vertex_indices\nend_header\n`);
  const body = new DataView(new ArrayBuffer(24 * count + 13 * corner.length / 3));
  for (let i = 0; i < position.length; i++)
    body.setFloat64(8 * i, data.center[i % 3] + data.radius * (origin[i] + share * (position[i] - origin[i])), true);
  for (let i = 0, at = 24 * count; i < corner.length; i += 3, at += 13) {
    body.setUint8(at, 3);
    for (let j = 0; j < 3; j++) body.setInt32(at + 1 + 4 * j, corner[i + j], true);
  }
  return new Blob([header, body], { type: "application/octet-stream" });
}

function start() {
  const program = makeProgram();
  gl.useProgram(program);
  const uniform = Object.fromEntries(
    ["turn", "scale", "shift", "share", "least", "most", "coloured", "edged", "smoothed"].map(
      name => [name, gl.getUniformLocation(program, name)]));
  const buffer = content => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, content, gl.STATIC_DRAW);
    return made;
  };
  const sides = [];
  for (const side of data.sides) {
    const corner = side.face === null ? sides[0].corner : decode(side.face, Uint32Array);
    const faceOfCorner = Uint32Array.from(corner, (_, i) => (i / 3) | 0), pos = decode(side.pos, Float32Array);
    sides.push({
      corner, pos,
      position: buffer(unrolled(pos, 3, corner)),
      normal: buffer(unrolled(decode(side.normal, Int16Array), 3, corner)),
      values: Object.fromEntries(Object.entries(side.values).map(([name, { per_face, values }]) => [
        name, buffer(unrolled(decode(values, Float32Array), 1, per_face ? faceOfCorner : corner))])),
    });
  }
  const ramp = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, ramp);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  for (const switched of [gl.DEPTH_TEST, gl.SCISSOR_TEST]) gl.enable(switched);

  const home = () => ({ turn: data.turn.slice(), zoom: 1, x: 0, y: 0 });
  const labels = [...document.querySelectorAll(".label")], handle = document.getElementById("handle");
  let camera = home(), mode = "shaded", edged = false, smoothed = false, waiting = false;
  let layout = "beside", cut = 0.5, shown = 0, share = 1;  // `shown` is the mesh that is visible while they blink

  function panels(width, height) {  // of each mesh: what is seen of it, and the frame that it is centred in; in pixels
    const whole = [0, 0, width, height], x = Math.round(cut * width);
    if (layout === "swipe") return [[[0, 0, x, height], whole], [[x, 0, width - x, height], whole]];
    if (layout === "blink") return sides.map((_, i) => [i === shown ? whole : [0, 0, 0, 0], whole]);
    const stacked = window.matchMedia("(max-width: 700px)").matches, n = sides.length;
    return sides.map((_, i) => {
      const frame = stacked ? [0, Math.floor((n - 1 - i) * height / n), width, Math.floor(height / n)]
        : [Math.floor(i * width / n), 0, Math.floor(width / n), height];
      return [frame, frame];
    });
  }

  function attribute(place, content, width, kind) {
    gl.bindBuffer(gl.ARRAY_BUFFER, content);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, width, kind, kind === gl.SHORT, 0, 0);
  }

  function draw() {
    waiting = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.scissor(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const described = data.modes[mode], found = panels(width, height);
    gl.uniformMatrix3fv(uniform.turn, false, camera.turn);
    for (const [name, on] of Object.entries({ coloured: Boolean(described), edged, smoothed }))
      gl.uniform1i(uniform[name], on ? 1 : 0);
    gl.uniform1f(uniform.least, described ? described.least : 0);
    gl.uniform1f(uniform.most, described ? described.most : 1);
    sides.forEach((side, i) => {
      const [seen, [x, y, w, h]] = found[i], origin = data.blends ? sides[0] : side;
      const reach = 0.94 * Math.min(w, h) * camera.zoom;
      gl.scissor(...seen);
      gl.viewport(x, y, w, h);
      gl.uniform2f(uniform.scale, reach / w, reach / h);
      gl.uniform2f(uniform.shift, camera.x * reach / w, camera.y * reach / h);
      gl.uniform1f(uniform.share, i ? share : 1);
      attribute(0, side.position, 3, gl.FLOAT);
      attribute(2, side.normal, 3, gl.SHORT);
      attribute(3, origin.position, 3, gl.FLOAT);
      attribute(4, origin.normal, 3, gl.SHORT);
      if (described && side.values[mode]) attribute(1, side.values[mode], 1, gl.FLOAT);
      else gl.disableVertexAttribArray(1);
      gl.drawArrays(gl.TRIANGLES, 0, side.corner.length);
      const label = labels[i];
      label.hidden = layout === "blink" && i !== shown;
      label.style.left = `${seen[0] / ratio + 12}px`;
      label.style.top = `${(height - seen[1] - seen[3]) / ratio + 10}px`;
    });
    handle.style.left = `${100 * cut}%`;
  }
  const redraw = () => { if (!waiting) { waiting = true; requestAnimationFrame(draw); } };

  function turnBy(right, down) {  // angles about the screen's axes, multiplied from the left; columns are stored
    const a = Math.cos(right), b = Math.sin(right), c = Math.cos(down), d = Math.sin(down), m = camera.turn;
    for (let i = 0; i < 9; i += 3) {
      const [x, y, z] = [a * m[i] + b * m[i + 2], m[i + 1], a * m[i + 2] - b * m[i]];
      [m[i], m[i + 1], m[i + 2]] = [x, c * y - d * z, d * y + c * z];
    }
    redraw();
  }
  function zoomBy(factor) { camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.2), 60); redraw(); }

  const pointers = new Map();
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
  });
  canvas.addEventListener("pointermove", event => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const right = event.clientX - last.clientX, down = event.clientY - last.clientY;
    if (pointers.size === 2) {
      const other = [...pointers.values()].find(found => found.pointerId !== event.pointerId);
      const far = found => Math.hypot(found.clientX - other.clientX, found.clientY - other.clientY);
      zoomBy(far(event) / Math.max(far(last), 1));
    } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) {
      const [, [, , w, h]] = panels(canvas.clientWidth, canvas.clientHeight)[0];
      const reach = 0.94 * Math.min(w, h) * camera.zoom;
      camera.x += 2 * right / reach;
      camera.y -= 2 * down / reach;
      redraw();
    } else turnBy(right * 0.008, down * 0.008);
    pointers.set(event.pointerId, event);
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, event => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("wheel", event => { event.preventDefault(); zoomBy(Math.exp(-event.deltaY * 0.0012)); },
    { passive: false });
  canvas.addEventListener("keydown", event => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    if (step) { event.preventDefault(); turnBy(...step); }
    if (event.key === "+" || event.key === "-") zoomBy(event.key === "+" ? 1.15 : 1 / 1.15);
  });
  const reset = () => { camera = home(); redraw(); };
  canvas.addEventListener("dblclick", reset);
  document.getElementById("reset").addEventListener("click", reset);
  for (const [name, turned] of Object.entries({ edges: () => (edged = !edged), smooth: () => (smoothed = !smoothed) }))
    document.getElementById(name).addEventListener("click", event => {
      event.currentTarget.setAttribute("aria-pressed", turned());
      redraw();
    });
  for (const button of document.querySelectorAll("[data-axis]"))
    button.addEventListener("click", () => {  // y points up, and z away from the viewer's feet in views along y
      const axis = Number(button.dataset.axis), toward = [0, 0, 0], up = [0, 0, 0];
      toward[axis] = 1;
      if (toward.every((value, i) => Math.abs(value - camera.turn[3 * i + 2]) < 1e-6)) toward[axis] = -1;
      if (axis === 1) up[2] = -toward[1]; else up[1] = 1;
      const right = [0, 1, 2].map(i => up[(i + 1) % 3] * toward[(i + 2) % 3] - up[(i + 2) % 3] * toward[(i + 1) % 3]);
      camera.turn = [0, 1, 2].flatMap(i => [right[i], up[i], toward[i]]);
      redraw();
    });

  let blinking = null;
  for (const button of document.querySelectorAll("[data-layout]"))
    button.addEventListener("click", () => {
      layout = button.dataset.layout;
      for (const other of document.querySelectorAll("[data-layout]"))
        other.setAttribute("aria-pressed", other === button);
      handle.hidden = layout !== "swipe";
      clearInterval(blinking);
      if (layout === "blink") blinking = setInterval(() => { shown = 1 - shown; redraw(); }, 900);
      redraw();
    });
  handle.addEventListener("pointerdown", event => handle.setPointerCapture(event.pointerId));
  handle.addEventListener("pointermove", event => {
    if (!handle.hasPointerCapture(event.pointerId)) return;
    const box = canvas.getBoundingClientRect();
    cut = Math.min(Math.max((event.clientX - box.left) / box.width, 0.02), 0.98);
    redraw();
  });

  if (data.blends) {
    document.getElementById("strength").addEventListener("input", event => {
      share = Number(event.currentTarget.value);
      document.getElementById("share").textContent = share.toFixed(2);
      redraw();
    });
    document.getElementById("save").addEventListener("click", () => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(meshFile(sides[0].pos, sides[1].pos, share, sides[0].corner));
      link.download = `${document.title.replace(/[^\w.-]+/g, "_")}_${share.toFixed(2)}.ply`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  }

  function choose(name) {
    mode = name;
    for (const button of document.querySelectorAll("[data-mode]"))
      button.setAttribute("aria-pressed", button.dataset.mode === name);
    const described = data.modes[name];
    document.getElementById("scale").classList.toggle("shown", Boolean(described));
    if (described) {
      const colours = decode(described.colours, Uint8Array);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, colours);
      const strip = document.createElement("canvas");
      [strip.width, strip.height] = [256, 1];
      strip.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(colours), 256, 1), 0, 0);
      document.getElementById("ramp").src = strip.toDataURL();
      document.getElementById("least").textContent = described.least_text;
      document.getElementById("most").textContent = described.most_text;
      document.getElementById("unit").textContent = described.unit;
    }
    redraw();
  }
  for (const button of document.querySelectorAll("[data-mode]"))
    button.addEventListener("click", () => choose(button.dataset.mode));
  new ResizeObserver(redraw).observe(canvas);
  const asked = window.location.hash.slice(1);  // page.html#error opens with the colours of the error
  choose(asked in data.modes ? asked : "shaded");
  document.querySelector(`[data-layout="${asked}"]`)?.click();
}

if (gl) start();
else document.getElementById("failure").hidden = false;
