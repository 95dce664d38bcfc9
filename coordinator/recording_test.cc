#include "coordinator/recording.h"

#include <gtest/gtest.h>

#include <vector>

namespace tessera {
namespace {

TEST(RecordOnReplyTest, AWorldIsRecordedOnceItIsLoaded) {
  v1::LoadRequest request;
  request.mutable_world()->set_name("towers");
  for (const absl::Status& status : {absl::NotFoundError(""), absl::OkStatus()}) {
    ClientCall<v1::LoadRequest, v1::LoadReply> call{request, [](const absl::Status&, const auto&) {}, {}};
    std::vector<v1::RecordedInput> inputs;
    record_on_reply(call, [&](const v1::RecordedInput& input) { inputs.push_back(input); });
    EXPECT_TRUE(inputs.empty());
    call.reply(status, {});
    ASSERT_EQ(inputs.size(), status.ok() ? 1u : 0u);
    for (const v1::RecordedInput& input : inputs) EXPECT_EQ(input.world().name(), "towers");
  }
}

}  // namespace
}  // namespace tessera
