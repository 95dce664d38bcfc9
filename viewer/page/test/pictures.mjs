// Takes the pictures of README.md and docs/viewer.md in a browser:
//
//   TESSERA_PAGE_PACKAGES=$PWD/build/release/viewer/node_modules TESSERA_PROGRAMS=build/release/bin \
//     TESSERA_WORLDS_FOLDER=worlds TESSERA_RECORD=$PWD/build/release/client_sdk/python/environment/bin/tessera-record \
//     node viewer/page/test/pictures.mjs docs/pictures [NAME ...]
//
// With NAMEs of worlds below, takes only their pictures.
import {mkdtemp, rm, writeFile} from 'node:fs/promises';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import {openBrowser, openPage, start, tessera, upCluster} from './browser.mjs';
import {animated} from './webp.mjs';

const [folder, ...wanted] = process.argv.slice(2);
const world = (name) => join(process.env.TESSERA_WORLDS_FOLDER, name);

const browser = await openBrowser(1440, 900);

// Waits until the requested view has arrived and been drawn a few times.
async function settle(page) {
  await page.evaluate(() => {
    const {state} = window.tessera;
    state.drawnBefore = state.framesDrawn;
    dispatchEvent(new Event('resize'));
  });
  await page.waitForFunction(() => {
    const {bodies, state} = window.tessera;
    return state.looked && bodies.view.sector.every((index, n) => index === state.looked.focus.sector[n]) &&
        state.framesDrawn > state.drawnBefore;
  });
}

// Rendering in full detail takes seconds on the CPU: only the pictures use it, of paused worlds.
const draw = (page, isFine) => page.evaluate(
    (fine) =>
        Object.assign(window.tessera.picture, {shadows: fine, ratioMax: fine ? 1 : 0.1}),
    isFine);

const shoot = async (page, name) => {
  await draw(page, true);
  await settle(page);
  await page.screenshot({path: join(folder, `page_${name}.png`)});
  await draw(page, false);
};

async function withPage(name, args, work) {
  if (wanted.length > 0 && !wanted.includes(name)) return;
  const cluster = await upCluster(...args);
  const page = await openPage(browser, `${cluster.url}?detail=fine`, true);
  try {
    await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
    await draw(page, false);
    await page.waitForFunction(() => window.tessera.bodies.countMoving > 0);
    await work(page, cluster);
  } finally {
    await page.close();
    await cluster.stop('SIGINT');
  }
}

const view = (page, yaw, pitch, distance) => page.evaluate((values) => {
  const {camera} = window.tessera;
  [camera.yaw, camera.pitch, camera.distance] = values;
}, [yaw, pitch, distance]);

for (const [name, shift] of [['tower', '0,0,0'], ['tower_far', '2^62,-2^62,2^62']]) {
  await withPage(name, [world('tower.sdf'), '--shift', shift], async (page, cluster) => {
    await tessera(cluster.address, 'step', '120');
    await page.evaluate(() => window.tessera.jump('tower::box_4'));
    await view(page, -2.2, 0.2, 14);
    await shoot(page, name);
  });
}

// Towers of two servers that fall across the border between them, frame by frame.
const kFrames = 40;
const kTicksPerFrame = 6;
const [kWide, kHigh] = [760, 475];
const kQuality = 58;
const kPushSpeed = 8;  // m/s

await withPage('falls', [world('seam.sdf'), '--servers', '2', '--balance-every', '0'], async (page, cluster) => {
  await page.click('#gridOn');
  await page.setViewport({width: kWide, height: kHigh});
  for (const side of ['#leftToggle', '#rightToggle']) {
    if (await page.$eval(side, (button) => button.getAttribute('aria-expanded') === 'true')) await page.click(side);
  }
  await tessera(cluster.address, 'step', '60');
  await page.evaluate(() => window.tessera.jump('tower_1::box_5'));
  await view(page, -1.1, 0.34, 24);
  await page.evaluate(async (speed) => {
    const {bodies, connection, select} = window.tessera;
    select(null);
    const named = (name) => [...bodies.ids].map((id) => bodies.look(id)).find(({info}) => info.name === name);
    for (const [from, to] of [['tower_1::box_8', 'tower_2::box_8'], ['tower_2::box_6', 'tower_1::box_6']]) {
      const [start, end] = [named(from), named(to)];
      const way = end.position.local.map((x, axis) => x - start.position.local[axis]);
      const impulse = way.map((x) => x / Math.hypot(...way) * speed * start.info.mass);
      await connection.ask('push', {body: start.id, impulse, lever: [0, 0, 0]});
    }
  }, kPushSpeed);
  await draw(page, true);
  const stills = [];
  for (let frame = 0; frame < kFrames; ++frame) {
    const {tick} = await page.evaluate((ticks) => window.tessera.connection.ask('step', {ticks}), kTicksPerFrame);
    await page.waitForFunction((wanted) => window.tessera.bodies.tick === wanted, {}, tick);
    await settle(page);
    stills.push(Buffer.from(await page.screenshot({type: 'webp', quality: kQuality})));
  }
  await writeFile(join(folder, 'page_falls.webp'), animated(stills, kWide, kHigh, Math.round(1000 * kTicksPerFrame / 60)));
});

await withPage('globe', [world('globe.sdf')], async (page) => {
  await page.waitForFunction(() => window.tessera.ground.object.visible);
  await page.click('#themeToggle');
  await page.evaluate(() => window.tessera.jump('cart::body').catch(() => window.tessera.jump('crate_1::crate')));
  await view(page, -2.2, 0.3, 40);
  await page.waitForFunction(() => window.tessera.ground.surface.geometry.index?.count === 6 * 32 * 32);
  await shoot(page, 'ground');
  await page.click('#themeToggle');
});

if (wanted.length === 0 || wanted.includes('empty')) {
  const up = await start(
      'tessera', ['up', '--listen', '127.0.0.1:0', '--page', '127.0.0.1:0'], / on (\S+) with /, /browser: (\S+)/);
  const page = await openPage(browser, up.found[1], true);
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'light'}]);
  await page.setViewport({width: 1024, height: 768});
  await page.waitForFunction(() => document.querySelectorAll('#worldsLists button').length > 0);
  await page.screenshot({path: join(folder, 'page_empty.png')});
  await page.close();
  await up.stop('SIGINT');
}

await withPage('seam', [world('seam.sdf'), '--servers', '2'], async (page, cluster) => {
  await page.click('#gridOn');
  await page.click('#contactsOn');
  await tessera(cluster.address, 'step', '40');
  while (await page.evaluate(() => window.tessera.picture.contacts.count === 0))
    await page.evaluate(() => window.tessera.connection.ask('step', {ticks: 1}));
  await view(page, -1.2, 0.3, 22);
  await shoot(page, 'seam');
  await page.click('#contactsOn');
  await page.click('#seamsOn');
  await page.waitForFunction(() => window.tessera.picture.seams.countClones > 0);
  await shoot(page, 'clones');
});

await withPage('looks', [world('house.sdf')], async (page, cluster) => {
  await tessera(cluster.address, 'step', '60');
  await page.evaluate(() => window.tessera.jump('arm::upper'));
  await page.waitForFunction(() => document.querySelectorAll('#modelJoints label').length > 0);
  await view(page, -2.4, 0.8, 3.4);
  await shoot(page, 'looks');
  const whole = page.viewport();
  await page.setViewport({width: 800, height: 600});
  await shoot(page, 'small');
  await page.setViewport({width: 390, height: 780});
  await shoot(page, 'phone');
  await page.setViewport(whole);
  await page.evaluate(() => window.tessera.jump('burger::base_link'));
  await page.waitForFunction(() => window.tessera.picture.sensorRays.object.visible);
  await view(page, -2.3, 0.9, 2.6);
  await shoot(page, 'sensors');
});

await withPage('earth', [world('earth.sdf'), '--servers', '2'], async (page, cluster) => {
  await tessera(cluster.address, 'resume');
  await page.waitForFunction(() => window.tessera.bodies.tick > 120);
  await tessera(cluster.address, 'pause');
  await view(page, -2.0, 0.42, 110);
  await shoot(page, 'dashboard');
  await page.evaluate(() => {
    const {goTo, places, camera} = window.tessera;
    const [place] = places.all;
    goTo({sector: [0n, 0n, 0n], local: [0, 0, 0]}, 2.4e7);
    camera.yaw = Math.atan2(Number(place.sector[1]), Number(place.sector[0])) + 0.6;
    camera.pitch = 0.7;
  });
  await shoot(page, 'whole');
});

await withPage('recording', [world('falling.sdf')], async (page, cluster) => {
  const records = await mkdtemp(join(tmpdir(), 'tessera-pictures-'));
  try {
    const file = join(records, 'falling.mcap');
    const recorder = await start(
        process.env.TESSERA_RECORD, ['--connect', cluster.address, '--output', file, '--ticks', '240'],
        /recording (.*) to/);
    await tessera(cluster.address, 'step', '240');
    await recorder.ended();
    await (await page.$('#file')).uploadFile(file);
    await page.waitForFunction(() => window.tessera.player.isOn && window.tessera.bodies.countMoving > 0);
    await page.$eval('#timeline', (slider) => {
      slider.value = 80;
      slider.dispatchEvent(new Event('input'));
    });
    await page.waitForFunction(() => window.tessera.bodies.tick === 80);
    await page.evaluate(() => window.tessera.jump('falling::box_1'));
    await view(page, -2.2, 0.45, 12);
    await shoot(page, 'recording');
  } finally {
    await rm(records, {recursive: true});
  }
});

await browser.close();
