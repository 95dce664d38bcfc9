#include "coordinator/input_log.h"

#include <absl/strings/str_cat.h>
#include <google/protobuf/message_lite.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "proto/whole_file.h"

namespace tessera {
namespace {

constexpr std::string_view kMagic = "tessera inputs\n\n";

// Before each entry.
struct EntryHeader {
  std::uint32_t bytes = 0;
  std::uint32_t zero = 0;
  std::uint64_t checksum = 0;  // of the entry; XXH3, seeded with that of the entry before and the length
};

std::uint64_t checksum_of(std::string_view bytes, std::uint64_t chain) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), chain ^ bytes.size());
}

// The bytes of an entry that follows one with the checksum `chain`, which becomes that of this one.
std::string entry_of(const google::protobuf::MessageLite& message, std::uint64_t& chain) {
  std::string bytes(sizeof(EntryHeader), '\0');
  message.AppendToString(&bytes);
  const std::string_view contents = std::string_view(bytes).substr(sizeof(EntryHeader));
  chain = checksum_of(contents, chain);
  const EntryHeader header{static_cast<std::uint32_t>(contents.size()), 0, chain};
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

// An entry as a file has it.
struct Entry {
  std::uint64_t checksum = 0;
  std::string_view contents;

  std::size_t size() const { return sizeof(EntryHeader) + contents.size(); }
  bool follows(std::uint64_t chain) const { return checksum_of(contents, chain) == checksum; }
};

std::optional<Entry> entry_at(std::string_view file, std::size_t at) {
  EntryHeader header;
  if (at > file.size() || file.size() - at < sizeof header) return std::nullopt;
  std::memcpy(&header, file.data() + at, sizeof header);
  at += sizeof header;
  if (header.zero != 0 || header.bytes > file.size() - at) return std::nullopt;
  return Entry{header.checksum, file.substr(at, header.bytes)};
}

// Both files as they are, entry by entry.
class Copies {
 public:
  absl::Status read(const InputLogFiles& files, Disk& disk) {
    for (std::size_t n = 0; n < files.size(); ++n) {
      absl::Status status = disk.read(files[n], [&](std::string_view piece) {
        bytes_[n] += piece;
        return absl::OkStatus();
      });
      if (!status.ok() && !absl::IsNotFound(status)) return status;
    }
    if (bytes_[0].empty() && bytes_[1].empty())
      return absl::DataLossError(absl::StrCat(files[0].string(), ": nothing of the inputs is left"));
    whole_ = kMagic;
    return absl::OkStatus();
  }

  // The next entry that either has.
  std::optional<std::string_view> next() {
    for (const std::string& bytes : bytes_) {
      const std::optional<Entry> entry = entry_at(bytes, whole_.size());
      if (!entry || !entry->follows(chain_)) continue;
      chain_ = entry->checksum;
      whole_ += std::string_view(bytes).substr(whole_.size(), entry->size());
      return entry->contents;
    }
    return std::nullopt;
  }

  // Whether an entry that neither has is followed by one that was written after it: then it was acknowledged.
  bool goes_on() const {
    return std::ranges::any_of(bytes_, [&](const std::string& bytes) {
      const std::optional<Entry> lost = entry_at(bytes, whole_.size());
      if (!lost) return false;
      const std::optional<Entry> after = entry_at(bytes, whole_.size() + lost->size());
      return after && after->follows(lost->checksum);
    });
  }

  // All that was read, as a file should be, and what file number `n` is.
  const std::string& whole() const { return whole_; }
  const std::string& bytes(std::size_t n) const { return bytes_[n]; }

 private:
  std::array<std::string, 2> bytes_;
  std::string whole_;
  std::uint64_t chain_ = 0;
};

// A line for a file that lacks what the other one has; nothing for what a crash has left at its end.
std::optional<std::string> damage_to(const std::filesystem::path& file, std::string_view bytes,
                                     std::string_view whole) {
  const std::size_t same =
      static_cast<std::size_t>(std::distance(whole.begin(), std::ranges::mismatch(whole, bytes).in1));
  if (same == whole.size()) return std::nullopt;
  if (bytes.empty()) return absl::StrCat(file.string(), ": it is missing");
  if (same == bytes.size())
    return absl::StrCat(file.string(), ": it ends at byte ", same, " of ", whole.size());
  return absl::StrCat(file.string(), ": it is damaged at byte ", same);
}

absl::Status write_anew(const std::filesystem::path& file, std::string_view bytes, Disk& disk) {
  absl::StatusOr<WholeFile> out = WholeFile::create(file, disk);
  if (!out.ok()) return out.status();
  if (absl::Status status = out->append(bytes); !status.ok()) return status;
  return out->finish();
}

}  // namespace

absl::StatusOr<InputLog> InputLog::create(const InputLogFiles& files, const v1::InputLogHead& head,
                                          Disk& disk) {
  InputLog log;
  const std::string bytes = std::string(kMagic) + entry_of(head, log.chain_);
  for (std::size_t n = 0; n < files.size(); ++n) {
    absl::StatusOr<WholeFile> out = WholeFile::create(files[n], disk);
    if (!out.ok()) return out.status();
    if (absl::Status status = out->append(bytes); !status.ok()) return status;
    absl::StatusOr<std::unique_ptr<Disk::File>> kept = out->finish_and_keep();
    if (!kept.ok()) return kept.status();
    log.files_[n] = *std::move(kept);
  }
  return log;
}

absl::Status InputLog::append(const v1::InputBatch& batch) {
  const std::string bytes = entry_of(batch, chain_);
  for (const std::unique_ptr<Disk::File>& file : files_) {
    if (absl::Status status = file->append(bytes); !status.ok()) return status;
    if (absl::Status status = file->sync(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::StatusOr<ReadInputLog> read_input_log(const InputLogFiles& files, Disk& disk) {
  Copies copies;
  if (absl::Status status = copies.read(files, disk); !status.ok()) return status;
  const auto lost = [&](const char* what) {
    return absl::StrCat(files[0].string(), " and its mirror: ", what, " at byte ", copies.whole().size(),
                        " is not as it was written");
  };
  ReadInputLog log;
  const std::optional<std::string_view> head = copies.next();
  if (!head || !log.head.ParseFromArray(head->data(), static_cast<int>(head->size())))
    return absl::DataLossError(lost("the head"));
  if (log.head.format() != kInputLogFormat) {
    return absl::FailedPreconditionError(
        absl::StrCat(files[0].string(), ": a store of format ", log.head.format(),
                     ", and this coordinator reads format ", kInputLogFormat));
  }
  while (const std::optional<std::string_view> entry = copies.next()) {
    v1::InputBatch batch;
    if (!batch.ParseFromArray(entry->data(), static_cast<int>(entry->size())))
      return absl::DataLossError(lost("an entry"));
    std::move(batch.mutable_inputs()->begin(), batch.mutable_inputs()->end(), std::back_inserter(log.inputs));
  }
  if (copies.goes_on()) log.lost = lost("an entry");
  for (std::size_t n = 0; n < files.size(); ++n) {
    if (std::optional<std::string> damage = damage_to(files[n], copies.bytes(n), copies.whole()))
      log.damage.push_back(*std::move(damage));
  }
  log.bytes = copies.whole();
  return log;
}

absl::Status mend_input_log(const InputLogFiles& files, const ReadInputLog& log, Disk& disk) {
  for (const std::filesystem::path& file : files) {
    if (absl::Status status = write_anew(file, log.bytes, disk); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera
