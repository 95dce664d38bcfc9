// Balances a pole on a cart: a hinge on a slider, which it drives.
#include <tessera/program.h>

TESSERA_PROGRAM(
    "program | balance | Balances a pole on a cart, and takes it to a place.\n"
    "parameter | slider | joint | 0 | 0 | 9.0072e+15 | What the cart moves along, from 0 in the middle.\n"
    "parameter | hinge | joint | 0 | 0 | 9.0072e+15 | Of the pole on the cart: 0 is upright, more towards "
    "larger places.\n"
    "parameter | by_place | N/m | 18 | 0 | 1e6 | The force on the cart by how far it is from its place,\n"
    "parameter | by_speed | N s/m | 23 | 0 | 1e6 | by its speed,\n"
    "parameter | by_angle | N/rad | 185 | 0 | 1e6 | by the angle of the pole,\n"
    "parameter | by_rate | N s/rad | 46 | 0 | 1e6 | and by the rate of that.\n"
    "parameter | force | N | 100 | 0 | 1e6 | The largest force.\n"
    "input | place | m | 0 | -1000 | 1000 | Where the cart should be.\n"
    "value | off | m | 0 | How far it is from there.\n"
    "value | angle | rad | 0 | Of the pole.\n");

enum { kSlider, kHinge, kByPlace, kBySpeed, kByAngle, kByRate, kForce, kParameters };
enum { kOff, kAngle, kValues };

TESSERA_EXPORT(ask) void ask(void) {
  double parameters[kParameters];
  tessera_parameters(parameters);
  tessera_joint(parameters[kSlider]);
  tessera_joint(parameters[kHinge]);
}

TESSERA_EXPORT(run) void run(void) {
  double parameters[kParameters], place, values[kValues];
  struct tessera_joint_finding slider, hinge;
  if (tessera_joint_findings(0) == 0 || tessera_joint_findings(1) == 0) return;
  tessera_parameters(parameters);
  tessera_inputs(&place);
  tessera_joint_finding(0, 0, &slider);
  tessera_joint_finding(1, 0, &hinge);
  values[kOff] = slider.position[0] - place;
  values[kAngle] = hinge.position[0];
  double force = parameters[kByPlace] * values[kOff] + parameters[kBySpeed] * slider.rate[0] +
                 parameters[kByAngle] * values[kAngle] + parameters[kByRate] * hinge.rate[0];
  if (force > parameters[kForce]) force = parameters[kForce];
  if (force < -parameters[kForce]) force = -parameters[kForce];
  tessera_drive(slider.joint, 0, TESSERA_DRIVE_EFFORT, force, 0, 0, 0, 0);
  tessera_set_values(values);
}
