#include "tessera/batch_json.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/util/json_util.h>

#include <utility>

#include "tessera.pb.h"

namespace tessera {

absl::StatusOr<Batch> batch_from_json(std::string_view json) {
  v1::Request request;
  const auto status = google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &request);
  if (!status.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("not a request of commands, ticks and queries: ", std::string(status.message())));
  }
  if (request.number() != 0 || request.answered() != 0 || !request.also_answered().empty())
    return absl::InvalidArgumentError("number, answered: they are the client's own");
  Batch batch;
  batch.ticks = request.ticks();
  batch.after = request.after();
  batch.owner = request.owner();
  batch.commands.request_->mutable_commands()->Swap(request.mutable_commands());
  batch.queries.request_->mutable_queries()->Swap(request.mutable_queries());
  return batch;
}

std::string to_json(const Answers& answers) {
  v1::Reply reply = *answers.reply_;
  reply.clear_number();
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  std::string json;
  static_cast<void>(google::protobuf::util::MessageToJsonString(reply, &json, options));
  return json;
}

}  // namespace tessera
