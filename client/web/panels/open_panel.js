// Opens scenes: from the lists of the daemon's roots, or uploaded from this machine.

import { button, bytes, find, make, section } from '../dom.js';

const SCENE = /\.(glb|gltf|xml)$/i;

export class OpenPanel {
  #folders = [];
  #cancel = null;

  constructor(app) {
    this.app = app;
    this.list = make('div', { class: 'list', id: 'files' });
    this.path = make('p', { class: 'note', id: 'files-path' });
    this.note = make('p', { class: 'note', id: 'open-note', 'aria-live': 'polite' });
    // Over the picture, wherever the panel is.
    this.step = make('span', { id: 'upload-step', role: 'status' });
    this.bar = make('progress', { id: 'upload-progress', max: 1, value: 0, 'aria-label': 'Progress of the upload' });
    this.box = make(
      'div',
      { id: 'upload-box', hidden: true },
      this.step,
      this.bar,
      button('upload-cancel', 'Cancel', () => this.#cancel?.abort()),
    );
    find('stages').append(this.box);
    this.input = make('input', {
      id: 'upload-files',
      type: 'file',
      multiple: true,
      hidden: true,
      on: {
        change: () => {
          this.upload([...this.input.files].map((file) => ({ name: file.name, file })));
          this.input.value = '';
        },
      },
    });
    this.content = make(
      'div',
      { id: 'open-content', class: 'group' },
      this.path,
      this.list,
      make('div', { class: 'row' }, button('upload', 'Open files of this machine …', () => this.input.click())),
      this.note,
      this.input,
    );
    this.element = section('section-open', 'Open', false);
    this.body = this.element.lastChild;
    this.card = make(
      'div',
      { class: 'card' },
      make('h1', { text: 'Heliograph' }),
      make('p', {
        text: 'Open a scene of the daemon, or drop a .glb, or a .gltf or .xml with its files, onto this page.',
      }),
    );
    find('welcome').append(this.card);
    this.element.addEventListener('toggle', () => this.element.open && this.browse(this.#folders.at(-1) ?? ''));
    this.#listenToDrops();
  }

  // In the middle of the page while there is no scene, in the side panel else.
  place(welcome) {
    find('welcome').hidden = !welcome;
    find('app').toggleAttribute('data-welcome', welcome);
    this.element.hidden = welcome;
    (welcome ? this.card : this.body).append(this.content);
    if (welcome) this.browse('');
  }

  async browse(folder) {
    try {
      const found = await this.app.connection.call('list_files', { folder });
      const maps = this.app.scenes.source?.path !== undefined; // can light the scene that is open
      const rows = found.entries
        .filter((entry) => maps || !entry.environment)
        .map((entry) => {
          const name = entry.path.split('/').pop() || entry.path;
          return make(
            'button',
            {
              type: 'button',
              class: 'plain',
              title: entry.path,
              'data-path': entry.path,
              on: {
                click: () => {
                  if (entry.folder) {
                    this.#folders.push(entry.path);
                    this.browse(entry.path);
                  } else if (entry.environment) {
                    this.light(entry.path);
                  } else {
                    this.open(entry.path);
                  }
                },
              },
            },
            make('span', { text: entry.folder ? `${name}/` : name }),
            make('small', { text: entry.folder ? '' : entry.environment ? 'light with it' : bytes(entry.bytes) }),
          );
        });
      if (this.#folders.length) {
        rows.unshift(
          make(
            'button',
            {
              type: 'button',
              class: 'plain',
              id: 'files-up',
              on: {
                click: () => {
                  this.#folders.pop();
                  this.browse(this.#folders.at(-1) ?? '');
                },
              },
            },
            make('span', { text: '../' }),
          ),
        );
      }
      this.path.textContent =
        folder || (rows.length ? 'Folders of the daemon' : 'The daemon serves no folders: upload a scene.');
      this.list.hidden = !rows.length;
      this.list.replaceChildren(...rows);
      if (found.total > found.entries.length)
        this.note.textContent = `The first ${found.entries.length} of ${found.total}.`;
    } catch (error) {
      this.path.textContent = error.lost ? '' : `The daemon lists no files: ${error.message}`;
      this.list.hidden = true;
    }
  }

  open(path) {
    return this.#load(() => this.app.scenes.openPath(path));
  }

  // The scene that is open again, with a map around it: seen as it is now, edits included.
  light(environment) {
    const { scenes, camera } = this.app;
    const edits = scenes.editEntries();
    return this.#load(
      async () => {
        const answer = await scenes.openPath(scenes.source.path, environment);
        if (edits.length) await scenes.setEdits(edits).catch((error) => this.app.say(error.message, 'error'));
        return answer;
      },
      camera.isHome ? '' : camera.toText(),
    );
  }

  async #load(load, camera = '') {
    this.#say('Loading …');
    try {
      await this.app.openScene(load, camera);
      this.#say('');
    } catch (error) {
      this.#say(error.message, true);
    }
  }

  #say(text, bad = false) {
    this.note.textContent = text;
    this.note.classList.toggle('bad', bad);
  }

  // Tells why nothing is opened: beside the list, and over the picture where that may be out of sight.
  #refuse(text, kind = 'error') {
    this.#say(text, kind === 'error');
    if (find('welcome').hidden) this.app.say(text, kind);
  }

  // files: [{ name, file }], one of them a scene.
  async upload(files) {
    if (this.#cancel) {
      this.#refuse('Another upload is under way: wait for its end, or cancel it.');
      return;
    }
    const scenes = files
      .filter(({ name }) => SCENE.test(name))
      .sort((a, b) => a.name.split('/').length - b.name.split('/').length);
    if (!scenes.length) {
      this.#refuse('None of these files is a scene (.glb, .gltf or .xml).');
      return;
    }
    const total = files.reduce((sum, { file }) => sum + file.size, 0),
      limit = this.app.info.limits?.max_scene_bytes ?? Infinity;
    if (total > limit) {
      this.#refuse(`The files have ${bytes(total)}; the daemon takes ${bytes(Number(limit))} at most.`);
      return;
    }
    this.#cancel = new AbortController();
    this.box.hidden = false;
    const about = `${scenes[0].name}, ${bytes(total)}`;
    const show = (step, share) => {
      if (this.step.textContent !== step) this.step.textContent = step;
      this.bar.value = share;
    };
    show(`Reading ${about} …`, 0);
    this.#say('');
    try {
      await this.app.openScene(() =>
        this.app.scenes.upload(
          files,
          scenes[0].name,
          (step, done, of) => {
            if (step === 'read') show(`Reading ${about} …`, done / of);
            else show(done < of ? `Uploading ${about} …` : `Loading ${scenes[0].name} …`, done / of);
          },
          this.#cancel.signal,
        ),
      );
    } catch (error) {
      this.#refuse(error.message, error.name === 'AbortError' ? 'info' : 'error');
    } finally {
      this.box.hidden = true;
      this.#cancel = null;
    }
  }

  #listenToDrops() {
    let depth = 0;
    const show = (on) => {
      find('drop').hidden = !on;
    };
    addEventListener('dragenter', (event) => {
      if (!event.dataTransfer?.types.includes('Files')) return;
      depth++;
      show(true);
    });
    addEventListener('dragleave', () => {
      depth = Math.max(0, depth - 1);
      if (!depth) show(false);
    });
    addEventListener('dragover', (event) => event.preventDefault());
    addEventListener('drop', async (event) => {
      event.preventDefault();
      depth = 0;
      show(false);
      const items = [...event.dataTransfer.items].filter(({ kind }) => kind === 'file');
      const entries = items.map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
      // What has no entry is a single file. All is asked for before the first wait, after which the items are gone.
      const files = entries.length ? [] : [...event.dataTransfer.files].map((file) => ({ name: file.name, file }));
      try {
        for (const entry of entries) await collect(entry, '', files);
      } catch (error) {
        this.#refuse(`What was dropped could not be read: ${error.message}`);
        return;
      }
      if (files.length) this.upload(strip(files));
      else if (items.length) this.#refuse('There are no files in what was dropped.');
    });
  }
}

async function collect(entry, prefix, files) {
  if (entry.isFile) {
    files.push({
      name: prefix + entry.name,
      file: await new Promise((resolve, reject) => entry.file(resolve, reject)),
    });
    return;
  }
  const reader = entry.createReader();
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return;
    for (const child of some) await collect(child, `${prefix}${entry.name}/`, files);
  }
}

// A dropped folder's own name is no part of its files' names.
function strip(files) {
  const top = files[0].name.split('/')[0];
  return files.every(({ name }) => name.startsWith(`${top}/`))
    ? files.map(({ name, file }) => ({ name: name.slice(top.length + 1), file }))
    : files;
}
