/* Tests a program in C or C++ where it is written, without a server: the test is its host.
 *
 *   #include <tessera/program_test.h>
 *   #include "flee.c"
 *
 *   int main(void) {
 *     tessera_test_begin();                      // a new instance, on a body of 1 kg at rest at 0
 *     *tessera_test_number("radius") = 5;
 *     tessera_test_ask(ask);                     // leaves tessera_test.questions
 *     struct tessera_finding hunter = {.position = {3, 0, 0}};
 *     tessera_test_answer(0, &hunter);
 *     tessera_test_run(run);                     // leaves tessera_test.acts and values
 *     TESSERA_EXPECT(tessera_test.acts[0].force[0] < 0);
 *     return tessera_test_result();
 *   }
 *
 * It is included in one file, before the program. What a server would stop an instance for ends the test. */
#ifndef TESSERA_PROGRAM_TEST_H
#define TESSERA_PROGRAM_TEST_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tessera/program.h"

enum {
  TESSERA_TEST_NUMBERS = 256,    /* parameters, inputs and values, of each */
  TESSERA_TEST_QUESTIONS = 1024, /* at most, in a call */
  TESSERA_TEST_ACTS = 1024,      /* likewise */
  TESSERA_TEST_FINDINGS = 1024,  /* of all questions */
  TESSERA_TEST_NAME = 64         /* bytes */
};

enum tessera_test_asked {
  TESSERA_ASKED_CAST,
  TESSERA_ASKED_CONTACTS,
  TESSERA_ASKED_INSIDE,
  TESSERA_ASKED_BODY,
  TESSERA_ASKED_JOINTS,
  TESSERA_ASKED_JOINT
};

struct tessera_test_question {
  enum tessera_test_asked kind;
  double body;    /* or joint */
  double from[3]; /* of a cast, as what follows */
  double direction[3];
  double length;
  double radius;
  unsigned mask;
};

enum tessera_test_done {
  TESSERA_DID_PUSH,
  TESSERA_DID_PUSH_AWAKE,
  TESSERA_DID_IMPULSE,
  TESSERA_DID_MOVE_TO,
  TESSERA_DID_TELL,
  TESSERA_DID_DRIVE,
  TESSERA_DID_REMOVE_JOINT
};

struct tessera_test_act {
  enum tessera_test_done kind;
  double body;      /* that is pushed off, or told; or the joint that is driven or removed */
  double force[3];  /* or the impulse, or where to */
  double torque[3]; /* or the lever */
  int program;      /* that is told, as what follows */
  int input;
  double value; /* or the target of a drive */
  int axis;     /* that is driven, as what follows */
  int mode;
  double servo[4]; /* stiffness, damping, velocity, effort */
};

struct tessera_test_numbers {
  int count;
  char names[TESSERA_TEST_NUMBERS][TESSERA_TEST_NAME];
  double now[TESSERA_TEST_NUMBERS];
};

/* The host. A test sets what is sensed, and looks at what is asked and done. */
struct tessera_test_host {
  struct tessera_senses senses;
  struct tessera_test_numbers parameters;
  struct tessera_test_numbers inputs;
  struct tessera_test_numbers values;
  double chance; /* what tessera_random() gives */
  int question_count;
  struct tessera_test_question questions[TESSERA_TEST_QUESTIONS];
  int finding_count;
  int finding_of[TESSERA_TEST_FINDINGS]; /* the question */
  struct tessera_finding findings[TESSERA_TEST_FINDINGS];
  int joint_count;
  int joint_of[TESSERA_TEST_FINDINGS]; /* the question */
  struct tessera_joint_finding joints[TESSERA_TEST_FINDINGS];
  int act_count;
  struct tessera_test_act acts[TESSERA_TEST_ACTS];
  int wakes_in; /* ticks; 0: it sleeps with its body */
  char calls;   /* 'a': ask(), 'r': run(), 0: nothing */
  int failures;
};
static struct tessera_test_host tessera_test;

#define TESSERA_EXPECT(condition)                                                   \
  do {                                                                              \
    if (condition) break;                                                           \
    fprintf(stderr, "%s:%d: this is not so: %s\n", __FILE__, __LINE__, #condition); \
    ++tessera_test.failures;                                                        \
  } while (0)

/* What main() returns: 0 where all was so. */
static inline int tessera_test_result(void) { return tessera_test.failures > 0; }

static inline void tessera_test_require(int is_so, const char* what) {
  if (is_so) return;
  fprintf(stderr, "the instance would be stopped: %s\n", what);
  exit(1);
}

static inline void tessera_test_require_finite(const double* numbers, int count) {
  for (int n = 0; n < count; ++n) tessera_test_require(isfinite(numbers[n]), "a number is not finite");
}

/* --- What tests call --- */

extern const char* const tessera_program_lines;

/* "parameter | radius | m | 8 | ...": its name and what it is at first. */
static inline void tessera_test_read_line(const char* line) {
  char kind[16];
  char name[TESSERA_TEST_NAME];
  double first = 0;
  if (sscanf(line, " %15[a-z] | %63[a-z0-9_] |%*[^|]| %lf", kind, name, &first) != 3) {
    if (sscanf(line, " %15[a-z] | %63[a-z0-9_] | | %lf", kind, name, &first) != 3) return;
  }
  struct tessera_test_numbers* const table = strcmp(kind, "parameter") == 0 ? &tessera_test.parameters
                                             : strcmp(kind, "input") == 0   ? &tessera_test.inputs
                                             : strcmp(kind, "value") == 0   ? &tessera_test.values
                                                                            : NULL;
  if (table == NULL) return;
  tessera_test_require(table->count < TESSERA_TEST_NUMBERS, "it has more than 256 numbers of a kind");
  strcpy(table->names[table->count], name);
  table->now[table->count++] = first;
}

/* A new instance: its numbers are as its lines say, its body has 1 kg and rests at 0 at tick 1. */
static inline void tessera_test_begin(void) {
  const int failures = tessera_test.failures;
  memset(&tessera_test, 0, sizeof tessera_test);
  tessera_test.failures = failures;
  tessera_test.senses.tick = 1;
  tessera_test.senses.dt = 1.0 / 60;
  tessera_test.senses.body = 1;
  tessera_test.senses.mass = 1;
  tessera_test.senses.orientation[3] = 1;
  tessera_test.senses.gravity[2] = -9.81;
  for (const char* line = tessera_program_lines; line != NULL && *line != 0;) {
    tessera_test_read_line(line);
    line = strchr(line, '\n');
    if (line != NULL) ++line;
  }
}

/* A parameter, input or value by its name, to be read and set. */
static inline double* tessera_test_number(const char* name) {
  struct tessera_test_numbers* const tables[] = {&tessera_test.parameters, &tessera_test.inputs,
                                                 &tessera_test.values};
  for (int table = 0; table < 3; ++table) {
    for (int n = 0; n < tables[table]->count; ++n)
      if (strcmp(tables[table]->names[n], name) == 0) return &tables[table]->now[n];
  }
  fprintf(stderr, "the program has no number '%s'\n", name);
  exit(1);
}

/* Calls ask(); what was found for earlier questions is gone. */
static inline void tessera_test_ask(void (*ask)(void)) {
  tessera_test.question_count = 0;
  tessera_test.finding_count = 0;
  tessera_test.joint_count = 0;
  tessera_test.calls = 'a';
  ask();
  tessera_test.calls = 0;
}

/* Adds to the answer to a question, from 0. */
static inline void tessera_test_answer(int question, const struct tessera_finding* finding) {
  tessera_test_require(tessera_test.finding_count < TESSERA_TEST_FINDINGS, "too much is found");
  tessera_test.finding_of[tessera_test.finding_count] = question;
  tessera_test.findings[tessera_test.finding_count++] = *finding;
}

/* Likewise a joint. */
static inline void tessera_test_answer_joint(int question, const struct tessera_joint_finding* joint) {
  tessera_test_require(tessera_test.joint_count < TESSERA_TEST_FINDINGS, "too much is found");
  tessera_test.joint_of[tessera_test.joint_count] = question;
  tessera_test.joints[tessera_test.joint_count++] = *joint;
}

/* Calls run(). */
static inline void tessera_test_run(void (*run)(void)) {
  tessera_test.act_count = 0;
  tessera_test.wakes_in = 0;
  tessera_test.calls = 'r';
  run();
  tessera_test.calls = 0;
}

/* --- What the program calls --- */

static inline void tessera_test_copy(double* to, const struct tessera_test_numbers* from) {
  memcpy(to, from->now, (size_t)from->count * sizeof(double));
}
void tessera_parameters(double* to) { tessera_test_copy(to, &tessera_test.parameters); }
void tessera_inputs(double* to) { tessera_test_copy(to, &tessera_test.inputs); }
void tessera_values(double* to) { tessera_test_copy(to, &tessera_test.values); }
void tessera_senses(struct tessera_senses* to) { *to = tessera_test.senses; }
double tessera_random(unsigned n) {
  (void)n;
  return tessera_test.chance;
}

static inline struct tessera_test_question* tessera_test_asks(enum tessera_test_asked kind, double body) {
  tessera_test_require(tessera_test.calls == 'a', "questions can be asked in ask() alone");
  tessera_test_require(tessera_test.question_count < TESSERA_TEST_QUESTIONS,
                       "it asks more than 1024 questions");
  struct tessera_test_question* const question = &tessera_test.questions[tessera_test.question_count++];
  memset(question, 0, sizeof *question);
  question->kind = kind;
  question->body = body;
  return question;
}
void tessera_cast(double from_x, double from_y, double from_z, double direction_x, double direction_y,
                  double direction_z, double length, double radius, unsigned mask) {
  const double way[] = {from_x, from_y, from_z, direction_x, direction_y, direction_z, length, radius};
  struct tessera_test_question* const question = tessera_test_asks(TESSERA_ASKED_CAST, 0);
  tessera_test_require_finite(way, 8);
  tessera_test_require(length >= 0 && length <= 1e4 && radius >= 0, "a cast is up to 10 km long");
  memcpy(question->from, way, sizeof question->from);
  memcpy(question->direction, way + 3, sizeof question->direction);
  question->length = length;
  question->radius = radius;
  question->mask = mask;
}
void tessera_contacts(double body) { tessera_test_asks(TESSERA_ASKED_CONTACTS, body); }
void tessera_inside(double body) { tessera_test_asks(TESSERA_ASKED_INSIDE, body); }
void tessera_body(double body) { tessera_test_asks(TESSERA_ASKED_BODY, body); }
void tessera_joints(void) { tessera_test_asks(TESSERA_ASKED_JOINTS, 0); }
void tessera_joint(double joint) { tessera_test_asks(TESSERA_ASKED_JOINT, joint); }

int tessera_findings(int question) {
  int count = 0;
  for (int n = 0; n < tessera_test.finding_count; ++n) count += tessera_test.finding_of[n] == question;
  return count;
}
void tessera_finding(int question, int n, struct tessera_finding* to) {
  for (int place = 0; place < tessera_test.finding_count; ++place) {
    if (tessera_test.finding_of[place] != question || n-- != 0) continue;
    *to = tessera_test.findings[place];
    return;
  }
  tessera_test_require(0, "it looks at a finding that is not there");
}

int tessera_joint_findings(int question) {
  int count = 0;
  for (int n = 0; n < tessera_test.joint_count; ++n) count += tessera_test.joint_of[n] == question;
  return count;
}
void tessera_joint_finding(int question, int n, struct tessera_joint_finding* to) {
  for (int place = 0; place < tessera_test.joint_count; ++place) {
    if (tessera_test.joint_of[place] != question || n-- != 0) continue;
    *to = tessera_test.joints[place];
    return;
  }
  tessera_test_require(0, "it looks at a joint that is not there");
}

static inline struct tessera_test_act* tessera_test_acts(enum tessera_test_done kind, double body, double x,
                                                         double y, double z) {
  const double force[] = {x, y, z};
  tessera_test_require(tessera_test.calls == 'r', "acts belong into run()");
  tessera_test_require(tessera_test.act_count < TESSERA_TEST_ACTS, "it acts more than 1024 times");
  tessera_test_require_finite(force, 3);
  struct tessera_test_act* const act = &tessera_test.acts[tessera_test.act_count++];
  memset(act, 0, sizeof *act);
  act->kind = kind;
  act->body = body;
  memcpy(act->force, force, sizeof force);
  return act;
}
static inline void tessera_test_turns(struct tessera_test_act* act, double x, double y, double z) {
  const double torque[] = {x, y, z};
  tessera_test_require_finite(torque, 3);
  memcpy(act->torque, torque, sizeof torque);
}
void tessera_set_values(const double* from) {
  tessera_test_require(tessera_test.calls == 'r', "values can be set in run() alone");
  tessera_test_require_finite(from, tessera_test.values.count);
  memcpy(tessera_test.values.now, from, (size_t)tessera_test.values.count * sizeof(double));
}
void tessera_push(double x, double y, double z, double torque_x, double torque_y, double torque_z) {
  tessera_test_turns(tessera_test_acts(TESSERA_DID_PUSH, 0, x, y, z), torque_x, torque_y, torque_z);
}
void tessera_push_awake(double x, double y, double z, double torque_x, double torque_y, double torque_z) {
  tessera_test_turns(tessera_test_acts(TESSERA_DID_PUSH_AWAKE, 0, x, y, z), torque_x, torque_y, torque_z);
}
void tessera_impulse(double body, double x, double y, double z, double lever_x, double lever_y,
                     double lever_z) {
  tessera_test_turns(tessera_test_acts(TESSERA_DID_IMPULSE, body, x, y, z), lever_x, lever_y, lever_z);
}
void tessera_move_to(double x, double y, double z) { tessera_test_acts(TESSERA_DID_MOVE_TO, 0, x, y, z); }
void tessera_tell(double body, int program, int input, double value) {
  struct tessera_test_act* const act = tessera_test_acts(TESSERA_DID_TELL, body, 0, 0, 0);
  tessera_test_require_finite(&value, 1);
  act->program = program;
  act->input = input;
  act->value = value;
}
void tessera_drive(double joint, int axis, int mode, double target, double stiffness, double damping,
                   double velocity, double effort) {
  const double numbers[] = {target, stiffness, damping, velocity, effort};
  struct tessera_test_act* const act = tessera_test_acts(TESSERA_DID_DRIVE, joint, 0, 0, 0);
  int found = 0;
  for (int n = 0; n < tessera_test.joint_count; ++n)
    found |= tessera_test.joints[n].joint == joint && axis >= 0 && axis < tessera_test.joints[n].axes;
  tessera_test_require(found, "it drives an axis of a joint that was not found");
  tessera_test_require(mode >= TESSERA_DRIVE_FREE && mode <= TESSERA_DRIVE_SERVO, "no such mode of a drive");
  tessera_test_require_finite(numbers, 5);
  act->axis = axis;
  act->mode = mode;
  act->value = target;
  memcpy(act->servo, numbers + 1, sizeof act->servo);
}
void tessera_remove_joint(double joint) {
  int found = 0;
  for (int n = 0; n < tessera_test.joint_count; ++n) found |= tessera_test.joints[n].joint == joint;
  tessera_test_require(found, "it removes a joint that was not found");
  tessera_test_acts(TESSERA_DID_REMOVE_JOINT, joint, 0, 0, 0);
}
void tessera_wake_in(int ticks) {
  tessera_test_require(tessera_test.calls == 'r' && ticks >= 1, "wake_in: in run(), at least 1 tick");
  tessera_test.wakes_in = ticks;
}

#endif
