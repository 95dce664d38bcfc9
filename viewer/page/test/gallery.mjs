// Takes the pictures of docs/gallery.md in a browser; environment variables are those of pictures.mjs:
//
//   node viewer/page/test/gallery.mjs docs/pictures [WORLD ...]
//
// With WORLDs of the table, takes only their pictures.
import {join} from 'node:path';

import {openBrowser, openPage, tessera, upCluster} from './browser.mjs';

// What is looked at, after how many ticks, and from where: angles in rad, a distance in m.
const kPictures = {
  station: {body: 'person_0::body', ticks: 240, yaw: -2.4, pitch: 0.5, distance: 16},
  town: {body: 'door_0::leaf', ticks: 240, yaw: -2.2, pitch: 0.5, distance: 45},
  road: {body: 'truck::tractor', ticks: 180, yaw: -0.9, pitch: 0.4, distance: 26},
  harbour: {body: 'drone::base_link', ticks: 240, yaw: -2.3, pitch: 0.35, distance: 12},
  machines: {body: 'cart::chassis', ticks: 60, yaw: -2.2, pitch: 0.35, distance: 9},
  rover: {body: 'robot::hull', ticks: 180, yaw: -2.3, pitch: 0.5, distance: 3.5},
  fountain: {body: 'ball_0::link', ticks: 300, yaw: -2.3, pitch: 0.4, distance: 11},
  balance: {body: 'cart_1::cart', ticks: 120, yaw: -2.3, pitch: 0.3, distance: 5},
  voyage: {body: 'sailor::body', ticks: 120, yaw: -2.0, pitch: 0.3, distance: 16},
  train: {body: 'crate_1::crate', ticks: 450, yaw: -1.9, pitch: 0.35, distance: 24},
  habitat: {body: 'tower::box_5', ticks: 120, yaw: -2.0, pitch: 0.3, distance: 30},
  seam: {body: 'tower_1::box_5', ticks: 30, yaw: -2.2, pitch: 0.3, distance: 22},
};

const [folder, ...wanted] = process.argv.slice(2);
const browser = await openBrowser(720, 450);

async function shoot(name, {body, ticks, yaw, pitch, distance}) {
  const cluster = await upCluster(join(process.env.TESSERA_WORLDS_FOLDER, `${name}.sdf`));
  const page = await openPage(browser, `${cluster.url}?detail=fine`, true);
  try {
    await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
    await page.addStyleTag({content: 'body > :not(canvas) { visibility: hidden !important; }'});
    await page.evaluate(() => Object.assign(window.tessera.picture, {shadows: false, ratioMax: 0.1}));
    await tessera(cluster.address, 'step', String(ticks));
    await page.waitForFunction(() => window.tessera.bodies.countMoving > 0);
    await page.evaluate(async (look) => {
      const {camera, jump} = window.tessera;
      await jump(look.body);
      [camera.yaw, camera.pitch, camera.distance] = [look.yaw, look.pitch, look.distance];
    }, {body, yaw, pitch, distance});
    await page.waitForFunction((tick) => window.tessera.bodies.tick >= tick, {}, ticks);
    await page.evaluate(() => {
      const {picture, state} = window.tessera;
      Object.assign(picture, {shadows: true, ratioMax: 1});
      state.drawnBefore = state.framesDrawn;
      dispatchEvent(new Event('resize'));
    });
    await page.waitForFunction(() => {
      const {state} = window.tessera;
      return state.looked && state.framesDrawn > state.drawnBefore + 1;
    });
    await page.screenshot({path: join(folder, `world_${name}.png`)});
  } finally {
    await page.close();
    await cluster.stop('SIGINT');
  }
}

for (const [name, look] of Object.entries(kPictures))
  if (wanted.length === 0 || wanted.includes(name)) await shoot(name, look);
await browser.close();
