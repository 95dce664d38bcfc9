#include "proto/recording_file.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <cerrno>
#include <string>
#include <utility>

namespace tessera {
namespace {

using google::protobuf::io::CodedInputStream;
using google::protobuf::io::IstreamInputStream;

constexpr std::uint32_t kLengthDelimited = 2;  // protobuf's wire type of messages
constexpr std::uint32_t kWorldTag = v1::RecordedInput::kWorldFieldNumber << 3 | kLengthDelimited;
constexpr std::uint32_t kSnapshotTag = v1::RecordedInput::kSnapshotFieldNumber << 3 | kLengthDelimited;

// Whether an entry with nothing but a world, or a chunk of one, begins here. Only its lengths need to be
// present.
bool begins_with_world(std::istream& in) {
  IstreamInputStream stream(&in);
  CodedInputStream coded(&stream);
  std::uint32_t entry_bytes = 0;
  if (!coded.ReadVarint32(&entry_bytes)) return false;
  const int entry = coded.CurrentPosition();
  std::uint32_t world_bytes = 0;
  const std::uint32_t tag = coded.ReadTag();
  if ((tag != kWorldTag && tag != kSnapshotTag) || !coded.ReadVarint32(&world_bytes)) return false;
  const auto lengths = static_cast<std::uint32_t>(coded.CurrentPosition() - entry);
  return entry_bytes == std::uint64_t{lengths} + world_bytes;
}

}  // namespace

RecordingWriter::RecordingWriter(std::filesystem::path file)
    : file_(std::move(file)), out_(file_, std::ios::binary | std::ios::trunc) {}

absl::StatusOr<RecordingWriter> RecordingWriter::create(const std::filesystem::path& file) {
  if (std::filesystem::exists(file)) {
    return absl::AlreadyExistsError(
        absl::StrCat(file.string(), " exists already: recordings are not overwritten"));
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
    : file_(std::move(file)), in_(std::move(in)), stream_(std::make_unique<IstreamInputStream>(in_.get())) {}

RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader::~RecordingReader() = default;

absl::StatusOr<RecordingReader> RecordingReader::open(const std::filesystem::path& file) {
  const auto cannot_read = [&] {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", file.string()));
  };
  auto in = std::make_unique<std::ifstream>(file, std::ios::binary);
  if (!in->is_open()) return cannot_read();
  const bool is_empty = in->peek() == std::ifstream::traits_type::eof();
  if (in->bad()) return cannot_read();
  if (is_empty) return absl::DataLossError(absl::StrCat(file.string(), " is empty: no world was recorded"));
  if (!begins_with_world(*in)) {
    return absl::DataLossError(
        absl::StrCat(file.string(), " is not a recording of inputs: it does not begin with a world"));
  }
  in->clear();
  in->seekg(0);
  return RecordingReader(file, std::move(in));
}

absl::StatusOr<std::optional<v1::RecordedInput>> RecordingReader::next() {
  const std::int64_t begin = stream_->ByteCount();
  v1::RecordedInput input;
  bool at_end = false;
  if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&input, stream_.get(), &at_end)) {
    ++entries_;
    return input;
  }
  if (at_end) return std::nullopt;
  return unreadable(begin);
}

absl::Status RecordingReader::unreadable(std::int64_t begin) {
  in_->clear();
  in_->seekg(0, std::ios::end);
  const std::int64_t end = in_->tellg();
  in_->seekg(begin);
  IstreamInputStream stream(in_.get());
  CodedInputStream coded(&stream);
  std::uint32_t bytes = 0;
  const bool has_length = coded.ReadVarint32(&bytes);
  const std::int64_t there = end - begin - coded.CurrentPosition();
  const bool is_cut_off = has_length ? there < bytes : there == 0;
  const std::string where = absl::StrCat("entry ", entries_ + 1, ", which begins at byte ", begin);
  return absl::DataLossError(
      is_cut_off ? absl::StrCat(file_.string(), " is truncated at byte ", end, ", within ", where)
                 : absl::StrCat(file_.string(), " is damaged: ", where, ", cannot be read"));
}

}  // namespace tessera
