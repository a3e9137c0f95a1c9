// The way between a view and its session through the kernel: messages as pages.py tells them.

const MOST_MOVES = 2; // cameras that the kernel has not answered; the newest waits here, not in the kernel's queue

let views = 0;

// handlers: picture(message, tiles), tiles the bytes of EXR files; problem(text); ended(text).
export class Link {
  #move = 0;
  #answered = 0;
  #waiting = null;
  #closed = false;

  constructor(model, handlers) {
    this.model = model;
    this.handlers = handlers;
    this.page = `${Date.now().toString(36)}-${Math.random().toString(36).slice(2)}-${++views}`;
    this.listener = (message, buffers) => this.#receive(message, buffers);
    model.on('msg:custom', this.listener);
    this.#send({ kind: 'open' });
  }

  #send(message) {
    try {
      this.model.send({ ...message, page: this.page });
    } catch (error) {
      this.handlers.problem(`The kernel cannot be reached: ${error.message}`);
    }
  }

  #receive(message, buffers) {
    if (this.#closed || message?.page !== this.page) return;
    const { handlers } = this;
    try {
      if (message.kind === 'picture') {
        handlers.picture(
          message,
          buffers.map((view) => new Uint8Array(view.buffer ?? view, view.byteOffset ?? 0, view.byteLength)),
        );
      } else if (message.kind === 'moved') {
        this.#answered = Math.max(this.#answered, message.move);
        if (this.#waiting) this.sendCamera(this.#waiting);
      } else if (message.kind === 'problem') {
        handlers.problem(message.text);
      } else if (message.kind === 'ended') {
        handlers.ended(message.text);
      }
    } catch (error) {
      handlers.problem(`${error.name}: ${error.message}`);
      if (message.kind === 'picture') this.drawn(message.picture); // or no other would come
    }
  }

  drawn(picture) {
    if (!this.#closed) this.#send({ kind: 'drawn', picture });
  }

  // The camera has moved on since the picture was sent whose session knew of this move.
  moving(move) {
    return this.#waiting !== null || move < this.#move;
  }

  sendCamera(camera) {
    if (this.#move - this.#answered >= MOST_MOVES) {
      this.#waiting = camera;
      return;
    }
    this.#waiting = null;
    this.#send({ kind: 'camera', move: ++this.#move, camera: { view: camera.message(), pivot: camera.pivot } });
  }

  close() {
    this.#send({ kind: 'close' });
    this.#closed = true;
    this.model.off('msg:custom', this.listener);
  }
}
