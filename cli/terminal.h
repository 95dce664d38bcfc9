// The terminal: tables, colours where it has them, and a progress bar with the time left.
#pragma once

#include <absl/strings/string_view.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace tessera::cli {

enum class Colour { kPlain, kBold, kGreen, kRed, kYellow };

// Whether the file descriptor is a terminal that shows colours: not with NO_COLOR or TERM=dumb.
bool shows_colours(int descriptor);

// `text` in `colour` for standard output, or as it is where that shows none.
std::string coloured(absl::string_view text, Colour colour);

// Rows of cells in columns as wide as their widest cell. Columns of numbers are set to the right: those that
// `right` names. The first row is the header where `header` is set.
std::string table(const std::vector<std::vector<std::string>>& rows, const std::vector<bool>& right = {},
                  bool header = true);

// Clears what is left on a terminal of a progress bar that was ended with its process.
void clear_progress();

// How far work has come, on standard error: on a terminal one line that is written anew, and elsewhere, as in
// a log, a line after two seconds and then every ten.
class ProgressBar {
 public:
  ProgressBar(absl::string_view what, std::uint64_t total);
  ~ProgressBar();  // clears the line
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // Whether it is on a terminal.
  bool shown() const { return shown_; }

  // Cheap to call often: draws a few times a second.
  void update(std::uint64_t done);
  // The same with another total, once it is known.
  void update(std::uint64_t done, std::uint64_t total);

 private:
  using Clock = std::chrono::steady_clock;

  void draw(double share, const std::string& left) const;
  void log(std::uint64_t done, double share, const std::string& left) const;

  std::string what_;
  std::uint64_t total_;
  bool shown_;
  Clock::time_point start_;
  Clock::time_point next_;  // when it is drawn again
  bool drawn_ = false;
};

}  // namespace tessera::cli
