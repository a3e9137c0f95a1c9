// Elements of the page, made by code: no markup is ever read from text.

// attributes: `on` holds listeners, `text` the text; what is a property of the element is set as one.
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null) continue;
    if (name === 'on') for (const [event, listener] of Object.entries(value)) element.addEventListener(event, listener);
    else if (name === 'text') element.textContent = value;
    else if (name === 'class') element.className = value;
    else if (name in element && !name.startsWith('aria')) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

// Calls when the page can no longer tell that a key is let go: the window loses the focus, or is hidden. Ends with the
// element, once it is no longer in the page.
export function onLeave(element, listener) {
  const end = new AbortController();
  const heard = () => (element.isConnected ? listener() : end.abort());
  addEventListener('blur', heard, end);
  document.addEventListener('visibilitychange', heard, end);
}

// Fingers are the main pointer.
export const coarse = () => matchMedia('(pointer: coarse)').matches;

export const find = (id) => document.getElementById(id);

export function field(label, id, ...controls) {
  const name = make('label', { text: label, htmlFor: id });
  return make(
    'div',
    { class: 'field' },
    name,
    controls.length > 1 ? make('div', { class: 'row' }, ...controls) : controls[0],
  );
}

// options: [[value, text], ...]
export function select(id, options, value, onChange, label) {
  const element = make(
    'select',
    { id, on: { change: () => onChange(element.value) } },
    ...options.map(([v, text]) => make('option', { value: v, text })),
  );
  if (label) element.setAttribute('aria-label', label);
  element.value = value;
  return element;
}

export function button(id, text, onClick, more = {}) {
  return make('button', { id, type: 'button', text, on: { click: onClick }, ...more });
}

export function check(id, text, checked, onChange) {
  const box = make('input', { id, type: 'checkbox', checked, on: { change: () => onChange(box.checked) } });
  return make('label', { class: 'check' }, box, text);
}

// What is typed is brought into the range of min and max, if there is one.
export function number(id, value, onChange, more = {}) {
  const changed = () => {
    const { min = -Infinity, max = Infinity, step } = more;
    const within = Math.min(Math.max(Number(element.value), min), max);
    if (element.value !== '') element.value = String(step === 1 ? Math.round(within) : within);
    onChange(element.value);
  };
  const element = make('input', { id, type: 'number', value, on: { change: changed }, ...more });
  return element;
}

export function section(id, title, open, ...children) {
  const body = make('div', { class: 'body' }, ...children);
  return make('details', { id, class: 'section', open }, make('summary', { text: title }), body);
}

// A number for people: four digits, and a power of ten where it is far from 1.
export function short(value, digits = 4) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? 'NaN' : value > 0 ? '∞' : '−∞';
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(2).replace('e+', 'e');
  return String(Number(value.toPrecision(digits)));
}

export function bytes(value) {
  const unit = value >= 1e9 ? [1e9, 'GB'] : value >= 1e6 ? [1e6, 'MB'] : value >= 1e3 ? [1e3, 'kB'] : [1, 'B'];
  return `${Number((value / unit[0]).toPrecision(3))} ${unit[1]}`;
}

export const ms = (value) => (Number.isFinite(value) ? `${Math.round(value)} ms` : '–');
