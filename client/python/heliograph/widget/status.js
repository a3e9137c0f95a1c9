// The state of a picture in a line.

import { short } from '../web/dom.js';

const ENDS = {
  samples: 'all samples taken',
  time: 'time is up',
  error: 'target error reached',
  cancelled: 'cancelled',
  failed: 'failed',
};

// The picture that a message `picture` holds.
export function statusText({ preview, size, status }) {
  const { samples, seconds, error, all_black: black, reuse_share: carried, ended_by: end } = status;
  const parts = [preview ? 'moving' : (ENDS[end] ?? 'rendering'), `${size[0]} × ${size[1]}`];
  if (preview) return parts.join(' · ');
  parts.push(`${samples.toLocaleString('en')} samples`);
  if (black) parts.push('all black so far');
  else if (error !== null) parts.push(`error ${short(error, 3)}`);
  if (carried > 0.005) parts.push(`${Math.round(100 * carried)} % carried over`);
  parts.push(`${short(seconds, 3)} s`);
  return parts.join(' · ');
}
