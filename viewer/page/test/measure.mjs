// Measures the cost of the web UI with 10,000 moving bodies, all in view: tick time (ms) and ticks per second
// without a client, with one that draws nothing, and with a browser; frames and megabytes per second; and
// pictures drawn per second, of the moving world and of a paused one seen from a turning camera (`turning`).
// The bodies are balls that roll on the ground at 60 ticks/s, and crates that drift and turn weightlessly at 30.
//
//   TESSERA_PAGE_PACKAGES=$PWD/build/release/viewer/node_modules TESSERA_PROGRAMS=build/release/bin \
//     TESSERA_WORLDS_FOLDER=worlds node viewer/page/test/measure.mjs [rounds, default 3]
import {mkdtemp, rm, writeFile} from 'node:fs/promises';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';

import {openBrowser, openPage, tessera, upCluster} from './browser.mjs';

const kRounds = Number(process.argv[2] ?? 3);
const kBodies = 10000;
const kSeconds = 10;

const WebSocket = createRequire(join(process.env.TESSERA_PAGE_PACKAGES, 'index.js'))('ws');
const models = resolve(process.env.TESSERA_WORLDS_FOLDER, 'models');

// All have the same velocity, so they never collide.
function thing(model, n, place, linear, angular) {
  return `<include><uri>${models}/${model}.sdf</uri><name>${model}_${n}</name><pose>${place.join(' ')} 0 0 0</pose>
      <tessera:velocity linear="${linear}" angular="${angular.join(' ')}"/></include>`;
}

// Positions of `count` things `spacing` apart, `edge` in a row.
const places = (count, edge, spacing) => Array.from({length: count}, (_, n) => [
  n % edge, Math.floor(n / edge) % edge, Math.floor(n / edge ** 2),
].map((place, axis) => (axis < 2 ? place - (edge - 1) / 2 : place) * spacing));

const kWorlds = {
  'rolling balls': [
    '<physics type="bullet"><max_step_size>0.016666666666666666</max_step_size></physics>',
    `<include><uri>${models}/plane.sdf</uri><name>ground</name></include>`,
    ...places(kBodies, 100, 1.5).map((place, n) => thing('ball', n, place, '0.4 0 0', [0, 0.8, 0])),
  ],
  'drifting crates': [
    '<physics type="bullet"><max_step_size>0.033333333333333333</max_step_size></physics>',
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

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

// {p50, p99: ms, ticks: per second} of a real-time run with `watch` in parallel, and the result of `watch`.
async function measure(file, watch) {
  const cluster = await upCluster(file, '--servers', '2');
  try {
    const watcher = await watch(cluster.url);
    await tessera(cluster.address, 'resume');
    await pause(4);  // until everything is running
    const {tick: before} = await status(cluster.url);
    await watcher.begin();
    await pause(kSeconds);
    const seen = await watcher.end();
    const {tick, tick_ms: {p50, p99}} = await status(cluster.url);
    await watcher.close();
    return {p50, p99, ticks: (tick - before) / kSeconds, ...seen};
  } finally {
    await cluster.stop('SIGINT');
  }
}

const nobody = async () => ({begin: async () => {}, end: async () => ({}), close: async () => {}});

// Receives frames as fast as they come, like a browser on another machine.
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
    end: async () => ({frames: frames / kSeconds, megabytes: bytes / kSeconds / 1e6}),
    close: async () => socket.close(),
  };
}

// Pictures per second of a paused world from a circling camera: the cost of drawing alone.
const drawnWhileTurning = (page) => page.evaluate(async (seconds) => {
  const {camera, state} = window.tessera;
  const timer = setInterval(() => camera.yaw += 0.002, 15);
  const wait = (time) => new Promise((done) => setTimeout(done, 1000 * time));
  await wait(seconds);  // until the level of detail has settled
  const [before, start] = [state.framesDrawn, performance.now()];
  await wait(seconds);
  const rate = 1000 * (state.framesDrawn - before) / (performance.now() - start);
  clearInterval(timer);
  return rate;
}, kSeconds);

async function browserPage(url) {
  const browser = await openBrowser();
  const page = await openPage(browser, url);
  await page.waitForFunction((count) => window.tessera.bodies.countMoving === count, {}, kBodies);
  const turning = await drawnWhileTurning(page);
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
      return {
        turning,
        drawn: (to.drawn - from.drawn) / seconds,
        megabytes: (to.bytes - from.bytes) / seconds / 1e6,
      };
    },
    close: () => browser.close(),
  };
}

const kWatchers = {
  'no page': nobody,
  'a client that draws nothing': reader,
  'a browser': browserPage,
};

const folder = await mkdtemp(join(tmpdir(), 'tessera-page-'));
try {
  for (const [name, parts] of Object.entries(kWorlds)) {
    const file = join(folder, 'moving_bodies.sdf');
    await writeFile(file, sdf(parts));
    const runs = Object.keys(kWatchers).map((watcher) => ({watcher, results: []}));
    for (let round = 0; round < kRounds; ++round) {
      for (const {watcher, results} of runs) results.push(await measure(file, kWatchers[watcher]));
    }
    console.log(`\n${name}, median of ${kRounds}`);
    console.table(Object.fromEntries(runs.map(({watcher, results}) => [watcher, Object.fromEntries(
        Object.keys(results[0]).map((key) => [key, Number(median(results.map((run) => run[key])).toFixed(2))]))])));
  }
} finally {
  await rm(folder, {recursive: true});
}
