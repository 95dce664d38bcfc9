#include "daemon/log.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "daemon/log_formatter.h"
#include "daemon/repeat_filter.h"

namespace tessera {
namespace {

constexpr std::size_t kRepeatsMax = 10;
constexpr std::chrono::seconds kRepeatWindow(10);

// The tick of the line that this thread is writing: spdlog's messages have no fields.
thread_local std::optional<std::uint64_t> tick_of_line;

void append(spdlog::memory_buf_t& dest, absl::string_view text) {
  dest.append(text.data(), text.data() + text.size());
}

class TickFlag : public spdlog::custom_flag_formatter {
 public:
  TickFlag(std::string before, std::string after) : before_(std::move(before)), after_(std::move(after)) {}

  void format(const spdlog::details::log_msg&, const std::tm&, spdlog::memory_buf_t& dest) override {
    if (tick_of_line) append(dest, absl::StrCat(before_, *tick_of_line, after_));
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<TickFlag>(before_, after_);
  }

 private:
  std::string before_;
  std::string after_;
};

class JsonStringFlag : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& dest) override {
    const nlohmann::json text = std::string(message.payload.data(), message.payload.size());
    append(dest, text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JsonStringFlag>(); }
};

spdlog::level::level_enum level_of(Severity severity) {
  switch (severity) {
    case Severity::kInfo:
      return spdlog::level::info;
    case Severity::kWarning:
      return spdlog::level::warn;
    case Severity::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

// Without what formats other types, which would be compiled anew wherever a line is written.
void log_as_it_is(spdlog::level::level_enum level, absl::string_view text) {
  spdlog::default_logger_raw()->log(level, spdlog::string_view_t(text.data(), text.size()));
}

}  // namespace

std::unique_ptr<spdlog::formatter> log_formatter(const std::string& name, const std::string& format) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  if (format == "json") {
    formatter->add_flag<TickFlag>('*', ",\"tick\":", "").add_flag<JsonStringFlag>('?');
    formatter->set_pattern(absl::StrCat(R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l","daemon":")", name,
                                        R"("%*,"message":%?})"));
  } else {
    formatter->add_flag<TickFlag>('*', "tick ", ": ");
    formatter->set_pattern(absl::StrCat("%Y-%m-%d %H:%M:%S.%e %^%l%$ ", name, ": %*%v"));
  }
  return formatter;
}

void start_log(const std::string& name, const LogOptions& options) {
  const auto filter = std::make_shared<RepeatFilter>(kRepeatsMax, kRepeatWindow);
  filter->add_sink(std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  const auto logger = std::make_shared<spdlog::logger>(name, filter);
  logger->set_formatter(log_formatter(name, options.format));
  logger->set_level(spdlog::level::from_str(options.level));
  spdlog::set_default_logger(logger);
}

void write_log(const LogLine& line) {
  tick_of_line = line.tick;
  const absl::Cleanup forget = [] { tick_of_line.reset(); };
  log_as_it_is(level_of(line.severity), line.text);
}

void log_info(absl::string_view text) { log_as_it_is(spdlog::level::info, text); }
void log_warning(absl::string_view text) { log_as_it_is(spdlog::level::warn, text); }
void log_error(absl::string_view text) { log_as_it_is(spdlog::level::err, text); }

}  // namespace tessera
