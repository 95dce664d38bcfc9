// The page in a browser against a real cluster.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {openBrowser, openPage, start, tessera, upCluster} from './browser.mjs';

const world = join(process.env.TESSERA_WORLDS_FOLDER, 'seam.sdf');

let cluster;
let browser;
let page;

// Drawn by a processor: coarse, so that the tests take seconds.
async function goCoarsely(url) {
  await page.goto(url);
  await page.evaluate(() => Object.assign(window.tessera.picture, {shadows: false, ratioMax: 0.25}));
  await page.waitForFunction(() => window.tessera.bodies.countMoving > 0);
}

before(async () => {
  cluster = await upCluster(world, '--servers', '2');
  browser = await openBrowser(900, 600);
  page = await openPage(browser, cluster.url);
  await goCoarsely(cluster.url);
});

after(async () => {
  await browser?.close();
  await cluster?.stop();
});

const selected = () => page.evaluate(() => {
  const {bodies, state} = window.tessera;
  return state.selected === null ? null : bodies.look(state.selected)?.info.name ?? null;
});

const isInState = (name) =>
    page.waitForFunction((text) => document.getElementById('state').textContent === text, {}, name);

// Moves the camera to a body and waits until it has drawn what is there.
async function jumpTo(name) {
  const drawn = await page.evaluate(async (body) => {
    await window.tessera.jump(body);
    return window.tessera.state.framesDrawn;
  }, name);
  await page.waitForFunction((body, before) => {
    const {bodies, state} = window.tessera;
    return bodies.look(state.selected)?.info.name === body && state.framesDrawn > before;
  }, {}, name, drawn);
}

async function clickInTheMiddle() {
  const {width, height} = page.viewport();
  await page.mouse.click(width / 2, height / 2);
}

test('shows every body of the world that can move', async () => {
  const expected = cluster.bodies - 1;  // the ground does not move
  await page.waitForFunction((count) => window.tessera.bodies.countMoving === count, {}, expected);
  assert.match(
      await page.$eval('#tiles', (tiles) => tiles.textContent), new RegExp(`^${cluster.bodies}bodies`));
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

// Tick by tick: what a click asked for takes effect in one of the next.
async function stepUntil(condition, ...args) {
  const deadline = Date.now() + 60_000;
  while (!await page.evaluate(condition, ...args)) {
    assert.ok(Date.now() < deadline, `${condition} does not come true`);
    await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 1}));
  }
}

test('runs and pauses by its button', async () => {
  const tick = await page.evaluate(() => window.tessera.bodies.tick);
  await playUntil((from) => window.tessera.bodies.tick > from + 10, tick);
});

test('a click selects a box, and another one pushes it', async () => {
  await jumpTo('crate_face::crate');
  await page.keyboard.press('Escape');
  assert.equal(await selected(), null);
  await clickInTheMiddle();
  await page.waitForFunction(() => window.tessera.state.selected !== null);
  assert.equal(await selected(), 'crate_face::crate');
  const speed = () => page.evaluate(() => window.tessera.bodies.look(window.tessera.state.selected).speed);
  assert.ok(await speed() < 0.2);
  await page.click('[data-tool=push]');
  await clickInTheMiddle();
  await stepUntil(() => window.tessera.bodies.look(window.tessera.state.selected)?.speed > 0.5);
  await page.click('[data-tool=select]');
});

test('a click puts a body into the world', async () => {
  const count = await page.evaluate(() => window.tessera.bodies.countMoving);
  await page.click('[data-tool=spawn]');
  await clickInTheMiddle();
  await stepUntil((before) => window.tessera.bodies.countMoving === before + 1, count);
  await page.click('[data-tool=select]');
});

test('shows contacts, the borders of sectors and what happens there', async () => {
  for (const mark of ['#gridOn', '#contactsOn', '#seamsOn']) await page.click(mark);
  await page.waitForFunction(() => window.tessera.picture.grid.object.visible);
  await playUntil(() => {
    const {contacts, seams} = window.tessera.picture;
    return contacts.count > 0 && seams.countClones > 0 && seams.countIslands > 0;
  });
});

test('sectors 2^62 away are reached by typing them', async () => {
  await page.$eval('#jumpText', (input) => input.value = '2^62, -2^62, 0');
  await page.$eval('#jump', (form) => form.requestSubmit());
  await page.waitForFunction(() => window.tessera.bodies.view.sector[0] === 1n << 62n);
  await page.waitForFunction(() => document.getElementById('where').textContent === 'sector 2⁶², −2⁶², 0');
});

test('comes back by itself after the connection was lost', async () => {
  // Of a viewer of its own, which can be ended and started again at the same address.
  const viewer = await start(
      'tessera-viewer', ['--connect', cluster.address, '--listen', '127.0.0.1:0'], /on (http\S+)/);
  const [url] = viewer.found;
  await goCoarsely(url);
  await viewer.stop();
  await page.waitForFunction(() => document.getElementById('state').textContent === 'no connection');
  const again = await start(
      'tessera-viewer', ['--connect', cluster.address, '--listen', new URL(url).host, '--read-only'],
      /on (http\S+)/);
  await page.waitForFunction(() => document.getElementById('state').textContent === 'paused');
  const tick = await page.evaluate(() => window.tessera.bodies.tick);
  await tessera(cluster.address, 'step', '7');
  await page.waitForFunction((from) => window.tessera.bodies.tick === from + 7, {}, tick);
  assert.equal(
      await page.$eval('#play', (button) => button.disabled), true, 'read-only pages have no controls');
  const refused =
      await page.evaluate(() => window.tessera.connection.ask('pause').catch((error) => error.message));
  assert.match(refused, /for reading only/);
  await goCoarsely(cluster.url);
  await again.stop();
});

test('another world takes the place of the first', async () => {
  await tessera(cluster.address, 'load', join(process.env.TESSERA_WORLDS_FOLDER, 'tower.sdf'), '--replace');
  await page.waitForFunction(() => document.getElementById('worldName').textContent === 'tower');
  await page.waitForFunction(() => window.tessera.bodies.countMoving === 10);
});

test('tells when the cluster has gone', async () => {
  await cluster.stop('SIGKILL');
  await page.waitForFunction(() => document.getElementById('state').className.includes('lost'));
});

test('makes no errors', () => {
  const errors = page.errors.filter((text) => !/WebSocket|ERR_CONNECTION/.test(text));
  assert.deepEqual(errors, []);
});
