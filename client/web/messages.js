// Sentences for people: messages that go away, a banner for a state that lasts, and a word for screen readers.

import { find, make } from './dom.js';

const SHOWN_MS = { info: 6000, good: 4000, error: 14000 };
const MOST = 4;

export function say(text, kind = 'info') {
  const list = find('messages');
  for (const old of list.children) if (old.textContent === text) old.remove();
  const message = make('div', {
    class: `message ${kind}`,
    text,
    title: 'Click to close',
    on: { click: () => message.remove() },
  });
  list.append(message);
  while (list.children.length > MOST) list.firstChild.remove();
  setTimeout(() => message.remove(), SHOWN_MS[kind] ?? SHOWN_MS.info);
  return message;
}

// more: elements below the sentence.
export function banner(text, ...more) {
  find('banner').replaceChildren(text, ...more);
  find('banner').hidden = !text;
}

export function announce(text) {
  find('live').textContent = text;
}
