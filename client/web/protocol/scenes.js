// The scene that is shown: where it came from and what was edited, so that it can be made again on another daemon.

import { Code } from './connection.js';
import { Sha256 } from './sha256.js';

const CHUNK = 1 << 20; // bytes of a file that are read at a time
const WAITING = 8 << 20; // bytes of an upload that may wait in the socket

const cancelled = () => new DOMException('The upload was cancelled.', 'AbortError');

// The bytes of a file, so many at a time.
async function* pieces(file) {
  for (let start = 0; start < file.size; start += CHUNK) {
    yield new Uint8Array(await file.slice(start, start + CHUNK).arrayBuffer());
  }
}

export class Scenes {
  #edits = new Map(); // by target: the whole edit of it
  #ensuring = null;
  #superseded = new Set(); // ids of edited scenes that are shown no more

  constructor(connection) {
    this.connection = connection;
    this.current = null; // SceneInfo
    this.loaded = null; // the one that was loaded, before any edit
    this.source = null; // { path, environment } or { files, main, environment }
  }

  get edits() {
    return [...this.#edits.values()];
  }

  // Loads from one of the daemon's roots.
  async openPath(path, environment = '') {
    const answer = await this.#load([{ begin: { path, environment } }]);
    this.#take(answer, { path, environment });
    return answer;
  }

  // Takes a scene that the daemon holds already. path: below its roots, where it loaded the scene from.
  async openId(sceneId, path) {
    const answer = await this.connection.call('list_scenes', { scene_id: sceneId });
    if (!answer.scenes.length) throw new Error('The daemon does not hold this scene any more.');
    this.#take({ scene: answer.scenes[0] }, path ? { path, environment: '' } : { id: sceneId });
    return { scene: answer.scenes[0], warnings: [], notices: [], unread: [] };
  }

  // files: [{ name, file }]; progress(step, bytes done, of) with step 'read' (for the digests) or 'send'; signal: an
  // AbortSignal.
  async upload(files, main, progress, signal) {
    const hashed = [];
    const total = files.reduce((sum, { file }) => sum + file.size, 0);
    let read = 0;
    for (const { name, file } of files) {
      const digest = new Sha256();
      for await (const data of pieces(file)) {
        if (signal?.aborted) throw cancelled();
        digest.update(data);
        read += data.length;
        progress?.('read', read, total);
      }
      hashed.push({ name, file, sha256: digest.digest() });
    }
    const source = { files, main };
    const self = this;
    async function* requests() {
      let sent = 0;
      yield { begin: { main_file: main, total_bytes: total } };
      for (const { name, file, sha256 } of hashed) {
        yield { begin_file: { name, bytes: file.size, sha256 } };
        for await (const data of pieces(file)) {
          while (self.connection.waiting > WAITING) await new Promise((resume) => setTimeout(resume, 20));
          if (signal?.aborted) throw cancelled();
          yield { data };
          sent += data.length;
          progress?.('send', sent, total);
        }
      }
    }
    const answer = await this.#load(requests(), signal);
    this.#take(answer, source);
    return answer;
  }

  #take(answer, source) {
    this.#leave(answer.scene);
    this.current = answer.scene;
    this.loaded = answer.scene;
    this.source = source;
    this.#edits.clear();
  }

  async #load(requests, signal) {
    return new Promise((resolve, reject) => {
      let answer = null;
      const call = this.connection.stream('load_scene', {
        message: (message) => {
          answer = message;
        },
        end: (status) =>
          status.code === Code.OK && answer
            ? resolve(answer)
            : reject(Object.assign(new Error(status.message), { code: status.code })),
      });
      signal?.addEventListener('abort', () => {
        call.cancel();
        reject(cancelled());
      });
      (async () => {
        for await (const request of requests) {
          if (!call.live) return;
          call.send(request);
        }
        call.end();
      })().catch((error) => {
        call.cancel();
        reject(error);
      });
    });
  }

  // Applies an edit to the loaded scene together with all before. key: of the target; edit: a SceneEdit that says all
  // that was ever changed of it, or null: as it was loaded.
  async edit(key, edit) {
    const before = new Map(this.#edits);
    if (edit) this.#edits.set(key, edit);
    else this.#edits.delete(key);
    try {
      return await this.#apply();
    } catch (error) {
      this.#edits = before;
      throw error;
    }
  }

  async setEdits(edits) {
    const before = this.#edits;
    this.#edits = new Map(edits);
    try {
      return await this.#apply();
    } catch (error) {
      this.#edits = before;
      throw error;
    }
  }

  editEntries() {
    return [...this.#edits];
  }
  editOf(key) {
    return this.#edits.get(key);
  }

  async #apply() {
    const scene = this.#edits.size
      ? (await this.connection.call('edit_scene', { scene_id: this.loaded.scene_id, edits: this.edits })).scene
      : this.loaded;
    this.#leave(scene);
    this.current = scene;
    return this.current;
  }

  // `scene` is shown from now on.
  #leave(scene) {
    if (this.current && this.current !== this.loaded) this.#superseded.add(this.current.scene_id);
    this.#superseded.delete(scene.scene_id);
  }

  // Unloads edited scenes that are shown no more; those that a session still uses stay for the next time.
  async sweep() {
    for (const id of [...this.#superseded]) {
      this.#superseded.delete(id);
      try {
        await this.connection.call('unload_scene', { scene_id: id });
      } catch (error) {
        if (error.code === Code.FAILED_PRECONDITION && id !== this.current.scene_id) this.#superseded.add(id);
      }
    }
  }

  async #isHeld({ scene_id: id }) {
    try {
      return (await this.connection.call('list_scenes', { scene_id: id })).scenes.length > 0;
    } catch (error) {
      if (error.code !== Code.NOT_FOUND) throw error;
      return false;
    }
  }

  // Makes sure that the daemon holds the scene: loads it again, and edits it again, where it does not.
  ensure() {
    this.#ensuring ??= this.#ensure().finally(() => {
      this.#ensuring = null;
    });
    return this.#ensuring;
  }

  async #ensure() {
    if (await this.#isHeld(this.current)) return this.current;
    const edits = this.editEntries(),
      { source } = this;
    if (this.current !== this.loaded && (await this.#isHeld(this.loaded))) return this.#apply();
    if (source.path !== undefined) await this.openPath(source.path, source.environment);
    else if (source.files) await this.upload(source.files, source.main);
    else await this.openId(source.id);
    if (edits.length) await this.setEdits(edits);
    return this.current;
  }
}
