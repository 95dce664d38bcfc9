#include "viewer/recorder.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

namespace tessera::viewer {
namespace {

using ::testing::HasSubstr;

class RecorderTest : public ::testing::Test {
 protected:
  RecorderTest() { std::filesystem::create_directories(folder_); }
  ~RecorderTest() override { std::filesystem::remove_all(folder_); }

  // Options for a program in the place of tessera-record, which does this once it has made its file.
  RecorderOptions with(const std::string& script) const {
    const std::filesystem::path program = folder_ / "tessera-record";
    std::ofstream(program) << "#!/bin/sh\ntrap 'echo; echo recorded 7 ticks, 0.0 MB; exit 0' INT\n"
                           << "[ \"$1 $2 $3\" = '--connect host:1 --output' ] || exit 9\n"
                           << script;
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    RecorderOptions options;
    options.command = program.string();
    options.folder = folder_ / "recordings";
    options.address = "host:1";
    options.keys = "/keys";
    return options;
  }
  static RecorderState await_end(const Recorder& recorder) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (recorder.state().is_recording && std::chrono::steady_clock::now() < deadline)
      std::this_thread::yield();
    return recorder.state();
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("tessera-recorder-" + std::to_string(getpid()));
  const std::string records_ = "echo \"$TESSERA_KEYS\" >\"$4\"\necho \"recording w to $4; Ctrl-C ends it\"\n";
  const std::string goes_on_ = "while :; do sleep 0.01; done\n";
};

TEST_F(RecorderTest, RecordsUntilItIsStopped) {
  Recorder recorder(with(records_ + goes_on_));
  EXPECT_EQ(recorder.state().number, 0u);
  EXPECT_THAT(recorder.stop().status().message(), HasSubstr("nothing is recorded"));
  ASSERT_TRUE(recorder.start("tower-3").ok());
  EXPECT_TRUE(recorder.state().is_recording);
  EXPECT_EQ(recorder.state().bytes, 6u) << "the keys of the web UI are its keys";
  EXPECT_THAT(recorder.start("other").message(), HasSubstr("a recording is made already: tower-3"));
  const absl::StatusOr<RecorderState> ended = recorder.stop();
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->said, "recorded 7 ticks, 0.0 MB");
  EXPECT_EQ(ended->bytes, 6u);
  EXPECT_TRUE(ended->is_whole);
  EXPECT_FALSE(ended->is_recording);
  EXPECT_EQ(recorder.file("tower-3").value(), folder_ / "recordings/tower-3.mcap");
  EXPECT_THAT(recorder.start("tower-3").message(), HasSubstr("there is a recording of the name 'tower-3'"));
  ASSERT_TRUE(recorder.start("tower-4").ok());
  EXPECT_EQ(recorder.state().number, 2u);
}

TEST_F(RecorderTest, EndsWhereThereIsNoMoreRoom) {
  RecorderOptions options = with(records_ + "head -c 5000 /dev/zero >>\"$4\"\n" + goes_on_);
  options.bytes_max = 4000;
  Recorder recorder(options);
  ASSERT_TRUE(recorder.start("large").ok());
  const RecorderState ended = await_end(recorder);
  EXPECT_THAT(ended.said, HasSubstr("recorded 7 ticks, 0.0 MB; ended, since recordings may have"));
  EXPECT_TRUE(ended.is_whole);
  const absl::Status full = recorder.start("more");
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(full.message(), HasSubstr("--recordings-max"));
}

TEST_F(RecorderTest, SaysWhyNothingIsRecorded) {
  Recorder none(RecorderOptions{});
  EXPECT_THAT(none.start("a").message(), HasSubstr("start it with --recordings FOLDER"));
  RecorderOptions absent = with("");
  absent.command = "no-such-recorder";
  EXPECT_THAT(Recorder(absent).start("a").message(), HasSubstr("there is no no-such-recorder: install it"));
  Recorder refused(with("echo 'tessera-record: no world is loaded' >&2\nexit 1\n"));
  EXPECT_EQ(refused.start("a").message(), "no world is loaded");
  EXPECT_EQ(refused.state().number, 0u);
  EXPECT_FALSE(refused.start("../a").ok());
  EXPECT_FALSE(refused.file("../tessera-record").ok());
}

TEST_F(RecorderTest, TellsOfAnEndThatNobodyAskedFor) {
  Recorder recorder(with(records_ + "echo 'tessera-record: the world has ended' >&2\nexit 1\n"));
  ASSERT_TRUE(recorder.start("a").ok()) << "it has begun";
  const RecorderState ended = await_end(recorder);
  EXPECT_EQ(ended.said, "the world has ended");
  EXPECT_FALSE(ended.is_whole);
}

}  // namespace
}  // namespace tessera::viewer
