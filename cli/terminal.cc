#include "cli/terminal.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace tessera::cli {
namespace {

constexpr auto kRepaintEvery = std::chrono::milliseconds(200);
constexpr auto kLogAfter = std::chrono::milliseconds(2000);  // quick work leaves no trace in a log
constexpr auto kLogEvery = std::chrono::milliseconds(10'000);
constexpr int kBarCells = 30;

std::string duration(double seconds) {
  const auto whole = static_cast<std::int64_t>(seconds + 0.5);
  if (whole >= 3600) return absl::StrFormat("%d h %02d min", whole / 3600, whole / 60 % 60);
  if (whole >= 60) return absl::StrFormat("%d min %02d s", whole / 60, whole % 60);
  return absl::StrFormat("%d s", whole);
}

}  // namespace

bool shows_colours(int descriptor) {
  const char* no_colour = std::getenv("NO_COLOR");
  const char* terminal = std::getenv("TERM");
  if (no_colour != nullptr && *no_colour != '\0') return false;
  return isatty(descriptor) == 1 && terminal != nullptr && absl::string_view(terminal) != "dumb";
}

std::string coloured(absl::string_view text, Colour colour) {
  if (colour == Colour::kPlain || !shows_colours(STDOUT_FILENO)) return std::string(text);
  const char* code = colour == Colour::kBold    ? "1"
                     : colour == Colour::kGreen ? "32"
                     : colour == Colour::kRed   ? "31"
                                                : "33";
  return absl::StrCat("\033[", code, "m", text, "\033[0m");
}

std::string table(const std::vector<std::vector<std::string>>& rows, const std::vector<bool>& right,
                  bool header) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t column = 0; column < row.size(); ++column) {
      widths[column] = std::max(widths[column], row[column].size());
    }
  }
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string line;
    for (std::size_t column = 0; column < rows[r].size(); ++column) {
      const std::string padding(widths[column] - rows[r][column].size(), ' ');
      const bool to_the_right = column < right.size() && right[column];
      absl::StrAppend(&line, column == 0 ? "" : "  ", to_the_right ? padding : "", rows[r][column],
                      to_the_right ? "" : padding);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    absl::StrAppend(&text, header && r == 0 ? coloured(line, Colour::kBold) : line, "\n");
  }
  return text;
}

void clear_progress() {
  if (isatty(STDERR_FILENO) == 1) std::fputs("\r\033[K", stderr);
}

ProgressBar::ProgressBar(absl::string_view what, std::uint64_t total)
    : what_(what),
      total_(total),
      shown_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      next_(start_ + (shown_ ? std::chrono::milliseconds(0) : kLogAfter)) {}

ProgressBar::~ProgressBar() {
  if (shown_ && drawn_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::update(std::uint64_t done) { update(done, total_); }

void ProgressBar::update(std::uint64_t done, std::uint64_t total) {
  total_ = total;
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  next_ = now + (shown_ ? kRepaintEvery : kLogEvery);
  drawn_ = true;
  const double share =
      std::min(1.0, static_cast<double>(done) / static_cast<double>(std::max<std::uint64_t>(total, 1)));
  std::string left = "...";
  if (done > 0) {
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    left = absl::StrCat(duration(elapsed * (1 - share) / share), " left");
  }
  if (shown_) {
    draw(share, left);
  } else {
    log(done, share, left);
  }
  std::fflush(stderr);
}

void ProgressBar::draw(double share, const std::string& left) const {
  const int cells = static_cast<int>(share * kBarCells);
  absl::FPrintF(stderr, "\r%s [%s%s] %3.0f%%, %s\033[K", what_, std::string(cells, '#'),
                std::string(kBarCells - cells, '.'), share * 100, left);
}

void ProgressBar::log(std::uint64_t done, double share, const std::string& left) const {
  absl::FPrintF(stderr, "%s: %d of %d, %.0f%%, %s\n", what_, done, total_, share * 100, left);
}

}  // namespace tessera::cli
