// The report's page is whole without this script, which chooses among what is there and puts pictures on a stage.
'use strict';

(() => {
  const find = (id) => document.getElementById(id);
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const kGap = 4;  // CSS pixels between pictures side by side, as in report.css
  document.documentElement.classList.add('with-script');

  // One measure and region at a time.
  function chooseParts() {
    const measure = find('measure'), region = find('region');
    if (!measure) return;
    const parts = all('.part');
    const has = (m, r) => parts.some(({ dataset }) => dataset.measure === m && dataset.region === r);
    const show = () => {
      for (const option of region.options) option.disabled = !has(measure.value, option.value);
      if (!has(measure.value, region.value)) region.value = [...region.options].find((o) => !o.disabled).value;
      for (const part of parts) {
        part.hidden = part.dataset.measure !== measure.value || part.dataset.region !== region.value;
      }
    };
    measure.addEventListener('change', show);
    region.addEventListener('change', show);
    show();
  }

  // A click on a mode in the legend hides and shows its curves.
  function toggleModes() {
    for (const item of all('.legend li')) {
      const button = document.createElement('button');
      button.type = 'button';
      button.setAttribute('aria-pressed', 'true');
      button.append(...item.childNodes);
      button.className = 'legend-button';
      item.append(button);
      button.addEventListener('click', () => {
        const shown = button.getAttribute('aria-pressed') !== 'true';
        button.setAttribute('aria-pressed', String(shown));
        item.classList.toggle('off', !shown);
        for (const series of all(`#curves .plot .s${item.dataset.style}`)) {
          series.classList.toggle('off', !shown);
        }
      });
    }
  }

  function copyButtons() {
    if (!navigator.clipboard) return;
    for (const code of all('code.copy')) {
      const button = document.createElement('button');
      button.type = 'button';
      button.className = 'scripted copy-button';
      button.textContent = 'copy';
      button.setAttribute('aria-label', `Copy ${code.textContent.slice(0, 60)}`);
      button.addEventListener('click', async () => {
        try {
          await navigator.clipboard.writeText(code.textContent);
          button.textContent = 'copied';
        } catch {
          getSelection().selectAllChildren(code);
          button.textContent = 'selected';
        }
        setTimeout(() => (button.textContent = 'copy'), 1500);
      });
      code.after(' ', button);
    }
  }

  // Radiance as the page holds it: planes R, G, B and exponent, each row as differences (pictures/rgbe_bytes.h).
  async function unpack(text, width, height) {
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
    const planes = new Uint8Array(await new Response(stream).arrayBuffer());
    if (planes.length !== 4 * width * height) throw new Error('a picture of this page is damaged');
    for (let row = 0; row < planes.length; row += width) {
      for (let i = row + 1; i < row + width; ++i) planes[i] += planes[i - 1];
    }
    return planes;
  }

  function radianceAt(planes, pixels, i) {
    const scale = 2 ** (planes[3 * pixels + i] - 136);
    return [0, 1, 2].map((c) => planes[c * pixels + i] * scale);
  }

  function encodedByte(linear) {
    const x = Math.min(1, Math.max(0, linear));
    return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  }

  // The byte of each exponent and mantissa, 256 mantissas after one another.
  function toneTable(exposure) {
    const table = new Uint8Array(65536);
    for (let e = 1; e < 256; ++e) {
      const scale = exposure * 2 ** (e - 136);
      if (scale * 255 < 1e-4) continue;
      if (scale > 1) table.fill(255, 256 * e + 1, 256 * (e + 1));
      else for (let m = 1; m < 256; ++m) table[256 * e + m] = encodedByte(m * scale);
    }
    return table;
  }

  class Shown {
    constructor(figure) {
      this.figure = figure;
      this.image = figure.querySelector('img');
      this.name = figure.dataset.name;
      this.view = figure.dataset.view;
      this.width = Number(this.image.getAttribute('width'));
      this.height = Number(this.image.getAttribute('height'));
      this.source = figure.querySelector('script');
    }
    async load() {
      if (this.source && !this.planes && typeof DecompressionStream !== 'undefined') {
        this.planes = await unpack(this.source.textContent, this.width, this.height);
      }
      await this.image.decode();
      return this;
    }
    // Maps have no exposure, nor have pictures in browsers without DecompressionStream.
    draw(canvas, exposure) {
      if (canvas.width !== this.width || canvas.height !== this.height) {
        canvas.width = this.width;
        canvas.height = this.height;
      }
      const context = canvas.getContext('2d');
      if (!this.planes) {
        context.drawImage(this.image, 0, 0, this.width, this.height);
        return;
      }
      const pixels = this.width * this.height, table = toneTable(exposure), { planes } = this;
      const image = context.createImageData(this.width, this.height), out = image.data;
      for (let i = 0; i < pixels; ++i) {
        const row = planes[3 * pixels + i] << 8;
        out[4 * i] = table[row | planes[i]];
        out[4 * i + 1] = table[row | planes[pixels + i]];
        out[4 * i + 2] = table[row | planes[2 * pixels + i]];
        out[4 * i + 3] = 255;
      }
      context.putImageData(image, 0, 0);
    }
    told(x, y) {
      if (!this.planes) return this.name;
      const values = radianceAt(this.planes, this.width * this.height, y * this.width + x);
      return `${this.name} ${values.map((v) => v.toPrecision(3)).join(', ')}`;
    }
  }

  // Two pictures of a view: flipped in place, split by a divider, or beside each other.
  function stage() {
    const root = find('stage');
    const pictures = all('.picture[data-kind]').map((figure) => new Shown(figure));
    if (!root || pictures.length < 2) return;
    root.hidden = false;
    const viewList = find('stage-view'), listA = find('stage-a'), listB = find('stage-b');
    const modeList = find('stage-mode'), zoomList = find('stage-zoom'), pair = find('stage-pair');
    const frame = find('stage-frame'), slider = find('stage-exposure'), flipButton = find('stage-flip');
    const divider = find('divider');
    const canvases = { a: find('canvas-a'), b: find('canvas-b') };
    const exposures = new Map(all('section.view').map(({ dataset }) => [dataset.view, Number(dataset.exposure)]));
    let shown = {}, flipped = false, split = 50, drawing = 0;

    const ofView = () => pictures.filter(({ view }) => view === viewList.value);
    const option = (value, text) => Object.assign(document.createElement('option'), { value, textContent: text });
    for (const view of exposures.keys()) viewList.append(option(view, view));

    function fill() {
      const kept = [listA.selectedIndex, listB.selectedIndex];
      [listA, listB].forEach((list, which) => {
        list.replaceChildren(...ofView().map(({ name }, i) => option(String(i), name)));
        list.selectedIndex = Math.min(kept[which] < 0 ? which : kept[which], list.options.length - 1);
      });
    }

    async function draw() {
      const turn = ++drawing;
      try {
        const choose = (list) => ofView()[list.selectedIndex].load();
        const [a, b] = await Promise.all([choose(listA), choose(listB)]);
        if (turn !== drawing) return;
        shown = { a, b };
        const exposure = exposures.get(viewList.value) * 2 ** Number(slider.value);
        a.draw(canvases.a, exposure);
        b.draw(canvases.b, exposure);
        canvases.a.setAttribute('aria-label', a.name);
        canvases.b.setAttribute('aria-label', b.name);
      } catch (error) {
        find('stage-told').textContent = `The pictures cannot be shown: ${error.message}`;
        return;
      }
      arrange();
    }

    // CSS pixels that a picture's pixel gets: the picture fits into the frame and four fifths of the window's height.
    // Small ones are enlarged by a whole number of the screen's pixels.
    function fittedScale(across) {
      const { width, height } = shown.a;
      const room = Math.min((frame.clientWidth - kGap * (across - 1)) / (across * width), 0.8 * innerHeight / height);
      const whole = Math.floor(room * devicePixelRatio) / devicePixelRatio;
      return whole > 0 ? whole : room;
    }

    function arrange() {
      const mode = modeList.value, zoom = Number(zoomList.value), across = mode === 'both' ? 2 : 1;
      const scale = zoom > 0 ? zoom / devicePixelRatio : fittedScale(across);
      pair.className = `${mode === 'both' ? 'beside' : 'over'}${scale * devicePixelRatio >= 1 ? ' whole' : ''}`;
      pair.style.width = `${across * scale * shown.a.width + kGap * (across - 1)}px`;
      canvases.b.style.visibility = mode === 'flip' && !flipped ? 'hidden' : 'visible';
      canvases.b.style.clipPath = mode === 'split' ? `inset(0 0 0 ${split}%)` : 'none';
      divider.hidden = mode !== 'split';
      divider.style.left = `${split}%`;
      divider.setAttribute('aria-valuenow', String(Math.round(split)));
      flipButton.hidden = mode !== 'flip';
      flipButton.setAttribute('aria-pressed', String(flipped));
      const names = [shown.a.name, shown.b.name];
      find('stage-told').textContent = mode === 'flip' ? names[flipped ? 1 : 0]
        : `${names[0]} (left), ${names[1]} (right)`;
    }

    function flip() {
      if (modeList.value !== 'flip' || !shown.a) return;
      flipped = !flipped;
      arrange();
    }
    function moveDivider(value) {
      split = Math.min(100, Math.max(0, value));
      arrange();
    }

    viewList.addEventListener('change', () => (fill(), draw()));
    for (const list of [listA, listB]) list.addEventListener('change', draw);
    modeList.addEventListener('change', arrange);
    zoomList.addEventListener('change', arrange);
    flipButton.addEventListener('click', flip);
    slider.addEventListener('input', () => {
      const stops = Number(slider.value);
      find('stage-stops').textContent = `${stops > 0 ? '+' : ''}${stops} stops`;
      draw();
    });
    for (const canvas of Object.values(canvases)) canvas.addEventListener('click', flip);
    frame.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const step = event.shiftKey ? 10 : 1;
      if (event.key === 'f' || event.key === 'F') flip();
      else if (modeList.value !== 'split') return;
      else if (event.key === 'ArrowLeft') moveDivider(split - step);
      else if (event.key === 'ArrowRight') moveDivider(split + step);
      else if (event.key === 'Home') moveDivider(0);
      else if (event.key === 'End') moveDivider(100);
      else return;
      event.preventDefault();
    });
    divider.addEventListener('pointerdown', (event) => {
      divider.setPointerCapture(event.pointerId);
      event.preventDefault();
      divider.focus();
    });
    divider.addEventListener('pointermove', (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      const box = pair.getBoundingClientRect();
      moveDivider(100 * (event.clientX - box.left) / box.width);
    });
    frame.addEventListener('pointermove', (event) => {
      const canvas = event.target;
      if (!(canvas instanceof HTMLCanvasElement) || !shown.a) return;
      const box = canvas.getBoundingClientRect();
      const place = (size, at) => Math.min(size - 1, Math.max(0, Math.floor(at * size)));
      const x = place(canvas.width, (event.clientX - box.left) / box.width);
      const y = place(canvas.height, (event.clientY - box.top) / box.height);
      const inside = ({ width, height }) => x < width && y < height;
      find('stage-pixel').textContent = `Pixel ${x}, ${y}: ` +
        [shown.a, shown.b].filter(inside).map((picture) => picture.told(x, y)).join('; ');
    });
    addEventListener('resize', () => shown.a && arrange());
    fill();
    draw();
  }

  chooseParts();
  toggleModes();
  copyButtons();
  stage();
})();
