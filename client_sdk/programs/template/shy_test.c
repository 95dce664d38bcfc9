#include "shy.c"

#include <tessera/program_test.h>

int main(void) {
  tessera_test_begin();
  *tessera_test_number("x") = 3;
  *tessera_test_number("y") = -4;
  tessera_test_run(run);
  TESSERA_EXPECT(tessera_test.act_count == 0);  // 5 m is not nearer than 5 m
  *tessera_test_number("radius") = 6;
  tessera_test_run(run);
  TESSERA_EXPECT(tessera_test.act_count == 1);
  TESSERA_EXPECT(tessera_test.acts[0].force[0] == -6);
  TESSERA_EXPECT(tessera_test.acts[0].force[1] == 8);
  TESSERA_EXPECT(*tessera_test_number("distance") == 5);
  return tessera_test_result();
}
