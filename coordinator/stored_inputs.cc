#include "coordinator/stored_inputs.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/util/json_util.h>

#include <set>
#include <utility>

#include "coordinator/command_list.h"
#include "coordinator/limits.h"

namespace tessera {
namespace {

v1::LeftOut left_out(const v1::RecordedCommands& commands, std::string reason) {
  std::string json;
  static_cast<void>(google::protobuf::util::MessageToJsonString(commands, &json));
  if (json.size() > kLeftOutBytesMax) json.replace(kLeftOutBytesMax, std::string::npos, "...");
  v1::LeftOut told;
  told.set_tick(commands.tick());
  told.set_commands(std::move(json));
  told.set_reason(std::move(reason));
  return told;
}

}  // namespace

absl::StatusOr<GivenInputs> give_inputs(const StoredWorld& stored, Tick tick, ActiveWorld& world,
                                        Sessions& sessions) {
  std::set<Tick> fatal;
  for (const v1::StoredInput& input : stored.inputs) {
    if (input.has_left_out()) fatal.insert(input.left_out());
  }
  GivenInputs inputs;
  for (const v1::StoredInput& input : stored.inputs) {
    const RequestId request{input.session(), input.number()};
    if (input.has_pace()) inputs.pace = input.pace();
    if (input.has_carried_out()) sessions.remember(request, input.carried_out());
    if (!input.has_commands()) continue;
    const v1::RecordedCommands& commands = input.commands();
    if (commands.tick() <= tick) {
      return absl::DataLossError(absl::StrCat("stored commands of tick ", commands.tick(),
                                              " cannot be given to the stored state of tick ", tick));
    }
    const auto leave_out = [&](std::string reason) {
      v1::Applied nothing;
      nothing.set_tick(commands.tick());
      sessions.remember(request, nothing);
      inputs.left_out.push_back(left_out(commands, std::move(reason)));
    };
    if (fatal.contains(commands.tick()) && !commands.commands().empty()) {
      leave_out("the servers that carried them out ended");
      continue;
    }
    if (!fatal.empty())
      world.registry.skip_ids_below(BodyId{commands.next_body()}, JointId{commands.next_joint()});
    absl::StatusOr<GivenCommands> given = give_again(commands, world.registry);
    if (!given.ok()) {
      if (fatal.empty()) {
        return absl::DataLossError(absl::StrCat("stored commands of tick ", commands.tick(),
                                                " cannot be given again: ", given.status().message()));
      }
      leave_out(std::string(given.status().message()));
      continue;
    }
    sessions.remember(request, given->applied);
    if (!commands.commands().empty()) inputs.given.push_back(&commands);
    if (!given->commands.empty()) {
      world.sequencer.hold_at(commands.tick(), *std::move(given));
    }
  }
  return inputs;
}

}  // namespace tessera
