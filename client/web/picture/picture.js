// The picture of one session: the film, the preview that stands in for it while the camera moves, a pinned reference;
// and the canvas that shows them. A new view never blanks it: film tiles replace the preview, or the film before, one
// by one as they come.

import { channelById, isColour, planesForError } from './channels.js';
import { Compare, Relation, standardErrors } from './compare.js';
import { colourMap } from './colour_map.js';
import { createContext, createProgram, createTexture, NOWHERE } from './gl.js';
import { Layer } from './layer.js';
import { fragmentSource, vertexSource } from './shaders.js';

export class Picture {
  #gl;
  #programs; // by the way that they show
  #buffer;
  #colours;
  #empty;
  #jpegs = [null, null]; // shown, and the one that is being received
  #jpegJobs = [];
  #samples = { film: '', seed: '' }; // of the film; film: names the sequence of its samples, '' when it is not known
  #uniform = false; // the film's planes hold tiles of that sequence alone
  #shows = ''; // names what the film is to show
  #filled = -1; // the revision of the newest tile
  #pinned = { film: '', seed: '' };

  // look: what picture_panel.js sets, shared by all pictures. onContext(lost): the WebGL context went or came back.
  constructor(canvas, look, onContext) {
    this.canvas = canvas;
    this.look = look;
    this.film = null;
    this.revision = -1;
    this.begun = 0; // frames of the film
    this.viewId = 0;
    this.window = null;
    this.preview = null;
    this.previewViewId = 0;
    this.reference = null;
    this.lost = false;
    this.zoom = 1;
    this.origin = [0, 0];
    this.#clear();
    this.#gl = createContext(canvas);
    if (!this.#gl) throw new Error('WebGL2');
    this.#create();
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.lost = true;
      onContext(true);
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.lost = false;
      for (const layer of [this.film, this.preview, this.under, this.reference]) if (layer) layer.textures = null;
      this.#jpegs = [null, null];
      this.#create();
      onContext(false);
    });
  }

  #clear() {
    this.valid = new Map(); // tiles that show the film's present view, by corner
    this.covered = 0; // pixels of them
    this.fresh = new Map(); // those of the film's present revision
    this.freshCovered = 0;
    this.whole = false; // the film's planes hold a whole picture, be it of several revisions
    this.under = null; // a layer that shows where no valid tile is; null: the film as it is
    this.encoded = false; // it is a JPEG
  }

  #create() {
    const gl = this.#gl;
    this.#programs = new Map();
    this.#buffer = gl.createBuffer();
    this.#colours = createTexture(gl, 256, 2, colourMap);
    this.#empty = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.#empty);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.R16F, 1, 1, 1);
    gl.disable(gl.DITHER);
  }

  get width() {
    return this.film?.width ?? this.preview?.width ?? 0;
  }
  get height() {
    return this.film?.height ?? this.preview?.height ?? 0;
  }
  // All tiles of the present revision have come.
  get complete() {
    return this.window !== null && this.freshCovered >= area(this.window);
  }
  get renderer() {
    const info = this.#gl.getExtension('WEBGL_debug_renderer_info');
    return this.#gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : this.#gl.RENDERER);
  }

  loseContext(restoreAfterMs) {
    const extension = this.#gl.getExtension('WEBGL_lose_context');
    extension?.loseContext();
    if (restoreAfterMs) setTimeout(() => extension.restoreContext(), restoreAfterMs);
  }

  // samples: equal text where pictures take the same samples of each pixel in the same order; shows: where they show
  // the same, so that the tiles there are stay until others replace them. '': it is not known.
  beginFilm(begin, samples, shows = '') {
    const { width, height, region } = begin.settings;
    this.begun++;
    this.#uniform &&= samples !== '' && samples === this.#samples.film;
    this.#samples = { film: samples, seed: String(begin.settings.seed) };
    this.revision = begin.tag.revision;
    this.viewId = begin.tag.view_id;
    this.window = region ? [region.x0, region.y0, region.x1, region.y1] : [0, 0, width, height];
    this.fresh.clear();
    this.freshCovered = 0;
    if (shows === '' || shows !== this.#shows) this.#forgetTiles();
    this.#shows = shows;
    if (this.film && this.film.width === width && this.film.height === height) return;
    const old = this.film;
    this.film = new Layer(width, height);
    if (old && this.whole && !this.under) this.#setUnder(old);
    else old?.release();
    this.whole = false;
  }

  // True: the picture has just become whole.
  addTile(tile) {
    if (!this.film || tile.tag.revision !== this.revision) return false;
    const rect = this.film.addExr(tile.exr, this.revision);
    const key = rect[1] * 65536 + rect[0];
    this.#filled = this.revision;
    if (!this.valid.has(key)) {
      this.valid.set(key, rect);
      this.covered += area(rect);
    }
    if (this.covered >= area(this.window)) {
      if (this.under) this.#setUnder(null);
      this.whole = true;
    }
    if (this.fresh.has(key)) return false;
    this.fresh.set(key, rect);
    this.freshCovered += area(rect);
    if (!this.complete) return false;
    this.#uniform = true;
    return true;
  }

  #forgetTiles() {
    this.valid.clear();
    this.covered = 0;
  }

  beginPreview(begin) {
    const { width, height } = begin.settings;
    if (this.preview && this.preview.width === width && this.preview.height === height) return;
    if (this.under === this.preview) this.#setUnder(null);
    this.preview?.release();
    this.preview = new Layer(width, height);
  }

  addPreviewTile(tile) {
    if (!this.preview) return;
    if (!tile.jpeg.length) {
      this.preview.addExr(tile.exr, 0);
      return;
    }
    const { x0 = 0, y0 = 0 } = tile.window;
    this.#jpegJobs.push(
      createImageBitmap(new Blob([tile.jpeg], { type: 'image/jpeg' })).then((bitmap) => {
        const gl = this.#gl;
        if (!this.lost) {
          this.#jpegs[1] ??= {
            width: this.preview.width,
            height: this.preview.height,
            texture: createTexture(gl, this.preview.width, this.preview.height),
          };
          gl.bindTexture(gl.TEXTURE_2D, this.#jpegs[1].texture);
          gl.texSubImage2D(gl.TEXTURE_2D, 0, x0, y0, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
        }
        bitmap.close();
      }),
    );
  }

  // A preview is whole: shows it from now on. gain: that its JPEG was made with.
  async showPreview({ view_id: viewId, revision }, gain) {
    const jobs = this.#jpegJobs,
      { begun } = this;
    this.#jpegJobs = [];
    if (jobs.length) {
      await Promise.all(jobs);
      this.#jpegs.reverse();
      const spare = this.#jpegs[1];
      if (spare && (spare.width !== this.preview.width || spare.height !== this.preview.height)) {
        this.#gl.deleteTexture(spare.texture);
        this.#jpegs[1] = null;
      }
    }
    // The film has better already, which it may have begun with while JPEGs were decoded.
    if (!this.preview || (this.valid.size && (this.begun !== begun || revision <= this.revision))) return;
    this.encoded = jobs.length > 0;
    this.encodedGain = 1 / gain;
    this.previewViewId = viewId;
    this.#setUnder(this.preview);
    this.#forgetTiles();
    this.fresh.clear();
    this.freshCovered = 0;
  }

  #setUnder(layer) {
    if (this.under && this.under !== layer && this.under !== this.preview) this.under.release();
    this.under = layer;
  }

  // A tile of the present view covers the pixel.
  validAt(x, y) {
    return isIn(this.valid, x, y);
  }

  // A tile of the present revision does.
  freshAt(x, y) {
    return isIn(this.fresh, x, y);
  }

  pin() {
    this.reference?.release();
    this.reference = this.film ? this.film.clone() : null;
    this.#pinned = this.#uniform ? this.#samples : { film: '', seed: '' };
  }

  // How the film's samples are related to those of the pinned picture.
  get relation() {
    const { film, seed } = this.#samples;
    if (film && this.#uniform && film === this.#pinned.film) return Relation.NESTED;
    return seed && seed === this.#pinned.seed ? Relation.SEED : Relation.INDEPENDENT;
  }

  unpin() {
    this.reference?.release();
    this.reference = null;
  }

  get comparable() {
    return !!this.reference && this.reference.width === this.width && this.reference.height === this.height;
  }

  // width, height: of the target in device pixels.
  #draw(width, height, zoom, origin) {
    const gl = this.#gl;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.0431, 0.0471, 0.0549, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (!this.film && !this.under) return;
    const { look } = this;
    const target = { width, height, origin };
    const smooth = this.smooth(zoom);
    const compares = look.compare !== Compare.NONE && this.comparable ? look.compare : Compare.NONE;
    const chosen = channelById(look.channel);
    const channel = compares === Compare.ERRORS && isColour(chosen) ? channelById('radiance') : chosen;
    if (this.under) {
      const preview = this.under === this.preview;
      this.#drawLayer(target, this.under, preview ? channelById('display') : channel, {
        encoded: preview && this.encoded,
        compare: Compare.NONE,
        rects: [[0, 0, this.under.width, this.under.height]],
        zoom: zoom * (this.width / this.under.width),
        smooth,
      });
    }
    const rects = this.under || !this.whole ? [...this.valid.values()] : [[0, 0, this.film.width, this.film.height]];
    if (rects.length && this.film) {
      this.#drawLayer(target, this.film, channel, { encoded: false, compare: compares, rects, zoom, smooth });
    }
  }

  #programOf(way) {
    const key = Object.values(way).join();
    if (!this.#programs.has(key)) {
      const gl = this.#gl;
      const made = createProgram(gl, vertexSource, fragmentSource(way));
      gl.useProgram(made.program);
      ['halfs', 'floats', 'referenceHalfs', 'referenceFloats', 'jpeg', 'colours'].forEach((name, unit) =>
        gl.uniform1i(made.at(name), unit),
      );
      this.#programs.set(key, made);
    }
    return this.#programs.get(key);
  }

  #drawLayer(target, layer, channel, { encoded, compare, rects, zoom, smooth }) {
    const gl = this.#gl,
      { look } = this;
    const errors = compare === Compare.ERRORS ? planesForError : [];
    const names = [...channel.planes, ...errors];
    const own = encoded ? null : layer.show(gl, names);
    const reference = compare ? this.reference.show(gl, names) : null;
    const places = (arrays, list, length = 6) =>
      Array.from({ length }, (_, i) => arrays?.placeOf(list[i]) ?? NOWHERE);
    const planes = places(own, channel.planes),
      referencePlanes = places(reference, channel.planes);
    const errorPlaces = [own, reference].flatMap((layers) => places(layers, planesForError, planesForError.length));
    const arrays = (list) => list.map((place) => place.array);
    const { program, at } = this.#programOf({
      kind: channel.kind,
      encoded,
      smooth,
      compare,
      nested: compare === Compare.ERRORS && this.relation === Relation.NESTED,
      toneMap: look.toneMap,
      logarithmic: look.logarithmic,
      own: arrays(planes),
      reference: arrays(referencePlanes),
      errors: arrays(errorPlaces),
    });
    gl.useProgram(program);
    const layers = (list) => Int32Array.from(list, (place) => place.layer);
    gl.uniform1iv(at('planes'), layers(planes));
    gl.uniform1iv(at('referencePlanes'), layers(referencePlanes));
    gl.uniform1iv(at('errors'), layers(errorPlaces));
    gl.uniform2f(at('viewport'), target.width, target.height);
    gl.uniform2f(at('origin'), ...target.origin);
    gl.uniform1f(at('zoom'), zoom);
    gl.uniform2f(at('filmSize'), layer.width, layer.height);
    gl.uniform1f(at('gain'), 2 ** look.exposure);
    gl.uniform2f(at('range'), ...look.range);
    gl.uniform1f(at('floor_'), look.floor);
    gl.uniform1f(at('encodedGain'), this.encodedGain ?? 1);
    gl.uniform1f(at('split'), look.split * layer.width);
    [own?.half, own?.float, reference?.half, reference?.float].forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture ?? this.#empty);
    });
    gl.activeTexture(gl.TEXTURE4);
    gl.bindTexture(gl.TEXTURE_2D, encoded && this.#jpegs[0] ? this.#jpegs[0].texture : this.#colours);
    gl.activeTexture(gl.TEXTURE5);
    gl.bindTexture(gl.TEXTURE_2D, this.#colours);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    const corners = new Float32Array(rects.length * 12);
    rects.forEach(([x0, y0, x1, y1], i) => corners.set([x0, y0, x1, y0, x0, y1, x0, y1, x1, y0, x1, y1], i * 12));
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.DYNAMIC_DRAW);
    gl.drawArrays(gl.TRIANGLES, 0, rects.length * 6);
  }

  // Whether pixels are interpolated at this zoom.
  smooth(zoom) {
    const { filter } = this.look;
    return filter === 'linear' || (filter === 'auto' && zoom < 4 && zoom % 1 !== 0);
  }

  // whole: the canvas has a pixel for each of the film's.
  draw(whole) {
    if (this.lost) return;
    this.#gl.bindFramebuffer(this.#gl.FRAMEBUFFER, null);
    if (whole) this.#draw(this.canvas.width, this.canvas.height, 1, [0, 0]);
    else this.#draw(this.canvas.width, this.canvas.height, this.zoom, this.origin);
  }

  // The film as it is shown, a device pixel for each of its own: RGBA bytes, rows from the top.
  snapshot() {
    const gl = this.#gl,
      { width, height } = this;
    if (this.lost || gl.isContextLost()) return new ImageData(width, height);
    const texture = createTexture(gl, width, height);
    const target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    this.#draw(width, height, 1, [0, 0]);
    const pixels = new Uint8ClampedArray(width * height * 4);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    gl.deleteTexture(texture);
    const flipped = new Uint8ClampedArray(pixels.length);
    for (let y = 0; y < height; y++) {
      flipped.set(pixels.subarray(y * width * 4, (y + 1) * width * 4), (height - 1 - y) * width * 4);
    }
    return new ImageData(flipped, width, height);
  }

  // The film's pixel is of the present picture.
  isKnown(x, y) {
    return !!this.film && ((!this.under && this.whole) || this.validAt(x, y));
  }

  // All numbers of a pixel by the names of their planes, or null where the film has none of the present picture.
  pixel(x, y) {
    if (!this.isKnown(x, y)) return null;
    const values = {};
    for (const name of this.film.names(this.#filled)) values[name] = this.film.at(name, x, y);
    return values;
  }

  // The difference of a pixel from the pinned one, in standard errors; undefined: not known, NaN: not defined.
  standardErrors(x, y) {
    if (!this.comparable || !this.isKnown(x, y)) return undefined;
    const read = (layer, names) => names.map((name) => layer.at(name, x, y));
    const { film, reference } = this,
      colours = channelById('radiance').planes;
    const parts = [read(film, colours), read(reference, colours)];
    const errors = [read(film, planesForError), read(reference, planesForError)];
    if ([...parts, ...errors].flat().includes(undefined)) return undefined;
    return standardErrors(...parts, ...errors, this.relation);
  }
}

function isIn(tiles, x, y) {
  for (const [x0, y0, x1, y1] of tiles.values()) if (x >= x0 && x < x1 && y >= y0 && y < y1) return true;
  return false;
}

function area([x0, y0, x1, y1]) {
  return (x1 - x0) * (y1 - y0);
}
