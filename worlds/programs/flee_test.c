// Tests of flee.c, which need no server:
//
//   cc -Iclient_sdk/include worlds/programs/flee_test.c -o flee_test -lm && ./flee_test
#include "flee.c"

#include <tessera/program_test.h>

static struct tessera_finding hunter_at(double x, double y) {
  struct tessera_finding hunter = {.body = 7, .motion = 2, .position = {x, y, 0}};
  return hunter;
}

static void it_rolls_away_from_what_is_near(void) {
  tessera_test_begin();
  *tessera_test_number("from") = 7;
  tessera_test_ask(ask);
  TESSERA_EXPECT(tessera_test.question_count == 1);
  TESSERA_EXPECT(tessera_test.questions[0].kind == TESSERA_ASKED_BODY && tessera_test.questions[0].body == 7);
  const struct tessera_finding hunter = hunter_at(3, 4);
  tessera_test_answer(0, &hunter);
  tessera_test_run(run);
  TESSERA_EXPECT(tessera_test.act_count == 1);
  TESSERA_EXPECT(tessera_test.acts[0].kind == TESSERA_DID_PUSH_AWAKE);
  TESSERA_EXPECT(fabs(tessera_test.acts[0].force[0] + 20 * 0.6) < 1e-12);
  TESSERA_EXPECT(fabs(tessera_test.acts[0].force[1] + 20 * 0.8) < 1e-12);
  TESSERA_EXPECT(*tessera_test_number("distance") == 5);
  TESSERA_EXPECT(tessera_test.wakes_in == 1);
}

static void it_rests_where_the_hunter_is_far_or_gone(void) {
  tessera_test_begin();
  tessera_test_ask(ask);
  tessera_test_run(run);
  TESSERA_EXPECT(tessera_test.act_count == 0 && tessera_test.wakes_in == 0);
  const struct tessera_finding hunter = hunter_at(0, *tessera_test_number("radius") + 0.1);
  tessera_test_answer(0, &hunter);
  tessera_test_run(run);
  TESSERA_EXPECT(tessera_test.act_count == 0);
  TESSERA_EXPECT(tessera_test.wakes_in == 1);
}

static void it_rolls_along_walls(void) {
  tessera_test_begin();
  tessera_test.senses.velocity[0] = 2;
  tessera_test_ask(ask);
  TESSERA_EXPECT(tessera_test.question_count == 2);
  TESSERA_EXPECT(tessera_test.questions[1].kind == TESSERA_ASKED_CAST);
  TESSERA_EXPECT(tessera_test.questions[1].direction[0] == 1 && tessera_test.questions[1].length == 1.5);
  const struct tessera_finding hunter = hunter_at(-3, -4);
  const struct tessera_finding wall = {.normal = {-1, 0, 0}};
  tessera_test_answer(0, &hunter);
  tessera_test_answer(1, &wall);
  tessera_test_run(run);
  TESSERA_EXPECT(tessera_test.acts[0].force[0] == 0);
  TESSERA_EXPECT(fabs(tessera_test.acts[0].force[1] - 20 * 0.8) < 1e-12);
  TESSERA_EXPECT(*tessera_test_number("turned") == 1);
}

int main(void) {
  it_rolls_away_from_what_is_near();
  it_rests_where_the_hunter_is_far_or_gone();
  it_rolls_along_walls();
  return tessera_test_result();
}
