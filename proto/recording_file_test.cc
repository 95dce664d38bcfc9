#include "proto/recording_file.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace tessera {
namespace {

using ::testing::HasSubstr;

class RecordingFileTest : public ::testing::Test {
 protected:
  RecordingFileTest() : file_(std::filesystem::path(::testing::TempDir()) / absl::StrCat(getpid(), ".rec")) {}
  ~RecordingFileTest() override { std::filesystem::remove(file_); }

  std::uintmax_t size() const { return std::filesystem::file_size(file_); }

  void write_bytes(const std::string& bytes) const { std::ofstream(file_, std::ios::binary) << bytes; }

  // A world of some hundred bytes and two ticks; where each entry begins, and the end.
  std::vector<std::uintmax_t> write_recording() const {
    RecordingWriter writer = RecordingWriter::create(file_).value();
    std::vector<std::uintmax_t> begins = {size()};
    v1::RecordedInput world;
    world.mutable_world()->set_name(std::string(300, 'w'));
    EXPECT_TRUE(writer.write(world).ok());
    begins.push_back(size());
    for (std::uint64_t tick = 1; tick <= 2; ++tick) {
      v1::RecordedInput hash;
      hash.mutable_hash()->set_tick(tick);
      hash.mutable_hash()->set_hash(std::string(32, 'a'));
      EXPECT_TRUE(writer.write(hash).ok());
      begins.push_back(size());
    }
    return begins;
  }

  // How many entries can be read, and what is said of the next one.
  std::pair<int, absl::Status> read_all() const {
    absl::StatusOr<RecordingReader> reader = RecordingReader::open(file_);
    if (!reader.ok()) return {0, reader.status()};
    for (int entries = 0;; ++entries) {
      const absl::StatusOr<std::optional<v1::RecordedInput>> entry = reader->next();
      if (!entry.ok() || !*entry) return {entries, entry.status()};
    }
  }

  std::filesystem::path file_;
};

TEST_F(RecordingFileTest, ReadsWhatWasWritten) {
  write_recording();
  EXPECT_EQ(read_all(), std::pair(3, absl::OkStatus()));
}

TEST_F(RecordingFileTest, WorldMayHaveNothingSet) {
  v1::RecordedInput world;
  world.mutable_world();
  ASSERT_TRUE(RecordingWriter::create(file_)->write(world).ok());
  EXPECT_EQ(read_all(), std::pair(1, absl::OkStatus()));
}

TEST_F(RecordingFileTest, WhatIsNoRecordingIsCalledSo) {
  for (const std::string& bytes :
       {std::string("<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n"), std::string("PK\3\4"),
        std::string(100, '\0'), std::string(100, '\xff'), std::string("\n"), std::string("\n\n\n\n")}) {
    write_bytes(bytes);
    const auto [entries, status] = read_all();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(std::string(status.message()), HasSubstr("is not a recording of inputs")) << bytes;
  }
}

TEST_F(RecordingFileTest, EmptyFileAndFolderAreCalledSo) {
  write_bytes("");
  EXPECT_THAT(std::string(read_all().second.message()), HasSubstr("is empty: no world was recorded"));
  EXPECT_EQ(RecordingReader::open(std::filesystem::temp_directory_path()).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(RecordingReader::open("nowhere.rec").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RecordingFileTest, CutIsToldWithItsPlace) {
  const std::vector<std::uintmax_t> begins = write_recording();
  for (std::uintmax_t end = size() - 1; end > 5; --end) {
    std::filesystem::resize_file(file_, end);
    const auto [entries, status] = read_all();
    const auto after = std::upper_bound(begins.begin(), begins.end(), end);
    const auto whole = after - begins.begin() - 1;
    EXPECT_EQ(entries, whole) << end;
    if (end == *(after - 1)) {
      EXPECT_TRUE(status.ok()) << status;
    } else {
      EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
      EXPECT_THAT(std::string(status.message()),
                  HasSubstr(absl::StrCat("is truncated at byte ", end, ", within entry ", whole + 1,
                                         ", which begins at byte ", *(after - 1))));
    }
  }
}

TEST_F(RecordingFileTest, DamageIsToldWithItsPlace) {
  const std::uintmax_t second = write_recording()[1];
  std::fstream file(file_, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(second) + 1);
  file.put('\x07');  // no type of a field
  file.close();
  const auto [entries, status] = read_all();
  EXPECT_EQ(entries, 1);
  EXPECT_THAT(
      std::string(status.message()),
      HasSubstr(absl::StrCat("is damaged: entry 2, which begins at byte ", second, ", cannot be read")));
}

}  // namespace
}  // namespace tessera
