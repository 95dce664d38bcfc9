// The right panel: metrics of the cluster, now and over the last minutes.
import {serverColour} from './colours.js';
import {number, Plot} from './plot.js';

// Names of colours of the theme.
const kTeal = 'teal';
const kBlue = 'blue';
const kAmber = 'amber';

const kFirstCounters = ['bodies_awake', 'contacts'];  // the others are behind a fold

export function element(tag, text, className) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

export function fill(list, facts) {
  list.replaceChildren(...facts.flatMap(([name, value]) => [element('dt', name), element('dd', value)]));
}

const megabytes = (bytes) => `${number(bytes / 1e6)} MB`;
const times = ({p50, p99, max}) => [p50, p99, max].map((ms) => ms.toFixed(2)).join(' / ');

function tile(name, value) {
  const made = element('div');
  made.append(element('b', number(value)), element('small', name.replaceAll('_', ' ')));
  return made;
}

// One row for each server; a click shows the details.
class ServerRow {
  constructor(parent, place) {
    this.element = element('div');
    const head = element('button');
    head.setAttribute('aria-expanded', 'false');
    const swatch = element('i');
    swatch.style.background = serverColour(place);
    this.name = element('span');
    this.load = element('small');
    head.append(swatch, this.name, this.load);
    this.more = element('div', undefined, 'more');
    this.more.hidden = true;
    this.facts = element('dl');
    this.more.append(this.facts);
    this.plot = new Plot(
        this.more, 'bodies, clones', '', [{name: 'bodies', colour: kBlue}, {name: 'clones', colour: kAmber}]);
    head.onclick = () => {
      this.more.hidden = !this.more.hidden;
      head.setAttribute('aria-expanded', String(!this.more.hidden));
      this.plot.draw();
    };
    this.element.append(head, this.more);
    parent.append(this.element);
  }

  show(server, place) {
    this.element.className = server ? '' : 'gone';
    if (!server) {
      this.load.textContent = 'has left';
      return;
    }
    const note = server.suspect ? ' (not responding)' : server.takes_part ? '' : ' (idle)';
    this.name.textContent = `server ${place + 1}${note}`;
    this.load.textContent = `${number(server.bodies)} bodies, ${server.own_ms.toFixed(1)} ms`;
    fill(this.facts, [
      ['node', server.node],
      ['streams', server.stream_address],
      ['sectors', `${number(server.sectors)}, ${number(server.sectors_awake)} awake`],
      ['own work of a tick', `${server.own_ms.toFixed(2)} ms`],
      ['tick p50 / p99 / max', `${times(server.tick_ms)} ms`],
      ['sent to servers', megabytes(server.exchange_bytes)],
      ['memory', megabytes(server.peak_rss_bytes)],
      ['engine', `${server.engine}, ${server.threads} thread${server.threads === 1 ? '' : 's'}`],
    ]);
    this.plot.add(server.bodies, server.clones);
  }
}

export class Dashboard {
  constructor({tiles, plots, moreTiles, morePlots, servers}) {
    Object.assign(this, {tiles, moreTiles, servers});
    let parent = plots;
    const plot = (title, unit, ...lines) => new Plot(parent, title, unit, lines);
    this.pace = plot('real-time factor', '×', {name: 'now', colour: kTeal});
    this.tick = plot(
        'slowest server\'s tick', 'ms', {name: 'p50 since the load', colour: kTeal},
        {name: 'p99 since the load', colour: kAmber});
    this.awake =
        plot('bodies awake, contacts', '', {name: 'awake', colour: kTeal}, {name: 'contacts', colour: kBlue});
    parent = morePlots;
    this.clones = plot('clones', '', {name: 'clones', colour: kAmber});
    this.islands = plot(
        'islands at seams', '', {name: 'across seams', colour: kBlue},
        {name: 'across servers', colour: kAmber});
    this.exchange = plot('exchange between servers', 'kB/s', {name: 'sent', colour: kBlue});
    this.load = plot(
        'own work of a tick', 'ms', {name: 'mean of the servers', colour: kTeal},
        {name: 'slowest server', colour: kAmber});
    this.moves = plot('bodies moved to other servers', '1/s', {name: 'moved', colour: kBlue});
    this.page = plot(
        'this web UI', 'fps, kB/s', {name: 'frames per second', colour: kTeal},
        {name: 'kB per second', colour: kBlue});
    this.rows = new Map();
    this.last = null;
  }

  clear() {
    const {pace, tick, awake, clones, islands, exchange, load, moves} = this;
    for (const plot of [pace, tick, awake, clones, islands, exchange, load, moves]) plot.clear();
    this.last = null;
  }

  show({status, nodes, answers}, page) {
    const now = performance.now();
    const [first, others] = [true, false].map(
        (isFirst) => status.counters.filter((name) => kFirstCounters.includes(name) === isFirst));
    this.tiles.replaceChildren(tile('bodies', status.bodies), ...first.map((name) => tile(name, status[name])));
    this.moreTiles.replaceChildren(...others.map((name) => tile(name, status[name])));
    this.page.add(page.framesPerSecond, page.bytesPerSecond / 1000);
    nodes.forEach((node, place) => {
      if (!this.rows.has(node)) this.rows.set(node, new ServerRow(this.servers, place));
      this.rows.get(node).show(status.servers.find((server) => server.node === node), place);
    });
    if (!answers) return;
    const sent = status.servers.reduce((sum, server) => sum + server.exchange_bytes, 0);
    const before = this.last;
    const moved = status.moved_bodies;
    this.last = {sent, moved, now};
    const own = status.servers.filter((server) => server.takes_part).map((server) => server.own_ms);
    this.pace.add(status.state === 'running' ? status.real_time_factor : 0);
    this.tick.add(status.tick_ms.p50, status.tick_ms.p99);
    this.awake.add(status.bodies_awake, status.contacts);
    this.clones.add(status.clones);
    this.islands.add(status.islands_across_seams, status.islands_shipped + status.islands_in_step);
    const perSecond = (count, countBefore) => 1000 * Math.max(0, count - countBefore) / (now - before.now);
    this.exchange.add(before ? perSecond(sent, before.sent) / 1000 : 0);
    this.load.add(own.reduce((sum, ms) => sum + ms, 0) / Math.max(1, own.length), Math.max(0, ...own));
    this.moves.add(before ? perSecond(moved, before.moved) : 0);
  }
}
