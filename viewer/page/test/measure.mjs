// What the page costs: 10,000 bodies that move, all in view. Frames per second and bytes per second of a
// page, and the time of ticks without a page, with one that draws nothing, and with one in a browser.
//
//   TESSERA_PAGE_PACKAGES=$PWD/build/release/viewer/node_modules TESSERA_PROGRAMS=build/release/bin \
//     TESSERA_WORLDS_FOLDER=worlds node viewer/page/test/measure.mjs [balls along each side, else 100]
import {mkdtemp, rm, writeFile} from 'node:fs/promises';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';

import {openBrowser, openPage, tessera, upCluster} from './browser.mjs';

const kEdge = Number(process.argv[2] ?? 100);  // balls along each side
const kSpacing = 1.5;  // m
const kSpeed = 0.4;    // m/s, all the same way: they roll and never meet
const kSeconds = 10;
const kTicks = 600;

const WebSocket = createRequire(join(process.env.TESSERA_PAGE_PACKAGES, 'index.js'))('ws');
const models = resolve(process.env.TESSERA_WORLDS_FOLDER, 'models');

function rollingBalls() {
  const balls = [];
  for (let n = 0; n < kEdge * kEdge; ++n) {
    const [x, y] = [n % kEdge, Math.floor(n / kEdge)].map((place) => (place - (kEdge - 1) / 2) * kSpacing);
    balls.push(
        `<include><uri>${models}/ball.sdf</uri><name>ball_${n}</name><pose>${x} ${y} 0 0 0 0</pose>` +
        `<tessera:velocity linear="${kSpeed} 0 0" angular="0 ${2 * kSpeed} 0"/></include>`);
  }
  return `<?xml version="1.0"?>
    <sdf version="1.9" xmlns:tessera="https://tessera.dev/sdf"><world name="rolling_balls">
      <tessera:settings><sector_size>64</sector_size></tessera:settings>
      <include><uri>${models}/plane.sdf</uri><name>ground</name></include>${balls.join('\n')}
    </world></sdf>`;
}

const pause = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));
const status = async (url) => (await fetch(new URL('status', url))).json();

// The times of ticks at real time for some seconds, then of ticks as fast as possible; with `watch` going on.
async function measure(name, file, watch) {
  const cluster = await upCluster(file, '--servers', '2');
  try {
    const watcher = await watch(cluster.url);
    await tessera(cluster.address, 'resume');
    await pause(3);  // until all is under way
    await watcher.begin();
    await pause(kSeconds);
    const seen = await watcher.end();
    await tessera(cluster.address, 'pause');
    const {tick_ms: {p50, p99}, tick} = await status(cluster.url);
    const start = performance.now();
    await tessera(cluster.address, 'step', String(kTicks));
    const fast = (performance.now() - start) / kTicks;
    await watcher.close();
    console.log(`${name}: ${tick} ticks, p50 ${p50.toFixed(2)} ms, p99 ${
        p99.toFixed(2)} ms; as fast as possible ${fast.toFixed(2)} ms a tick${seen}`);
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
  await page.waitForFunction((count) => window.tessera.bodies.countMoving === count, {}, kEdge * kEdge);
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
  const file = join(folder, 'rolling_balls.sdf');
  await writeFile(file, rollingBalls());
  for (let round = 0; round < 2; ++round) {
    await measure('no page', file, nobody);
    await measure('a page that draws nothing', file, reader);
    await measure('a page in a browser', file, browserPage);
  }
} finally {
  await rm(folder, {recursive: true});
}
