#include "coordinator/recording.h"

#include <gtest/gtest.h>

#include <set>
#include <type_traits>
#include <variant>
#include <vector>

namespace tessera {
namespace {

// A call of each type of the variant, none of which has been answered.
template <typename... Calls>
std::vector<std::variant<Calls...>> one_of_each(std::type_identity<std::variant<Calls...>>) {
  return {Calls{{}, [](const absl::Status&, const auto&) {}}...};
}

std::vector<v1::RecordedInput> recorded_on_reply(ClientRequest request, const absl::Status& status) {
  std::vector<v1::RecordedInput> inputs;
  std::visit(
      [&]<typename Request, typename Answer>(ClientCall<Request, Answer>& call) {
        record_on_reply(call, [&](const v1::RecordedInput& input) { inputs.push_back(input); });
        call.reply(status, Answer());
      },
      request);
  return inputs;
}

TEST(RecordOnReplyTest, WhatChangesAWorldIsRecordedOnceItIsTaken) {
  const google::protobuf::OneofDescriptor& fields =
      *v1::RecordedCommand::descriptor()->FindOneofByName("request");
  std::set<int> commands;
  int worlds = 0;
  for (const ClientRequest& request : one_of_each(std::type_identity<ClientRequest>())) {
    EXPECT_TRUE(recorded_on_reply(request, absl::NotFoundError("")).empty());
    for (const v1::RecordedInput& input : recorded_on_reply(request, absl::OkStatus())) {
      worlds += input.has_world() ? 1 : 0;
      if (input.has_command()) commands.insert(input.command().request_case());
    }
  }
  EXPECT_EQ(worlds, 1);
  EXPECT_EQ(commands.size(), fields.field_count());
}

TEST(RecordOnReplyTest, CommandIsRecordedWithItsRequestTickAndId) {
  v1::SpawnRequest request;
  request.mutable_body()->set_name("crate");
  ClientCall<v1::SpawnRequest, v1::SpawnReply> call{request, [](const absl::Status&, const auto&) {}};
  v1::RecordedInput recorded;
  record_on_reply(call, [&](const v1::RecordedInput& input) { recorded = input; });
  v1::SpawnReply answer;
  answer.set_tick(7);
  answer.set_id(30);
  call.reply(absl::OkStatus(), answer);
  EXPECT_EQ(recorded.command().tick(), 7);
  EXPECT_EQ(recorded.command().id(), 30);
  EXPECT_EQ(recorded.command().spawn().body().name(), "crate");
}

}  // namespace
}  // namespace tessera
