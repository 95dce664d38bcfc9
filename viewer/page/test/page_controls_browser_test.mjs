// Layout, colours, keys and roles of the web UI, in a browser with a real cluster.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {goCoarsely, openBrowser, openPage, upCluster} from './browser.mjs';

let cluster;
let browser;
let page;
const open = () => goCoarsely(page, cluster.url);

before(async () => {
  cluster = await upCluster(join(process.env.TESSERA_WORLDS_FOLDER, 'seam.sdf'), '--servers', '2');
  browser = await openBrowser(900, 600);
  page = await openPage(browser, cluster.url);
  await open();
});

after(async () => {
  await browser?.close();
  await cluster?.stop();
});

const isInState = (name) =>
    page.waitForFunction((text) => document.getElementById('state').textContent === text, {}, name);

// The panels and controls that are shown: boxes in pixels, and whether they or their texts are cut.
const shownBoxes = () => page.evaluate(() => {
  const panels = ['header', 'nav', '#left', '#right', 'footer'];
  const shown = (element) => getComputedStyle(element).display !== 'none' && element.getClientRects().length > 0;
  const box = (element) => {
    const {left, top, right, bottom} = element.getBoundingClientRect();
    return {name: element.id || element.tagName, left, top, right, bottom};
  };
  const controls = [...document.querySelectorAll('header button, nav button, nav select, nav input')].filter(shown);
  return {
    panels: panels.map((name) => document.querySelector(name)).filter(shown).map(box),
    controls: controls.map((element) => {
      const {left, top, right, bottom} = element.getBoundingClientRect();
      const found = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
      return {...box(element), isOnTop: element.contains(found)};
    }),
    wide: document.querySelector('header').scrollWidth - document.querySelector('header').clientWidth,
  };
});

// Waits until the page has fitted its panels, which it does before the next frame.
async function resize(viewport) {
  await page.setViewport(viewport);
  await page.waitForFunction(
      ({width, height}) => innerWidth === width && innerHeight === height, {polling: 'raf'}, viewport);
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

for (const [width, height] of [[390, 780], [800, 600], [1024, 768], [1440, 900], [2560, 1080]]) {
  test(`at ${width} x ${height} nothing is covered or cut`, async () => {
    const before = page.viewport();
    await resize({width, height});
    for (const side of ['left', 'right', 'none']) {
      await page.evaluate((wanted) => {
        for (const name of ['left', 'right']) {
          const button = document.getElementById(`${name}Toggle`);
          if ((button.getAttribute('aria-expanded') === 'true') !== (name === wanted || innerWidth >= 900 && wanted !== 'none'))
            button.click();
        }
      }, side);
      const {panels, controls, wide} = await shownBoxes();
      assert.ok(panels.length >= (side === 'none' ? 3 : 4), side);
      for (const box of [...panels, ...controls]) {
        assert.ok(box.left >= 0 && box.top >= 0 && box.right <= width && box.bottom <= height, `${box.name} is outside`);
      }
      for (const [n, a] of panels.entries()) {
        for (const b of panels.slice(n + 1)) {
          const isApart = a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
          assert.ok(isApart, `${a.name} covers ${b.name}, ${side}`);
        }
      }
      for (const {name, isOnTop} of controls) assert.ok(isOnTop, `${name} is covered`);
      assert.ok(wide <= 0, 'the header is cut');
    }
    await resize(before);
    await page.evaluate(() => localStorage.clear());
    await open();
  });
}

test('colours are light where the system says so, and as chosen from then on', async () => {
  const isTheme = (name) => page.waitForFunction((wanted) => document.documentElement.dataset.theme === wanted, {}, name);
  const sky = () => page.evaluate(() => window.tessera.picture.scene.background.getHexString());
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'dark'}]);
  await isTheme('dark');
  const dark = await sky();
  await page.emulateMediaFeatures([{name: 'prefers-color-scheme', value: 'light'}]);
  await isTheme('light');
  assert.notEqual(await sky(), dark);
  await page.click('#themeToggle');
  await open();
  await isTheme('dark');
  await page.evaluate(() => localStorage.clear());
});

test('Space presses the button that has the focus, and else runs and pauses', async () => {
  const isHelpOpen = (wanted) => page.waitForFunction((open) => document.getElementById('help').open === open, {}, wanted);
  await isInState('paused');
  await page.focus('#helpOpen');
  await page.keyboard.press('Space');
  await isHelpOpen(true);
  assert.match(await page.$eval('#help', (help) => help.innerText), /Space\s+run or pause/);
  await page.keyboard.press('Escape');
  await isHelpOpen(false);
  assert.equal(await page.$eval('#state', ({textContent}) => textContent), 'paused');
  await page.focus('#world');
  await page.keyboard.press('?');
  await isHelpOpen(true);
  await page.keyboard.press('Escape');
  await isHelpOpen(false);
  await page.focus('#world');
  await page.keyboard.press('Space');
  await isInState('running');
  await page.keyboard.press('Space');
  await isInState('paused');
});

test('arrow keys move within a group of choices', async () => {
  await page.focus('[data-mode=server]');
  await page.keyboard.press('ArrowRight');
  assert.equal(await page.evaluate(() => window.tessera.bodies.mode), 'sector');
  const chosen = () => page.$$eval('#modes [aria-checked=true]', (all) => all.map(({dataset}) => dataset.mode));
  assert.deepEqual(await chosen(), ['sector']);
  await page.keyboard.press('ArrowLeft');
  assert.deepEqual(await chosen(), ['server']);
});

test('every control has a name, and few numbers come first', async () => {
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, input, select, [role]')]
      .filter((element) => !element.hidden && element.type !== 'file' && element.role !== 'status')
      .filter((element) => !(element.ariaLabel || element.textContent.trim() || element.closest('label') || element.getAttribute('aria-labelledby')))
      .map(({outerHTML}) => outerHTML));
  assert.deepEqual(nameless, []);
  await page.waitForFunction(() => document.querySelectorAll('#tiles > div').length === 3);
  assert.equal(await page.$eval('#counters', ({open}) => open), false);
  await page.click('#counters summary');
  await page.waitForFunction(() => /clones/.test(document.getElementById('moreTiles').innerText));
  await page.click('#counters summary');
});

test('causes no errors', () => {
  assert.deepEqual(page.errors.filter((text) => !/WebSocket|ERR_CONNECTION/.test(text)), []);
});
