// Files that the page reads by way of its second module, or of none: each is shown as its twin without the extension is.
import { strict as assert } from 'node:assert';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { browserName, slack } from './browsers.mjs';
import { openSite, readDisplay, waitForFrames, waitForMessage, withPage } from './pages.mjs';
import { cook } from './native.mjs';

let site;
before(async () => (site = await openSite()));
after(() => site.close());

const open = (query, work, prepare) => withPage(site, query, work, prepare);

const small = '?scene=cornell&technique=normals&size=24x16&frames=1';

/** Drops files on the page, as a person would. */
const drop = (page, files) =>
  page.evaluate(
    (list) => {
      const dataTransfer = new DataTransfer();
      for (const { name, text } of list) {
        dataTransfer.items.add(new File([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))], name));
      }
      document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
    },
    files.map(({ name, bytes }) => ({ name, text: Buffer.from(bytes).toString('base64') })),
  );

const shown = (page, name) =>
  page.waitForFunction(
    (wanted) => {
      if (!document.getElementById('message').hidden) throw new Error(document.getElementById('message').innerText);
      return document.getElementById('scene').value === wanted && document.getElementById('loading').hidden;
    },
    { polling: 50 },
    name,
  );

/** Drops files, and reads what the page then shows of the view `view`. */
async function pictureOf(page, files, view = 'normal') {
  await drop(page, files);
  await shown(page, files[0].name);
  await page.select('#view', view);
  await waitForFrames(page, 1);
  return readDisplay(page);
}

const data = (name) => readFileSync(new URL(`../data/${name}`, import.meta.url));
const cases = (name) => JSON.parse(data(name));
const bytes = (text) => Buffer.from(text, 'base64');
const floats = (list) => Buffer.from(new Float32Array(list).buffer);

/** Binary glTF of views and what else the JSON says. */
function glb(json, views) {
  const bufferViews = [];
  const parts = [];
  let length = 0;
  for (const view of views) {
    bufferViews.push({ buffer: 0, byteOffset: length, byteLength: view.length });
    parts.push(view, Buffer.alloc(-view.length & 3));
    length += (view.length + 3) & ~3;
  }
  const root = { asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], buffers: [{ byteLength: length }], ...json };
  root.bufferViews = [...bufferViews, ...(json.bufferViews ?? [])];
  const text = Buffer.from(JSON.stringify(root));
  const padded = Buffer.concat([text, Buffer.alloc(-text.length & 3, 32)]);
  const chunk = (kind, body) => {
    const head = Buffer.alloc(8);
    head.writeUInt32LE(body.length, 0);
    head.write(kind, 4, 'latin1');
    return Buffer.concat([head, body]);
  };
  const chunks = Buffer.concat([chunk('JSON', padded), chunk('BIN\0', Buffer.concat(parts))]);
  const head = Buffer.alloc(12);
  head.write('glTF', 0, 'latin1');
  head.writeUInt32LE(2, 4);
  head.writeUInt32LE(12 + chunks.length, 8);
  return Buffer.concat([head, chunks]);
}

const accessor = (view, type, componentType, count, more = {}) => ({ ...(view === undefined ? {} : { bufferView: view }), type, componentType, count, ...more });
const primitive = { attributes: { POSITION: 0, NORMAL: 1 }, indices: 2 };

/** The page's picture must be one of the scene, and that of the twin. */
async function assertTwins(page, withExtension, without, view) {
  const twin = await pictureOf(page, without, view);
  assert.ok(new Set(twin).size > 2, 'the twin shows nothing');
  const blank = await pictureOf(page, [{ name: 'empty.glb', bytes: glb({ nodes: [{}] }, [Buffer.alloc(4)]) }], view);
  assert.notDeepEqual(twin, blank);
  assert.deepEqual(await pictureOf(page, withExtension, view), twin);
}

test('Draco', () =>
  open(small, async (page) => {
    const [draco] = cases('draco.json');
    const indices = bytes(draco.indices);
    const meshes = (extension) => [{ primitives: [{ ...primitive, ...extension }] }];
    const counts = [draco.vertices, draco.vertices, indices.length / 4];
    const without = glb(
      { meshes: meshes({}), accessors: [accessor(0, 'VEC3', 5126, counts[0]), accessor(1, 'VEC3', 5126, counts[1]), accessor(2, 'SCALAR', 5125, counts[2])] },
      [bytes(draco.POSITION), bytes(draco.NORMAL), indices],
    );
    const name = 'KHR_draco_mesh_compression';
    const withDraco = glb(
      {
        meshes: meshes({ extensions: { [name]: { bufferView: 0, attributes: draco.ids } } }),
        accessors: [accessor(undefined, 'VEC3', 5126, counts[0]), accessor(undefined, 'VEC3', 5126, counts[1]), accessor(undefined, 'SCALAR', 5125, counts[2])],
        extensionsUsed: [name],
        extensionsRequired: [name],
      },
      [bytes(draco.encoded)],
    );
    await assertTwins(page, [{ name: 'draco.glb', bytes: withDraco }], [{ name: 'a%20twin.glb', bytes: without }]);
    // What the decoder refuses is said with the file's name.
    const broken = Buffer.from(withDraco);
    broken.fill(255, broken.length - 100);
    await drop(page, [{ name: 'broken.glb', bytes: broken }]);
    assert.match(await waitForMessage(page), /broken\.glb: Draco/);
  }));

test('meshopt', () =>
  open(small, async (page) => {
    const all = cases('meshopt.json');
    const parts = ['exponential v1', 'octahedral 8 v1', 'sheet TRIANGLES'].map((name) => all.find((entry) => entry.name === name));
    const name = 'KHR_meshopt_compression';
    const file = (compressed) => {
      const views = parts.map((part) => bytes(compressed ? part.encoded : part.decoded));
      const first = compressed ? views.length : 0;
      const accessors = [
        accessor(first, 'VEC3', 5126, parts[0].count),
        accessor(first + 1, 'VEC3', 5120, parts[1].count, { normalized: true }),
        accessor(first + 2, 'SCALAR', 5123, parts[2].count),
      ];
      const stride = (part) => (part.mode === 'ATTRIBUTES' ? { byteStride: part.stride } : {});
      let offset = 0;
      const described = parts.map((part, index) => {
        const [byteOffset, byteLength] = [offset, views[index].length];
        offset += (byteLength + 3) & ~3;
        const { mode, filter, count, stride: byteStride } = part;
        return {
          buffer: 1, byteLength: part.count * part.stride, ...stride(part),
          extensions: { [name]: { buffer: 0, byteOffset, byteLength, byteStride, count, mode, filter } },
        };
      });
      const used = compressed ? [name, 'KHR_mesh_quantization'] : ['KHR_mesh_quantization'];
      const json = { meshes: [{ primitives: [primitive] }], accessors, extensionsUsed: used, extensionsRequired: used };
      if (!compressed) {
        const views_ = views.map((view, index) => ({ buffer: 0, byteOffset: described[index].extensions[name].byteOffset, byteLength: view.length, ...stride(parts[index]) }));
        accessors.forEach((entry, index) => (entry.bufferView = views.length + index));
        return glb({ ...json, bufferViews: views_ }, views);
      }
      return glb({ ...json, bufferViews: described, buffers: [{ byteLength: offset }, { byteLength: 10_000 }] }, views);
    };
    await assertTwins(page, [{ name: 'meshopt.glb', bytes: file(true) }], [{ name: 'twin.glb', bytes: file(false) }]);
  }));

const quad = {
  meshes: [{ primitives: [{ attributes: { POSITION: 0, TEXCOORD_0: 1 }, material: 0 }] }],
  materials: [{ pbrMetallicRoughness: { baseColorTexture: { index: 0 } } }],
  accessors: [accessor(0, 'VEC3', 5126, 6), accessor(1, 'VEC2', 5126, 6)],
};
const quadViews = [floats([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0]), floats([0, 1, 1, 1, 1, 0, 0, 1, 1, 0, 0, 0])];

for (const [name, file, twin] of [
  ['KHR_texture_basisu', 'etc1s.ktx2', 'etc1s.png'],
  ['KHR_texture_basisu', 'uastc-zstd.ktx2', 'uastc-zstd.png'],
  ['EXT_texture_webp', 'lossless.webp', 'lossless.png'],
]) {
  test(`${name}, ${file}`, () =>
    open(small, async (page) => {
      const images = [{ bufferView: 2 }];
      const required = { extensionsUsed: [name], extensionsRequired: [name] };
      const withExtension = glb({ ...quad, images, textures: [{ extensions: { [name]: { source: 0 } } }], ...required }, [...quadViews, data(file)]);
      const without = glb({ ...quad, images, textures: [{ source: 0 }] }, [...quadViews, data(twin)]);
      await assertTwins(page, [{ name: 'picture.glb', bytes: withExtension }], [{ name: 'twin.glb', bytes: without }], 'albedo');
    }));
}

test('Wavefront OBJ with its MTL', () =>
  open(small, async (page) => {
    const obj = 'mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n';
    const files = [
      { name: 'a.obj', bytes: Buffer.from(obj) },
      { name: 'a.mtl', bytes: Buffer.from('newmtl m\nKd 1 1 1\nmap_Kd a.png\n') },
      { name: 'a.png', bytes: data('etc1s.png') },
    ];
    const without = glb({ ...quad, images: [{ bufferView: 2 }], textures: [{ source: 0 }] }, [...quadViews, data('etc1s.png')]);
    await assertTwins(page, files, [{ name: 'twin.glb', bytes: without }], 'albedo');
    await drop(page, [{ name: 'bad.obj', bytes: Buffer.from('v 0 0 0\nf 1 2 3\n') }]);
    assert.match(await waitForMessage(page), /bad\.obj: OBJ: /);
  }));

test('a scene that the command line has cooked, and one of another version', () =>
  open(small, async (page) => {
    const cooked = await cook('builtin:cornell');
    const direct = await readDisplay(page);
    await drop(page, [{ name: 'cornell.restir', bytes: cooked }]);
    await shown(page, 'cornell.restir');
    await waitForFrames(page, 1);
    assert.deepEqual(await readDisplay(page), direct);
    const old = Buffer.from(cooked);
    old[8] ^= 64;
    await drop(page, [{ name: 'old.restir', bytes: old }]);
    assert.match(await waitForMessage(page), /old\.restir: cooked scene of version .* cook it again/);
  }));

test('variants and scenes are chosen in menus', () =>
  open(small, async (page) => {
    const name = 'KHR_materials_variants';
    const color = (baseColorFactor) => ({ pbrMetallicRoughness: { baseColorFactor } });
    const mappings = [{ material: 1, variants: [0] }];
    const file = glb(
      {
        ...quad,
        meshes: [{ primitives: [{ attributes: { POSITION: 0 }, material: 0, extensions: { [name]: { mappings } } }] }],
        materials: [color([1, 0, 0, 1]), color([0, 0, 1, 1])],
        nodes: [{ mesh: 0 }, {}],
        scenes: [{ name: 'full', nodes: [0] }, { name: 'bare', nodes: [1] }],
        extensions: { [name]: { variants: [{ name: 'blue' }] } },
        extensionsUsed: [name],
      },
      quadViews,
    );
    const hasColor = (rgb, channel) => rgb.some((value, at) => at % 3 === channel && value > 200 && rgb[at - channel + ((channel + 2) % 3)] < 50);
    const red = await pictureOf(page, [{ name: 'variants.glb', bytes: file }], 'albedo');
    assert.ok(hasColor(red, 0) && !hasColor(red, 2), 'red by default');
    const choose = async (menu, value, hidden) => {
      await page.select(menu, value);
      await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
      await page.waitForFunction((id, wanted) => document.querySelector(id).value === wanted, { polling: 50 }, menu, hidden ?? value);
      await waitForFrames(page, 1);
      return readDisplay(page);
    };
    assert.ok(!(await page.evaluate(() => document.getElementById('variant-row').hidden || document.getElementById('file-scene-row').hidden)));
    const blue = await choose('#variant', 'blue');
    assert.ok(hasColor(blue, 2) && !hasColor(blue, 0), 'blue when chosen');
    const bare = await choose('#file-scene', '1');
    assert.ok(!hasColor(bare, 2) && !hasColor(bare, 0), 'nothing in the other scene');
  }));

/** A wavy square of `side` squared quads, with flat normals unless `smooth`. */
function grid(side) {
  const positions = new Float32Array((side + 1) ** 2 * 3);
  const indices = new Uint32Array(side * side * 6);
  let [vertex, corner] = [0, 0];
  for (let y = 0; y <= side; y++) {
    for (let x = 0; x <= side; x++) {
      positions.set([x / side, 0.05 * Math.sin(x / 9) * Math.cos(y / 7), y / side], vertex);
      vertex += 3;
      if (x === side || y === side) continue;
      const at = y * (side + 1) + x;
      indices.set([at, at + side + 1, at + 1, at + 1, at + side + 1, at + side + 2], corner);
      corner += 6;
    }
  }
  const json = {
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 0 }, indices: 1 }] }],
    accessors: [accessor(0, 'VEC3', 5126, (side + 1) ** 2), accessor(1, 'SCALAR', 5125, indices.length)],
  };
  return glb(json, [Buffer.from(positions.buffer), Buffer.from(indices.buffer)]);
}

/** Puts a file on the page's side in pieces, for one large string chokes the browsers' protocols. */
async function upload(page, name, content) {
  await page.evaluate(() => (window.pieces = []));
  for (let at = 0; at < content.length; at += 4 << 20) {
    const text = content.subarray(at, at + (4 << 20)).toString('base64');
    await page.evaluate((piece) => window.pieces.push(Uint8Array.from(atob(piece), (letter) => letter.charCodeAt(0))), text);
  }
  await page.evaluate((fileName) => (window.large = new File(window.pieces, fileName)), name);
}

const dropLarge = (page) =>
  page.evaluate(() => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(window.large);
    window.longTasks = [];
    document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
  });

test('a load is cancelled, and the former scene stays', () =>
  open(small, async (page) => {
    const before_ = await readDisplay(page);
    await upload(page, 'large.glb', grid(400));
    await dropLarge(page);
    await page.waitForFunction(() => !document.getElementById('loading').hidden && !document.getElementById('cancel').disabled, { polling: 20 });
    await page.click('#cancel');
    await page.waitForFunction(() => document.getElementById('loading').hidden, { polling: 50 });
    assert.equal(await page.evaluate(() => document.getElementById('message').hidden), true);
    assert.equal(await page.evaluate(() => document.getElementById('scene').value), 'cornell');
    assert.deepEqual(await readDisplay(page), before_);
  }));

// A busy machine can only make tasks longer: one undisturbed load of six is the proof. Only Chromium reports long tasks,
// those of 50 ms and more.
const onlyChromium = { skip: browserName !== 'chromium' };
test('a scene of a million triangles does not block the page for 50 ms', onlyChromium, () =>
  open(
    small,
    async (page) => {
      await upload(page, 'million.glb', grid(708));
      const longest = [];
      const isShort = (ms) => ms < 50 * slack;
      for (let attempt = 0; attempt < 6 && !longest.some(isShort); attempt++) {
        await dropLarge(page);
        await page.waitForFunction(() => !document.getElementById('loading').hidden, { polling: 50 });
        await shown(page, 'million.glb');
        await waitForFrames(page, 1);
        longest.push(await page.evaluate(() => Math.max(0, ...window.longTasks)));
      }
      console.log(`longest tasks of a load of 1 002 528 triangles: ${longest.map((ms) => Math.round(ms) || 'below 50').join(', ')} ms`);
      assert.ok(longest.some(isShort), `tasks of ${longest} ms`);
    },
    () => {
      window.longTasks = [];
      new PerformanceObserver((list) => window.longTasks.push(...list.getEntries().map(({ duration }) => duration))).observe({ type: 'longtask' });
    },
  ));
