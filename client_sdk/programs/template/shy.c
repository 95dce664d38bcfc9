// A ball that flees the camera.
#include <tessera/program.h>

TESSERA_PROGRAM(
    "program | shy | Rolls away from the camera.\n"
    "motion | dynamic\n"
    "parameter | radius | m | 5 | 0 | 100 | It flees a camera that is nearer than that.\n"
    "parameter | force | N | 10 | 0 | 1000 | That it rolls with.\n"
    "input | x | m | 1000 | -1e6 | 1e6 | Where the camera is, from where the ball started,\n"
    "input | y | m | 0 | -1e6 | 1e6 | along the world's axes.\n"
    "value | distance | m | 0 | How far away it is.\n");

TESSERA_EXPORT(run) void run(void) {
  double parameters[2], camera[2];
  struct tessera_senses own;
  tessera_parameters(parameters);
  tessera_inputs(camera);
  tessera_senses(&own);
  const double x = own.position[0] - own.start[0] - camera[0];
  const double y = own.position[1] - own.start[1] - camera[1];
  const double distance = __builtin_sqrt(x * x + y * y);
  if (distance > 0 && distance < parameters[0]) {
    const double push = parameters[1] / distance;
    tessera_push_awake(push * x, push * y, 0, 0, 0, 0);
  }
  tessera_set_values(&distance);
}
