#include "coordinator/sequence_list.h"

#include <utility>

#include "coordinator/recording.h"

namespace tessera {

void sequence_list(const CoordinatorContext& context, ActiveWorld& world, GivenCommands given,
                   v1::RecordedCommands recorded, RequestId request) {
  if (!given.commands.empty()) world.sequencer.submit(std::move(given));
  if (!recorded.commands().empty() && context.options.inputs)
    context.options.inputs(tessera::recorded(recorded));
  context.journal.add(std::move(recorded), request);
}

}  // namespace tessera
