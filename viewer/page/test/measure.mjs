// What the page costs: 10,000 bodies that move, all in view. Frames per second and bytes per second of a
// page, and the time of ticks without a page, with one that draws nothing, and with one in a browser: of balls
// that roll on the ground, and of crates that drift and turn without any weight, which is less work.
//
//   TESSERA_PAGE_PACKAGES=$PWD/build/release/viewer/node_modules TESSERA_PROGRAMS=build/release/bin \
//     TESSERA_WORLDS_FOLDER=worlds node viewer/page/test/measure.mjs [rounds, else 2]
import {mkdtemp, rm, writeFile} from 'node:fs/promises';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';

import {openBrowser, openPage, tessera, upCluster} from './browser.mjs';

const kRounds = Number(process.argv[2] ?? 2);
const kBodies = 10000;
const kSeconds = 10;
const kTicks = 300;  // as fast as possible

const WebSocket = createRequire(join(process.env.TESSERA_PAGE_PACKAGES, 'index.js'))('ws');
const models = resolve(process.env.TESSERA_WORLDS_FOLDER, 'models');

// All with the same velocity: they never meet.
function thing(model, n, place, linear, angular) {
  return `<include><uri>${models}/${model}.sdf</uri><name>${model}_${n}</name><pose>${place.join(' ')} 0 0 0</pose>
      <tessera:velocity linear="${linear}" angular="${angular.join(' ')}"/></include>`;
}

// The places of `count` things `spacing` apart, `edge` in a row.
const places = (count, edge, spacing) => Array.from({length: count}, (_, n) => [
  n % edge, Math.floor(n / edge) % edge, Math.floor(n / edge ** 2),
].map((place, axis) => (axis < 2 ? place - (edge - 1) / 2 : place) * spacing));

const kWorlds = {
  'rolling balls': [
    '<gravity>0 0 -9.81</gravity>',
    `<include><uri>${models}/plane.sdf</uri><name>ground</name></include>`,
    ...places(kBodies, 100, 1.5).map((place, n) => thing('ball', n, place, '0.4 0 0', [0, 0.8, 0])),
  ],
  'drifting crates': [
    '<gravity>0 0 0</gravity>',
    ...places(kBodies, 22, 3).map(
        (place, n) => thing('crate', n, place, '0.4 0 0', [n % 3 - 1, n % 5 - 2, n % 7 - 3])),
  ],
};

const sdf = (parts) => `<?xml version="1.0"?>
  <sdf version="1.9" xmlns:tessera="https://tessera.dev/sdf"><world name="moving_bodies">
    <tessera:settings><sector_size>64</sector_size></tessera:settings>${parts.join('\n')}
  </world></sdf>`;

const pause = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));
const status = async (url) => (await fetch(new URL('status', url))).json();

// The times of ticks at real time for some seconds, then of ticks as fast as possible; with `watch` going on.
async function measure(name, file, watch) {
  const cluster = await upCluster(file, '--servers', '2');
  try {
    const watcher = await watch(cluster.url);
    await tessera(cluster.address, 'resume');
    await pause(4);  // until all is under way
    await watcher.begin();
    await pause(kSeconds);
    const seen = await watcher.end();
    const {tick_ms: {p50, p99}, real_time_factor: pace} = await status(cluster.url);
    await tessera(cluster.address, 'pause');
    const start = performance.now();
    await tessera(cluster.address, 'step', String(kTicks));
    const fast = (performance.now() - start) / kTicks;
    await watcher.close();
    console.log(`${name}: p50 ${p50.toFixed(2)} ms, p99 ${p99.toFixed(2)} ms at a real-time factor of ${
        pace.toFixed(2)}; as fast as possible ${fast.toFixed(2)} ms a tick${seen}`);
  } finally {
    await cluster.stop('SIGINT');
  }
}

const nobody = async () => ({begin: async () => {}, end: async () => '', close: async () => {}});

// Takes frames as fast as they come, as a page on another machine would.
async function reader(url) {
  const socket = new WebSocket(new URL('live', url.replace('http', 'ws')));
  let frames = 0;
  let bytes = 0;
  socket.on('message', (data, isBinary) => {
    bytes += data.length;
    if (!isBinary) return;
    ++frames;
    socket.send(JSON.stringify({type: 'seen'}));
  });
  await new Promise((opened) => socket.on('open', opened));
  socket.send(JSON.stringify({type: 'look', sector: ['0', '0', '0'], local: [0, 0, 0], half: 400}));
  return {
    begin: async () => {
      frames = bytes = 0;
    },
    end: async () =>
        `; ${(frames / kSeconds).toFixed(1)} frames/s, ${(bytes / kSeconds / 1e6).toFixed(2)} MB/s`,
    close: async () => socket.close(),
  };
}

async function browserPage(url) {
  const browser = await openBrowser();
  const page = await openPage(browser, url);
  await page.waitForFunction((count) => window.tessera.bodies.countMoving === count, {}, kBodies);
  const count = () => page.evaluate(() => ({
                                      drawn: window.tessera.state.framesDrawn,
                                      bytes: window.tessera.connection.bytes,
                                      at: performance.now(),
                                    }));
  let from;
  return {
    begin: async () => {
      from = await count();
    },
    end: async () => {
      const to = await count();
      const seconds = (to.at - from.at) / 1000;
      return `; ${((to.drawn - from.drawn) / seconds).toFixed(1)} frames/s drawn, ${
          ((to.bytes - from.bytes) / seconds / 1e6).toFixed(2)} MB/s`;
    },
    close: () => browser.close(),
  };
}

const folder = await mkdtemp(join(tmpdir(), 'tessera-page-'));
try {
  for (const [name, parts] of Object.entries(kWorlds)) {
    const file = join(folder, 'moving_bodies.sdf');
    await writeFile(file, sdf(parts));
    for (let round = 0; round < kRounds; ++round) {
      await measure(`${name}, no page`, file, nobody);
      await measure(`${name}, a page that draws nothing`, file, reader);
      await measure(`${name}, a page in a browser`, file, browserPage);
    }
  }
} finally {
  await rm(folder, {recursive: true});
}
