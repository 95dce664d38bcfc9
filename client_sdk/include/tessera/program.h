/* For authors of programs that run inside the tick, as WebAssembly modules of a world (docs/programs.md):
 *
 *   clang --target=wasm32 -O2 -nostdlib -Wl,--no-entry -o flee.wasm flee.c
 *
 * A module describes its program with TESSERA_PROGRAM, and exports run() and, where it has questions, ask().
 * All lengths are in m, angles in rad, times in s; vectors are along the world's axes, and positions are
 * relative to the centre of the sector in which the body lives. Nothing but its values lasts from call to
 * call: variables begin anew in each. With tessera/program_test.h, a program is tested where it is written.
 */
#ifndef TESSERA_PROGRAM_H
#define TESSERA_PROGRAM_H

#ifdef __wasm__
#define TESSERA_IMPORT(name) __attribute__((import_module("tessera"), import_name(#name)))
#define TESSERA_EXPORT(name) __attribute__((export_name(#name)))
#else
#define TESSERA_IMPORT(name)
#define TESSERA_EXPORT(name)
#endif

/* Once, with string literals: lines that end with \n. A unit may be empty.
 *   program | name | summary
 *   motion | dynamic or kinematic
 *   parameter | name | unit | first | least | most | meaning
 *   input | name | unit | first | least | most | meaning
 *   value | name | unit | first | meaning */
#ifdef __wasm__
#define TESSERA_PROGRAM(lines) __asm__(".section .custom_section.tessera,\"\",@\n.ascii " #lines "\n.text\n")
#else
#define TESSERA_PROGRAM(lines) const char* const tessera_program_lines = lines
#endif

/* --- What an instance knows, in ask() and run() --- */

/* Its numbers, in the order of their lines. */
TESSERA_IMPORT(parameters) void tessera_parameters(double* to);
TESSERA_IMPORT(inputs) void tessera_inputs(double* to);
TESSERA_IMPORT(values) void tessera_values(double* to);

struct tessera_senses {
  double tick; /* that ends */
  double dt;   /* of a tick */
  double body;
  double program; /* its place on the body */
  double asleep;  /* 1: it sleeps */
  double mass;
  double position[3];    /* of the centre of mass */
  double orientation[4]; /* of the body frame: x, y, z, w */
  double velocity[3];
  double angular_velocity[3];
  double gravity[3]; /* m/s^2, at the body */
  double start[3];   /* where the centre of mass was at first */
};
TESSERA_IMPORT(senses) void tessera_senses(struct tessera_senses* to);

/* At least 0 and less than 1: the n-th number by chance of this instance in this tick. */
TESSERA_IMPORT(random) double tessera_random(unsigned n);

/* --- Questions, in ask(), at most 1,024; their numbers count from 0 --- */

/* What a ball (a ray where `radius` is 0) meets first on its way of `length`, up to 10 km, along a direction
 * of unit length. It passes through the own body and through triggers. */
TESSERA_IMPORT(cast)
void tessera_cast(double from_x, double from_y, double from_z, double direction_x, double direction_y,
                  double direction_z, double length, double radius, unsigned mask);
TESSERA_IMPORT(contacts) void tessera_contacts(double body); /* what touches it */
TESSERA_IMPORT(inside) void tessera_inside(double body);     /* what is in its triggers */
TESSERA_IMPORT(body) void tessera_body(double body);         /* where it is */
TESSERA_IMPORT(joints) void tessera_joints(void);            /* the joints of the own body */
TESSERA_IMPORT(joint) void tessera_joint(double joint); /* one, as a parameter of the unit `joint` names it */

/* --- Answers, in run() --- */

struct tessera_finding {
  double body;
  double motion;      /* 0: static, 1: dynamic, 2: kinematic */
  double distance;    /* of a cast: that it went */
  double normal[3];   /* of a cast or contact: on `body`, pointing away from it */
  double point[3];    /* of the hit or contact */
  double velocity[3]; /* of the place that was hit; otherwise of the centre of mass */
  double impulse;     /* N s, of a contact, along the normal, in the last tick */
  double position[3]; /* of the centre of mass */
  double rotation[9]; /* of its centre frame, by rows */
};
/* How many there are for a question: for a cast at most one, the nearest; otherwise by ascending id. */
TESSERA_IMPORT(findings) int tessera_findings(int question);
TESSERA_IMPORT(finding) void tessera_finding(int question, int n, struct tessera_finding* to);

/* Of axes that the joint does not have, numbers are 0. */
struct tessera_joint_finding {
  double joint;
  double type;   /* 0: fixed, 1: revolute, 2: prismatic, 3: ball, 4: universal, 5: screw */
  double parent; /* 0: the world */
  double child;
  double axes;        /* 0 (fixed, ball), 1, or 2 (universal) */
  double position[2]; /* rad, from -pi to pi, or m */
  double rate[2];     /* rad/s or m/s */
  double lower[2];    /* the limits, infinite where there is none */
  double upper[2];
  double effort[2]; /* N m or N, of drive, spring, damper, friction and limit in the last tick */
  double drive[2];  /* what drives it: an enum tessera_drive_mode */
  double target[2];
  double force[3];  /* N, on the child in the last tick, along the axes of the joint frame there */
  double torque[3]; /* N m, about its origin */
  double gap;       /* m, between the two points that it holds together */
};
/* How many joints were found, by ascending id; none where the joint is gone. */
TESSERA_IMPORT(joint_findings) int tessera_joint_findings(int question);
TESSERA_IMPORT(joint_finding)
void tessera_joint_finding(int question, int n, struct tessera_joint_finding* to);

/* --- Acts, in run(), at most 1,024; they take effect at the beginning of the next tick --- */

TESSERA_IMPORT(set_values) void tessera_set_values(const double* from);
/* N at the centre of mass of the own dynamic body, and N m, for the next tick. */
TESSERA_IMPORT(push)
void tessera_push(double x, double y, double z, double torque_x, double torque_y, double torque_z);
/* The same, and it keeps the body awake. */
TESSERA_IMPORT(push_awake)
void tessera_push_awake(double x, double y, double z, double torque_x, double torque_y, double torque_z);
/* N s on another body, at a lever from its centre of mass. */
TESSERA_IMPORT(impulse)
void tessera_impulse(double body, double x, double y, double z, double lever_x, double lever_y,
                     double lever_z);
/* The own kinematic body arrives there at the end of the next tick. */
TESSERA_IMPORT(move_to) void tessera_move_to(double x, double y, double z);
/* Sets an input of a program, of any body. */
TESSERA_IMPORT(tell) void tessera_tell(double body, int program, int input, double value);
enum tessera_drive_mode {
  TESSERA_DRIVE_FREE,
  TESSERA_DRIVE_VELOCITY, /* holds the target, rad/s or m/s */
  TESSERA_DRIVE_POSITION, /* moves to the target, rad or m, and holds it */
  TESSERA_DRIVE_EFFORT,   /* the target itself, N m or N */
  TESSERA_DRIVE_SERVO     /* stiffness (target - position) + damping (velocity - rate) + effort */
};
/* Drives an axis, from 0 on, of a joint that was found in this run, until it is driven otherwise: what comes
 * after the target is 0 but for a servo. It wakes the joint's bodies where it changes anything. Each axis is
 * for one program. */
TESSERA_IMPORT(drive)
void tessera_drive(double joint, int axis, int mode, double target, double stiffness, double damping,
                   double velocity, double effort);
/* Takes a joint of its body, which was found in this run, out of the world. */
TESSERA_IMPORT(remove_joint) void tessera_remove_joint(double joint);
/* It runs again in so many ticks, at least 1, even if its body sleeps. */
TESSERA_IMPORT(wake_in) void tessera_wake_in(int ticks);

#endif
