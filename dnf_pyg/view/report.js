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
uniform mat3 turn; uniform vec2 scale; uniform vec2 shift;
out vec3 place; out vec3 corner; out float shade;
void main() {
  place = turn * position;
  shade = value;
  corner = vec3(gl_VertexID % 3 == 0, gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);
  gl_Position = vec4(place.xy * scale + shift, -place.z * 0.3, 1.0);
}`;
const fragmentShader = `#version 300 es
precision highp float;
in vec3 place; in vec3 corner; in float shade;
uniform sampler2D ramp; uniform float most; uniform bool coloured; uniform bool edged;
out vec4 colour;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  if (normal.z < 0.0) normal = -normal;
  float light = 0.3 + 0.62 * max(dot(normal, normalize(vec3(-0.45, 0.65, 0.6))), 0.0)
                    + 0.2 * max(dot(normal, normalize(vec3(0.8, -0.1, 0.5))), 0.0);
  vec3 base = gl_FrontFacing ? vec3(0.84, 0.85, 0.87) : vec3(0.46, 0.58, 0.82);
  if (coloured) {
    base = texture(ramp, vec2(clamp(shade / most, 0.002, 0.998), 0.5)).rgb;
    light = 0.45 + 0.55 * light;
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
  const out = new Float32Array(corner.length * width);
  for (let i = 0; i < corner.length; i++)
    for (let j = 0; j < width; j++) out[i * width + j] = values[corner[i] * width + j];
  return out;
}

function start() {
  const program = makeProgram();
  gl.useProgram(program);
  const at = name => gl.getUniformLocation(program, name);
  const uniform = Object.fromEntries(
    ["turn", "scale", "shift", "most", "coloured", "edged"].map(name => [name, at(name)]));
  const corner = decode(data.face, Uint32Array);
  const faceOfCorner = Uint32Array.from(corner, (_, i) => (i / 3) | 0);
  const buffer = content => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, content, gl.STATIC_DRAW);
    return made;
  };
  const sides = data.sides.map(side => ({
    position: buffer(unrolled(decode(side.pos, Float32Array), 3, corner)),
    values: Object.fromEntries(Object.entries(side.values).map(([name, text]) => [
      name, buffer(unrolled(decode(text, Float32Array), 1, data.modes[name].per_face ? faceOfCorner : corner))])),
  }));
  const ramp = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, ramp);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.enable(gl.DEPTH_TEST);

  const home = () => ({ turn: data.turn.slice(), zoom: 1, x: 0, y: 0 });
  let camera = home(), mode = "shaded", edged = false, waiting = false;

  function draw() {
    waiting = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const stacked = window.matchMedia("(max-width: 700px)").matches;
    const [w, h] = stacked ? [width, height >> 1] : [width >> 1, height];
    const reach = 0.94 * Math.min(w, h) * camera.zoom;
    gl.uniformMatrix3fv(uniform.turn, false, camera.turn);
    gl.uniform2f(uniform.scale, reach / w, reach / h);
    gl.uniform2f(uniform.shift, camera.x * reach / w, camera.y * reach / h);
    gl.uniform1i(uniform.coloured, mode === "shaded" ? 0 : 1);
    gl.uniform1i(uniform.edged, edged ? 1 : 0);
    gl.uniform1f(uniform.most, mode === "shaded" ? 1 : data.modes[mode].most);
    sides.forEach((side, i) => {
      gl.viewport(stacked ? 0 : i * w, stacked ? (1 - i) * h : 0, w, h);
      gl.bindBuffer(gl.ARRAY_BUFFER, side.position);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
      if (mode === "shaded") gl.disableVertexAttribArray(1);
      else {
        gl.bindBuffer(gl.ARRAY_BUFFER, side.values[mode]);
        gl.enableVertexAttribArray(1);
        gl.vertexAttribPointer(1, 1, gl.FLOAT, false, 0, 0);
      }
      gl.drawArrays(gl.TRIANGLES, 0, corner.length);
    });
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
      const stacked = window.matchMedia("(max-width: 700px)").matches;
      const w = canvas.clientWidth / (stacked ? 1 : 2), h = canvas.clientHeight / (stacked ? 2 : 1);
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
  document.getElementById("edges").addEventListener("click", event => {
    edged = !edged;
    event.currentTarget.setAttribute("aria-pressed", edged);
    redraw();
  });

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
      document.getElementById("most").textContent = "≥ " + described.most_text;
      document.getElementById("unit").textContent = described.unit;
    }
    redraw();
  }
  for (const button of document.querySelectorAll("[data-mode]"))
    button.addEventListener("click", () => choose(button.dataset.mode));
  new ResizeObserver(redraw).observe(canvas);
  const asked = window.location.hash.slice(1);  // page.html#error opens with the colours of the error
  choose(asked in data.modes ? asked : "shaded");
}

if (gl) start();
else document.getElementById("failure").hidden = false;
