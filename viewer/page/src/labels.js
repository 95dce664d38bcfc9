// Labels in the picture: the selected body, and places too far away to be seen.
import {Vector3} from 'three';

import {between, isSameFrame, placed} from './position.js';

const kPlacesMax = 50;

function hidesBehind({centre}, eye, local) {
  const up = new Vector3(...local).sub(new Vector3(...centre));
  return up.dot(eye.clone().sub(new Vector3(...local))) < 0;
}

// Of the body `selected`, an id or null, and of these places, as Labels shows them.
export function labelsOf(picture, camera, bodies, selected, places) {
  const shown = [];
  const body = selected === null ? null : bodies.look(selected);
  if (body) {
    const at = picture.toWindow(camera, body.position.local);
    if (at) shown.push({text: body.info.name, at});
  }
  const {view} = bodies;
  const eye = camera.three.position;
  for (const place of places.slice(0, kPlacesMax)) {
    if (!isSameFrame(place, view)) continue;
    const local = between(placed(view), place, view.sector_size);
    const distance = new Vector3(...local).distanceTo(eye);
    if (distance < 400 + 6 * place.half || distance > 1e9) continue;
    if (view.planet && hidesBehind(view.planet, eye, local)) continue;
    const at = picture.toWindow(camera, local);
    if (at) shown.push({text: place.name.split('::')[0], at, className: 'place'});
  }
  return shown;
}

export class Labels {
  constructor(parent) {
    this.parent = parent;
    this.free = [];
  }

  // `labels` are {text, at: [x, y] in pixels, className}.
  show(labels) {
    while (this.free.length < labels.length)
      this.free.push(this.parent.appendChild(document.createElement('span')));
    this.free.forEach((span, n) => {
      const label = labels[n];
      span.hidden = !label;
      if (!label) return;
      if (span.textContent !== label.text) span.textContent = label.text;
      span.className = label.className ?? '';
      span.style.transform =
          `translate(${Math.round(label.at[0] + 10)}px, ${Math.round(label.at[1] - 10)}px)`;
    });
  }
}
