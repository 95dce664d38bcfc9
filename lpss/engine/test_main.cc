// Runs the tests in one of the two precisions, since a process can load only one: --precision=f32 or f64.

#include <gtest/gtest.h>

#include <cstdio>
#include <string_view>

#include "lpss/engine/test_world.h"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--precision=f32") {
      tessera::engine_tests::test_precision = tessera::Precision::kFloat32;
    } else if (argument == "--precision=f64") {
      tessera::engine_tests::test_precision = tessera::Precision::kFloat64;
    } else {
      std::fprintf(stderr, "unknown argument %s\n", argv[i]);
      return 2;
    }
  }
  return RUN_ALL_TESTS();
}
