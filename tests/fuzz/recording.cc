// Files of recorded inputs, up to the commands in them.
#include "coordinator/command_list.h"
#include "coordinator/world_to_load.h"
#include "proto/recording_file.h"
#include "tests/fuzz/temporary_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  const fuzz::TemporaryFile file("", data, size);
  absl::StatusOr<RecordingReader> reader = RecordingReader::open(file.path());
  if (!reader.ok()) return 0;
  std::optional<WorldRegistry> registry;
  for (;;) {
    const absl::StatusOr<std::optional<v1::RecordedInput>> input = reader->next();
    if (!input.ok() || !*input) return 0;
    if ((*input)->has_world() && !registry) {
      absl::StatusOr<WorldToLoad> world = described_world((*input)->world());
      if (world.ok()) registry.emplace(registry_of(*world));
    }
    if ((*input)->has_commands() && registry) static_cast<void>(give_again((*input)->commands(), *registry));
  }
}
