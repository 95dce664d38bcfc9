// The web UI in a browser with a real cluster.
import assert from 'node:assert/strict';
import {mkdtemp, rm, writeFile} from 'node:fs/promises';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {goCoarsely as goCoarselyIn, openBrowser, openPage, start, tessera, upCluster} from './browser.mjs';

const world = join(process.env.TESSERA_WORLDS_FOLDER, 'seam.sdf');

let cluster;
let browser;
let page;
let folder;

const goCoarsely = (url) => goCoarselyIn(page, url);

before(async () => {
  folder = await mkdtemp(join(tmpdir(), 'tessera-page-'));
  cluster = await upCluster(world, '--servers', '2');
  browser = await openBrowser(900, 600);
  page = await openPage(browser, cluster.url);
  await goCoarsely(cluster.url);
});

after(async () => {
  await browser?.close();
  await cluster?.stop();
  await rm(folder, {recursive: true});
});

const selected = () => page.evaluate(() => {
  const {bodies, state} = window.tessera;
  return state.selected === null ? null : bodies.look(state.selected)?.info.name ?? null;
});

const isInState = (name) =>
    page.waitForFunction((text) => document.getElementById('state').textContent === text, {}, name);

// Waits until the text of an element matches.
const reads = (id, pattern) => page.waitForFunction(
    (element, source) => new RegExp(source).test(document.getElementById(element).innerText), {}, id, pattern.source);

const isSelected = (pattern) => page.waitForFunction((source) => {
  const {bodies, state} = window.tessera;
  return new RegExp(source).test(bodies.look(state.selected)?.info.name ?? '');
}, {}, pattern.source);

// Moves the camera to a body and waits until the view there is drawn, with bodies where they are in the last frame.
async function jumpTo(name) {
  const drawn = await page.evaluate(async (body) => {
    await window.tessera.jump(body);
    return window.tessera.state.framesDrawn;
  }, name);
  await page.waitForFunction((body, before) => {
    const {bodies, state} = window.tessera;
    return bodies.look(state.selected)?.info.name === body && state.framesDrawn > before && bodies.isBlended;
  }, {}, name, drawn);
}

// Returns when the cluster has answered all that the click asks for: a tick before that would move what was clicked.
async function clickInTheMiddle() {
  const {width, height} = page.viewport();
  await page.mouse.click(width / 2, height / 2);
  await page.waitForFunction(() => !window.tessera.connection.isAsking);
}

test('shows every movable body of the world', async () => {
  const expected = cluster.bodies - 1;  // the ground does not move
  await page.waitForFunction((count) => window.tessera.bodies.countMoving === count, {}, expected);
  await reads('tiles', new RegExp(`^${cluster.bodies}\\s*bodies`));
});

test('draws a picture', async () => {
  await page.waitForFunction(() => window.tessera.state.framesDrawn > 0);
  const colours = await page.evaluate(() => {
    const {picture, camera, bodies, state} = window.tessera;
    picture.draw(camera, bodies.view, state.looked.half, 0);
    const canvas = document.createElement('canvas');
    canvas.width = 160;
    canvas.height = 100;
    const context = canvas.getContext('2d');
    context.drawImage(document.getElementById('world'), 0, 0, 160, 100);
    return new Set(new Uint32Array(context.getImageData(0, 0, 160, 100).data.buffer)).size;
  });
  assert.ok(colours > 200, `${colours} colours`);
});

async function playUntil(condition, ...args) {
  await page.click('#play');
  await isInState('running');
  await page.waitForFunction(condition, {}, ...args);
  await page.click('#play');
  await isInState('paused');
}

// Steps tick by tick, each of which is shown before the next: a click takes effect in one of the next ticks.
async function stepUntil(condition, ...args) {
  const deadline = Date.now() + 60_000;
  while (!await page.evaluate(condition, ...args)) {
    assert.ok(Date.now() < deadline, `${condition} does not become true`);
    const {tick} = await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 1}));
    await isAtTick(tick);
  }
}

test('the button runs and pauses the world', async () => {
  const tick = await page.evaluate(() => window.tessera.bodies.tick);
  await playUntil((from) => window.tessera.bodies.tick > from + 10, tick);
});

test('a click selects a box, another pushes it', async () => {
  await jumpTo('crate_face::crate');
  await page.keyboard.press('Escape');
  assert.equal(await selected(), null);
  await clickInTheMiddle();
  await isSelected(/^crate_face::crate$/);
  const speed = () => page.evaluate(() => window.tessera.bodies.look(window.tessera.state.selected).speed);
  assert.ok(await speed() < 0.2);
  await page.click('[data-tool=push]');
  await clickInTheMiddle();
  await stepUntil(() => window.tessera.bodies.look(window.tessera.state.selected)?.speed > 0.5);
  await page.click('[data-tool=select]');
});

test('a click spawns a body', async () => {
  const count = await page.evaluate(() => window.tessera.bodies.countMoving);
  await page.click('[data-tool=spawn]');
  await clickInTheMiddle();
  await stepUntil((before) => window.tessera.bodies.countMoving === before + 1, count);
  await page.click('[data-tool=select]');
});

test('shows contacts, sector borders and seams', async () => {
  for (const mark of ['#gridOn', '#contactsOn', '#seamsOn']) await page.click(mark);
  await page.waitForFunction(() => window.tessera.picture.grid.object.visible);
  // Bodies at rest have no island.
  await page.evaluate(
      () => window.tessera.connection.ask(
          'push', {body: 'tower_2::box_1', impulse: [1, 0, 0], lever: [0, 0, 0]}));
  await stepUntil(() => {
    const {contacts, seams} = window.tessera.picture;
    return contacts.count > 0 && seams.countClones > 0 && seams.countIslands > 0;
  });
});

test('contacts of a paused world are shown from any view', async () => {
  for (const name of ['tower_1::box_1', 'crate_face::crate', 'tower_2::box_1']) {
    await page.evaluate(() => window.tessera.picture.contacts.count = -1);
    await jumpTo(name);
    await page.waitForFunction(() => window.tessera.picture.contacts.count > 0);
  }
});

test('a click on the ground selects the sector, if sectors are shown', async () => {
  await jumpTo('crate_face::crate');
  // Beside the crate; what was spawned and pushed before may lie on one side of it.
  const ground = await page.evaluate(async () => {
    const {bodies, camera, connection, picture, state} = window.tessera;
    const box = document.getElementById('world').getBoundingClientRect();
    const [x, y, z] = bodies.look(state.selected).position.local;
    for (const [dx, dy] of [[0, -2], [-2, 0], [2, 0], [0, 2], [-2, -2]]) {
      picture.aim(camera, bodies.view);  // `view` may be newer than the last picture
      const [left, top] = picture.toWindow(camera, [x + dx, y + dy, z - 0.5]);
      const [clientX, clientY] = [left + box.left, top + box.top];
      const {origin, direction} = picture.rayThrough(camera, bodies.view, {clientX, clientY});
      const hit = await connection.ask(
          'pick', {sector: bodies.view.sector.map(String), local: origin, direction, length: 100});
      if (hit.hit && bodies.look(hit.body).info.motion === 'static') return [clientX, clientY];
    }
    throw new Error('no ground beside the crate');
  });
  await page.mouse.click(...ground);
  await reads('detailsName', /^sector /);
  await reads('facts', /edge\s*10 m\s*bodies\s*[1-9]\d*\s*awake\s*\d+\s*fastest\s*[\d.]+ m\/s\s*server\s*[12]/);
  assert.equal(await selected(), null);
  await page.click('#gridOn');
  await page.mouse.click(...ground);
  await page.waitForFunction(() => document.getElementById('details').hidden);
  await page.click('#gridOn');
});

// The positions of all movable bodies by id, in m from the centre of sector 0, 0, 0: as drawn, or as reported
// by the cluster.
const places = (isDrawn) => page.evaluate(async (drawn) => {
  const {bodies, connection} = window.tessera;
  const moving =
      [...bodies.ids].filter((id) => bodies.look(id).info.motion !== 'static').sort((a, b) => a - b);
  return Promise.all(moving.map(async (id) => {
    const {sector, local} = drawn ? bodies.look(id).position : await connection.ask('find', {body: id});
    return [id, ...local.map((x, axis) => x + Number(sector[axis]) * bodies.view.sector_size)];
  }));
}, isDrawn);
const drawnPlaces = () => places(true);
const truePlaces = () => places(false);

const isVisible = (id) => page.$eval(id, (element) => getComputedStyle(element).display !== 'none');
const isAtTick = (tick) => page.waitForFunction((wanted) => window.tessera.bodies.tick === wanted, {}, tick);

function assertNear(found, expected) {
  assert.deepEqual(found.map(([id]) => id), expected.map(([id]) => id));
  const misses = found.flat().map((x, n) => Math.abs(x - expected.flat()[n]));
  assert.ok(Math.max(...misses) < 1e-4, `${Math.max(...misses)} m`);
}

async function dragTimeline(from, to) {
  const {x, y, width, height} = await (await page.$('#timeline')).boundingBox();
  const at = (share) => [x + 7 + share * (width - 14), y + height / 2];  // the middle of the slider's thumb
  await page.mouse.move(...at(from));
  await page.mouse.down();
  await page.mouse.move(...at((from + to) / 2));
  await page.mouse.move(...at(to));
  await page.mouse.up();
}

test('opens a recording, moves through it and comes back', async () => {
  const kTicks = 40;
  const file = join(folder, 'run.mcap');
  await page.evaluate(async () => {
    const {connection, goTo, places} = window.tessera;
    goTo(places.all[0], 30);
    await connection.ask('push', {body: 'crate_face::crate', impulse: [0, 0, 300], lever: [0, 0, 0]});
  });
  const first = Number(/tick (\d+)/.exec(await tessera(cluster.address, 'step', '1'))[1]);
  const before = await truePlaces();
  const recorder = await start(
      process.env.TESSERA_RECORD, ['--connect', cluster.address, '--output', file, '--ticks', String(kTicks)],
      /recording (.*) to/);
  await tessera(cluster.address, 'step', String(kTicks));
  assert.equal(await recorder.ended(), 0);
  const after = await truePlaces();
  const focus = await page.evaluate(() => window.tessera.camera.focus.local);
  assert.throws(() => assertNear(after, before), 'something moves');

  await (await page.$('#file')).uploadFile(file);
  await isInState('recording');
  await isAtTick(first);
  assertNear(await drawnPlaces(), before);
  await dragTimeline(0, 1);
  await isAtTick(first + kTicks);
  assertNear(await drawnPlaces(), after);
  await reads('player', new RegExp(`tick ${first + kTicks}`));
  for (const button of ['[data-tool=push]', '[data-tool=spawn]', '#pushUp', '#remove'])
    assert.equal(await page.$eval(button, ({disabled}) => disabled), true, button);
  assert.deepEqual([await isVisible('#player'), await isVisible('#play')], [true, false]);
  await page.click('#back');
  await isAtTick(first + kTicks - 1);
  await page.click('#replay');
  await page.waitForFunction(() => !window.tessera.player.isPlaying);
  await isAtTick(first + kTicks);
  await page.evaluate(() => window.tessera.jump('crate_face::crate'));
  assert.equal(await selected(), 'crate_face::crate');

  await page.click('#live');
  await isInState('paused');
  await page.waitForFunction((count) => window.tessera.bodies.countMoving === count, {}, after.length);
  assert.deepEqual(await page.evaluate(() => window.tessera.camera.focus.local), focus);
  assert.deepEqual([await isVisible('#player'), await isVisible('#play')], [false, true]);
});

test('reports what is wrong with a file, and continues', async () => {
  const file = join(folder, 'note.mcap');
  await writeFile(file, 'precious');
  await (await page.$('#file')).uploadFile(file);
  await page.waitForFunction(
      () => document.getElementById('notice').textContent === 'note.mcap is not an MCAP file');
  await isInState('paused');
});

test('a typed sector 2^62 away is reached', async () => {
  await page.$eval('#jumpText', (input) => input.value = '2^62, -2^62, 0');
  await page.$eval('#jump', (form) => form.requestSubmit());
  await page.waitForFunction(() => window.tessera.bodies.view.sector[0] === 1n << 62n);
  await page.waitForFunction(() => document.getElementById('where').textContent === 'sector 2⁶², −2⁶², 0');
});

test('a jump that finds nothing says so and leads back', async () => {
  const text = () => page.$eval('#jumpAnswer', ({textContent}) => textContent);
  const jump = async (to) => {
    await page.$eval('#jumpText', (input, wanted) => input.value = wanted, to);
    await page.$eval('#jump', (form) => form.requestSubmit());
  };
  await jump('crate_face::crate');
  await page.waitForFunction(() => window.tessera.bodies.countMoving > 0);
  const focus = await page.evaluate(() => window.tessera.camera.focus.local);
  await jump('2^40, 0, 0');
  await page.waitForFunction(() => document.getElementById('jumpAnswer').textContent.startsWith('No body is near'));
  assert.match(await text(), /2⁴⁰, 0, 0/);
  await page.click('#jumpAnswer button');
  await page.waitForFunction(() => window.tessera.bodies.countMoving > 0);
  assert.deepEqual(await page.evaluate(() => window.tessera.camera.focus.local), focus);
  await jump('box_1');
  await page.waitForFunction(() => document.querySelectorAll('#jumpAnswer button').length > 1);
  assert.match(await text(), /"box_1".*tower_1::box_1/);
  await page.click('#jumpAnswer button');
  await page.waitForFunction(() => document.getElementById('jumpAnswer').hidden);
  await isSelected(/box_1/);
});

test('the tree of all bodies is searched by parts of names, and used with the keyboard', async () => {
  await page.click('#treeFold summary');
  await page.waitForFunction(() => document.querySelectorAll('#tree > [role=treeitem]').length > 3);
  await page.type('#treeText', 'OX_10');
  await reads('tree', /^tower_1::box_10\s+tower_2::box_10$/);
  await page.focus('#tree [tabindex="0"]');
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('Enter');
  await isSelected(/^tower_2::box_10$/);
  await page.$eval('#treeText', (input) => {
    input.value = 'tower_1';
    input.dispatchEvent(new Event('input'));
  });
  await page.waitForFunction(() => document.querySelector('#tree [aria-expanded=true]'));
  await page.focus('#tree [tabindex="0"]');
  await page.keyboard.press('ArrowLeft');
  assert.equal(await page.$eval('#tree [role=treeitem]', (item) => item.getAttribute('aria-expanded')), 'false');
  await page.keyboard.press('ArrowRight');
  assert.equal(await page.$eval('#tree [role=treeitem]', (item) => item.getAttribute('aria-expanded')), 'true');
  await page.$eval('#treeText', (input) => {
    input.value = 'nowhere';
    input.dispatchEvent(new Event('input'));
  });
  await page.waitForFunction(() => document.getElementById('treeNote').textContent === 'no name has “nowhere” in it');
  await page.$eval('#treeFold', (fold) => fold.open = false);
});

test('reconnects by itself after the connection is lost', async () => {
  // Uses a separate viewer, which can be stopped and restarted at the same address.
  const viewer = await start(
      'tessera-viewer', ['--connect', cluster.address, '--listen', '127.0.0.1:0'], /at (http\S+)/);
  const [url] = viewer.found;
  await goCoarsely(url);
  await viewer.stop();
  await page.waitForFunction(() => document.getElementById('state').textContent === 'no connection');
  const again = await start(
      'tessera-viewer', ['--connect', cluster.address, '--listen', new URL(url).host, '--read-only'],
      /at (http\S+)/);
  await page.waitForFunction(() => document.getElementById('state').textContent === 'paused');
  const tick = await page.evaluate(() => window.tessera.bodies.tick);
  await tessera(cluster.address, 'step', '7');
  await page.waitForFunction((from) => window.tessera.bodies.tick === from + 7, {}, tick);
  await page.waitForFunction(() => document.getElementById('play').disabled);  // the read-only web UI has no controls
  for (const what of ['pause', 'load', 'reset', 'restore', 'save', 'undo', 'record', 'stop_recording']) {
    const refused = await page.evaluate(
        (name) => window.tessera.connection.ask(name, {world: 'tower', name: 'a'}).catch((error) => error.message), what);
    assert.match(refused, /read-only/, what);
  }
  await goCoarsely(cluster.url);
  await again.stop();
});

test('another world replaces the first', async () => {
  await tessera(cluster.address, 'load', join(process.env.TESSERA_WORLDS_FOLDER, 'tower.sdf'), '--replace');
  await page.waitForFunction(() => document.getElementById('worldName').textContent === 'tower');
  await page.waitForFunction(() => window.tessera.bodies.countMoving === 10);
});

test('the model of a selected body shows its parts, and its joints are driven', async () => {
  await tessera(cluster.address, 'load', join(process.env.TESSERA_WORLDS_FOLDER, 'rover.sdf'), '--replace');
  await page.waitForFunction(() => {
    const {bodies} = window.tessera;
    return [...bodies.ids].some((id) => bodies.look(id).info.name === 'robot::hull');
  });
  await jumpTo('arm::lower');
  const joint = () => page.evaluate(() => {
    const rows = [...document.querySelectorAll('#modelJoints label')];
    return rows.find((row) => row.textContent.startsWith('elbow'))?.querySelector('small').textContent ?? '';
  });
  await page.waitForFunction(() => document.querySelectorAll('#modelJoints label').length > 0);
  await reads('modelBodies', /lower/);
  await page.evaluate(() => {
    const slider = document.querySelector('#modelJoints input[aria-label="arm::elbow"]');
    slider.value = 0.3;
    slider.dispatchEvent(new Event('input'));
  });
  const stepUntil = async (isThere, what) => {
    const deadline = Date.now() + 60_000;
    while (!await isThere()) {
      assert.ok(Date.now() < deadline, what);
      await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 10}));
    }
  };
  await stepUntil(async () => /^0\.(2[5-9]|3[0-5])\d rad$/.test(await joint()), 'the elbow is not where it was told to be');
  await page.waitForFunction(() => [...document.getElementById('plotted').options].some(({value}) => value === 'joint elbow, rad'));
  await page.type('#modelFilter', 'elbow');
  await page.waitForFunction(
      () => [...document.querySelectorAll('#modelJoints label')].filter((row) => !row.hidden).length === 1);
  await jumpTo('robot::hull');
  // Where it stands, nothing may be in its sight.
  await stepUntil(() => page.evaluate(() => window.tessera.picture.sensorRays.object.visible), 'no ray meets anything');
  await page.waitForFunction(
      () => [...document.getElementById('plotted').options].some(({value}) => value === 'ranger: range_0'));
  await page.type('#jumpText', 'arm::');
  await page.waitForFunction(
      () => [...document.querySelectorAll('#jumpNames option')].some(({value}) => value === 'arm::lower'));
});

test('a removed body comes back by undo, where nothing else hangs on it', async () => {
  await tessera(cluster.address, 'load', join(process.env.TESSERA_WORLDS_FOLDER, 'tower.sdf'), '--replace');
  await page.waitForFunction(() => {
    const {bodies} = window.tessera;
    return [...bodies.ids].some((id) => bodies.look(id).info.name === 'tower::box_3');
  });
  await jumpTo('tower::box_3');
  const place = () => page.evaluate(() => window.tessera.connection.ask('find', {body: 'tower::box_3'}));
  const {local} = await place();
  await page.click('#remove');
  await page.waitForFunction(() => document.querySelector('#notice.on button')?.textContent === 'Undo');
  await stepUntil(() => window.tessera.bodies.countMoving === 9);
  await page.$eval('#notice button', (undo) => undo.click());  // it may have faded meanwhile
  await stepUntil(() => window.tessera.bodies.countMoving === 10);
  for (const [axis, x] of (await place()).local.entries()) assert.ok(Math.abs(x - local[axis]) < 0.05, `axis ${axis}`);
  const again = await page.evaluate(() => window.tessera.connection.ask('undo').catch(({message}) => message));
  assert.equal(again, 'there is nothing to undo');
});

test('a world is recorded, up to a size, and the file is one that Open… shows', async () => {
  const recordings = join(folder, 'recordings');
  const viewer = await start(
      'tessera-viewer',
      [
        '--connect', cluster.address, '--listen', '127.0.0.1:0', '--recordings', recordings, '--recorder', process.env.TESSERA_RECORD,
        '--recordings-max', '1'
      ],
      /at (http\S+)/);
  await goCoarsely(viewer.found[0]);
  const isButton = (text) => page.waitForFunction(
      (wanted) => document.getElementById('record').textContent === wanted && !document.getElementById('record').disabled, {}, text);
  await isButton('Record');
  await page.click('#record');
  await isButton('Stop');
  const refused = (what, details) => page.evaluate(
      (...question) => window.tessera.connection.ask(...question).catch(({message}) => message), what, details);
  assert.match(await refused('record', {name: 'b'}), /a recording is made already/);
  await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 20}));
  await page.click('#record');
  await isButton('Record');
  await page.waitForFunction(() => /recorded \d+ ticks, [\d.]+ MB$/.test(document.getElementById('notice').textContent));
  const file = await page.evaluate(async () => {
    const bytes = new Uint8Array(await (await fetch(document.getElementById('recordingFile').href)).arrayBuffer());
    return {size: bytes.length, start: [...bytes.subarray(1, 5)], end: [...bytes.subarray(-7, -3)]};
  });
  const mcap = [...'MCAP'].map((letter) => letter.charCodeAt(0));
  assert.deepEqual([file.start, file.end], [mcap, mcap], `${file.size} bytes`);
  assert.equal(await refused('stop_recording'), 'nothing is recorded');
  assert.match(await refused('record', {name: '../out'}), /^name: use 1 to 64/);
  const missing = await fetch(new URL('/recordings/..%2Fsecret.mcap', viewer.found[0]));
  assert.equal(missing.status, 404);
  // What is there already counts.
  await writeFile(join(recordings, 'large.mcap'), Buffer.alloc(1_000_000));
  assert.match(await refused('record', {name: 'c'}), /which is all that they may have/);
  await goCoarsely(cluster.url);
  await viewer.stop();
});

test('a world is saved, reset and restored', async () => {
  const isTick = (wanted) => page.waitForFunction((at) => window.tessera.state.status?.status.tick === at, {}, wanted);
  const viewer = await start(
      'tessera-viewer',
      [
        '--connect', cluster.address, '--listen', '127.0.0.1:0', '--worlds', process.env.TESSERA_WORLDS_FOLDER, '--snapshots',
        join(folder, 'snapshots')
      ],
      /at (http\S+)/);
  await goCoarsely(viewer.found[0]);
  const {tick: saved} = await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 3}));
  await isTick(saved);
  await page.click('#save');
  await page.waitForFunction(() => document.getElementById('notice').textContent.startsWith('saved as'));
  assert.equal(await page.$eval('#notice', ({textContent}) => textContent), `saved as tower-${saved}`);
  await page.click('#reset');
  await isTick(0);
  await page.click('#worldsOpen');
  await page.waitForFunction(() => /Snapshots/.test(document.getElementById('worldsLists').textContent));
  await page.evaluate(
      (name) => [...document.querySelectorAll('#worldsLists button')].find(({textContent}) => textContent.startsWith(name)).click(),
      `tower-${saved}`);
  await isTick(saved);
  const refused = (what, details) => page.evaluate(
      (...question) => window.tessera.connection.ask(...question).catch(({message}) => message), what, details);
  assert.match(await refused('load', {world: '../worlds/tower', replace: true}), /no world of the name/);
  assert.match(await refused('save', {name: '../out'}), /^name: use 1 to 64/);
  assert.match(await refused('save', {name: `tower-${saved}`}), /there is a snapshot of the name/);
  await tessera(
      cluster.address, 'load', join(process.env.TESSERA_WORLDS_FOLDER, 'tower.sdf'), '--replace', '--shift', '2^40,0,0');
  await page.waitForFunction(() => window.tessera.state.status.status.tick === 0);
  assert.match(await refused('reset'), /the world was moved when it was loaded/);
  await goCoarsely(cluster.url);
  await viewer.stop();
});

test('an empty cluster offers worlds, and loads the one that is chosen', async () => {
  const empty = await start(
      'tessera', ['up', '--listen', '127.0.0.1:0', '--page', '127.0.0.1:0', '--servers', '1'], / on (\S+) with /,
      /browser: (\S+)/);
  const viewer = await start(
      'tessera-viewer',
      ['--connect', empty.found[0], '--listen', '127.0.0.1:0', '--worlds', process.env.TESSERA_WORLDS_FOLDER, '--snapshots', ''],
      /at (http\S+)/);
  const watching = await start(
      'tessera-viewer', ['--connect', empty.found[0], '--listen', '127.0.0.1:0', '--read-only'], /at (http\S+)/);
  try {
    await page.goto(watching.found[0]);
    await page.waitForFunction(() => /as soon as somebody/.test(document.getElementById('worldsHint').innerText));
    await page.waitForFunction(() => document.getElementById('worldsOpen').disabled);
    await page.goto(viewer.found[0]);
    await page.waitForFunction(() => document.querySelectorAll('#worldsLists button').length > 5);
    await reads('worldsTitle', /^This cluster has no world$/);
    await page.evaluate(
        () => [...document.querySelectorAll('#worldsLists button')].find((button) => button.textContent.startsWith('towerA tower')).click());
    await page.waitForFunction(() => window.tessera.bodies.countMoving === 10);
    await page.waitForFunction(() => document.getElementById('worlds').hidden);
    await reads('worldName', /^tower$/);
  } finally {
    await goCoarsely(cluster.url);
    await Promise.all([viewer.stop(), watching.stop()]);
    await empty.stop();
  }
});

// `isAboard`: of another frame than the view's.
const isInView = (name, isAboard) => page.waitForFunction((wanted, aboard) => {
  const {bodies} = window.tessera;
  return [...bodies.ids].map((id) => bodies.look(id))
      .some((look) => look.info.name === wanted && look.isAboard === aboard);
}, {}, name, isAboard);

// Moves the camera to a body that is aboard of a frame, seen from the world.
async function lookFromOutside(name) {
  await page.evaluate(() => window.tessera.goTo({sector: [0n, 0n, 0n], local: [0, 0, 0]}));
  await isInView(name, true);
  const drawn = await page.evaluate((wanted) => {
    const {bodies, goTo, state} = window.tessera;
    const id = [...bodies.ids].find((one) => bodies.look(one).info.name === wanted);
    goTo(bodies.look(id).position, 14);
    return state.framesDrawn;
  }, name);
  await page.waitForFunction(
      (before) => window.tessera.state.framesDrawn > before && window.tessera.bodies.isBlended, {}, drawn);
}

test('what is aboard of a frame that moves is selected, pushed and joined by clicks from outside', async () => {
  await tessera(cluster.address, 'load', join(process.env.TESSERA_WORLDS_FOLDER, 'train.sdf'), '--replace');
  await reads('worldName', /^train$/);
  await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 60}));
  await isAtTick(60);
  await lookFromOutside('crate_2::crate');
  await page.keyboard.press('Escape');
  await clickInTheMiddle();
  await isSelected(/^crate_2::crate$/);
  await page.click('[data-tool=spawn]');
  await clickInTheMiddle();
  const isAboard = () => {
    const {bodies, state} = window.tessera;
    const body = bodies.look(state.selected);
    const isNew = body !== null && body.info.name !== 'crate_2::crate' && body.isAboard;
    if (isNew) window.spawned = state.selected;
    return isNew;
  };
  await stepUntil(isAboard);
  await page.evaluate(() => window.tessera.connection.ask('remove', {body: window.spawned}));
  await stepUntil(() => ![...window.tessera.bodies.ids].includes(window.spawned));
  await lookFromOutside('crate_2::crate');  // which has moved along
  await page.click('[data-tool=push]');
  await clickInTheMiddle();
  await stepUntil(() => {
    const {bodies, state} = window.tessera;
    return bodies.look(state.selected)?.info.name === 'crate_2::crate' && bodies.look(state.selected).speed > 0.5;
  });
  await page.click('[data-tool=select]');
});

test('the camera rides along in the frame of a body that it follows, and clicks take effect there', async () => {
  await lookFromOutside('crate_3::crate');
  await page.keyboard.press('Escape');
  await clickInTheMiddle();
  await isSelected(/^crate_3::crate$/);
  await page.click('#follow');
  await page.waitForFunction(() => window.tessera.bodies.view.frame_name === 'train');
  await isInView('crate_3::crate', false);
  await reads('where', /^train, sector 1, 0, 0$/);
  await reads('facts', /frame\s*train/);
  const local = (name) => page.evaluate((wanted) => {
    const {bodies} = window.tessera;
    const id = [...bodies.ids].find((one) => bodies.look(one).info.name === wanted);
    const {sector, local: place} = bodies.look(id).position;
    return place.map((x, axis) => x + Number(sector[axis]) * bodies.view.sector_size);
  }, name);
  const [crate, outside] = [await local('crate_3::crate'), await local('beside_the_line::crate')];
  const {tick} = await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 60}));
  await isAtTick(tick);
  const moved = async (name, before) => Math.hypot(...(await local(name)).map((x, axis) => x - before[axis]));
  assert.ok(await moved('crate_3::crate', crate) < 1e-3, 'it rests in the train');
  assert.ok(Math.abs(await moved('beside_the_line::crate', outside) - 30) < 1e-3, 'a second at 30 m/s');
  // The crate is still in the middle.
  await page.click('[data-tool=push]');
  await clickInTheMiddle();
  await stepUntil(() => window.tessera.bodies.look(window.tessera.state.selected)?.speed > 0.5);
  await page.click('[data-tool=select]');
  assert.equal(await selected(), 'crate_3::crate');
  for (let n = 0; n < 30; ++n)
    await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 1}));
  await page.waitForFunction(() => {
    const {bodies, camera, state} = window.tessera;
    const place = bodies.drawnPlace(state.selected);
    const away = place.local.map(
        (x, axis) => x - camera.focus.local[axis] + Number(place.sector[axis] - camera.focus.sector[axis]) * camera.sectorSize);
    return Math.hypot(...away) < 1e-3;
  });
  await jumpTo('beside_the_line::crate');
  await page.waitForFunction(() => !window.tessera.bodies.view.frame);
});

test('ground without an end is drawn, where rays of the cluster meet it', async () => {
  await tessera(cluster.address, 'load', join(process.env.TESSERA_WORLDS_FOLDER, 'globe.sdf'), '--replace');
  await page.waitForFunction(() => {
    const {bodies} = window.tessera;
    return [...bodies.ids].some((id) => bodies.look(id).info.name.startsWith('crate_1'));
  });
  await page.waitForFunction(() => {
    const {bodies, ground} = window.tessera;
    return ground.object.visible && ground.surface.geometry.index?.count === 6 * 32 * 32 && bodies.ground !== null;
  });
  const refused = await page.evaluate(() => {
    const {bodies, connection} = window.tessera;
    const place = {sector: ['0', '0', '0'], local: [0, 0, 0], body: bodies.ground, half: 1e9};
    return connection.ask('ground', place).catch(({message}) => message);
  });
  assert.equal(refused, 'half: 1e+09 m is not 1 to 5000 m');
});

test('bodies are shown by the visuals of their world file', async () => {
  const file = join(folder, 'looks.sdf');
  const box = '<geometry><box><size>1 1 1</size></box></geometry>';
  await writeFile(file, `<sdf version="1.9"><world name="looks"><model name="crate"><link name="l">
      <collision name="c">${box}</collision>
      <visual name="v">${box}<material><diffuse>1 0 0 1</diffuse></material></visual></link></model></world></sdf>`);
  await tessera(cluster.address, 'load', file, '--replace');
  const viewer = await start(
      'tessera-viewer', ['--connect', cluster.address, '--listen', '127.0.0.1:0', '--looks', file], /at (http\S+)/);
  await goCoarsely(viewer.found[0]);
  await page.waitForFunction(() => window.tessera.bodies.hasLooks);
  await page.waitForFunction(() => window.tessera.bodies.mode === 'look');
  assert.equal(await page.$eval('[data-mode=look]', (button) => button.hidden), false);
  await goCoarsely(cluster.url);  // whose file is another
  await viewer.stop();
  await page.waitForFunction(() => document.querySelector('[data-mode=look]').hidden);
});

test('reports that the cluster has gone', async () => {
  await cluster.stop('SIGKILL');
  await page.waitForFunction(() => document.getElementById('state').className.includes('lost'));
});

test('causes no errors', () => {
  const errors = page.errors.filter((text) => !/WebSocket|ERR_CONNECTION/.test(text));
  assert.deepEqual(errors, []);
});
