#include "daemon/log.h"

#include <gmock/gmock.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/log_formatter.h"
#include "daemon/repeat_filter.h"

namespace tessera {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

// The default logger, for the time of a test, with lines in a string.
class LogTest : public ::testing::Test {
 protected:
  void start(const std::string& format) {
    const auto logger =
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(lines_));
    logger->set_formatter(log_formatter("coordinator", format));
    spdlog::set_default_logger(logger);
  }
  ~LogTest() override { spdlog::set_default_logger(before_); }

  std::ostringstream lines_;
  std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
};

TEST_F(LogTest, TextHasLevelDaemonAndTick) {
  start("text");
  write_log({.severity = Severity::kWarning, .tick = 120, .text = "server 3f2a left"});
  EXPECT_THAT(lines_.str(), EndsWith(" warning coordinator: tick 120: server 3f2a left\n"));
  log_info("no world");
  EXPECT_THAT(lines_.str(), EndsWith(" info coordinator: no world\n"));
}

TEST_F(LogTest, JsonIsOneObjectALine) {
  start("json");
  write_log({.tick = 7, .text = "the world 'a \"b\"\n\xff' is loaded"});
  log_error("plain");
  std::istringstream lines(lines_.str());
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  const nlohmann::json first = nlohmann::json::parse(line);
  EXPECT_EQ(first["tick"], 7);
  EXPECT_EQ(first["level"], "info");
  EXPECT_EQ(first["daemon"], "coordinator");
  EXPECT_EQ(first["message"], "the world 'a \"b\"\n\xef\xbf\xbd' is loaded");
  EXPECT_THAT(first["time"].get<std::string>(), HasSubstr("T"));
  ASSERT_TRUE(std::getline(lines, line));
  const nlohmann::json second = nlohmann::json::parse(line);
  EXPECT_EQ(second["level"], "error");
  EXPECT_FALSE(second.contains("tick"));
}

class RepeatFilterTest : public ::testing::Test {
 protected:
  RepeatFilterTest() {
    filter_.add_sink(std::make_shared<spdlog::sinks::ostream_sink_mt>(lines_));
    filter_.set_formatter(std::make_unique<spdlog::pattern_formatter>("%v", spdlog::pattern_time_type::local,
                                                                      std::string("\n")));
  }
  void log(int second, spdlog::level::level_enum level, const std::string& text) {
    const spdlog::log_clock::time_point time{std::chrono::seconds(1000 + second)};
    filter_.log(spdlog::details::log_msg(time, {}, "test", level, text));
  }
  std::string take() {
    std::string text = lines_.str();
    lines_.str("");
    return text;
  }

  std::ostringstream lines_;
  RepeatFilter filter_{2, std::chrono::seconds(10)};
};

TEST_F(RepeatFilterTest, WarningsThatDifferInNumbersOnlyAreLimited) {
  log(0, spdlog::level::warn, "node 1a: late by 3 s");
  log(1, spdlog::level::warn, "node 2b: late by 4 s");
  log(2, spdlog::level::warn, "node 3c: late by 5 s");
  log(3, spdlog::level::warn, "node 4d: late by 6 s");
  EXPECT_EQ(take(), "node 1a: late by 3 s\nnode 2b: late by 4 s\n");
  log(4, spdlog::level::warn, "node 1a: lost");
  EXPECT_EQ(take(), "node 1a: lost\n");
  log(10, spdlog::level::warn, "node 1a: late by 7 s");
  EXPECT_EQ(take(), "node 1a: late by 7 s (2 similar lines were suppressed)\n");
  log(11, spdlog::level::warn, "node 1a: late by 8 s");
  EXPECT_EQ(take(), "node 1a: late by 8 s\n");
}

TEST_F(RepeatFilterTest, WhatIsNoWarningPasses) {
  for (int i = 0; i < 4; ++i) log(0, spdlog::level::info, "joined");
  EXPECT_EQ(take(), "joined\njoined\njoined\njoined\n");
}

}  // namespace
}  // namespace tessera
