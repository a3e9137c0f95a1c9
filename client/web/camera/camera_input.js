// Mouse, trackpad, touch and keys on the picture: moves of the camera.

import { onLeave } from '../dom.js';

const ORBIT_PER_PIXEL = 0.006; // radians
const TURN_PER_SECOND = 1.2;
const DOLLY_PER_NOTCH = 0.0015; // of the logarithm of the distance, by a pixel of the wheel
const FLY_PER_SECOND = 0.35; // of the scene's size
const DOUBLE_TAP_MS = 320;

const FLY = { KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, -1, 0], KeyE: [0, 1, 0] };
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

// app.moved(time): the camera has changed by an event of that time. app.pickPivot, app.pickFocus, app.hover take a
// viewport and a point of it in CSS pixels.
export function listenToCamera(app, viewport) {
  const { overlay: target } = viewport;
  const pointers = new Map();
  let drag = null;
  let lastTap = { time: 0, x: 0, y: 0 };

  const point = (event) => {
    const box = target.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const scale = () => (viewport.picture.zoom * viewport.picture.height) / viewport.ratio || viewport.stage.clientHeight;

  target.addEventListener('contextmenu', (event) => event.preventDefault());

  target.addEventListener('pointerdown', (event) => {
    target.focus({ preventScroll: true });
    target.setPointerCapture(event.pointerId);
    if (drag?.tool) return; // another finger
    pointers.set(event.pointerId, point(event));
    if (pointers.size === 1 && app.tool?.down(viewport, ...point(event), event)) {
      drag = { tool: app.tool };
      return;
    }
    if (pointers.size === 1) {
      const pan = event.button === 1 || event.button === 2 || event.shiftKey;
      drag = { kind: event.altKey ? 'shift' : pan ? 'pan' : 'orbit', moved: 0 };
    } else {
      drag = { kind: 'pinch', moved: 99, spread: spread(), centre: centre() };
    }
    if (event.button === 1) event.preventDefault();
  });

  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1;
  };
  const centre = () => {
    const [a, b] = [...pointers.values()];
    return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  };

  target.addEventListener('pointermove', (event) => {
    const now = point(event);
    if (!drag || !pointers.has(event.pointerId)) {
      app.hover(viewport, ...now);
      return;
    }
    if (drag.tool) {
      if (drag.tool === app.tool) drag.tool.move(viewport, ...now);
      return;
    }
    const [x, y] = pointers.get(event.pointerId);
    const dx = now[0] - x,
      dy = now[1] - y;
    pointers.set(event.pointerId, now);
    drag.moved += Math.abs(dx) + Math.abs(dy);
    if (!dx && !dy) return;
    if (drag.kind === 'pinch') {
      if (pointers.size < 2) return;
      const [cx, cy] = centre(),
        grown = spread();
      const [u, v] = viewport.uvAt(cx, cy);
      app.camera.dolly(drag.spread / grown, u, v, viewport.aspect);
      app.camera.pan((cx - drag.centre[0]) / scale(), (cy - drag.centre[1]) / scale());
      drag.spread = grown;
      drag.centre = [cx, cy];
    } else if (drag.kind === 'shift') {
      viewport.shift(dx, dy);
      return;
    } else if (drag.kind === 'pan') {
      app.camera.pan(dx / scale(), dy / scale());
    } else {
      app.camera.orbit(-dx * ORBIT_PER_PIXEL, -dy * ORBIT_PER_PIXEL);
    }
    app.moved(event.timeStamp);
  });

  const up = (event) => {
    if (!pointers.delete(event.pointerId)) return;
    if (drag?.tool) {
      if (drag.tool !== app.tool) drag = null;
      else if (event.type === 'pointercancel') drag.tool.leave();
      else drag.tool.up(viewport, ...point(event));
    } else if (drag && drag.moved < 4 && event.type === 'pointerup') {
      tapped(event, ...point(event));
    }
    drag = pointers.size ? { kind: 'orbit', moved: 99 } : null;
  };
  target.addEventListener('pointerup', up);
  target.addEventListener('pointercancel', up);
  target.addEventListener('pointerleave', (event) => {
    if (!drag && event.pointerType !== 'touch') app.hover(viewport, NaN, NaN); // what a finger tapped stays
  });

  const tapped = (event, x, y) => {
    if (event.pointerType === 'touch') app.hover(viewport, x, y, true);
    const near = Math.hypot(x - lastTap.x, y - lastTap.y) < 12;
    if (event.button === 0 && near && event.timeStamp - lastTap.time < DOUBLE_TAP_MS) {
      app.pickPivot(viewport, x, y);
      lastTap.time = 0;
    } else {
      lastTap = { time: event.timeStamp, x, y };
    }
  };

  // A page around the picture may be scrolled until the picture has the focus.
  target.addEventListener(
    'wheel',
    (event) => {
      if (document.activeElement !== target) return;
      event.preventDefault();
      const [x, y] = point(event);
      const pixels = event.deltaY * (event.deltaMode === 1 ? 33 : event.deltaMode === 2 ? 400 : 1);
      if (event.altKey) {
        viewport.zoomBy(Math.exp(-pixels * 2 * DOLLY_PER_NOTCH), x, y);
        return;
      }
      const [u, v] = viewport.uvAt(x, y);
      const speed = event.ctrlKey ? 6 : 1; // a trackpad's pinch comes in small steps
      const clamp = (value) => Math.min(Math.max(value, -1), 1);
      app.camera.dolly(
        Math.exp(Math.min(Math.max(pixels, -400), 400) * speed * DOLLY_PER_NOTCH),
        clamp(u),
        clamp(v),
        viewport.aspect,
      );
      app.moved(event.timeStamp);
    },
    { passive: false },
  );

  const held = new Set();
  let last = 0;
  const step = (time) => {
    if (!held.size) return;
    const seconds = Math.min((time - last) / 1000, 0.1);
    last = time;
    move(seconds, held.has('Shift') ? 4 : 1);
    app.moved(performance.now());
    requestAnimationFrame(step);
  };
  const move = (seconds, fast) => {
    const { camera } = app;
    const fly = [0, 0, 0];
    for (const key of held) {
      if (FLY[key])
        FLY[key].forEach((value, i) => {
          fly[i] += value;
        });
      if (ARROWS[key])
        camera.orbit(ARROWS[key][0] * TURN_PER_SECOND * seconds, ARROWS[key][1] * TURN_PER_SECOND * seconds);
    }
    if (fly.some(Boolean)) {
      const reach = camera.size * FLY_PER_SECOND * seconds * fast;
      camera.move(
        [0, 1, 2].map((i) => reach * (camera.right[i] * fly[0] + (i === 1 ? fly[1] : 0) + camera.forward[i] * fly[2])),
      );
    }
  };
  // Inspects the picture's middle, or the pixel beside the one that is inspected.
  const inspect = (event) => {
    const { picture } = viewport,
      arrow = event.altKey && ARROWS[event.code];
    if (!arrow && (event.key !== 'Enter' || event.altKey)) return false;
    const middle = [picture.width >> 1, picture.height >> 1];
    const from = arrow && app.inspector.viewport === viewport ? (app.inspector.at ?? middle) : middle;
    const step = event.shiftKey ? 10 : 1;
    const pixel = [picture.width, picture.height].map((side, i) =>
      Math.min(Math.max(from[i] + (arrow ? arrow[i] * step : 0), 0), side - 1),
    );
    app.hover(viewport, ...viewport.stageAt(pixel[0] + 0.5, pixel[1] + 0.5), true);
    return true;
  };
  target.addEventListener('keydown', (event) => {
    const plain = !event.ctrlKey && !event.metaKey;
    if (plain && ((!event.altKey && app.tool?.key(viewport, event, ARROWS[event.code])) || inspect(event))) {
      event.preventDefault();
      return;
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === 'Shift') held.size && held.add('Shift');
    if (!FLY[event.code] && !ARROWS[event.code]) return;
    event.preventDefault();
    if (held.has(event.code)) return;
    const idle = ![...held].some((key) => key !== 'Shift');
    if (event.shiftKey) held.add('Shift');
    held.add(event.code);
    if (idle) {
      last = performance.now();
      move(1 / 60, 1); // a tap moves a little at once
      app.moved(event.timeStamp);
      requestAnimationFrame(step);
    }
  });
  target.addEventListener('keyup', (event) => {
    held.delete(event.code);
    if (event.key === 'Shift' || [...held].every((key) => key === 'Shift')) held.delete('Shift');
  });
  target.addEventListener('blur', () => held.clear());
  onLeave(target, () => held.clear());
}
