#include "cli/screen.h"

#include <absl/strings/str_replace.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <string>

namespace tessera::cli {
namespace {

constexpr const char* kCutLines = "\033[?7l";
constexpr const char* kWrapLines = "\033[?7h";
constexpr const char* kHome = "\033[H";
constexpr const char* kClearLineAndEnd = "\033[K\n";
constexpr const char* kClearBelow = "\033[J";

void write(absl::string_view text) { std::fwrite(text.data(), 1, text.size(), stdout); }

}  // namespace

Screen::Screen(bool redraw) : redraw_(redraw && isatty(STDOUT_FILENO) == 1) {
  if (redraw_) write(kCutLines);
}

Screen::~Screen() {
  if (!redraw_) return;
  write(kWrapLines);
  std::fflush(stdout);
}

std::optional<std::size_t> Screen::lines() const {
  winsize size = {};
  if (!redraw_ || ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0) return std::nullopt;
  return size.ws_row - 1;  // the cursor stands on the last one
}

void Screen::draw(absl::string_view text) {
  if (redraw_) {
    write(kHome);
    write(absl::StrReplaceAll(text, {{"\n", kClearLineAndEnd}}));
    write(kClearBelow);
  } else {
    if (drawn_) write("\n");
    write(text);
  }
  drawn_ = true;
  std::fflush(stdout);
}

}  // namespace tessera::cli
