// Sentences for people: messages that go away, a banner for a state that lasts, and a word for screen readers.

import { find, make } from './dom.js';

const SHOWN_MS = { info: 6000, good: 4000, error: 14000, busy: 300000 };
const MOST = 4;

// kind: 'info', 'good', 'error', or 'busy' of what takes its time, which the caller removes. Answers the message.
export function say(text, kind = 'info') {
  const list = find('messages');
  for (const old of list.children) if (old.textContent === text) old.remove();
  const message = make('div', {
    class: `message ${kind}`,
    text,
    title: 'Click, or escape, to close',
    on: { click: () => message.remove() },
  });
  list.append(message);
  while (list.children.length > MOST) list.firstChild.remove();
  setTimeout(() => message.remove(), SHOWN_MS[kind] ?? SHOWN_MS.info);
  return message;
}

// Closes the newest message; false: there is none.
export function closeMessage() {
  const newest = find('messages').lastElementChild;
  newest?.remove();
  return newest !== null;
}

// more: what follows the sentence and is not announced, as how long the page waits. A sentence that stays is not
// announced again.
export function banner(text, ...more) {
  const sentence = find('banner-text');
  if (sentence.textContent !== text) sentence.textContent = text;
  find('banner-more').replaceChildren(...more.filter(Boolean));
  find('banner').hidden = !text;
}

export function announce(text) {
  find('live').textContent = text;
}
