#include "cli/screen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>

namespace tessera::cli {
namespace {

// Standard output goes to this descriptor for as long as this lives.
class Redirected {
 public:
  explicit Redirected(int descriptor) : before_((std::fflush(stdout), dup(STDOUT_FILENO))) {
    dup2(descriptor, STDOUT_FILENO);
  }
  ~Redirected() {
    std::fflush(stdout);
    dup2(before_, STDOUT_FILENO);
    close(before_);
  }
  Redirected(const Redirected&) = delete;
  Redirected& operator=(const Redirected&) = delete;

 private:
  int before_;
};

// What is drawn by two looks is read at `from` when it goes to `to`. Closes both.
std::string drawn(int from, int to, bool redraw, std::optional<std::size_t>& lines) {
  {
    const Redirected redirected(to);
    Screen screen(redraw);
    lines = screen.lines();
    screen.draw("first\nlook\n");
    screen.draw("second\n");
  }
  close(to);
  std::string text;
  char part[1000];
  for (ssize_t size = 0; (size = read(from, part, sizeof part)) > 0;) {
    text.append(part, static_cast<std::size_t>(size));
  }
  close(from);
  return text;
}

class TerminalTest : public ::testing::Test {
 protected:
  void SetUp() override {
    termios as_it_comes = {};
    cfmakeraw(&as_it_comes);
    const winsize size = {.ws_row = 24, .ws_col = 80, .ws_xpixel = 0, .ws_ypixel = 0};
    if (openpty(&here_, &terminal_, nullptr, &as_it_comes, &size) != 0) {
      GTEST_SKIP() << "this machine has no pseudoterminals (/dev/pts): " << std::strerror(errno);
    }
  }

  int here_ = -1;
  int terminal_ = -1;
  std::optional<std::size_t> lines_;
};

TEST_F(TerminalTest, IsOneScreenThatIsDrawnAnew) {
  EXPECT_EQ(drawn(here_, terminal_, true, lines_),
            "\033[?7l"
            "\033[Hfirst\033[K\nlook\033[K\n\033[J"
            "\033[Hsecond\033[K\n\033[J"
            "\033[?7h");
  EXPECT_EQ(lines_, 23);
}

TEST_F(TerminalTest, KeepsOneLook) {
  EXPECT_EQ(drawn(here_, terminal_, false, lines_), "first\nlook\n\nsecond\n");
  EXPECT_EQ(lines_, std::nullopt);
}

TEST(ScreenTest, ElsewhereLooksFollowEachOther) {
  int ends[2];
  std::optional<std::size_t> lines;
  ASSERT_EQ(pipe(ends), 0);
  EXPECT_EQ(drawn(ends[0], ends[1], true, lines), "first\nlook\n\nsecond\n");
  EXPECT_EQ(lines, std::nullopt);
}

}  // namespace
}  // namespace tessera::cli
