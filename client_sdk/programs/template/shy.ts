/* TESSERA_PROGRAM
program | shy | Rolls away from the camera.
motion | dynamic
parameter | radius | m | 5 | 0 | 100 | It flees a camera that is nearer than that.
parameter | force | N | 10 | 0 | 1000 | That it rolls with.
input | x | m | 1000 | -1e6 | 1e6 | Where the camera is, from where the ball started,
input | y | m | 0 | -1e6 | 1e6 | along the world's axes.
value | distance | m | 0 | How far away it is.
*/
import * as tessera from "../assemblyscript/tessera";

@unmanaged class Parameters {
  radius: f64;
  force: f64;
}

@unmanaged class Inputs {
  x: f64;
  y: f64;
}

@unmanaged class Values {
  distance: f64;
}

const parameters = changetype<Parameters>(memory.data(offsetof<Parameters>()));
const camera = changetype<Inputs>(memory.data(offsetof<Inputs>()));
const values = changetype<Values>(memory.data(offsetof<Values>()));
const own = changetype<tessera.Senses>(memory.data(offsetof<tessera.Senses>()));

export function run(): void {
  tessera.parameters(changetype<usize>(parameters));
  tessera.inputs(changetype<usize>(camera));
  tessera.senses(own);
  const x = own.position_x - own.start_x - camera.x;
  const y = own.position_y - own.start_y - camera.y;
  const distance = sqrt(x * x + y * y);
  if (distance > 0 && distance < parameters.radius) {
    const push = parameters.force / distance;
    tessera.push_awake(push * x, push * y, 0, 0, 0, 0);
  }
  values.distance = distance;
  tessera.set_values(changetype<usize>(values));
}
