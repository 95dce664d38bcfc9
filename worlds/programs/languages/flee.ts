/* TESSERA_PROGRAM
program | flee | Rolls away from a body that comes near.
motion | dynamic
parameter | from | body | 0 | 0 | 9.0072e+15 | The body that it flees; 0: none.
parameter | radius | m | 8 | 0 | 1000 | It flees what is nearer than that.
parameter | force | N | 20 | 0 | 1e6 | That it rolls with.
parameter | look | m | 1.5 | 0 | 100 | How far ahead of itself it looks for walls.
value | distance | m | 0 | How far away the body is.
value | turned | | 0 | How often a wall has turned it.
*/
// The program of flee.c in AssemblyScript: it computes the same bits.
import * as tessera from "../../../client_sdk/programs/assemblyscript/tessera";

@unmanaged class Parameters {
  from: f64;
  radius: f64;
  force: f64;
  look: f64;
}

@unmanaged class Values {
  distance: f64;
  turned: f64;
}

const parameters = changetype<Parameters>(memory.data(offsetof<Parameters>()));
const values = changetype<Values>(memory.data(offsetof<Values>()));
const own = changetype<tessera.Senses>(memory.data(offsetof<tessera.Senses>()));
const hunter = changetype<tessera.Finding>(memory.data(offsetof<tessera.Finding>()));
const wall = changetype<tessera.Finding>(memory.data(offsetof<tessera.Finding>()));

function length(x: f64, y: f64): f64 {
  return sqrt(x * x + y * y);
}

export function ask(): void {
  tessera.parameters(changetype<usize>(parameters));
  tessera.senses(own);
  tessera.body(parameters.from);
  // Where it rolls to, unless it is slow.
  const speed = length(own.velocity_x, own.velocity_y);
  if (speed > 0.1) {
    tessera.cast(own.position_x, own.position_y, own.position_z, own.velocity_x / speed, own.velocity_y / speed, 0,
                 parameters.look, 0, 0xffffffff);
  }
}

export function run(): void {
  tessera.parameters(changetype<usize>(parameters));
  tessera.values(changetype<usize>(values));
  tessera.senses(own);
  if (tessera.findings(0) == 0) return;
  tessera.finding(0, 0, hunter);
  let x = own.position_x - hunter.position_x;
  let y = own.position_y - hunter.position_y;
  const distance = length(x, y);
  values.distance = distance;
  // The hunter may come while this body sleeps.
  tessera.wake_in(1);
  if (distance < parameters.radius && distance > 0) {
    x /= distance;
    y /= distance;
    if (tessera.findings(1) > 0) {
      // Along the wall, not into it.
      tessera.finding(1, 0, wall);
      const into = x * wall.normal_x + y * wall.normal_y;
      if (into < 0) {
        x -= into * wall.normal_x;
        y -= into * wall.normal_y;
        values.turned += 1;
      }
    }
    tessera.push_awake(parameters.force * x, parameters.force * y, 0, 0, 0, 0);
  }
  tessera.set_values(changetype<usize>(values));
}
