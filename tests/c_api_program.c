/* Tests tessera/c.h from C: c_api_program ADDRESS WORLD.pb ROVERS.pb FERRY.pb, on a cluster without a world.
 * WORLD has a plane and ten crates, ROVERS joints and rangers, FERRY the body ferry::hull, which carries the
 * frame deck. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tessera/c.h"

#define CHECK(condition)                                                                               \
  do {                                                                                                 \
    if (!(condition)) {                                                                                \
      fprintf(stderr, "line %d: %s; last error: %s\n", __LINE__, #condition, tessera_error_message()); \
      exit(1);                                                                                         \
    }                                                                                                  \
  } while (0)

enum { kPatience = 60, kTicks = 60, kCrates = 10 };

static void check_positions(void) {
  const int64_t far = INT64_C(1) << 62;
  const tessera_position point = {{far, -far, 3}, {0.1, -0.2, 63.5}, 0};
  const int64_t sector[3] = {far, 1 - far, 3};
  double metres[3];
  tessera_relative_to(&point, sector, 128, metres);
  CHECK(metres[0] == 0.1 && metres[1] == -128.2 && metres[2] == 63.5);
}

static void check_errors(tessera_client* client, const char* world) {
  tessera_client* nobody = NULL;
  CHECK(tessera_connect("127.0.0.1:1", 0.1, &nobody) == TESSERA_UNAVAILABLE);
  CHECK(strstr(tessera_error_message(), "127.0.0.1:1") != NULL && nobody == NULL);
  tessera_stream* stream = NULL;
  CHECK(tessera_watch(client, NULL, 0, &stream) == TESSERA_FAILED_PRECONDITION);
  CHECK(tessera_load(client, "nowhere.pb", false) == TESSERA_NOT_FOUND);
  CHECK(strstr(tessera_error_message(), "nowhere.pb") != NULL);
  CHECK(tessera_load(client, world, false) == TESSERA_OK);
  CHECK(tessera_load(client, world, false) == TESSERA_ALREADY_EXISTS);
  CHECK(tessera_load(client, world, true) == TESSERA_OK);
  const double impulse[3] = {1, 0, 0};
  CHECK(tessera_apply_impulse(client, 123456, impulse, NULL) == TESSERA_NOT_FOUND);
  const tessera_position at = {{0, 0, 0}, {0, 0, 50}, 0};
  uint64_t id;
  CHECK(tessera_spawn_sphere(client, "light", 0.5, -1, &at, &id) == TESSERA_INVALID_ARGUMENT);
  CHECK(strstr(tessera_error_message(), "mass") != NULL);
}

/* Watches a ball that flies up in a distant sector. */
static void check_flight(tessera_client* client) {
  const int64_t far[3] = {INT64_C(1) << 62, 0, 0};
  const tessera_position at = {{far[0], far[1], far[2]}, {0, 0, 50}, 0};
  const double up[3] = {0, 0, 40};
  uint64_t ball;
  uint64_t found;
  CHECK(tessera_spawn_sphere(client, "ball", 0.5, 2, &at, &ball) == TESSERA_OK);
  CHECK(tessera_find(client, "ball", &found) == TESSERA_OK && found == ball);
  CHECK(tessera_apply_impulse(client, ball, up, NULL) == TESSERA_OK);

  tessera_stream* stream;
  CHECK(tessera_watch(client, &ball, 1, &stream) == TESSERA_OK);
  uint64_t tick;
  CHECK(tessera_step(client, kTicks, &tick) == TESSERA_OK && tick == kTicks);
  tessera_body body;
  size_t count;
  for (uint64_t n = 0; n <= kTicks; ++n) {
    CHECK(tessera_next(stream, kPatience, &tick, &body, 1, &count) == TESSERA_OK);
    CHECK(tick == n && count == (n == 0 ? 0 : 1));
  }
  double metres[3];
  tessera_relative_to(&body.position, far, 128, metres);
  CHECK(body.id == ball && fabs(metres[2] - (50 + 20 - 9.81 / 2)) < 0.2);
  CHECK(tessera_next(stream, 0, &tick, &body, 1, &count) == TESSERA_DEADLINE_EXCEEDED);
  tessera_unwatch(stream);
  tessera_unwatch(NULL);
}

/* More bodies than fit into the caller's array. */
static void check_frame(tessera_client* client) {
  tessera_stream* stream;
  CHECK(tessera_watch(client, NULL, 0, &stream) == TESSERA_OK);
  tessera_body bodies[2];
  size_t count;
  CHECK(tessera_next(stream, kPatience, NULL, bodies, 2, &count) == TESSERA_OK);
  CHECK(count == kCrates + 1 && bodies[0].id < bodies[1].id);
  tessera_unwatch(stream);
}

static void check_questions(tessera_client* client) {
  tessera_status status;
  CHECK(tessera_get_status(client, &status) == TESSERA_OK);
  CHECK(status.state == TESSERA_PAUSED && status.tick == kTicks && status.bodies == kCrates + 2);
  CHECK(status.servers == 2 && status.time_step == 1.0 / 60 && status.sector_size == 128);
  const tessera_position above = {{0, 0, 0}, {0, 0, 30}, 0};
  const double down[3] = {0, 0, -2};
  const double aside[3] = {1, 0, 0};
  tessera_hit hit;
  CHECK(tessera_raycast(client, &above, down, 100, &hit) == TESSERA_OK);
  CHECK(hit.body != 0 && fabs(hit.distance - 20) < 0.1 && hit.normal[2] > 0.99);
  CHECK(tessera_raycast(client, &above, aside, 100, &hit) == TESSERA_OK && hit.body == 0);
  char hash[33];
  uint64_t tick;
  CHECK(tessera_hash(client, hash, &tick) == TESSERA_OK && strlen(hash) == 32 && tick == kTicks);
  CHECK(tessera_resume(client, 0, NULL) == TESSERA_OK);
  CHECK(tessera_pause(client, &tick) == TESSERA_OK && tick >= kTicks);
}

static void check_batch(tessera_client* client) {
  uint64_t before;
  CHECK(tessera_hash(client, (char[33]){0}, &before) == TESSERA_OK);
  tessera_batch* batch;
  CHECK(tessera_batch_new("{\"commands\": 5}", &batch) == TESSERA_INVALID_ARGUMENT);
  CHECK(tessera_batch_new("{\"queries\": [{\"hash\": {}}]}", &batch) == TESSERA_OK);
  uint64_t ball;
  CHECK(tessera_find(client, "ball", &ball) == TESSERA_OK);
  const double up[3] = {0, 0, 3};
  tessera_batch_set_velocity(batch, ball, up, NULL);
  tessera_batch_set_ticks(batch, 2);
  const tessera_position above = {{0, 0, 0}, {0, 0, 30}, 0};
  const double down[3] = {0, 0, -1};
  const size_t ray = tessera_batch_ray(batch, &above, down, 100, 0);
  const size_t states = tessera_batch_states(batch, &ball, 1);
  tessera_answers* answers;
  CHECK(tessera_run(client, batch, kPatience, &answers) == TESSERA_OK);
  CHECK(tessera_answers_effect(answers) == before + 1 && tessera_answers_tick(answers) == before + 2);
  tessera_hit hit;
  CHECK(tessera_answers_ray(answers, ray, &hit) == TESSERA_OK && hit.body != 0);
  CHECK(tessera_answers_ray(answers, states, &hit) == TESSERA_INVALID_ARGUMENT);
  tessera_body body;
  size_t count;
  CHECK(tessera_answers_states(answers, states, &body, 1, &count) == TESSERA_OK && count == 1);
  CHECK(body.id == ball && body.linear_velocity[2] > 2);
  CHECK(strstr(tessera_answers_json(answers), "\"hash\"") != NULL);
  tessera_answers_free(answers);
  tessera_batch_remove(batch, ~UINT64_C(0));
  CHECK(tessera_run(client, batch, kPatience, &answers) == TESSERA_NOT_FOUND);
  CHECK(strstr(tessera_error_message(), "commands[1] (remove)") != NULL);
  tessera_batch_free(batch);
  tessera_batch_free(NULL);
  tessera_answers_free(NULL);
}

/* Several are under way, and their answers are taken in any order. */
static void check_sending(tessera_client* client) {
  enum { kSent = 3 };
  uint64_t ball;
  CHECK(tessera_find(client, "ball", &ball) == TESSERA_OK);
  tessera_pending* pending[kSent];
  for (int n = 0; n < kSent; ++n) {
    tessera_batch* batch;
    CHECK(tessera_batch_new(NULL, &batch) == TESSERA_OK);
    const double velocity[3] = {n, 0, 0};
    tessera_batch_set_velocity(batch, ball, velocity, NULL);
    if (n == kSent - 1) tessera_batch_set_ticks(batch, 1);
    CHECK(tessera_batch_states(batch, &ball, 1) == 0);
    CHECK(tessera_send(client, batch, &pending[n]) == TESSERA_OK);
    tessera_batch_free(batch);
  }
  for (int n = kSent - 1; n >= 0; --n) {
    tessera_answers* answers;
    CHECK(tessera_take(pending[n], kPatience, &answers) == TESSERA_OK);
    tessera_body body;
    size_t count;
    CHECK(tessera_answers_states(answers, 0, &body, 1, &count) == TESSERA_OK && count == 1);
    if (n == kSent - 1) CHECK(body.linear_velocity[0] == kSent - 1);
    tessera_answers_free(answers);
    CHECK(tessera_take(pending[n], 0, &answers) == TESSERA_FAILED_PRECONDITION);
    tessera_pending_free(pending[n]);
  }
  tessera_batch* batch;
  CHECK(tessera_batch_new(NULL, &batch) == TESSERA_OK);
  tessera_batch_remove(batch, ~UINT64_C(0));
  CHECK(tessera_send(client, batch, &pending[0]) == TESSERA_OK);
  tessera_answers* answers;
  CHECK(tessera_take(pending[0], -1, &answers) == TESSERA_NOT_FOUND);
  CHECK(strstr(tessera_error_message(), "no body with the id") != NULL);
  tessera_pending_free(pending[0]);
  tessera_pending_free(NULL);
  tessera_batch_free(batch);
}

/* As many as there may be, which wait for a tick that the world does not reach, until it pauses. */
static void check_bound(const char* address, tessera_client* client) {
  tessera_batch* batch;
  CHECK(tessera_batch_new("{\"queries\": [{\"hash\": {}}], \"after\": 1000000000}", &batch) == TESSERA_OK);
  CHECK(tessera_resume(client, 1, NULL) == TESSERA_OK);
  tessera_pending* pending[TESSERA_PENDING_MAX];
  for (int n = 0; n < TESSERA_PENDING_MAX; ++n) CHECK(tessera_send(client, batch, &pending[n]) == TESSERA_OK);
  tessera_answers* answers;
  CHECK(tessera_take(pending[0], 0, &answers) == TESSERA_DEADLINE_EXCEEDED);
  tessera_pending* more;
  CHECK(tessera_send(client, batch, &more) == TESSERA_RESOURCE_EXHAUSTED);
  CHECK(strstr(tessera_error_message(), "512 batches") != NULL);
  tessera_client* other;
  CHECK(tessera_connect(address, kPatience, &other) == TESSERA_OK);
  CHECK(tessera_send(other, batch, &more) == TESSERA_OK);
  tessera_disconnect(other);
  CHECK(tessera_take(more, kPatience, &answers) == TESSERA_CANCELLED);
  tessera_pending_free(more);
  CHECK(tessera_pause(client, NULL) == TESSERA_OK);
  for (int n = 0; n < TESSERA_PENDING_MAX; ++n) {
    CHECK(tessera_take(pending[n], kPatience, &answers) == TESSERA_OK);
    tessera_answers_free(answers);
    tessera_pending_free(pending[n]);
  }
  CHECK(tessera_send(client, batch, &more) == TESSERA_OK);
  tessera_pending_free(more);
  tessera_batch_free(batch);
}

/* Contacts, joints and programs, as ticks go by. */
static void check_streams(tessera_client* client, const char* rovers) {
  CHECK(tessera_load(client, rovers, true) == TESSERA_OK);
  tessera_stream* contacts;
  tessera_stream* joints;
  tessera_stream* programs;
  CHECK(tessera_watch_contacts(client, NULL, 0, true, 0, &contacts) == TESSERA_OK);
  CHECK(tessera_watch_joints(client, "nothing", &joints) == TESSERA_NOT_FOUND);
  CHECK(strstr(tessera_error_message(), "'nothing'") != NULL);
  CHECK(tessera_watch_joints(client, "", &joints) == TESSERA_OK);
  CHECK(tessera_watch_programs(client, NULL, 0, "ranger", &programs) == TESSERA_OK);
  uint64_t tick;
  CHECK(tessera_step(client, kTicks, NULL) == TESSERA_OK);

  tessera_contact contact;
  size_t count = 0;
  double impulse = 0;
  for (tick = 0; tick < kTicks;) {
    CHECK(tessera_next_contacts(contacts, kPatience, &tick, &contact, 1, &count) == TESSERA_OK);
    if (count > 0) impulse += contact.impulse;
  }
  CHECK(count > 0 && impulse > 0 && contact.a < contact.b && contact.phase == TESSERA_PERSIST);
  CHECK(fabs(sqrt(contact.normal[0] * contact.normal[0] + contact.normal[1] * contact.normal[1] +
                  contact.normal[2] * contact.normal[2]) -
             1) < 1e-5);

  tessera_joint joint[2];
  for (tick = 0; tick < kTicks;)
    CHECK(tessera_next_joints(joints, kPatience, &tick, joint, 2, &count) == TESSERA_OK);
  CHECK(count > 2 && joint[0].id < joint[1].id && joint[0].gap < 1e-3);

  tessera_program program;
  CHECK(tessera_next_programs(programs, kPatience, &tick, &program, 1, &count) == TESSERA_OK);
  CHECK(count > 0 && strcmp(program.kind, "ranger") == 0 && !program.stopped && program.value_count == 18);
  for (; tick < kTicks;)
    CHECK(tessera_next_programs(programs, kPatience, &tick, &program, 1, &count) == TESSERA_OK);

  CHECK(tessera_next_contacts(joints, 0, &tick, &contact, 1, &count) == TESSERA_INVALID_ARGUMENT);
  CHECK(tessera_next_joints(joints, 0, &tick, joint, 2, &count) == TESSERA_DEADLINE_EXCEEDED);

  /* Sectors of 8 m cut what drives about. */
  tessera_stream* seams;
  CHECK(tessera_watch_seams(client, &seams) == TESSERA_OK);
  tessera_clone clone;
  tessera_island island = {0};
  size_t clones;
  size_t islands = 0;
  CHECK(tessera_resume(client, 0, NULL) == TESSERA_OK);
  while (islands == 0) {
    CHECK(tessera_next_seams(seams, kPatience, &tick, &clone, 1, &clones, &island, 1, &islands) ==
          TESSERA_OK);
  }
  CHECK(tessera_pause(client, NULL) == TESSERA_OK);
  CHECK(clones > 0 && clone.server != 0 && island.body_count > 1 && island.id == island.bodies[0]);
  tessera_unwatch(seams);

  tessera_unwatch(contacts);
  tessera_unwatch(joints);
  tessera_unwatch(programs);
}

/* What is aboard: where it is in its frame, and in the world. */
static void check_moving_frames(tessera_client* client, const char* ferry) {
  tessera_moving_frames* frames;
  uint32_t deck = 0;
  CHECK(tessera_get_moving_frames(client, &frames) == TESSERA_OK && tessera_moving_frames_count(frames) == 0);
  tessera_moving_frames_free(frames);
  CHECK(tessera_load(client, ferry, true) == TESSERA_OK);
  CHECK(tessera_get_moving_frames(client, &frames) == TESSERA_OK && tessera_moving_frames_count(frames) == 1);
  CHECK(tessera_find_moving_frame(frames, "nothing", &deck) == TESSERA_NOT_FOUND);
  CHECK(tessera_find_moving_frame(frames, "deck", &deck) == TESSERA_OK && deck == 1);
  CHECK(strcmp(tessera_moving_frame_name(frames, 1), "deck") == 0);
  CHECK(tessera_moving_frame_name(frames, 0) == NULL && tessera_moving_frame_name(frames, 2) == NULL);

  const tessera_position aboard = {{0, 0, 0}, {0, 0, 4}, deck};
  const tessera_position nowhere = {{0, 0, 0}, {0, 0, 4}, 2};
  const double half_size[3] = {1, 1, 2};
  uint64_t ball;
  CHECK(tessera_spawn_sphere(client, "aboard", 0.1, 1, &nowhere, &ball) == TESSERA_INVALID_ARGUMENT);
  CHECK(strstr(tessera_error_message(), "frame 2 must be at most 1") != NULL);
  CHECK(tessera_spawn_sphere(client, "aboard", 0.1, 1, &aboard, &ball) == TESSERA_OK);
  tessera_stream* stream;
  CHECK(tessera_watch_region(client, &aboard, half_size, &stream) == TESSERA_OK);
  CHECK(tessera_step(client, 6, NULL) == TESSERA_OK);
  uint64_t tick;
  tessera_body body;
  size_t count;
  do CHECK(tessera_next(stream, kPatience, &tick, &body, 1, &count) == TESSERA_OK);
  while (tick < 6);
  CHECK(count == 1 && body.id == ball && body.position.frame == deck);
  tessera_unwatch(stream);

  const double down[3] = {0, 0, -1};
  tessera_hit hit;
  const tessera_position above = {{0, 0, 0}, {0, 0, 5}, deck};
  CHECK(tessera_raycast(client, &above, down, 2, &hit) == TESSERA_OK);
  CHECK(hit.body == ball && hit.position.frame == deck);

  tessera_position there;
  const double turn[4] = {0, 0, 0, 1};
  double turn_there[4];
  CHECK(tessera_pose_in_frame(frames, tick, &body.position, turn, 0, &there, turn_there) ==
        TESSERA_UNAVAILABLE);
  tessera_batch* batch;
  uint64_t hull;
  CHECK(tessera_find(client, "ferry::hull", &hull) == TESSERA_OK);
  CHECK(tessera_batch_new(NULL, &batch) == TESSERA_OK);
  const size_t place = tessera_batch_states(batch, &hull, 1);
  tessera_answers* answers;
  tessera_body carrier;
  CHECK(tessera_run(client, batch, kPatience, &answers) == TESSERA_OK);
  CHECK(tessera_answers_states(answers, place, &carrier, 1, &count) == TESSERA_OK && count == 1);
  tessera_answers_free(answers);
  tessera_batch_free(batch);
  tessera_see_carriers(frames, &carrier, 1);
  CHECK(tessera_pose_in_frame(frames, tick, &body.position, turn, 0, &there, turn_there) == TESSERA_OK);
  CHECK(there.frame == 0 && fabs(turn_there[3]) > 0.9);
  tessera_position back;
  CHECK(tessera_pose_in_frame(frames, tick, &there, NULL, deck, &back, NULL) == TESSERA_OK &&
        back.frame == deck);
  for (int axis = 0; axis < 3; ++axis) CHECK(fabs(back.local[axis] - body.position.local[axis]) < 1e-9);
  CHECK(tessera_pose_in_frame(frames, tick, &there, NULL, 7, &back, NULL) == TESSERA_NOT_FOUND);
  tessera_moving_frames_free(frames);
  tessera_moving_frames_free(NULL);
}

int main(int argc, char** argv) {
  CHECK(argc == 5);
  tessera_client* client;
  CHECK(tessera_connect(argv[1], kPatience, &client) == TESSERA_OK);
  check_positions();
  check_errors(client, argv[2]);
  check_flight(client);
  check_frame(client);
  check_questions(client);
  check_batch(client);
  check_sending(client);
  check_bound(argv[1], client);
  check_streams(client, argv[3]);
  check_moving_frames(client, argv[4]);
  tessera_disconnect(client);
  tessera_disconnect(NULL);
  return 0;
}
