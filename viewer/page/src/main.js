// The web UI: shows the world of a cluster, as received from tessera-viewer.
import {Bodies} from './bodies.js';
import {Camera} from './camera.js';
import {kLegends, serverColour, useColours} from './colours.js';
import {Connection} from './connection.js';
import {Dashboard} from './dashboard.js';
import {Details} from './details.js';
import {Ground} from './ground.js';
import {Keys} from './keys.js';
import {Labels, labelsOf} from './labels.js';
import {Model} from './model.js';
import {Notice} from './notice.js';
import {Panels} from './panels.js';
import {distanceFor, Places} from './places.js';
import {Player} from './player.js';
import {number, usePlotColours} from './plot.js';
import {between, fromJson, isSameFrame, placed, sectorText, toJson} from './position.js';
import {Radios} from './radios.js';
import {RecordButton} from './record_button.js';
import {Picture} from './scene.js';
import {Source} from './source.js';
import {storage} from './storage.js';
import {Theme} from './theme.js';
import {Tools} from './tools.js';
import {Tree} from './tree.js';
import {Worlds} from './worlds.js';

const kHalfMin = 120;    // m: smallest region requested around the focus
const kHalfMax = 20000;  // m: largest
const kLookEveryMs = 250;
const kPlacesEveryMs = 30000;
const kRates = [0.1, 0.25, 0.5, 1, 2, 4, 10, 0];  // simulated seconds per second; 0: as fast as possible
const kDrawForMs = 300;  // after a change, while bodies move between frames

const $ = (id) => document.getElementById(id);

const bodies = new Bodies();
const camera = new Camera($('world'));
const picture = new Picture($('world'), bodies, new URLSearchParams(location.search).get('detail'));
const labels = new Labels($('labels'));
const dashboard = new Dashboard({
  tiles: $('tiles'),
  plots: $('plots'),
  moreTiles: $('moreTiles'),
  morePlots: $('morePlots'),
  servers: $('servers'),
});
const connection = new Connection(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/live`);
const source = new Source(connection);
const ground = new Ground((...question) => source.ask(...question), () => redraw());
picture.scene.add(ground.object);
const player = new Player({connection, source, bodies, notify});

const state = {
  status: null,  // the last "status" message
  pendingView: null,
  looked: null,  // {focus, half} of the last "look"
  wantsPlace: true,  // go to the first place as soon as one is known
  selected: null,
  following: false,
  isBoarding: false,
  framesDrawn: 0,
  framesPerSecond: 0,
  bytesPerSecond: 0,
  readOnly: false,
  mayLoad: false,
  hasChosenColours: false,
  live: null,  // the camera and colours of the cluster's view, while a recording is shown
};

const notice = new Notice($('notice'));
function notify(...message) { notice.show(...message); }

const command = (what, details) => source.ask(what, details).catch((error) => notify(error.message, true));

// --- what the camera sees ---

function wantedHalf() { return Math.min(Math.max(3 * camera.distance, kHalfMin), kHalfMax); }

// Requests a new region when the focus nears the border of the last one, or the camera zooms in or out.
function lookWhereNeeded(force = false) {
  if (!camera.focus) return;
  const half = wantedHalf();
  const last = state.looked;
  const isEnough = last && isSameFrame(last.focus, camera.focus) && half <= last.half && half > last.half / 3 &&
      Math.max(...between(last.focus, camera.focus, camera.sectorSize).map(Math.abs)) <
          last.half - 0.7 * half;
  if (isEnough && !force) return;
  state.looked = {focus: camera.focus, half: 1.5 * half};
  source.send({type: 'look', ...toJson(camera.focus), half: 1.5 * half});
}

function goTo(focus, distance) {
  setFollowing(false);
  camera.jump(focus, distance);
  lookWhereNeeded(true);
}

async function refreshPlaces() {
  if (!source.isOpen || !['paused', 'running', 'recording'].includes(state.status?.status.state)) return;
  try {
    await places.ask();
  } catch {
    return;  // will be retried soon
  }
  if (state.wantsPlace && places.all.length > 0) {
    state.wantsPlace = false;
    goTo(places.all[0], distanceFor(places.all[0].half));
  }
  places.show();
}

const places = new Places({
  list: $('places'),
  form: $('jump'),
  text: $('jumpText'),
  names: $('jumpNames'),
  answer: $('jumpAnswer'),
  source,
  camera,
  bodies,
  goTo,
  select: (id) => select(id),
  isLive: () => !player.isOn,
});

const tree = new Tree({
  fold: $('treeFold'),
  text: $('treeText'),
  tree: $('tree'),
  note: $('treeNote'),
  ask: (...question) => source.ask(...question),
  go: (name) => places.jump(name).catch(() => {}),
});

// --- the selected body or sector ---

const details = new Details({
  panel: $('details'),
  name: $('detailsName'),
  facts: $('facts'),
  plot: $('history'),
  choice: $('plotted'),
  actions: $('bodyActions'),
  bodies,
  programsOf: (id) => source.ask('programs', {body: id}),
  joints: () => model.told,
  onRays: (rays) => {
    picture.sensorRays.show(rays);
    redraw();
  },
});

const model = new Model({
  panel: $('model'),
  name: $('modelName'),
  filter: $('modelFilter'),
  bodies: $('modelBodies'),
  joints: $('modelJoints'),
  ask: (what, details) => source.ask(what, details),
  select: (id) => select(id),
  mayDrive: () => isLive() && !state.readOnly,
  notify,
});

function select(id) {
  state.selected = id;
  bodies.selected = id;
  setFollowing(state.following && id !== null);
  if (id === null)
    details.hide();
  else
    details.showBody(id);
  refreshDetails();
}

// A click on a static body selects the sector there, if sectors are shown.
function selectPlace({sector}) {
  select(null);
  if (!$('gridOn').checked) return;
  details.showSector(sector);
  refreshDetails();
  showGrid();
}

function refreshDetails() {
  details.refresh(!player.isOn);
  const body = player.isOn || state.selected === null ? null : bodies.look(state.selected);
  if (body || state.selected === null || player.isOn) model.show(body?.info.name ?? null);
  model.refresh();
}

function setFollowing(on) {
  state.following = on;
  $('follow').classList.toggle('on', on);
  $('follow').setAttribute('aria-pressed', String(on));
  if (!on) camera.stopRiding();
}

// What is followed is seen from its own frame: there it moves as slowly as it does, and the view turns with it.
async function boardWhereNeeded() {
  if (!state.following || state.isBoarding || bodies.look(state.selected)?.isAboard === false) return;
  state.isBoarding = true;
  const found = await source.ask('find', {body: state.selected}).catch(() => null);  // the next time
  state.isBoarding = false;
  if (!state.following || found?.body !== state.selected) return;
  camera.jump(fromJson(found));
  lookWhereNeeded(true);
}

const worlds = new Worlds({
  panel: $('worlds'),
  title: $('worldsTitle'),
  hint: $('worldsHint'),
  lists: $('worldsLists'),
  buttons: {open: $('worldsOpen'), close: $('worldsClose'), reset: $('reset'), save: $('save')},
  ask: (...question) => source.ask(...question),
  mayLoad: () => source.isOpen && !player.isOn && state.mayLoad,
  maySave: () => source.isOpen && !player.isOn && !state.readOnly,
  status: () => player.isOn || !state.status?.answers ? null : state.status.status,
  notify,
});

const recordButton = new RecordButton({
  button: $('record'),
  link: $('recordingFile'),
  ask: (...question) => source.ask(...question),
  mayRecord: () => source.isOpen && !player.isOn && !state.readOnly,
  status: () => player.isOn || !state.status?.answers ? null : state.status.status,
  notify,
});

// --- messages from the server ---

source.addEventListener('open', () => {
  state.looked = null;
  sendMarks();
  lookWhereNeeded(true);
  refreshPlaces();
});

source.addEventListener('lost', () => {
  showState('lost', 'no connection');
});

source.addEventListener('hello', ({detail}) => {
  state.readOnly = detail.read_only;
  state.mayLoad = detail.may_load;
  enableControls();
});

source.addEventListener('world', ({detail}) => {
  const isOther = state.world !== undefined && state.world !== detail.world;
  state.world = detail.world;
  bodies.clear();
  ground.clear();
  tree.clear();
  offerLooks();
  select(null);
  dashboard.clear();
  state.wantsPlace ||= isOther;
  if (isOther && camera.focus?.frame) goTo(placed({sector: [0n, 0n, 0n]}));  // which the world may not have
  refreshPlaces();
});

source.addEventListener('view', ({detail}) => {
  const sector = detail.sector.map(BigInt);
  // Small integers that differ between neighbouring sectors, wherever the view is.
  const low = sector.map((index) => Number(BigInt.asIntN(16, index)));
  state.pendingView = {...detail, sector, low};
  camera.sectorSize = detail.sector_size;
});

source.addEventListener('bodies', ({detail}) => {
  const hadLooks = bodies.hasLooks;
  bodies.introduce(detail);
  if (bodies.hasLooks !== hadLooks) offerLooks();
});

source.addEventListener('frame', ({detail}) => {
  redraw();
  requestAnimationFrame(() => source.send({type: 'seen'}));
  if (detail.kind === 'contacts') return picture.contacts.show(detail);
  if (detail.isKey) camera.up.set(...state.pendingView.up);
  bodies.apply(detail, state.pendingView);
  if (detail.isKey) places.arrived();
});

source.addEventListener('seams', ({detail}) => {
  picture.seams.show(detail, bodies);
  redraw();
  requestAnimationFrame(() => source.send({type: 'seen'}));
});

source.addEventListener('status', ({detail}) => {
  const before = state.status?.status;
  state.status = detail;
  const {status, answers} = detail;
  showState(answers ? status.state : 'lost', answers ? status.state : 'cluster not responding');
  if (status.failure && status.failure !== before?.failure) notify(status.failure, true);
  $('worldName').textContent = status.world;
  $('clock').textContent = status.settings ? `${status.time.toFixed(1)} s` : '';
  document.title = status.world ? `${status.world} · Tessera` : 'Tessera';
  enableControls();
  showLegend();
  if (!player.isOn) dashboard.show(detail, state);
  worlds.refresh();
  recordButton.refresh(detail.recording);
  refreshDetails();
  if (state.wantsPlace || places.all.length === 0) refreshPlaces();
});

// --- controls ---

const kPlay = 'M4 2.5v11l9-5.5z';
const kPause = 'M3.5 2.5h3v11h-3zM9.5 2.5h3v11h-3z';

function showState(name, text) {
  $('state').className = `pill ${name}`;
  $('state').textContent = text;
  $('play').querySelector('path').setAttribute('d', name === 'running' ? kPause : kPlay);
  $('play').setAttribute('aria-label', name === 'running' ? 'Pause' : 'Run');
}

const isLive = () => ['paused', 'running'].includes(state.status?.status.state) && state.status.answers;

function enableControls() {
  const mayChange = isLive() && !state.readOnly;
  for (const id of ['play', 'step', 'steps', 'rate', 'pushUp', 'remove']) $(id).disabled = !mayChange;
  for (const button of $('tools').children) {
    const {tool} = button.dataset;
    button.disabled = (['push', 'spawn'].includes(tool) && !mayChange) || (tool !== 'select' && player.isOn);
  }
  for (const control of [$('seamsOn'), ...$('modes').querySelectorAll('[data-mode=server]')])
    control.disabled = player.isOn;  // recordings do not contain them
}

function togglePlay() {
  if (player.isOn) return player.toggle();
  return state.status?.status.state === 'running' ? command('pause') : resume();
}

const resume = () => command('resume', {real_time_factor: Number($('rate').value)});

function step(way) {
  if (player.isOn)
    player.step(way);
  else if (way > 0)
    command('step', {ticks: 1});
}

const tools = new Tools({source, picture, camera, bodies, options: $('toolOptions'), notify, select, selectPlace});
camera.onClick = (event) => tools.click(event);
camera.onMove = () => setFollowing(false);

const toolRadios = new Radios($('tools'), 'tool', (tool) => useTool(tool));
const modeRadios = new Radios($('modes'), 'mode', (mode) => {
  state.hasChosenColours = true;
  colourBy(mode);
});

async function removeSelected() {
  const removed = await command('remove', {body: state.selected});
  if (!removed) return;
  select(null);
  const undo = async () => {
    const again = await command('undo');
    if (again) select(again.body);
  };
  notify(`${removed.name} is removed`, false, removed.can_undo ? {text: 'Undo', run: undo} : null);
}

function useTool(name) {
  if ($('tools').querySelector(`[data-tool=${name}]`).disabled) return;
  tools.use(name);
  $('world').classList.toggle('tool', name !== 'select');
  toolRadios.show(name);
}

function colourBy(mode) {
  bodies.mode = mode;
  modeRadios.show(mode);
  showLegend();
}

// A world that has looks is shown in them, until another colouring is chosen.
function offerLooks() {
  $('modes').querySelector('[data-mode=look]').hidden = !bodies.hasLooks;
  if (bodies.hasLooks && !state.hasChosenColours) colourBy('look');
  if (!bodies.hasLooks && bodies.mode === 'look') colourBy(player.isOn ? 'speed' : 'server');
}

function showLegend() {
  const servers =
      (state.status?.nodes ?? []).map((_, place) => [`server ${place + 1}`, [serverColour(place)]]);
  const rows = kLegends[bodies.mode] ?? servers;
  const text = JSON.stringify(rows);
  if ($('legend').dataset.shown === text) return;
  $('legend').dataset.shown = text;
  $('legend').replaceChildren(...rows.map(([name, colours]) => {
    const entry = document.createElement('span');
    for (const colour of colours) entry.appendChild(document.createElement('i')).style.background = colour;
    entry.append(name);
    return entry;
  }));
}

function sendMarks() {
  for (const type of ['contacts', 'seams']) {
    const on = $(`${type}On`).checked && !$(`${type}On`).disabled;
    picture[type].object.visible = on;
    source.send({type, on});
  }
}

// --- recordings ---

// The cluster continues meanwhile; closing the recording restores the camera.
player.onBegin = () => {
  state.live ??= {focus: camera.focus, pose: [camera.yaw, camera.pitch, camera.distance], mode: bodies.mode};
  state.wantsPlace = true;
  changeSource();
  useTool('select');
  if (bodies.mode === 'server') colourBy('speed');
};

player.onEnd = () => {
  const {focus, pose, mode} = state.live;
  state.live = null;
  state.wantsPlace = focus === null;
  [camera.yaw, camera.pitch, camera.distance] = pose;
  if (focus) camera.jump(focus);
  changeSource();
  colourBy(mode);
};

function changeSource() {
  state.status = null;
  state.world = undefined;
  places.all = [];
  document.body.classList.toggle('replaying', player.isOn);
  worlds.close();
  showState('lost', 'connecting');
  enableControls();
}

$('rate').replaceChildren(...kRates.map((rate) => new Option(rate > 0 ? `${rate} ×` : 'max', rate, false, rate === 1)));
$('rate').onchange = () => state.status?.status.state === 'running' && resume();
$('play').onclick = togglePlay;
$('step').onclick = () => step(1);
$('steps').onclick = () => command('step', {ticks: 60});
$('contactsOn').onchange = $('seamsOn').onchange = sendMarks;
$('gridOn').onchange = () => showGrid();
$('shadowsOn').checked = picture.shadows;
$('shadowsOn').onchange = () => {
  picture.shadows = $('shadowsOn').checked;
  picture.mayCoarsen = false;
};
picture.onTooSlow = () => $('shadowsOn').checked = false;
$('deselect').onclick = () => select(null);
$('follow').onclick = () => setFollowing(!state.following);
$('pushUp').onclick = () => tools.pushUp(state.selected).catch((error) => notify(error.message, true));
$('remove').onclick = removeSelected;

const kToolKeys = {
  1: 'select',
  2: 'push',
  3: 'spawn',
  4: 'ray'
};
const keys = new Keys([
  {keys: [], names: ['drag'], text: 'turn around the focus; with Shift or the right button, move'},
  {keys: [], names: ['wheel'], text: 'zoom'},
  {keys: [], names: ['W', 'A', 'S', 'D', 'Q', 'E'], text: 'fly, while the picture has the focus'},
  {keys: [' '], names: ['Space'], text: 'run or pause; on a button that has the focus: press it', run: togglePlay},
  {keys: ['.'], names: ['.'], text: 'one tick', run: () => step(1)},
  {keys: [','], names: [','], text: 'in a recording: one tick back', run: () => step(-1)},
  {keys: Object.keys(kToolKeys), names: Object.keys(kToolKeys), text: 'select, push, spawn, cast a ray', run: (key) => useTool(kToolKeys[key])},
  {keys: ['f'], names: ['F'], text: 'follow the selected body', run: () => state.selected !== null && setFollowing(!state.following)},
  {keys: ['g'], names: ['G'], text: 'show sectors', run: () => $('gridOn').click()},
  {keys: ['c'], names: ['C'], text: 'show contacts', run: () => $('contactsOn').click()},
  {keys: ['b'], names: ['B'], text: 'show seams', run: () => $('seamsOn').click()},
  {keys: ['/'], names: ['/'], text: 'go to a sector or a body', run: focusJump},
  {keys: ['Escape'], names: ['Escape'], text: 'deselect', run: () => select(null)},
  {keys: ['?'], names: ['?'], text: 'this help', run: () => keys.showHelp()},
], $('help'), $('helpKeys'));
$('helpOpen').onclick = () => keys.showHelp();

const panels = new Panels(document.body, {left: $('leftToggle'), right: $('rightToggle')});

function focusJump() {
  panels.reveal('left');
  $('jumpText').focus();
}

const theme = new Theme(document.documentElement, storage, matchMedia('(prefers-color-scheme: light)'));
theme.addEventListener('change', useTheme);
$('themeToggle').onclick = () => theme.toggle();

function useTheme() {
  useColours(theme.colours.picture);
  usePlotColours(theme.colours.ui);
  picture.use(theme.colours.picture);
  ground.use(theme.colours.picture);
  bodies.repaint();
  $('themeToggle').setAttribute('aria-pressed', String(theme.name === 'light'));
  redraw();
}

// --- the loop ---

function showGrid() {
  const {view} = bodies;
  const on = $('gridOn').checked && view !== null;
  picture.grid.object.visible = on;
  if (!on || !camera.focus || !isSameFrame(camera.focus, view)) return;
  const offsetOf = (sector) => sector.map((index, axis) => Number(index - view.sector[axis]));
  picture.grid.show(bodies.occupiedSectors(), offsetOf(details.sector ?? camera.focus.sector), view.sector_size);
}

function showFooter() {
  const {focus} = camera;
  const frame = focus?.frame && bodies.view?.frame === focus.frame ? `${bodies.view.frame_name}, ` : '';
  $('where').textContent = focus ? `${frame}sector ${sectorText(focus.sector)}` : '';
  $('view').textContent = focus ?
      `at ${focus.local.map((x) => x.toFixed(1)).join(', ')} m · camera ${number(camera.distance)} m away` :
      '';
  $('pace').textContent = `${number(bodies.countMoving)} bodies in view · tick ${bodies.tick} · ${
      number(state.framesPerSecond)} fps · ${number(state.bytesPerSecond / 1000)} kB/s`;
}

// A picture that no longer changes is not drawn again.
let drawUntil = 0;
let drawnAt = 0;
function redraw() { drawUntil = performance.now() + kDrawForMs; }

let last = performance.now();
let lastPose = '';
function draw(now) {
  requestAnimationFrame(draw);
  const seconds = Math.min((now - last) / 1000, 0.25);
  const frameMs = now - last;
  last = now;
  camera.advance(seconds);
  player.advance(seconds);
  if (!camera.focus || !bodies.view || !isSameFrame(camera.focus, bodies.view)) return;
  const pose = `${camera.focus.sector} ${camera.focus.local} ${camera.yaw} ${camera.pitch} ${camera.distance}`;
  if (pose !== lastPose) redraw();
  lastPose = pose;
  if (drawnAt > drawUntil && !picture.ray.object.visible) return;
  drawnAt = performance.now();
  bodies.blend(drawnAt);
  const followed = state.following ? bodies.drawnPlace(state.selected) : null;
  if (followed) camera.ride(followed);
  ground.place(bodies.view);
  if (picture.seams.object.visible) picture.seams.advance(bodies);
  const measuring = picture.sensorRays.object.visible ? bodies.look(state.selected) : null;
  if (measuring) picture.sensorRays.follow(measuring);
  picture.draw(camera, bodies.view, state.looked?.half ?? kHalfMin, frameMs);
  labels.show(labelsOf(picture, camera, bodies, state.selected, places.all));
  state.framesDrawn += 1;
}

let measured = {at: performance.now(), frames: 0, bytes: 0};
setInterval(() => {
  const now = performance.now();
  const seconds = (now - measured.at) / 1000;
  state.framesPerSecond = (state.framesDrawn - measured.frames) / seconds;
  state.bytesPerSecond = Math.max(0, source.bytes - measured.bytes) / seconds;
  measured = {at: now, frames: state.framesDrawn, bytes: source.bytes};
}, 1000);
for (const change of ['click', 'change', 'keydown', 'resize']) addEventListener(change, redraw);
setInterval(() => {
  boardWhereNeeded();
  lookWhereNeeded();
  ground.lookAround(player.isOn ? null : bodies.ground, camera);
}, kLookEveryMs);
setInterval(() => {
  showGrid();
  showFooter();
}, 250);
setInterval(refreshPlaces, kPlacesEveryMs);

useTheme();
useTool('select');
colourBy('server');
enableControls();
requestAnimationFrame(draw);

// For scripts that control the web UI: tests, screenshots, measurements.
window.tessera = {
  state,
  bodies,
  camera,
  picture,
  ground,
  connection,
  player,
  places,
  goTo,
  select,
  jump: (text) => places.jump(text),
};
