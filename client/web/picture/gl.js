// WebGL2: context, program, and array textures that hold the planes of a layer.

import { FLOAT, HALF } from './exr.js';

// Of a plane that is in no texture.
export const NOWHERE = { array: null, layer: 0 };

export function createContext(canvas) {
  return canvas.getContext('webgl2', {
    alpha: false,
    antialias: false,
    depth: false,
    stencil: false,
    premultipliedAlpha: false,
    preserveDrawingBuffer: false,
    powerPreference: 'high-performance',
  });
}

export function createProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [type, source] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
    }
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`program: ${gl.getProgramInfoLog(program)}`);
  }
  const uniforms = new Map();
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
  for (let i = 0; i < count; i++) {
    const { name } = gl.getActiveUniform(program, i);
    uniforms.set(name.replace('[0]', ''), gl.getUniformLocation(program, name));
  }
  return { program, at: (name) => uniforms.get(name) ?? null };
}

function parameters(gl, target, filter) {
  gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(target, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(target, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
}

export function createTexture(gl, width, height, pixels = null) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
  if (pixels) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  parameters(gl, gl.TEXTURE_2D, gl.LINEAR);
  return texture;
}

// Textures of a layer: `half` and `float` array textures, and placeOf(name): in which of the two a plane is ('halfs',
// 'floats') and its layer there.
export function loadArrays(gl, layer) {
  const arrays = { [HALF]: { names: [], texture: null }, [FLOAT]: { names: [], texture: null } };

  const allocate = (type) => {
    const array = arrays[type];
    gl.deleteTexture(array.texture);
    array.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, array.texture);
    gl.texStorage3D(
      gl.TEXTURE_2D_ARRAY,
      1,
      type === HALF ? gl.R16F : gl.R32F,
      layer.width,
      layer.height,
      array.names.length,
    );
    parameters(gl, gl.TEXTURE_2D_ARRAY, type === HALF ? gl.LINEAR : gl.NEAREST);
  };

  const upload = (type, name, [x0, y0, x1, y1]) => {
    const plane = layer.planes.get(name);
    gl.texSubImage3D(
      gl.TEXTURE_2D_ARRAY,
      0,
      x0,
      y0,
      arrays[type].names.indexOf(name),
      x1 - x0,
      y1 - y0,
      1,
      gl.RED,
      type === HALF ? gl.HALF_FLOAT : gl.FLOAT,
      plane.data,
      y0 * layer.width + x0,
    );
  };

  return {
    show(names) {
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.pixelStorei(gl.UNPACK_ROW_LENGTH, layer.width);
      const all = [0, 0, layer.width, layer.height];
      const changed = union(layer.dirty, all);
      layer.dirty = [];
      for (const type of [HALF, FLOAT]) {
        const array = arrays[type];
        const wanted = names.filter((name) => layer.planes.get(name)?.type === type);
        const missing = wanted.filter((name) => !array.names.includes(name));
        if (missing.length) {
          array.names = [...new Set(wanted)];
          allocate(type);
        } else if (array.texture) {
          gl.bindTexture(gl.TEXTURE_2D_ARRAY, array.texture);
        }
        for (const name of array.names) {
          for (const rect of missing.length ? [all] : changed) upload(type, name, rect);
        }
      }
      gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
    },
    placeOf(name) {
      const half = arrays[HALF].names.indexOf(name);
      if (half >= 0) return { array: 'halfs', layer: half };
      const float = arrays[FLOAT].names.indexOf(name);
      return float >= 0 ? { array: 'floats', layer: float } : NOWHERE;
    },
    get half() {
      return arrays[HALF].texture;
    },
    get float() {
      return arrays[FLOAT].texture;
    },
    forget() {
      for (const type of [HALF, FLOAT]) arrays[type].names = [];
    },
    dispose() {
      for (const type of [HALF, FLOAT]) gl.deleteTexture(arrays[type].texture);
    },
  };
}

// One rectangle for all where that uploads little more than they would.
function union(rects, all) {
  if (rects.length < 2) return rects;
  const box = [all[2], all[3], 0, 0];
  let area = 0;
  for (const [x0, y0, x1, y1] of rects) {
    box[0] = Math.min(box[0], x0);
    box[1] = Math.min(box[1], y0);
    box[2] = Math.max(box[2], x1);
    box[3] = Math.max(box[3], y1);
    area += (x1 - x0) * (y1 - y0);
  }
  return (box[2] - box[0]) * (box[3] - box[1]) <= 1.3 * area ? [box] : rects;
}
