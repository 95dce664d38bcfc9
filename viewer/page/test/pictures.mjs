// The pictures of docs/viewer.md, taken in a browser:
//
//   TESSERA_PAGE_PACKAGES=build/release/viewer/node_modules TESSERA_PROGRAMS=build/release/bin \
//     TESSERA_WORLDS_FOLDER=worlds node viewer/page/test/pictures.mjs docs/pictures
import {join} from 'node:path';

import {openBrowser, openPage, tessera, upCluster} from './browser.mjs';

const folder = process.argv[2];
const world = (name) => join(process.env.TESSERA_WORLDS_FOLDER, name);

const browser = await openBrowser(1440, 900);

// Waits until what the camera asked for is there and has been drawn a few times.
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

const shoot = async (page, name) => {
  await settle(page);
  await page.screenshot({path: join(folder, `page_${name}.png`)});
};

async function withPage(args, work) {
  const cluster = await upCluster(...args);
  const page = await openPage(browser, cluster.url);
  try {
    await page.waitForFunction(() => window.tessera.bodies.countMoving > 0);
    // Without a graphics card the picture is slow to draw; it keeps its shadows all the same.
    await page.evaluate(() => {
      window.tessera.picture.mayCoarsen = false;
    });
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
  await withPage([world('tower.sdf'), '--shift', shift], async (page, cluster) => {
    await tessera(cluster.address, 'step', '120');
    await page.evaluate(() => window.tessera.jump('tower::box_4'));
    await view(page, -2.2, 0.2, 14);
    await shoot(page, name);
  });
}

await withPage([world('seam.sdf'), '--servers', '2'], async (page, cluster) => {
  await page.click('#gridOn');
  await page.click('#contactsOn');
  await tessera(cluster.address, 'step', '40');
  await view(page, -1.2, 0.3, 22);
  await shoot(page, 'seam');
  await page.click('#contactsOn');
  await page.click('#seamsOn');
  await page.waitForFunction(() => window.tessera.picture.seams.countClones > 0);
  await shoot(page, 'clones');
});

await withPage([world('earth.sdf'), '--servers', '2'], async (page, cluster) => {
  await tessera(cluster.address, 'resume');
  await page.waitForFunction(() => window.tessera.bodies.tick > 120);
  await view(page, -2.0, 0.42, 110);
  await shoot(page, 'dashboard');
  await tessera(cluster.address, 'pause');
  await page.evaluate(() => {
    const {goTo, state, camera} = window.tessera;
    const [place] = state.places;
    goTo({sector: [0n, 0n, 0n], local: [0, 0, 0]}, 2.4e7);
    camera.yaw = Math.atan2(Number(place.sector[1]), Number(place.sector[0])) + 0.6;
    camera.pitch = 0.7;
  });
  await shoot(page, 'whole');
});

await browser.close();
