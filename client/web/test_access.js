// window.heliograph: what tests read. README.md lists it.

import { exrOf, pngOf } from './picture/save.js';

// As JSON has it: numbers that are too large for it become text.
const plain = (state) =>
  JSON.parse(JSON.stringify(state, (name, value) => (typeof value === 'bigint' ? String(value) : value)));

export function exposeForTests(app) {
  const viewport = (number = 0) => app.viewports[number];
  globalThis.heliograph = {
    app,
    counters: app.counters,
    camera: app.camera,
    state: (number) => {
      if (!viewport(number)) return null;
      const { picture, session, progress, end, settings, moving, name, own, trouble, error, points } = viewport(number);
      return plain({
        connection: app.connection.state,
        scene: app.scenes.current?.scene_id ?? '',
        session: session.id,
        attached: session.attached,
        paused: app.paused,
        width: picture.width,
        height: picture.height,
        revision: picture.revision,
        viewId: picture.viewId,
        sentViewId: session.viewId,
        complete: picture.complete,
        covered: picture.under ? picture.width * picture.height : picture.covered, // pixels that show something
        preview: picture.under !== null,
        moving,
        settings,
        budget: app.budget,
        progress,
        end,
        look: { ...app.look },
        camera: app.camera.message(),
        renderer: picture.renderer,
        planes: picture.film?.names(picture.revision) ?? [],
        pinned: picture.reference !== null,
        gaze: app.gaze.at,
        gazePinned: app.gaze.pinned,
        frame: app.frame,
        sessions: app.viewports.length,
        name,
        own,
        trouble,
        error,
        points,
        zoom: picture.zoom,
        origin: picture.origin,
        bytes: app.connection.bytes,
      });
    },
    pixel: (x, y, number) => viewport(number).picture.pixel(x, y),
    inspect: (x, y) => app.inspector.read(app.main, x, y),
    latencies: (number) => viewport(number).meter.latencies,
    figures: () => app.panels.link.figures(app.main),
    exr: () => exrOf(app.main.picture),
    png: () => pngOf(app.main.picture),
    loseContext: (restoreAfterMs) => app.main.picture.loseContext(restoreAfterMs),
    shown: (x, y) => {
      const { data, width } = app.active.picture.snapshot();
      return [...data.subarray((y * width + x) * 4, (y * width + x) * 4 + 3)];
    },
  };
}
