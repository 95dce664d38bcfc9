#include "proto/recording_file.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <utility>

namespace tessera {

RecordingWriter::RecordingWriter(std::filesystem::path file)
    : file_(std::move(file)), out_(file_, std::ios::binary | std::ios::trunc) {}

absl::StatusOr<RecordingWriter> RecordingWriter::create(const std::filesystem::path& file) {
  if (std::filesystem::exists(file)) {
    return absl::AlreadyExistsError(
        absl::StrCat(file.string(), " is there already: recordings are not overwritten"));
  }
  RecordingWriter writer(file);
  if (!writer.out_) return absl::UnavailableError(absl::StrCat("cannot write ", file.string()));
  return writer;
}

absl::Status RecordingWriter::write(const v1::RecordedInput& input) {
  const bool written = google::protobuf::util::SerializeDelimitedToOstream(input, &out_) && out_.flush();
  return written ? absl::OkStatus() : absl::UnavailableError(absl::StrCat("cannot write ", file_.string()));
}

RecordingReader::RecordingReader(std::filesystem::path file, std::unique_ptr<std::ifstream> in)
    : file_(std::move(file)),
      in_(std::move(in)),
      stream_(std::make_unique<google::protobuf::io::IstreamInputStream>(in_.get())) {}

RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader::~RecordingReader() = default;

absl::StatusOr<RecordingReader> RecordingReader::open(const std::filesystem::path& file) {
  auto in = std::make_unique<std::ifstream>(file, std::ios::binary);
  if (!*in) return absl::NotFoundError(absl::StrCat("cannot read ", file.string()));
  return RecordingReader(file, std::move(in));
}

absl::StatusOr<std::optional<v1::RecordedInput>> RecordingReader::next() {
  v1::RecordedInput input;
  bool at_end = false;
  if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&input, stream_.get(), &at_end)) {
    ++entries_;
    return input;
  }
  if (at_end) return std::nullopt;
  return absl::DataLossError(absl::StrCat(file_.string(), " is cut off or no recording: what follows entry ",
                                          entries_, " cannot be read"));
}

}  // namespace tessera
