// Tests of balance.c, which need no server:
//
//   cc -Iclient_sdk/include worlds/programs/balance_test.c -o balance_test -lm && ./balance_test
#include "balance.c"

#include <tessera/program_test.h>

static void answer(double place, double speed, double angle, double rate) {
  const struct tessera_joint_finding slider = {
      .joint = 3, .type = 2, .axes = 1, .position = {place, 0}, .rate = {speed, 0}};
  const struct tessera_joint_finding hinge = {
      .joint = 4, .type = 1, .axes = 1, .position = {angle, 0}, .rate = {rate, 0}};
  tessera_test_ask(ask);
  tessera_test_answer_joint(0, &slider);
  tessera_test_answer_joint(1, &hinge);
  tessera_test_run(run);
}

static void it_asks_for_both_joints(void) {
  tessera_test_begin();
  *tessera_test_number("slider") = 3;
  *tessera_test_number("hinge") = 4;
  tessera_test_ask(ask);
  TESSERA_EXPECT(tessera_test.question_count == 2);
  TESSERA_EXPECT(tessera_test.questions[0].kind == TESSERA_ASKED_JOINT &&
                 tessera_test.questions[0].body == 3);
  TESSERA_EXPECT(tessera_test.questions[1].kind == TESSERA_ASKED_JOINT &&
                 tessera_test.questions[1].body == 4);
}

static void it_pushes_the_cart_under_the_pole(void) {
  tessera_test_begin();
  answer(0, 0, 0.1, 0);
  TESSERA_EXPECT(tessera_test.act_count == 1);
  TESSERA_EXPECT(tessera_test.acts[0].kind == TESSERA_DID_DRIVE && tessera_test.acts[0].body == 3);
  TESSERA_EXPECT(tessera_test.acts[0].axis == 0 && tessera_test.acts[0].mode == TESSERA_DRIVE_EFFORT);
  TESSERA_EXPECT(fabs(tessera_test.acts[0].value - 18.5) < 1e-12);
  TESSERA_EXPECT(*tessera_test_number("angle") == 0.1);
}

static void it_adds_what_each_number_asks_for_up_to_a_bound(void) {
  tessera_test_begin();
  *tessera_test_number("place") = 2;
  answer(1, 0.5, -0.01, 0.02);
  TESSERA_EXPECT(fabs(tessera_test.acts[0].value - (-18 + 11.5 - 1.85 + 0.92)) < 1e-12);
  TESSERA_EXPECT(*tessera_test_number("off") == -1);
  answer(-90, 0, 0, 0);
  TESSERA_EXPECT(tessera_test.acts[0].value == -100);
}

static void it_does_nothing_where_a_joint_is_gone(void) {
  tessera_test_begin();
  tessera_test_ask(ask);
  tessera_test_run(run);
  TESSERA_EXPECT(tessera_test.act_count == 0);
}

int main(void) {
  it_asks_for_both_joints();
  it_pushes_the_cart_under_the_pole();
  it_adds_what_each_number_asks_for_up_to_a_bound();
  it_does_nothing_where_a_joint_is_gone();
  return tessera_test_result();
}
