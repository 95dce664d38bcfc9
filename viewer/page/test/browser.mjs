// A cluster with its web UI in a headless browser, for tests, pictures and measurements.
import {spawn} from 'node:child_process';
import {once} from 'node:events';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';
import {createInterface} from 'node:readline';

const kPatienceMs = 120_000;              // for busy machines
const kDrawingPatienceMs = 5 * kPatienceMs;  // for rendering on the CPU
const [packages, programs] = [process.env.TESSERA_PAGE_PACKAGES, process.env.TESSERA_PROGRAMS];
const puppeteer = createRequire(join(packages, 'index.js'))('puppeteer-core');

// Starts a program and waits until its output matches all patterns; returns their first groups. `ended` waits for
// its end and returns the exit code.
export async function start(name, args, ...patterns) {
  const child = spawn(resolve(programs, name), args, {stdio: ['ignore', 'pipe', 'inherit']});
  const exit = once(child, 'exit');
  const found = [];
  const deadline = setTimeout(() => child.kill(), kPatienceMs);
  for await (const line of createInterface({input: child.stdout})) {
    const match = patterns[found.length].exec(line);
    if (match) found.push(match[1]);
    if (found.length === patterns.length) break;
  }
  clearTimeout(deadline);
  if (found.length < patterns.length)
    throw new Error(`${name} ended without printing ${patterns[found.length]}`);
  child.stdout.resume();
  const stop = async (signal = 'SIGTERM') => {
    if (child.exitCode !== null || child.signalCode !== null) return;
    child.kill(signal);
    await exit;
  };
  return {found, stop, ended: async () => (await exit)[0]};
}

export async function upCluster(...args) {
  const up = await start(
      'tessera', ['up', '--listen', '127.0.0.1:0', '--page', '127.0.0.1:0', ...args], / on (\S+) with /,
      /browser: (\S+)/, /([\d,]+) bodies in/);
  const [address, url, bodies] = up.found;
  return {...up, address, url, bodies: Number(bodies.replaceAll(',', ''))};
}

export async function tessera(address, ...args) {
  const child = spawn(
      join(programs, 'tessera'), [...args, '--connect', address], {stdio: ['ignore', 'pipe', 'inherit']});
  let told = '';
  child.stdout.on('data', (text) => told += text);
  const [code] = await once(child, 'close');
  if (code !== 0) throw new Error(`tessera ${args.join(' ')} ended with exit code ${code}`);
  return told;
}

export function openBrowser(width = 1280, height = 800) {
  return puppeteer.launch({
    executablePath: process.env.TESSERA_CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    args: [
      '--no-sandbox', '--enable-unsafe-swiftshader', '--hide-scrollbars', `--window-size=${width},${height}`
    ],
    defaultViewport: {width, height},
    timeout: kPatienceMs,
    protocolTimeout: kDrawingPatienceMs,
  });
}

// `isPatient` for large windows, which take seconds to render on the CPU.
export async function openPage(browser, url, isPatient = false) {
  const page = await browser.newPage();
  page.setDefaultTimeout(isPatient ? kDrawingPatienceMs : kPatienceMs);
  page.errors = [];
  page.on('pageerror', (error) => page.errors.push(String(error)));
  page.on('console', (message) => {
    if (message.type() === 'error') page.errors.push(message.text());
  });
  await page.bringToFront();  // background tabs draw nothing
  await page.goto(url);
  return page;
}

// Opens the web UI at `url`, coarse, so that rendering on the CPU takes only seconds, and waits for its bodies.
export async function goCoarsely(page, url) {
  await page.goto(url);
  await page.evaluate(() => Object.assign(window.tessera.picture, {shadows: false, ratioMax: 0.25}));
  await page.waitForFunction(() => window.tessera.bodies.countMoving > 0);
}
