// The WebSocket to the daemon: says hello, numbers calls, tells each call its answers, and comes back when it is lost.

import { Codec } from './proto.js';

const ENVELOPE = 1;
const FIRST_WAIT_S = 0.25,
  LONGEST_WAIT_S = 10;
const FULL = 503; // of HTTP
const TOKEN_REFUSED = 4401,
  OTHER_VERSION = 4400; // closed for good: trying again would not help

export const Code = {
  OK: 0,
  CANCELLED: 1,
  INVALID_ARGUMENT: 3,
  NOT_FOUND: 5,
  PERMISSION_DENIED: 7,
  RESOURCE_EXHAUSTED: 8,
  FAILED_PRECONDITION: 9,
  ABORTED: 10,
  UNIMPLEMENTED: 12,
  UNAVAILABLE: 14,
};

export class CallError extends Error {
  constructor(status, lost = false) {
    super(status.message || `the call ended with status ${status.code}`);
    this.code = status.code;
    this.lost = lost; // the connection went, not the call
  }
}

export class Connection {
  #calls = new Map();
  #next = 1;
  #wait_s = FIRST_WAIT_S;
  #socket = null;
  #timer = 0;
  #stopped = false;
  #opened = false; // the newest connection was

  // onState(state, sentence, more): state is 'connecting', 'open', 'lost' (and tried again) or 'refused'; sentence is
  // for people, more says what the page does about it. link: received(bytes), of each message; heldUp(bytes a second):
  // the connection takes no more, and holds answers up.
  constructor(token, onState, link) {
    this.token = token;
    this.onState = onState;
    this.link = link;
    this.state = 'connecting';
    this.tokenRefused = false;
    this.codec = null;
    this.bytes = 0;
  }

  async start() {
    clearTimeout(this.#timer);
    this.#stopped = false;
    const problem = this.#opened ? '' : await this.#ask();
    if (problem) this.#lost(problem);
    if (problem || this.#stopped) return;
    this.#opened = false;
    const address = new URL('ws', location.href);
    address.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    address.hash = '';
    const socket = new WebSocket(address, 'heliograph.v1');
    socket.binaryType = 'arraybuffer';
    this.#socket = socket;
    socket.onopen = () => this.#send(0, 'hello', { token: this.token, envelope: ENVELOPE });
    socket.onmessage = (event) => this.#receive(new Uint8Array(event.data));
    socket.onclose = (event) => this.#closed(event);
  }

  // Fetches the protocol. Answers why no connection is to be had: a WebSocket does not tell; '': it may be.
  async #ask() {
    try {
      const answer = await fetch('protocol.json');
      if (answer.status === FULL) return 'The daemon is full: all its connections are in use (--max-http-connections)';
      if (!answer.ok) return `The daemon answers with status ${answer.status}`;
      this.codec ??= new Codec(await answer.json());
      return '';
    } catch {
      return 'The daemon does not answer';
    }
  }

  stop() {
    this.#stopped = true;
    clearTimeout(this.#timer);
    this.#socket?.close();
  }

  // Bytes that wait to be sent: an upload holds back while there are many.
  get waiting() {
    return this.#socket?.bufferedAmount ?? 0;
  }

  // One request, one answer.
  call(kind, request = {}) {
    return new Promise((resolve, reject) => {
      let answer;
      this.stream(kind, {
        message: (message) => {
          answer = message;
        },
        end: (status, lost) =>
          status.code === Code.OK && answer ? resolve(answer) : reject(new CallError(status, lost)),
      }).send(request);
    });
  }

  // A call whose requests and answers are many. handlers: message(answer), end(status, lost).
  stream(kind, handlers) {
    const id = this.#next++;
    const live = () => this.#calls.has(id);
    if (this.state === 'open') {
      this.#calls.set(id, { kind, handlers });
    } else {
      queueMicrotask(() => handlers.end({ code: Code.UNAVAILABLE, message: 'There is no connection.' }, true));
    }
    return {
      send: (request) => live() && this.#send(id, kind, request),
      end: () => live() && this.#send(id, 'end', {}),
      cancel: () => live() && this.#send(id, 'cancel', {}),
      get live() {
        return live();
      },
    };
  }

  #send(id, kind, request) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return;
    this.#socket.send(this.codec.encode('heliograph.v1.WebRequest', { id, [kind]: request }));
  }

  #receive(bytes) {
    this.bytes += bytes.length;
    this.link.received(bytes.length);
    const answer = this.codec.decode('heliograph.v1.WebResponse', bytes);
    if (answer.welcome) {
      this.#wait_s = FIRST_WAIT_S;
      this.#opened = true;
      this.#tell('open', '');
      return;
    }
    if (answer.link) this.link.heldUp(answer.link.bytes_per_second);
    const call = this.#calls.get(answer.id);
    if (!call) return;
    if (answer.status) {
      this.#calls.delete(answer.id);
      call.handlers.end(answer.status, false);
    } else if (answer[call.kind]) {
      call.handlers.message(answer[call.kind], bytes.length);
    }
  }

  #closed(event) {
    const calls = [...this.#calls.values()];
    this.#calls.clear();
    this.#socket = null;
    this.tokenRefused = event.code === TOKEN_REFUSED;
    const permanent = event.code === TOKEN_REFUSED || event.code === OTHER_VERSION;
    if (permanent) this.#tell('refused', event.reason || 'The daemon refused the connection.');
    else if (!this.#stopped) this.#lost(event.reason || 'The connection to the daemon is lost');
    for (const call of calls) {
      call.handlers.end({ code: Code.UNAVAILABLE, message: event.reason || 'The connection is lost.' }, true);
    }
  }

  #lost(why) {
    this.#tell('lost', `${why.replace(/\.$/, '')}.`, `Trying again in ${this.#wait_s} s.`);
    this.#timer = setTimeout(() => this.start(), this.#wait_s * 1000);
    this.#wait_s = Math.min(this.#wait_s * 2, LONGEST_WAIT_S);
  }

  #tell(state, sentence, more = '') {
    this.state = state;
    this.onState(state, sentence, more);
  }
}
