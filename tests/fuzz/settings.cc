// Files of settings.
#include "lpss/base/invariant.h"
#include "tests/fuzz/input.h"
#include "worlds/knobs.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  const absl::StatusOr<Knobs> knobs = knobs_from_text(fuzz::text_of(data, size));
  if (!knobs.ok()) return 0;
  invariant(knobs_from_json(to_json(*knobs)).ok(), "settings can be read as they are written");
  WorldDescription world;
  world.bodies.emplace_back().name = "body";
  static_cast<void>(apply(*knobs, world));
  return 0;
}
