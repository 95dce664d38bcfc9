// Worlds, models and robots as text. Other files are not found: the folder is empty.
#include "worlds/loader/world_file.h"

#include "tests/fuzz/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(tessera::fuzz::text_of(data, size));
  static_cast<void>(tessera::load_world_string(text, "/nonexistent"));
  return 0;
}
