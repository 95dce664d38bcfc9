// A ball that flees a body: it rolls away from it, and not into walls.
#include <tessera/program.h>

TESSERA_PROGRAM(
    "program | flee | Rolls away from a body that comes near.\n"
    "motion | dynamic\n"
    "parameter | from | body | 0 | 0 | 9.0072e+15 | The body that it flees; 0: none.\n"
    "parameter | radius | m | 8 | 0 | 1000 | It flees what is nearer than that.\n"
    "parameter | force | N | 20 | 0 | 1e6 | That it rolls with.\n"
    "parameter | look | m | 1.5 | 0 | 100 | How far ahead of itself it looks for walls.\n"
    "value | distance | m | 0 | How far away the body is.\n"
    "value | turned | | 0 | How often a wall has turned it.\n");

enum { kFrom, kRadius, kForce, kLook, kParameters };
enum { kDistance, kTurned, kValues };

static double length(double x, double y) { return __builtin_sqrt(x * x + y * y); }

// The direction in which it rolls, or 0, 0 while it is slow.
static void heading(const struct tessera_senses* own, double* x, double* y) {
  const double speed = length(own->velocity[0], own->velocity[1]);
  *x = speed > 0.1 ? own->velocity[0] / speed : 0;
  *y = speed > 0.1 ? own->velocity[1] / speed : 0;
}

TESSERA_EXPORT(ask) void ask(void) {
  double parameters[kParameters];
  struct tessera_senses own;
  double x, y;
  tessera_parameters(parameters);
  tessera_senses(&own);
  tessera_body(parameters[kFrom]);
  heading(&own, &x, &y);
  if (x != 0 || y != 0)
    tessera_cast(own.position[0], own.position[1], own.position[2], x, y, 0, parameters[kLook], 0, ~0u);
}

TESSERA_EXPORT(run) void run(void) {
  double parameters[kParameters], values[kValues];
  struct tessera_senses own;
  struct tessera_finding hunter, wall;
  tessera_parameters(parameters);
  tessera_values(values);
  tessera_senses(&own);
  if (tessera_findings(0) == 0) return;
  tessera_finding(0, 0, &hunter);
  double x = own.position[0] - hunter.position[0];
  double y = own.position[1] - hunter.position[1];
  const double distance = length(x, y);
  values[kDistance] = distance;
  // The hunter may come while this body sleeps.
  tessera_wake_in(1);
  if (distance < parameters[kRadius] && distance > 0) {
    x /= distance;
    y /= distance;
    if (tessera_findings(1) > 0) {
      // Along the wall, not into it.
      tessera_finding(1, 0, &wall);
      const double into = x * wall.normal[0] + y * wall.normal[1];
      if (into < 0) {
        x -= into * wall.normal[0];
        y -= into * wall.normal[1];
        values[kTurned] += 1;
      }
    }
    tessera_push_awake(parameters[kForce] * x, parameters[kForce] * y, 0, 0, 0, 0);
  }
  tessera_set_values(values);
}
