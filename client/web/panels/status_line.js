// The state of the main picture in a line, what matters most first.

import { short } from '../dom.js';

const ENDS = {
  END_REASON_SAMPLES: 'all samples taken',
  END_REASON_TIME: 'time is up',
  END_REASON_ERROR: 'target error reached',
  END_REASON_CANCELLED: 'cancelled',
  END_REASON_FAILED: 'failed',
};

const reason = (app) => app.main?.end && app.connection.codec.nameOf('EndReason', app.main.end.reason);

// Another view took over before the picture was done.
const isSuperseded = (app) => reason(app) === 'END_REASON_SUPERSEDED';

// How much of the budget is used up, [0, 1].
export function usedBudget(app) {
  const done = ['END_REASON_SAMPLES', 'END_REASON_TIME', 'END_REASON_ERROR'].includes(reason(app));
  return done ? 1 : (app.main?.progress?.budget_used ?? 0);
}

export function statusLine(app) {
  const { progress, end, settings } = app.main ?? {};
  if (!app.scenes.current) return '';
  const parts = [];
  if (app.connection.state !== 'open') parts.push('no connection');
  else if (app.stopReason) parts.push('stopped');
  else if (app.paused) parts.push('paused');
  else if (isSuperseded(app)) parts.push(app.main.moving ? 'moving' : 'rendering');
  else if (end) parts.push(ENDS[app.connection.codec.nameOf('EndReason', end.reason)] ?? 'done');
  else if (!progress) parts.push('rendering');
  const size = settings ? [`${settings.width} × ${settings.height}`] : [];
  if (app.gaze.pinned) size.push('gaze pinned');
  if (!progress) return [...parts, ...size].join(' · ');
  const { error } = progress;
  if (error?.all_black) parts.push('all black so far');
  else if (error?.known) parts.push(`error ${short(error.rmse, 3)}`);
  parts.push(`${progress.samples_per_pixel.toLocaleString('en')} samples`, ...size);
  if (progress.samples_per_second) parts.push(`${short(progress.samples_per_second / 1e6, 3)} M samples/s`);
  if (progress.reuse_share > 0.005) parts.push(`${Math.round(100 * progress.reuse_share)} % carried over`);
  if (error?.unproven > 0.001) parts.push(`${short(100 * error.unproven, 2)} % unproven`);
  if (progress.invalid_samples) parts.push(`${progress.invalid_samples} invalid samples`);
  parts.push(`${short(progress.seconds, 3)} s`);
  return parts.join(' · ');
}
