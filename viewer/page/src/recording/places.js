// Places of interest in a recording: clusters of sectors with bodies, as tessera-viewer finds them in a live
// world (viewer/places.cc).
import {between, moved} from '../position.js';

const kPlacesMax = 200;

const kNeighbours = Array.from(
    {length: 27}, (_, n) => [n % 3, Math.floor(n / 3) % 3, Math.floor(n / 9)].map((x) => BigInt(x - 1)));

function bySector(states) {
  const sectors = new Map();
  for (let n = 0; n < states.count; ++n) {
    const place = states.positionOf(n);
    const key = place.sector.join();
    if (!sectors.has(key)) sectors.set(key, {sector: place.sector, bodies: []});
    sectors.get(key).bodies.push({id: states.ids[n], place});
  }
  return sectors;
}

// Removes the sector with this key and all sectors connected to it from `sectors`.
function takeCluster(sectors, first) {
  const cluster = [];
  const take = (key) => {
    const found = sectors.get(key);
    if (!found) return;
    sectors.delete(key);
    cluster.push(found);
  };
  take(first);
  for (let next = 0; next < cluster.length; ++next) {
    for (const way of kNeighbours) take(cluster[next].sector.map((index, axis) => index + way[axis]).join());
  }
  return cluster;
}

function placeOf(cluster, sectorSize) {
  const origin = {sector: cluster[0].sector, local: [0, 0, 0]};
  const low = [Infinity, Infinity, Infinity];
  const high = low.map((x) => -x);
  let first = Infinity;
  let count = 0;
  for (const {id, place} of cluster.flatMap(({bodies}) => bodies)) {
    between(origin, place, sectorSize).forEach((x, axis) => {
      low[axis] = Math.min(low[axis], x);
      high[axis] = Math.max(high[axis], x);
    });
    first = Math.min(first, id);
    ++count;
  }
  const centre = moved(origin, low.map((x, axis) => (x + high[axis]) / 2), sectorSize);
  const half = Math.max(...low.map((x, axis) => high[axis] - x)) / 2;
  return {...centre, half, bodies: count, sectors: cluster.length, first};
}

// Adjacent sectors with bodies, also at a corner, form one place: its centre, the largest distance of a body
// from it along an axis (m), the number of bodies, the smallest id. Places with the most bodies come first.
export function placesOf(states, sectorSize) {
  const sectors = bySector(states);
  const places = [];
  while (sectors.size > 0)
    places.push(placeOf(takeCluster(sectors, sectors.keys().next().value), sectorSize));
  return places.sort((a, b) => b.bodies - a.bodies || a.first - b.first).slice(0, kPlacesMax);
}
