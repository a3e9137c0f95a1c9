// Drawn over the picture: numbers in pixels that are large enough, the split, the region, marks of the camera.

import { channelById, valueOf } from './channels.js';
import { short } from '../dom.js';
import { Compare } from './compare.js';

const LEAST_PIXEL = 52; // CSS pixels a side from which numbers fit

export function drawOverlay(app, viewport) {
  const { overlay, picture, ratio } = viewport;
  // Most of the time nothing lies over the picture, and an empty canvas that changes is composed anew all the same.
  const marked =
    picture.zoom / ratio >= LEAST_PIXEL ||
    viewport.box ||
    viewport.settings?.region ||
    viewport.mark ||
    app.gaze.pinned ||
    app.inspector?.mark ||
    app.comparing(viewport) !== Compare.NONE;
  if (!marked && !viewport.marked) return;
  viewport.marked = marked;
  const g = overlay.getContext('2d');
  g.setTransform(1, 0, 0, 1, 0, 0);
  g.clearRect(0, 0, overlay.width, overlay.height);
  if (!picture.width) return;
  const [ox, oy] = picture.origin,
    { zoom } = picture;
  const x = (film) => ox + film * zoom,
    y = (film) => oy + film * zoom;
  if (zoom / ratio >= LEAST_PIXEL) numbers(g, app, viewport, x, y);
  const region =
    viewport.box ??
    (viewport.settings?.region && ['x0', 'y0', 'x1', 'y1'].map((name) => viewport.settings.region[name]));
  if (region) {
    const [x0, y0, x1, y1] = region;
    if (viewport.settings?.region && !viewport.box) {
      g.fillStyle = 'rgb(11 12 14 / 45%)';
      g.beginPath();
      g.rect(x(0), y(0), picture.width * zoom, picture.height * zoom);
      g.rect(x(x0), y(y0), (x1 - x0) * zoom, (y1 - y0) * zoom);
      g.fill('evenodd');
    }
    g.strokeStyle = '#f0b860';
    g.lineWidth = ratio;
    g.setLineDash([5 * ratio, 4 * ratio]);
    g.strokeRect(x(x0) + 0.5, y(y0) + 0.5, (x1 - x0) * zoom, (y1 - y0) * zoom);
    g.setLineDash([]);
  }
  if (app.gaze.pinned) {
    const gaze = app.gaze.of(picture);
    g.strokeStyle = '#f0b860';
    g.lineWidth = 1.5 * ratio;
    g.beginPath();
    g.arc(x(gaze.x), y(gaze.y), 7 * ratio, 0, 7);
    g.stroke();
  }
  if (app.comparing(viewport) === Compare.SPLIT) {
    const at = x(app.look.split * picture.width),
      middle = overlay.height / 2;
    g.fillStyle = '#ffffff';
    g.fillRect(Math.round(at) - ratio / 2, y(0), ratio, picture.height * zoom);
    g.beginPath();
    g.arc(at, middle, 9 * ratio, 0, 7);
    g.fill();
    g.fillStyle = '#131519';
    for (const side of [-1, 1]) {
      g.beginPath();
      g.moveTo(at + side * 6 * ratio, middle);
      g.lineTo(at + side * 2 * ratio, middle - 3.5 * ratio);
      g.lineTo(at + side * 2 * ratio, middle + 3.5 * ratio);
      g.fill();
    }
    label(g, ratio, 'now', at - 12 * ratio, y(0) + 22 * ratio, 'right');
    label(g, ratio, 'pinned', at + 12 * ratio, y(0) + 22 * ratio, 'left');
  }
  if (app.comparing(viewport) === Compare.REFERENCE) {
    label(g, ratio, 'pinned', x(0) + 14 * ratio, y(0) + 24 * ratio, 'left');
  }
  if (app.inspector?.mark) corners(g, ratio, zoom, ...app.inspector.mark.map((v, i) => (i ? y(v) : x(v))));
  const mark = viewport.mark;
  if (mark && performance.now() - mark.time < 1200) {
    g.globalAlpha = 1 - (performance.now() - mark.time) / 1200;
    g.strokeStyle = '#f0b860';
    g.lineWidth = 1.5 * ratio;
    g.beginPath();
    g.arc(mark.x * ratio, mark.y * ratio, 11 * ratio, 0, 7);
    g.moveTo((mark.x - 16) * ratio, mark.y * ratio);
    g.lineTo((mark.x + 16) * ratio, mark.y * ratio);
    g.moveTo(mark.x * ratio, (mark.y - 16) * ratio);
    g.lineTo(mark.x * ratio, (mark.y + 16) * ratio);
    g.stroke();
    g.globalAlpha = 1;
    requestAnimationFrame(() => drawOverlay(app, viewport));
  } else if (mark) {
    viewport.mark = null;
  }
}

// Marks the pixel at (x, y) of the canvas by the corners of a square around it.
function corners(g, ratio, zoom, x, y) {
  const half = Math.max(zoom / 2 + 2 * ratio, 7 * ratio),
    arm = half * 0.45;
  const [cx, cy] = [x + zoom / 2, y + zoom / 2];
  g.beginPath();
  for (const [sx, sy] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
    g.moveTo(cx + sx * half, cy + sy * (half - arm));
    g.lineTo(cx + sx * half, cy + sy * half);
    g.lineTo(cx + sx * (half - arm), cy + sy * half);
  }
  for (const [width, colour] of [[3.5, 'rgb(0 0 0 / 70%)'], [1.5, '#f0b860']]) {
    g.lineWidth = width * ratio;
    g.strokeStyle = colour;
    g.stroke();
  }
}

function label(g, ratio, text, x, y, align) {
  g.font = `${12 * ratio}px system-ui`;
  g.textAlign = align;
  const { width } = g.measureText(text),
    left = align === 'right' ? x - width : x;
  g.fillStyle = 'rgb(11 12 14 / 70%)';
  g.fillRect(left - 6 * ratio, y - 14 * ratio, width + 12 * ratio, 20 * ratio);
  g.fillStyle = '#d8dade';
  g.fillText(text, x, y);
}

function numbers(g, app, viewport, x, y) {
  const { picture, overlay, ratio } = viewport,
    { zoom, film } = picture;
  if (!film) return;
  const channel = channelById(viewport.look.channel);
  const from = viewport.filmAt(0, 0).map((v) => Math.max(0, Math.floor(v)));
  const to = [
    Math.min(picture.width, Math.ceil((overlay.width - picture.origin[0]) / zoom)),
    Math.min(picture.height, Math.ceil((overlay.height - picture.origin[1]) / zoom)),
  ];
  const size = Math.min(12, zoom / ratio / 4.6) * ratio;
  g.font = `${size}px system-ui`;
  g.textAlign = 'center';
  g.lineWidth = 2.5 * ratio;
  g.strokeStyle = 'rgb(0 0 0 / 75%)';
  for (let py = from[1]; py < to[1]; py++) {
    for (let px = from[0]; px < to[0]; px++) {
      if (!picture.pixel(px, py)) continue;
      const value = valueOf(channel, (name) => film.at(name, px, py) ?? NaN, app.look.floor);
      const lines = Array.isArray(value) ? value : [value];
      lines.forEach((number, i) => {
        g.fillStyle = lines.length > 1 ? ['#ff9d92', '#9fe3aa', '#9cc3ff'][i] : '#ffffff';
        const text = short(number, 3),
          ty = y(py + 0.5) + (i - (lines.length - 1) / 2 + 0.35) * size * 1.25;
        g.strokeText(text, x(px + 0.5), ty);
        g.fillText(text, x(px + 0.5), ty);
      });
    }
  }
}
